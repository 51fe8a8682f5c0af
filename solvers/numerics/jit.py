"""One place for how kernels are compiled: cached on disk, IEEE arithmetic, no hidden threads.

The compiler itself is imported with the first kernel that is called: who only reads a scene or a table does without.

numba keeps machine code as long as the file that a kernel stands in is unchanged, although code of the kernels it calls
is part of it. Here the cache is told of every file of this package that the kernel's module imports, directly or not.

What a machine waits for at its first start is compiled here. A kernel that puts an array into a part of another one
costs some two seconds more than one that does so element by element, for the message about shapes that do not fit.
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
"""Every kernel of the modules imported so far."""


class Kernel:
    """A function that is compiled when it is first called, from Python or from another kernel."""

    def __init__(self, function: Callable[..., Any], fastmath: object, inlined: bool = False) -> None:
        self.py_func = function
        self._fastmath, self._inlined = fastmath, inlined
        update_wrapper(self, function)
        KERNELS.append(self)

    @cached_property
    def compiled(self) -> Any:
        """As Python calls it: compiled for the types it is called with, or loaded from the disk."""
        dispatcher = _kept(self._dispatcher(cache=True))
        dispatcher.compile = linking.once(dispatcher.compile)
        return dispatcher

    @cached_property
    def inner(self) -> Any:
        """As other kernels call it, whose machine code holds this one's: without the entry from Python.

        The entry takes apart every array of every tuple, which is most of what a small kernel costs to compile.
        """
        return self._dispatcher(no_cpython_wrapper=True, forceinline=self._inlined)

    @property
    def is_compiled(self) -> bool:
        """Whether its machine code is in memory, for any types."""
        return any(kind in self.__dict__ and bool(getattr(self, kind).signatures) for kind in ("compiled", "inner"))

    @property
    def files(self) -> list[Path]:
        """Where the machine code that Python calls lies on disk; none where numba keeps it otherwise than expected."""
        kept = getattr(getattr(self.__dict__.get("compiled"), "_cache", None), "_cache_file", None)
        index = getattr(kept, "_index_path", None)
        return [] if index is None else sorted(Path(index).parent.glob(f"{escape(Path(index).stem)}.*"))

    @property
    def _numba_type_(self) -> Any:
        """By this numba knows the type of a value: that of the kernel as other kernels call it."""
        return self.inner._numba_type_

    def _dispatcher(self, **options: Any) -> Any:
        import numba

        # No kernel is handed to C code as a pointer, so none needs an entry for that.
        always: dict[str, Any] = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
        return numba.njit(fastmath=self._fastmath, **always, **options)(self.py_func)

    def __call__(self, *arguments: Any) -> Any:
        return self.compiled(*arguments)


def kernel(function: F) -> F:
    """Compile ``function`` for the machine at hand, keep the machine code on disk, leave IEEE rules intact.

    ``error_model="numpy"`` lets divisions by zero give inf, as in numpy, so that loops vectorise. ``fastmath`` is
    denied in so many words: left unsaid, it would be taken over from whichever kernel calls this one first.
    """
    return cast(F, Kernel(function, fastmath=False))


def inlined_kernel(function: F) -> F:
    """As ``kernel``, for a few lines that loops of other kernels call with large tuples: its code becomes theirs.

    Otherwise every number and array of a tuple is handed over at every call, which may take longer than the lines do.
    """
    return cast(F, Kernel(function, fastmath=False, inlined=True))


def reducing_kernel(function: F) -> F:
    """As ``kernel``, for loops that take greatest and least values: assumes no NaN and no care for the sign of zero.

    Without that promise a maximum is a chain of comparisons that no processor can take several at a time. Sums and
    products keep their order and rounding.
    """
    return cast(F, Kernel(function, fastmath={"nnan", "nsz"}))


def fusing_kernel(function: F) -> F:
    """As ``reducing_kernel``; a product added to a sum may moreover be rounded once instead of twice.

    The last place then depends on whether the processor has such an instruction.
    """
    return cast(F, Kernel(function, fastmath={"nnan", "nsz", "contract"}))


def _kept(compiled: Any) -> Any:
    """The same kernel, its cache good for as long as no source it may hold code of has changed."""
    # There is no public way to name what a cache depends on; without this attribute numba's own rule holds.
    cache = getattr(compiled, "_cache", None)
    loading.load_alone(cache)
    file = getattr(cache, "_cache_file", None)
    if file is not None and _file(compiled.py_func.__module__) is not None:
        file._source_stamp = stamp(compiled.py_func.__module__)
    return compiled


@cache
def stamp(module: str) -> str:
    """A digest of the module and of everything in this package that it imports."""
    digest = hashlib.sha256()
    for path in sources(module):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def sources(module: str) -> list[Path]:
    """The files of this repository that a module's code may come from, itself first."""
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
