"""What type an operator has for numbers and arrays is found out once in a process, not at each of its uses.

numba tries some fifty rules for each ``+`` that it meets, one after the other, when it finds the types and again when
it makes code of it: a tenth of the time that a kernel takes to compile.

This reaches into numba's types of functions; where these look otherwise than expected, numba goes its own way.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_FOUND: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}
"""For an operator, by its identity, and the types it is given: the operator, held so that nothing else gets its
identity, and the types of its arguments and its result."""


@contextmanager
def types_of_operators() -> Iterator[None]:
    """As long as this lasts."""
    from numba.core.types.functions import BaseFunction, Function

    find = getattr(BaseFunction, "get_call_type", None)
    if find is None or "get_call_type" in Function.__dict__:
        yield
        return

    def get_call_type(self: Any, context: Any, given: Any, named: Any) -> Any:
        if named or getattr(self.typing_key, "__module__", None) != "_operator" or not all(map(_is_plain, given)):
            return find(self, context, given, named)
        key = (id(self), tuple(given))
        if key not in _FOUND:
            _FOUND[key] = (self, find(self, context, given, named))
        return _FOUND[key][1]

    Function.get_call_type = get_call_type
    try:
        yield
    finally:
        del Function.get_call_type


def _is_plain(type_: Any) -> bool:
    """What no one defines operators for but numba itself, and by rules that look at the types alone."""
    from numba.core import types

    if isinstance(type_, types.BaseTuple):
        return all(map(_is_plain, type_))
    return isinstance(type_, (types.Number, types.Boolean, types.Array, types.SliceType))
