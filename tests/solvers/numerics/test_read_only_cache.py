"""Compiled kernels whose directory can be read but not written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
_TRIAL = """
import sys, tempfile
import app
from numba.core import caching

class ReadOnly:
    def TemporaryFile(*_args, **_options):
        raise OSError(30, "Read-only file system")

    def __getattr__(self, name):
        return getattr(tempfile, name)

if "read-only" in sys.argv:
    caching.tempfile = ReadOnly()
sys.path.insert(0, FOLDER)
import doubling
assert doubling.twice(21.0) == 42.0
print(len(doubling.twice.files), sum(doubling.twice.compiled.stats.cache_hits.values()))
"""
_KERNEL = """
from solvers.numerics.jit import kernel

@kernel
def twice(x):
    return 2.0 * x
"""


@pytest.mark.parametrize("where", ["NUMBA_CACHE_DIR", "in tree", "XDG_CACHE_HOME"])
def test_what_was_compiled_before_is_loaded_where_nothing_can_be_written(tmp_path: Path, where: str):
    folder, elsewhere = tmp_path / "code", tmp_path / "cache"
    folder.mkdir()
    (folder / "doubling.py").write_text(_KERNEL)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path / "none")}
    if where != "in tree":
        environment[where] = str(elsewhere)
        (folder / "__pycache__").write_text("no folder")  # so that nothing can be cached beside the source

    def told(*words: str) -> str:
        command = [sys.executable, "-c", _TRIAL.replace("FOLDER", repr(str(folder))), *words]
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert told() == "2 0\n"
    assert told("read-only") == "2 1\n"
