"""Caches for intermediate results that numba otherwise recomputes while it compiles.

- The type of an operator: numba tries about fifty rules for every ``+``, once for type inference and once for code
  generation, a tenth of the compilation time of a kernel.
- The size of a type: LLVM parses a module for every query.
- The variables alive in each block of a function: recomputed after nine compiler passes, although only the last
  result is used, to place the releases of variables.

This relies on numba's internals; where they differ from what is expected, numba's own code is used.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_OPERATOR_TYPES: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}
"""Results by operator identity and argument types. The operator is stored too: as long as it is alive its identity
stays unique."""


_SIZES: dict[str, int] = {}
"""Size in bytes by LLVM type."""


@contextmanager
def all_caches() -> Iterator[None]:
    """Apply every cache of this module within the block."""
    with types_of_operators(), sizes_of_types(), without_block_lifetimes():
        yield


@contextmanager
def sizes_of_types() -> Iterator[None]:
    """Cache the sizes of types on this machine within the block."""
    from numba.core.registry import cpu_target

    context = cpu_target.target_context
    original = getattr(context, "get_abi_sizeof", None)
    if original is None or "get_abi_sizeof" in vars(context):
        yield
        return

    def get_abi_sizeof(type_: Any) -> int:
        name = str(type_)
        if name not in _SIZES:
            _SIZES[name] = original(type_)
        return _SIZES[name]

    context.get_abi_sizeof = get_abi_sizeof
    try:
        yield
    finally:
        del context.get_abi_sizeof


@contextmanager
def without_block_lifetimes() -> Iterator[None]:
    """Skip the computation of the variables alive at the start of each block of code, within the context.

    Only generators and numba's object mode need these variables, and kernels use neither. Lifetimes of variables are
    computed on request, by numba's own rule.
    """
    from inspect import signature

    from numba.core import postproc, transforms

    original = postproc.PostProcessor.run
    if list(signature(original).parameters) != ["self", "emit_dels", "extend_lifetimes"]:
        yield
        return

    def run(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        function = self.func_ir
        if emit_dels or function.is_generator:
            original(self, emit_dels, extend_lifetimes)
            return
        function.blocks = transforms.canonicalize_cfg(function.blocks)
        function.variable_lifetime = postproc.VariableLifetime(function.blocks)
        function.generator_info = None

    postproc.PostProcessor.run = run
    try:
        yield
    finally:
        postproc.PostProcessor.run = original


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
