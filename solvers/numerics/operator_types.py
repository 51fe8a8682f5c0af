"""The types of operators, which numba otherwise looks up again whenever it compiles.

numba tries about fifty rules for every ``+``, once for type inference and once for code generation, a tenth of the
compilation time of a kernel. This relies on numba's internals; where they differ from what is expected, numba's own
code is used.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_OPERATOR_TYPES: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}
"""Results by operator identity and argument types. The operator is stored too: as long as it is alive its identity
stays unique."""


@contextmanager
def types_of_operators() -> Iterator[None]:
    """Cache operator types within the block."""
    from numba.core.types.functions import BaseFunction, Function

    original = getattr(BaseFunction, "get_call_type", None)
    if original is None or "get_call_type" in Function.__dict__:
        yield
        return

    def get_call_type(self: Any, context: Any, arguments: Any, keywords: Any) -> Any:
        if (
            keywords
            or getattr(self.typing_key, "__module__", None) != "_operator"
            or not all(map(_is_plain, arguments))
        ):
            return original(self, context, arguments, keywords)
        key = (id(self), tuple(arguments))
        if key not in _OPERATOR_TYPES:
            _OPERATOR_TYPES[key] = (self, original(self, context, arguments, keywords))
        return _OPERATOR_TYPES[key][1]

    Function.get_call_type = get_call_type
    try:
        yield
    finally:
        del Function.get_call_type


def _is_plain(type_: Any) -> bool:
    """Whether only numba itself defines the operators of a type, by rules that depend on types alone."""
    from numba.core import types

    if isinstance(type_, types.BaseTuple):
        return all(map(_is_plain, type_))
    return isinstance(type_, (types.Number, types.Boolean, types.Array, types.SliceType))
