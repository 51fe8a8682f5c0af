"""Stored results of a campaign, for resuming it.

Every batch of results is appended to a file per kind in `.campaign/`, which git ignores. The file name contains a
fingerprint of everything the results depend on: the sources of the campaign, of the kind and of shared modules, and the
time limit. Changed sources select another file, so the campaign restarts; changes in one package leave the results of
the others. Only one campaign per kind may run at a time.
"""

from __future__ import annotations

import hashlib
import pickle
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from bench.campaign.seeds import Part

_ROOT = Path(__file__).parents[2]
FOLDER = _ROOT / ".campaign"
_SOURCES = ("solvers", "app/designs", "bench/campaign", "oracles")
_PROBLEMS = "bench/rod_problems.py"
"""Realistic rods, which their contests share with the benchmarks."""
_SHARED_FOLDERS = frozenset({"references", "examples", "dense", "textbook", "rivals"})
"""Shared folders that contain files per kind."""
_NON_JUDGING = frozenset({"__main__", "designs_page", "kept", "page", "rod_contests_page", "workers"})
"""Modules of the campaign that do not affect results; figures are excluded, too."""

OWN: Mapping[str, frozenset[str]] = {
    "flexible-rod": frozenset({"flexible_rod", "rod", "crank"}),
    "impact-linkage": frozenset({"impact_linkage", "linkage"}),
    "crank-dynamics": frozenset({"crank_dynamics", "crank"}),
    "pin-profile": frozenset({"pin_profile", "pin"}),
}
"""Names of modules and packages that belong to one kind, alone or before a `_`; the rod also uses the crank's
kinematics. All others are shared."""

_LENGTH, _CHECKSUM = 8, 4


def fingerprint(slug: str, limit: float, root: Path = _ROOT) -> str:
    """Hash of all sources on which a kind's verdicts depend, and of the time limit [s]."""
    others = frozenset().union(*OWN.values()) - OWN[slug]
    told = hashlib.sha256(f"{limit:g}".encode())
    sources = [path for folder in _SOURCES for path in (root / folder).rglob("*.py")]
    for source in sorted([*sources, *root.glob(_PROBLEMS)]):
        place = source.relative_to(root).with_suffix("")
        drawn = any(part.endswith(("picture", "pictures")) for part in place.parts)
        judging = not drawn and not (place.parts[0] == "bench" and place.name in _NON_JUDGING)
        if judging and not _named(_owner(place), others):
            told.update(f"\0{place.as_posix()}\0".encode() + source.read_bytes())
    return told.hexdigest()[:16]


def _owner(place: Path) -> str:
    """The part of a path that identifies the kind: the first name below a source folder or a shared folder.

    Deeper names are ignored: a linkage may have a module named after the crank.
    """
    folder = next((folder for folder in _SOURCES if place.is_relative_to(folder)), place.parent)
    below = place.relative_to(folder).parts
    return below[1] if below[0] in _SHARED_FOLDERS and len(below) > 1 else below[0]


def _named(part: str, names: Iterable[str]) -> bool:
    return any(part == name or part.startswith(f"{name}_") for name in names)


class Kept:
    """Append-only file of parts; every batch is preceded by its length and checksum.

    An incomplete batch at the end is ignored on reading and overwritten by the next one.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._end = path, 0
        self.parts: list[Part] = []
        if path.exists():
            with path.open("rb") as file:
                for batch in _batches(file):
                    self.parts += pickle.loads(batch)
                    self._end += _LENGTH + _CHECKSUM + len(batch)

    @property
    def seeds(self) -> frozenset[int]:
        return frozenset(part.seed for part in self.parts)

    def add(self, parts: list[Part]) -> None:
        """Append the results of complete seeds. Raises OSError if they cannot be written; earlier results remain."""
        batch = pickle.dumps(parts)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._path.touch()
        with self._path.open("r+b") as file:
            file.seek(self._end)
            file.write(len(batch).to_bytes(_LENGTH, "big") + zlib.crc32(batch).to_bytes(_CHECKSUM, "big") + batch)
            file.truncate()
        self._end += _LENGTH + _CHECKSUM + len(batch)
        self.parts += parts


def kept(slug: str, limit: float, what: str = "") -> Kept:
    """The file of a kind for the current sources and time limit; ``what`` is empty for scenes."""
    return Kept(FOLDER / f"{slug}{what}.{fingerprint(slug, limit)}")


def _batches(file: BinaryIO) -> Iterator[bytes]:
    """All complete batches."""
    while len(head := file.read(_LENGTH + _CHECKSUM)) == _LENGTH + _CHECKSUM:
        batch = file.read(int.from_bytes(head[:_LENGTH], "big"))
        if zlib.crc32(batch) != int.from_bytes(head[_LENGTH:], "big"):
            return
        yield batch
