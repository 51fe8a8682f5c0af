"""Cached machine code is invalidated when any of its sources changes."""

from __future__ import annotations

import pickle

from solvers.numerics import jit
from solvers.rod.optimum.proof.branch_and_bound import prove


def names(module):
    return {path.relative_to(jit._ROOT).as_posix() for path in jit.sources(module)}


def test_sources_reach_the_kernels_that_kernels_call():
    found = names("solvers.rod.optimum.proof.branch_and_bound")
    proof = ("branch_and_bound", "bound_tightening", "box_bounds", "intervals")
    assert {f"solvers/rod/optimum/proof/{name}.py" for name in proof} < found
    assert "solvers/rod/check.py" not in names("solvers.rod.optimum.proof.intervals")


def test_a_kernel_is_kept_under_the_digest_of_all_its_sources():
    assert prove.compiled._cache._cache_file._source_stamp == jit.source_digest(
        "solvers.rod.optimum.proof.branch_and_bound"
    )


def test_code_with_another_digest_is_not_loaded(tmp_path):
    file = type(prove.compiled._cache._cache_file)
    old, new = file(str(tmp_path), "kernel", "old"), file(str(tmp_path), "kernel", "new")
    old.save("signature", b"code")
    assert old.load("signature") == b"code"
    assert new.load("signature") is None


def test_an_index_of_other_sources_is_replaced_unread(tmp_path):
    """It may name classes that no longer exist, as after an update."""
    kept = prove.compiled._cache._cache_file
    old, new = (type(kept)(str(tmp_path), "kernel", kept._source_stamp) for _ in range(2))
    new._version = kept._version
    (tmp_path / old._index_name).write_bytes(pickle.dumps(old._version) + b"csolvers.rod\nNoSuchClass\n.")
    assert new.load("signature") is None
    new.save("signature", b"code")
    assert new.load("signature") == b"code"


def test_a_digest_follows_a_module_that_moves(tmp_path, monkeypatch):
    """The cache of a folder that is renamed names types of modules that no longer exist."""
    monkeypatch.setattr(jit, "_ROOT", tmp_path)
    digests = set()
    for folder in ("one", "other"):
        (tmp_path / "solvers" / folder).mkdir(parents=True)
        (tmp_path / "solvers" / folder / "same.py").write_text("size = 1\n", "utf-8")
        digests.add(jit.source_digest.__wrapped__(f"solvers.{folder}.same"))
    jit._file.cache_clear()
    jit._imports.cache_clear()
    assert len(digests) == 2


def test_a_digest_follows_a_change_in_an_imported_module(tmp_path, monkeypatch):
    package = tmp_path / "solvers"
    package.mkdir()
    (package / "upper.py").write_text("from solvers.lower import one\n", "utf-8")
    (package / "lower.py").write_text("one = 1\n", "utf-8")
    monkeypatch.setattr(jit, "_ROOT", tmp_path)
    digests = []
    for value in (1, 2):
        (package / "lower.py").write_text(f"one = {value}\n", "utf-8")
        for memory in (jit.source_digest, jit._imports, jit._file):
            memory.cache_clear()
        digests.append(jit.source_digest("solvers.upper"))
    for memory in (jit.source_digest, jit._imports, jit._file):
        memory.cache_clear()
    assert digests[0] != digests[1]
