"""Generating machine code only once per kernel called from Python, including all inner kernels.

By default numba optimizes every kernel, generates its machine code, links its optimized code into each caller, and
optimizes it again there: in a chain of six, the innermost kernel six times. Inner kernels are only called by other
kernels. Here they stay unoptimized until a kernel with a Python entry includes them, and are optimized with it.

This relies on numba's ``JITCodeLibrary``; if it differs from what is expected, numba's own mechanism is used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from typing import Any, TypeVar

from solvers.numerics.operator_types import types_of_operators

R = TypeVar("R")

_REQUIRED_ATTRIBUTES = ("finalize", "_optimize_functions", "_finalize_dynamic_globals", "_get_module_for_linking",
           "_get_compiled_object", "serialize_using_object_code", "codegen")  # fmt: skip
_ENTRY, _ENVIRONMENT = "_ZN7cpython", "_ZN08NumbaEnv"
"""Prefixes of the names of Python entries and of function environments."""


def link_once(compile_: Callable[..., R]) -> Callable[..., R]:
    """Wrap a dispatcher's ``compile_`` so that everything it calls is linked before any optimization."""

    @wraps(compile_)
    def compiling(*arguments: Any) -> R:
        with _linking():
            return compile_(*arguments)

    return compiling


@contextmanager
def _linking() -> Iterator[None]:
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.registry import cpu_target

    library = _library()
    generator = cpu_target.target_context.codegen()
    if library is None or not hasattr(generator, "_library_class"):
        yield
        return
    with global_compiler_lock, _no_entry_from_c(cpu_target.target_context), types_of_operators():
        original = generator._library_class
        generator._library_class = library
        try:
            yield
        finally:
            generator._library_class = original


@contextmanager
def _no_entry_from_c(context: Any) -> Iterator[None]:
    """Suppress the unused C entries that numba generates for its own functions (``numpy.empty``, slices, sums)."""
    context.create_cfunc_wrapper = lambda *_arguments: None
    try:
        yield
    finally:
        del context.create_cfunc_wrapper


@cache
def _library() -> type | None:
    """numba's code library, without optimizing libraries that have no entry."""
    from llvmlite.binding import Linkage
    from numba.core.codegen import JITCodeLibrary

    if not all(hasattr(JITCodeLibrary, name) for name in _REQUIRED_ATTRIBUTES):
        return None

    class Library(JITCodeLibrary):
        _inner = False

        def finalize(self) -> None:
            self._inner = not any(
                function.name.startswith(_ENTRY) for function in _defined_functions(self._final_module)
            )
            if self._inner:
                self._finalize_dynamic_globals()
                self._finalized = True
            else:
                self._linking_libraries = _all_callees(self)
                super().finalize()

        def _optimize_functions(self, module: Any) -> None:
            module.data_layout = self._codegen._data_layout
            passes, builder = self._codegen._function_pass_manager()
            for function in _defined_functions(module):
                passes.run(function, builder)

        def _get_module_for_linking(self) -> Any:
            if not self._inner:
                return super()._get_module_for_linking()
            for function in _defined_functions(self._final_module):
                if function.linkage == Linkage.external:
                    function.linkage = "linkonce_odr"
            for variable in self._final_module.global_variables:
                # Python objects used by a function, which numba would look up again wherever it is loaded.
                if variable.name.startswith(_ENVIRONMENT) and not variable.is_declaration:
                    variable.linkage = "internal"
            return self._final_module

        def serialize_using_object_code(self) -> tuple[str, str, tuple[bytes, bytes]]:
            """As in numba, but without the intermediate code, which is never linked again; the names suffice."""
            return self.name, "object", (self._get_compiled_object(), _without_bodies(self._final_module))

        @property
        def codegen(self) -> Any:
            return _NoEnvironment if self._inner else super().codegen

    return Library


def _defined_functions(module: Any) -> list[Any]:
    return [function for function in module.functions if not function.is_declaration]


def _all_callees(library: Any) -> list[Any]:
    """All libraries called, callers first, because LLVM drops functions that nothing has called so far."""
    found: dict[Any, None] = {}

    def visit(caller: Any) -> None:
        for callee in caller._linking_libraries:
            if callee not in found:
                found[callee] = None
                if getattr(callee, "_inner", False):
                    visit(callee)
                # Appended after all its callees, so that it precedes them in the reversed order.
                found[callee] = found.pop(callee)

    visit(library)
    return [*reversed(found)]


def _without_bodies(module: Any) -> bytes:
    """A module with the same entries and empty bodies."""
    from llvmlite.binding import parse_assembly

    entries = [function.name for function in _defined_functions(module) if function.name.startswith(_ENTRY)]
    return parse_assembly("\n".join(f'define void @"{name}"() {{ ret void }}' for name in entries)).as_bitcode()


class _NoEnvironment:
    """A stub for the environment of an inner kernel, which is never read."""

    @staticmethod
    def set_env(_name: str, _environment: Any) -> None:
        """Ignore it."""
