"""Caching of operator types during compilation.

numba tries about fifty rules for every ``+``, once for type inference and once for code generation: a tenth of the
compilation time of a kernel.

This relies on numba's function types; if they differ from what is expected, numba's own mechanism is used.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_FOUND: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}
"""By operator identity and argument types: the operator (kept alive, so that its identity stays unique), and argument
and result types."""


@contextmanager
def types_of_operators() -> Iterator[None]:
    """Cache operator types within the block."""
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
    """Types whose operators only numba itself defines, by rules that depend on types alone."""
    from numba.core import types

    if isinstance(type_, types.BaseTuple):
        return all(map(_is_plain, type_))
    return isinstance(type_, (types.Number, types.Boolean, types.Array, types.SliceType))
