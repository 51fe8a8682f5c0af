"""The greater and the lesser of two numbers, in the one form whose loops the compiler takes several at a time.

Python's own ``max`` and ``min`` become a comparison and a choice, and numba marks only the comparison as free of NaN;
LLVM then sees no maximum in the loop and does it number by number. Here the processor's instruction is asked for by
name. For use in ``reducing_kernel`` and ``fusing_kernel``, on floats that are not NaN.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_DOUBLE = ir.DoubleType()
_TWO_TO_ONE = ir.FunctionType(_DOUBLE, [_DOUBLE, _DOUBLE])
_SIGNATURE = types.float64(types.float64, types.float64)


@intrinsic
def greater(typing_context: Any, one: Any, other: Any) -> Any:
    """The greater of two floats."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.call(builder.module.declare_intrinsic("llvm.maxnum", [_DOUBLE], _TWO_TO_ONE), arguments)

    return _SIGNATURE, code


@intrinsic
def lesser(typing_context: Any, one: Any, other: Any) -> Any:
    """The lesser of two floats."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.call(builder.module.declare_intrinsic("llvm.minnum", [_DOUBLE], _TWO_TO_ONE), arguments)

    return _SIGNATURE, code
