"""Entry points: the kernels called from Python, with their argument types, for compilation ahead of use.

`signatures.py` lists them by the part whose rehearsals call them first. Types are abbreviated: ``f``, ``i``, ``b``,
``c`` for a scalar (float, int, bool, complex), followed by the number of dimensions for an array (``f2``), and by ``F``
or ``r`` for Fortran order or read-only; any other word is a named tuple.

The list only saves time: a kernel that is missing from it, or listed with outdated types, is compiled on its first
call.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Any

from app.designs.signatures import ENTRIES, TUPLES
from solvers.numerics.jit import KERNELS, Kernel

Part = tuple[str, str]

Entry = tuple[str, str]
"""Qualified name of a kernel, and its abbreviated types."""

_LETTERS = {"f": "float64", "i": "int64", "b": "boolean", "c": "complex128"}
_SHORT = {"float64": "f", "int64": "i", "bool": "b", "complex128": "c"}
_WORD = re.compile(r"([fibc])(\d?)(F?)(r?)")


def units_of(part: Part) -> list[tuple[tuple[Entry, ...], frozenset[str]]]:
    """The part's entries in units, each compiled by one process, and the names of all kernels of each.

    A unit is an entry, with those that it calls as inner kernels: in another process these would be compiled again. The
    longest units come first, so that two processes finish at about the same time.
    """
    left = {entry: _called_by(_kernel(entry[0])) for entry in ENTRIES.get(part, ())}
    units = []
    for entry in sorted(left, key=lambda each: sum(map(code_size, left[each])), reverse=True):
        if entry in left:
            called = left[entry]
            entries = (entry, *(each for each in left if each != entry and _kernel(each[0]) in called))
            units.append((entries, frozenset(map(name_of, called))))
            for each in entries:
                del left[each]
    return units


def _called_by(kernel: Kernel) -> set[Kernel]:
    """The kernel and all that it calls, directly or indirectly."""
    found, waiting = {kernel}, [kernel]
    while waiting:
        of = waiting.pop().py_func
        called = (of.__globals__.get(name) for name in of.__code__.co_names)
        new = {each for each in called if isinstance(each, Kernel)} - found
        found |= new
        waiting += new
    return found


def name_of(kernel: Kernel) -> str:
    """Qualified name of a kernel."""
    return f"{kernel.py_func.__module__}.{kernel.py_func.__name__}"


def code_size(kernel: Kernel) -> int:
    """Size of the kernel's own bytecode, by which the time to compile it is estimated."""
    return len(kernel.py_func.__code__.co_code)


def compile_entry(entry: Entry) -> bool:
    """Compile or load an entry; False if the listed types are outdated."""
    name, types = entry
    try:
        _kernel(name).compiled.compile(tuple(_type(word) for word in types.split()))
    except Exception:
        return False
    return True


def _kernel(name: str) -> Kernel:
    module, _, own = name.rpartition(".")
    found = getattr(import_module(module), own)
    assert isinstance(found, Kernel)
    return found


@cache
def _type(word: str) -> Any:
    """numba's type of an abbreviation."""
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
    """Every kernel called from Python in this process, with its types."""
    for kernel in KERNELS:
        if "compiled" in kernel.__dict__:
            for types in kernel.compiled.signatures:
                yield name_of(kernel), types


def word_of(type_: Any, tuples: dict[str, str]) -> str:
    """The abbreviation of a numba type; named tuples are added to ``tuples``."""
    from numba import types

    if isinstance(type_, types.BaseNamedTuple):
        own = type_.instance_class
        name = f"{own.__module__}.{own.__name__}"
        tuples[name] = " ".join(word_of(each, tuples) for each in type_)
        return name
    if isinstance(type_, types.Array):
        return _SHORT[str(type_.dtype)] + str(type_.ndim) + type_.layout.replace("C", "") + "r" * (not type_.mutable)
    return _SHORT[str(type_)]
