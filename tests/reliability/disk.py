"""Atomicity of commits under disk faults: truncated or corrupted write-ahead log, and failing system calls.

    python -m tests.reliability.disk 900

truncates or corrupts the log at that many positions, then fails every I/O call of a commit once.
"""

from __future__ import annotations

import asyncio
import ctypes
import errno
import json
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from app.store.errors import StoreError
from app.store.migrate import upgrade
from app.store.record import RunFilter, RunRecord
from app.store.repository import RunStore
from app.store.verify import verify
from tests.app.running import ROOT
from tests.app.store.records import make_record, make_response

COMMITS = 30
_HEADER_BYTES = 32
"""Header size of a write-ahead log; frames follow, each with a checksum cumulative over its predecessors."""


class Journal:
    """A database with all commits in its write-ahead log, and the length of the log after each."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "runs.sqlite3"
        upgrade(f"sqlite:///{self.file}")
        self.runs: list[RunRecord] = []
        self.ends: list[int] = []
        with RunStore(f"sqlite:///{self.file}") as store:
            for number in range(COMMITS):
                run = make_record(number, result=b'{"x":"%s"}' % (b"y" * random.Random(number).randrange(9000)))
                store.put_and_wait(run, make_response(run, f"key-{number}"))
                self.runs.append(run)
                self.ends.append(self.log.stat().st_size)
            self.kept = folder / "kept"
            self.kept.mkdir()
            for file in (self.file, self.log):
                shutil.copy(file, self.kept)

    @property
    def log(self) -> Path:
        return self.file.with_name(self.file.name + "-wal")

    def damaged(self, folder: Path, rng: random.Random) -> tuple[str, int]:
        """Copy with a log damaged at a random position; returns the damage and the number of commits before it."""
        folder.mkdir()
        for file in self.kept.iterdir():
            shutil.copy(file, folder)
        log = folder / self.log.name
        content = bytearray(log.read_bytes())
        place = rng.randrange(len(content))
        how = rng.choice(("cut", "bit", "zeros"))
        if how == "cut":
            del content[place:]
        elif how == "bit":
            content[place] ^= 1 << rng.randrange(8)
        else:  # a sector never written
            place -= place % 512
            content[place : place + 512] = bytes(len(content[place : place + 512]))
        if how == "zeros":
            original = self.kept.joinpath(log.name).read_bytes()
            place = next((at for at in range(place, len(content)) if content[at] != original[at]), len(content))
        log.write_bytes(content)
        return how, sum(end <= place for end in self.ends) if place >= _HEADER_BYTES else 0


def cut_and_changed(places: int, folder: Path, seed: int = 1) -> Counter[str]:
    """Damage the log; asserts that recovery yields a complete prefix of the commits. Counts by kind of damage."""
    journal, rng, tried = Journal(folder), random.Random(seed), Counter[str]()
    for number in range(places):
        where = folder / f"place-{number}"
        how, whole = journal.damaged(where, rng)
        url = f"sqlite:///{where}/{journal.file.name}"
        with RunStore(url) as store:
            found = {item.id for item in asyncio.run(store.list_runs(RunFilter(), limit=200)).items}
        assert found == {run.id for run in journal.runs[:whole]}, (seed, number, how)
        report = verify(url)
        assert report.sound and report.runs == report.idempotency_keys == whole, (seed, number, how, report)
        tried[how] += 1
        shutil.rmtree(where)
    return tried


# -- every I/O call of a commit ----------------------------------------------------------------------------------


def failed_io(folder: Path, every: int = 1) -> Counter[str]:
    """Fail every ``every``-th I/O call of commits and of closing the store, alternating EIO and ENOSPC.

    Requires ``faulty_io.c`` to be preloaded. Returns failures by call; asserts that no commit is partial.
    """
    faults = ctypes.CDLL(None)
    faults.fired.restype = ctypes.c_char_p
    base = folder / "base.sqlite3"
    upgrade(f"sqlite:///{base}")
    with RunStore(f"sqlite:///{base}") as store:
        store.put_and_wait(make_record(0))
    tried, number = Counter[str](), 1
    while True:
        where = folder / f"io-{number}"
        where.mkdir()
        shutil.copy(base, where / "runs.sqlite3")
        fired = _one_failure(faults, where, number, errno.ENOSPC if number % 2 else errno.EIO)
        if not fired:
            return tried
        tried[fired] += 1
        shutil.rmtree(where)
        number += every


def _one_failure(faults: ctypes.CDLL, where: Path, number: int, error: int) -> str:
    url = f"sqlite:///{where}/runs.sqlite3"
    asked, acknowledged = [make_record(number) for number in (1, 2, 3)], set()
    with RunStore(url) as store:
        faults.arm(number, error, str(where).encode())
        for run in asked:
            try:
                store.put_and_wait(run, make_response(run, f"key-{run.id}"))
                acknowledged.add(run.id)
            except StoreError:
                continue
    faults.disarm()
    fired = faults.fired().decode()
    report = verify(url)
    assert report.sound, (number, fired, report)
    with sqlite3.connect(where / "runs.sqlite3") as connection:
        runs = {run for (run,) in connection.execute("SELECT id FROM runs")}
        keys = {run for (run,) in connection.execute("SELECT run_id FROM idempotency_keys")}
    connection.close()
    assert keys == runs & {run.id for run in asked}, (number, fired)
    assert acknowledged <= runs, (number, fired)
    assert len(acknowledged) >= 2, (number, fired, "one failure, and no more")
    return fired


def in_a_faulty_process(every: int = 1) -> Counter[str]:
    """Run ``failed_io`` in a subprocess. Raises FileNotFoundError without a C compiler."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "faulty_io.so"
        source = Path(__file__).with_name("faulty_io.c")
        subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl"], check=True)
        words = f"from tests.reliability.disk import *; print(json.dumps(failed_io(Path({folder!r}), {every})))"
        environment = {**os.environ, "LD_PRELOAD": str(library), "PYTHONPATH": str(ROOT)}
        done = subprocess.run([sys.executable, "-c", words], env=environment, capture_output=True, text=True, cwd=ROOT)
        assert done.returncode == 0, done.stderr
        return Counter(json.loads(done.stdout))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        print("journal cut or changed:", dict(cut_and_changed(int(sys.argv[1]), Path(scratch))))
    print("failed:", dict(in_a_faulty_process()))
