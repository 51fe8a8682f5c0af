"""Machine code is made once: in the kernels that Python calls, which hold the code of all those that they call.

numba optimizes every kernel and makes machine code of it, links its optimized code into each of its callers, and there
optimizes it again: in a chain of six, the last one six times. Nothing but its callers ever calls an inner kernel,
though. Here it stays as it was lowered until a kernel with an entry from Python takes it in, and is optimized with it.

This reaches into numba's ``JITCodeLibrary``; where that one looks otherwise than expected, numba goes its own way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from typing import Any, TypeVar

from solvers.numerics import remembering

R = TypeVar("R")

_NEEDED = ("finalize", "_optimize_functions", "_finalize_dynamic_globals", "_get_module_for_linking",
           "_get_compiled_object", "serialize_using_object_code", "codegen")  # fmt: skip
_ENTRY, _ENVIRONMENT = "_ZN7cpython", "_ZN08NumbaEnv"
"""What the names of the functions that Python calls, and of every function's environment, begin with."""


def once(compile_: Callable[..., R]) -> Callable[..., R]:
    """``compile_``, a dispatcher's method, with all that it calls for linked into one piece before any optimization."""

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
    with global_compiler_lock, _no_entry_from_c(cpu_target.target_context), remembering.types_of_operators():
        before = generator._library_class
        generator._library_class = library
        try:
            yield
        finally:
            generator._library_class = before


@contextmanager
def _no_entry_from_c(context: Any) -> Iterator[None]:
    """What numba is made of (``numpy.empty``, slices, sums) would get one each, which nothing calls."""
    context.create_cfunc_wrapper = lambda *_arguments: None
    try:
        yield
    finally:
        del context.create_cfunc_wrapper


@cache
def _library() -> type | None:
    """numba's library of code, which leaves alone what has no entry of its own."""
    from llvmlite.binding import Linkage
    from numba.core.codegen import JITCodeLibrary

    if not all(hasattr(JITCodeLibrary, name) for name in _NEEDED):
        return None

    class Library(JITCodeLibrary):
        _inner = False

        def finalize(self) -> None:
            self._inner = not any(function.name.startswith(_ENTRY) for function in _defined(self._final_module))
            if self._inner:
                self._finalize_dynamic_globals()
                self._finalized = True
            else:
                self._linking_libraries = _reached(self)
                super().finalize()

        def _optimize_functions(self, module: Any) -> None:
            module.data_layout = self._codegen._data_layout
            passes, builder = self._codegen._function_pass_manager()
            for function in _defined(module):
                passes.run(function, builder)

        def _get_module_for_linking(self) -> Any:
            if not self._inner:
                return super()._get_module_for_linking()
            for function in _defined(self._final_module):
                if function.linkage == Linkage.external:
                    function.linkage = "linkonce_odr"
            for variable in self._final_module.global_variables:
                # What numba keeps for a function's use of Python, and would look up again wherever it is loaded.
                if variable.name.startswith(_ENVIRONMENT) and not variable.is_declaration:
                    variable.linkage = "internal"
            return self._final_module

        def serialize_using_object_code(self) -> tuple[str, str, tuple[bytes, bytes]]:
            """As numba's, which keeps the intermediate code beside: nothing links what has an entry, names will do."""
            return self.name, "object", (self._get_compiled_object(), _names_alone(self._final_module))

        @property
        def codegen(self) -> Any:
            return _Nowhere if self._inner else super().codegen

    return Library


def _defined(module: Any) -> list[Any]:
    return [function for function in module.functions if not function.is_declaration]


def _reached(library: Any) -> list[Any]:
    """All that a library calls, directly or not: what an inner one calls is linked where that is, and once.

    A caller comes before what it calls, for LLVM leaves out what nothing has called so far.
    """
    found: dict[Any, None] = {}

    def look_into(calling: Any) -> None:
        for called in calling._linking_libraries:
            if called not in found:
                found[called] = None
                if getattr(called, "_inner", False):
                    look_into(called)
                # Last among the known as soon as all that it calls are there: read backwards, it is ahead of them.
                found[called] = found.pop(called)

    look_into(library)
    return [*reversed(found)]


def _names_alone(module: Any) -> bytes:
    """A module that defines the same entries, with nothing in them."""
    from llvmlite.binding import parse_assembly

    entries = [function.name for function in _defined(module) if function.name.startswith(_ENTRY)]
    return parse_assembly("\n".join(f'define void @"{name}"() {{ ret void }}' for name in entries)).as_bitcode()


class _Nowhere:
    """Where the environment of an inner kernel is put: nothing that it does looks into it."""

    @staticmethod
    def set_env(_name: str, _environment: Any) -> None:
        """Leave it."""
