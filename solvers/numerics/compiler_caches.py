"""Caches for what numba would otherwise compute repeatedly while it compiles.

- The type of an operator: numba tries about fifty rules for every ``+``, once for type inference and once for code
  generation, a tenth of the compilation time of a kernel.
- The size of a type: LLVM parses a module for each question.
- Which variables are alive in each block of a function: recomputed after nine compiler passes, although only the last
  result is used, to place the releases of variables.

This relies on numba's internals; what differs from what is expected is left to numba.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_FOUND: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}
"""Results by operator identity and argument types. The operator is stored too: as long as it is alive its identity
stays unique."""


_SIZES: dict[str, int] = {}
"""Size in bytes by LLVM type."""


@contextmanager
def all_caches() -> Iterator[None]:
    """Apply every cache of this module within the block."""
    with types_of_operators(), sizes_of_types(), last_lifetimes():
        yield


@contextmanager
def sizes_of_types() -> Iterator[None]:
    """Cache the sizes of types on this machine within the block."""
    from numba.core.registry import cpu_target

    context = cpu_target.target_context
    find = getattr(context, "get_abi_sizeof", None)
    if find is None or "get_abi_sizeof" in vars(context):
        yield
        return

    def get_abi_sizeof(type_: Any) -> int:
        name = str(type_)
        if name not in _SIZES:
            _SIZES[name] = find(type_)
        return _SIZES[name]

    context.get_abi_sizeof = get_abi_sizeof
    try:
        yield
    finally:
        del context.get_abi_sizeof


@contextmanager
def last_lifetimes() -> Iterator[None]:
    """Skip the computation of the variables alive at the start of each block of code, within the context.

    Only generators and numba's object mode need them, and kernels use neither. Lifetimes of variables are still
    computed on request, by numba's own rule.
    """
    from inspect import signature

    from numba.core import postproc, transforms

    process = postproc.PostProcessor.run
    if list(signature(process).parameters) != ["self", "emit_dels", "extend_lifetimes"]:
        yield
        return

    def run(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        code = self.func_ir
        if emit_dels or code.is_generator:
            process(self, emit_dels, extend_lifetimes)
            return
        code.blocks = transforms.canonicalize_cfg(code.blocks)
        code.variable_lifetime = postproc.VariableLifetime(code.blocks)
        code.generator_info = None

    postproc.PostProcessor.run = run
    try:
        yield
    finally:
        postproc.PostProcessor.run = process


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
    """Whether only numba itself defines the operators of a type, by rules that depend on types alone."""
    from numba.core import types

    if isinstance(type_, types.BaseTuple):
        return all(map(_is_plain, type_))
    return isinstance(type_, (types.Number, types.Boolean, types.Array, types.SliceType))
