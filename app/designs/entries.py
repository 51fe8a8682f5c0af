"""The kernels that Python calls, with their types: what can be compiled side by side before anything is asked for.

`signatures.py` lists them by the part whose rehearsals are the first to call for them. In short, types are: ``f``,
``i``, ``b``, ``c`` for a number (float, int, bool, complex), with the number of dimensions behind it for an array
(``f2``), and ``F`` or ``r`` behind that for one that lies in Fortran's order or may not be written to; a name is a
named tuple.

The list saves time and nothing else: a kernel that it does not know or no longer fits is compiled when it is called.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Any

from app.designs.signatures import ENTRIES, TUPLES
from solvers.numerics.jit import KERNELS, Kernel, sources

Part = tuple[str, str]

Entry = tuple[str, str]
"""Full name of a kernel, and its types as they are written here."""

_ROOM_DEPTH = 4

_LETTERS = {"f": "float64", "i": "int64", "b": "boolean", "c": "complex128"}
_SHORT = {"float64": "f", "int64": "i", "bool": "b", "complex128": "c"}
_WORD = re.compile(r"([fibc])(\d?)(F?)(r?)")


def units_of(part: Part) -> list[tuple[Entry, ...]]:
    """The entries that a part is the first to call, in bundles: those of one room hold the same inner kernels.

    What may take longest is begun first, so that two processes end at about the same time.
    """
    bundles: dict[str, list[Entry]] = {}
    for name, types in ENTRIES.get(part, ()):
        bundles.setdefault(".".join(_module(name).split(".")[:_ROOM_DEPTH]), []).append((name, types))
    return [tuple(bundle) for bundle in sorted(bundles.values(), key=_reach, reverse=True)]


def _module(name: str) -> str:
    return name.rpartition(".")[0]


def _reach(bundle: list[Entry]) -> int:
    """How many bytes of source its kernels may hold code of."""
    return sum(path.stat().st_size for path in {path for name, _ in bundle for path in sources(_module(name))})


def compile_entry(entry: Entry) -> bool:
    """Compile one for the types it is called with, or load it; False where the list no longer fits."""
    name, types = entry
    try:
        _kernel(name).compiled.compile(tuple(_type(word) for word in types.split()))
    except Exception:
        return False
    return True


def _kernel(name: str) -> Kernel:
    found = getattr(import_module(_module(name)), name.rpartition(".")[2])
    assert isinstance(found, Kernel)
    return found


@cache
def _type(word: str) -> Any:
    """numba's type for a word of the list."""
    from numba import types

    plain = _WORD.fullmatch(word)
    if plain is None:
        fields, own = TUPLES[word], _tuple_class(word)
        each = [_type(field) for field in fields.split()]
        return types.NamedUniTuple(each[0], len(each), own) if len(set(each)) == 1 else types.NamedTuple(each, own)
    letter, dimensions, fortran, readonly = plain.groups()
    number = getattr(types, _LETTERS[letter])
    if not dimensions:
        return number
    return types.Array(number, int(dimensions), "F" if fortran else "C", readonly=bool(readonly))


def _tuple_class(name: str) -> Any:
    module, _, own = name.rpartition(".")
    return getattr(import_module(module), own)


def called() -> Iterator[tuple[str, Any]]:
    """Every kernel that this process has called from Python, and the types it was called with."""
    for kernel in KERNELS:
        if "compiled" in kernel.__dict__:
            for types in kernel.compiled.signatures:
                yield f"{kernel.py_func.__module__}.{kernel.py_func.__name__}", types


def word_of(type_: Any, tuples: dict[str, str]) -> str:
    """The word for one of numba's types; named tuples are added to ``tuples``."""
    from numba import types

    if isinstance(type_, types.BaseNamedTuple):
        own = type_.instance_class
        name = f"{own.__module__}.{own.__name__}"
        tuples[name] = " ".join(word_of(each, tuples) for each in type_)
        return name
    if isinstance(type_, types.Array):
        return _SHORT[str(type_.dtype)] + str(type_.ndim) + type_.layout.replace("C", "") + "r" * (not type_.mutable)
    return _SHORT[str(type_)]
