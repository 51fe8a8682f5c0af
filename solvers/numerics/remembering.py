"""What numba finds out again and again while it compiles, found out once.

- The type of an operator: numba tries about fifty rules for every ``+``, once for type inference and once for code
  generation, a tenth of the compilation time of a kernel.
- The size of a type: LLVM parses a module for each question.
- Which variables are alive in each block of a function: determined anew after nine passes, but only the last result is
  used, for the places where variables are released.
- Which declarations are new: two hundred of them are imported and looked through for each function that is called.
- Which settings a function is compiled with: compared one by one for each call of a function.
- Which variables a statement names, by the rules of each of its parts.

Nor does anything listen to what is announced before and after each call of LLVM.

This relies on numba's internals; what differs from what is expected is left to numba.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from typing import Any

_FOUND: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}
"""By operator identity and argument types: the operator (kept alive, so that its identity stays unique), and argument
and result types."""


_SIZES: dict[str, int] = {}
"""Size in bytes by LLVM type."""


@contextmanager
def findings() -> Iterator[None]:
    """All of the below within the block."""
    with ExitStack() as stack:
        for finding in (types_of_operators, sizes_of_types, last_lifetimes, new_declarations, settings, variables,
                        silence):  # fmt: skip
            stack.enter_context(finding())
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
    """Within the block, the variables alive at the start of each block of code are not determined.

    Only generators and numba's object mode need them, which kernels do not use. Lifetimes themselves are determined
    when they are asked for, by numba's own rule.
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
    """Types whose operators only numba itself defines, by rules that depend on types alone."""
    from numba.core import types

    if isinstance(type_, types.BaseTuple):
        return all(map(_is_plain, type_))
    return isinstance(type_, (types.Number, types.Boolean, types.Array, types.SliceType))


@contextmanager
def _replaced(owner: Any, **attributes: Any) -> Iterator[None]:
    """Other attributes of a class or module within the block; nothing if it does not have all of them itself."""
    before = {name: vars(owner)[name] for name in attributes if name in vars(owner)}
    if len(before) < len(attributes):
        yield
        return
    for name, attribute in attributes.items():
        setattr(owner, name, attribute)
    try:
        yield
    finally:
        for name, attribute in before.items():
            setattr(owner, name, attribute)


@contextmanager
def new_declarations() -> Iterator[None]:
    """Within the block, contexts look for new declarations only if there are more than before."""
    from numba.core import base
    from numba.core.typing import context

    with _refreshed_when_longer(base.BaseContext), _refreshed_when_longer(context.BaseContext):
        yield


@contextmanager
def _refreshed_when_longer(owner: Any) -> Iterator[None]:
    refresh, known = owner.refresh, dict[int, tuple[int, list[Any]]]()

    def refresh_if_longer(self: Any) -> None:
        length, lists = known.get(id(self), (-1, []))
        if not lists or sum(map(len, lists)) != length:
            refresh(self)
            lists = [getattr(each, name) for each, own in self._registries.items() for name in own.registry_items]
            known[id(self)] = sum(map(len, lists)), lists

    with _replaced(owner, refresh=refresh_if_longer):
        yield


@contextmanager
def settings() -> Iterator[None]:
    """Within the block, equal settings are found equal without filling in the others."""
    from numba.core import base
    from numba.core.targetconfig import TargetConfig

    equal = TargetConfig.__eq__

    def __eq__(self: Any, other: Any) -> bool:
        return (type(self) is type(other) and self._values == other._values) or equal(self, other)

    with _replaced(TargetConfig, __eq__=__eq__), _replaced(base, _has_loc=cache(base._has_loc)):
        yield


@contextmanager
def variables() -> Iterator[None]:
    """Within the block, the variables of a statement are listed by a table of its parts' types."""
    from numba.core.ir import Inst, Var

    kinds: dict[type, int] = {}

    def kind(type_: type) -> int:
        found = [issubclass(type_, classes) for classes in (Var, Inst, (dict, list, tuple))]
        kinds[type_] = found.index(True) if any(found) else len(found)
        return kinds[type_]

    def listed(self: Any, part: Any) -> list[Any]:
        found: list[Any] = []
        for each in part.values() if isinstance(part, dict) else part if isinstance(part, (list, tuple)) else (part,):
            own = kinds.get(type(each))
            own = kind(type(each)) if own is None else own
            if own == 0:
                found.append(each)
            elif own == 1:
                found += each.list_vars()
            elif own == 2:
                found += listed(self, each)
        return found

    with _replaced(Inst, _rec_list_vars=listed):
        yield


@contextmanager
def silence() -> Iterator[None]:
    """Within the block, calls of LLVM are not announced."""
    from llvmlite.binding import ffi
    from numba.core import event

    lock = getattr(ffi.lib, "_lock", None)
    announced = getattr(lock, "_cblist", None)
    if not isinstance(announced, list) or len(announced) != 1 or event._registered.get("numba:llvm_lock"):
        yield
        return
    lock._cblist = []
    try:
        yield
    finally:
        lock._cblist = announced
