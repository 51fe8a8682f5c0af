"""Compilation of kernels: cached on disk, IEEE arithmetic, single-threaded.

The compiler is imported on the first kernel call, so that reading a scene or a table does not need it.

numba invalidates cached code only if the file defining the kernel changes, although the code of called kernels is
included. Here the cache key covers all files of this package that the kernel's module imports, directly or indirectly.

Compilation time matters: on a new machine, the first requests wait for it. For that reason kernels copy arrays in
explicit loops: assigning an array to a slice takes two seconds longer to compile, mostly for its error message about
mismatched shapes.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from glob import escape
from pathlib import Path
from typing import Any, TypeVar, cast

from solvers.numerics import linking, loading

F = TypeVar("F", bound=Callable[..., object])

_ROOT = Path(__file__).parents[2]
_IMPORT = re.compile(r"^from (solvers[\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)

KERNELS: list[Kernel] = []
"""All kernels of the modules imported so far."""


class Kernel:
    """A function compiled on its first call, from Python or from another kernel."""

    def __init__(self, function: Callable[..., Any], fastmath: object, inlined: bool = False) -> None:
        self.py_func = function
        self._fastmath, self._inlined = fastmath, inlined
        update_wrapper(self, function)
        KERNELS.append(self)

    @cached_property
    def compiled(self) -> Any:
        """The entry for Python: compiled for the argument types, or loaded from disk."""
        dispatcher = _with_source_digest(self._dispatcher(cache=True))
        dispatcher.compile = linking.link_once(dispatcher.compile)
        return dispatcher

    @cached_property
    def inner(self) -> Any:
        """The entry for other kernels, which include its machine code: without a Python wrapper.

        The wrapper unpacks every array of every tuple, which is most of the compilation time of a small kernel.
        """
        dispatcher = self._dispatcher(no_cpython_wrapper=True, forceinline=self._inlined)
        dispatcher.get_call_template = _without_literals(dispatcher.get_call_template)
        return dispatcher

    @property
    def is_compiled(self) -> bool:
        """Whether its machine code is in memory, for any types."""
        return any(kind in self.__dict__ and bool(getattr(self, kind).signatures) for kind in ("compiled", "inner"))

    @property
    def files(self) -> list[Path]:
        """Cache files of the Python entry; empty if numba's cache differs from what is expected."""
        cache_file = getattr(getattr(self.__dict__.get("compiled"), "_cache", None), "_cache_file", None)
        index = getattr(cache_file, "_index_path", None)
        return [] if index is None else sorted(Path(index).parent.glob(f"{escape(Path(index).stem)}.*"))

    @property
    def _numba_type_(self) -> Any:
        """numba's hook for the type of a value: the kernel as called by other kernels."""
        return self.inner._numba_type_

    def _dispatcher(self, **options: Any) -> Any:
        import numba

        # no kernel is passed to C as a function pointer
        common: dict[str, Any] = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
        return numba.njit(fastmath=self._fastmath, **common, **options)(self.py_func)

    def __call__(self, *arguments: Any) -> Any:
        return self.compiled(*arguments)


def kernel(function: F) -> F:
    """Compile ``function`` for this machine, cache the machine code on disk, keep IEEE semantics.

    ``error_model="numpy"`` makes division by zero return inf, so that loops vectorise. ``fastmath`` is disabled
    explicitly; otherwise it would be inherited from the first kernel that calls this one.
    """
    return cast(F, Kernel(function, fastmath=False))


def inlined_kernel(function: F) -> F:
    """Like ``kernel``, but inlined: for short functions called in loops with large tuples.

    Passing every number and array of a tuple at each call may take longer than the function itself.
    """
    return cast(F, Kernel(function, fastmath=False, inlined=True))


def reducing_kernel(function: F) -> F:
    """Like ``kernel``, for minima and maxima in loops: assumes no NaN and ignores the sign of zero.

    Without this assumption a maximum cannot be vectorised. The order and rounding of sums and products are unaffected.
    """
    return cast(F, Kernel(function, fastmath={"nnan", "nsz"}))


def fusing_kernel(function: F) -> F:
    """Like ``reducing_kernel``, and allows fused multiply-add.

    The last digit then depends on whether the processor has that instruction.
    """
    return cast(F, Kernel(function, fastmath={"nnan", "nsz", "contract"}))


def _without_literals(call_template: Callable[..., Any]) -> Callable[..., Any]:
    """Treat constants as numbers; numba would otherwise compile a kernel again for each value."""

    def of_types(arguments: Any, named: Any) -> Any:
        from numba.core.types import unliteral

        return call_template(tuple(map(unliteral, arguments)), {name: unliteral(own) for name, own in named.items()})

    return of_types


def _with_source_digest(compiled: Any) -> Any:
    """Make the cache depend on all sources that the kernel's code may include."""
    # There is no public API for a cache's dependencies; without this attribute numba's own rule applies.
    cache = getattr(compiled, "_cache", None)
    loading.load_without_compiler(cache)
    file = getattr(cache, "_cache_file", None)
    if file is not None and _file(compiled.py_func.__module__) is not None:
        file._source_stamp = source_digest(compiled.py_func.__module__)
        # numba compares the version before it reads the rest, which may name classes that no longer exist.
        file._version = f"{file._version} {file._source_stamp}"
    return compiled


@cache
def source_digest(module: str) -> str:
    """A digest of the module and everything it imports from this package, with their places."""
    digest = hashlib.sha256()
    for path in sources(module):
        digest.update(path.relative_to(_ROOT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()


def sources(module: str) -> list[Path]:
    """The files of this package that a module's code may depend on, itself first."""
    found: list[Path] = []
    waiting = [module]
    while waiting:
        path = _file(waiting.pop())
        if path is not None and path not in found:
            found.append(path)
            waiting += _imports(path)
    return found


@cache
def _imports(path: Path) -> list[str]:
    names = []
    for base, listed in _IMPORT.findall(path.read_text("utf-8")):
        names += [base, *(f"{base}.{name}" for name in re.findall(r"\w+", listed))]
    return names


@cache
def _file(module: str) -> Path | None:
    path = _ROOT / Path(*module.split("."))
    return next((p for p in (path.with_suffix(".py"), path / "__init__.py") if p.is_file()), None)
