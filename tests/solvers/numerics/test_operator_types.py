"""What is kept is what numba finds, for numbers and arrays alone, and only while kernels are compiled."""

from __future__ import annotations

import operator
import re
from contextlib import nullcontext
from typing import Any

import numba
import numpy as np
import pytest
from numba.core import types
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction, Function

from solvers.numerics import operator_types

ARRAY = types.Array(types.float64, 1, "C")


def prepared() -> Any:
    """numba's knowledge of types, as it is when a kernel is compiled."""
    cpu_target.typing_context.refresh()
    return cpu_target.typing_context


@pytest.mark.parametrize(
    "given",
    [
        (types.float64, types.int64),
        (types.complex128, types.float64),
        (ARRAY, types.float64),
        (types.IntegerLiteral(2), types.int64),
    ],
    ids=str,
)
def test_the_second_answer_is_the_first_and_numba_s_own(given: tuple[types.Type, ...]) -> None:
    context = prepared()
    plus = context.resolve_value_type(operator.add)
    own = plus.get_call_type(context, given, {})
    with operator_types.types_of_operators():
        first, second = (plus.get_call_type(context, given, {}) for _ in range(2))
    assert second is first
    assert (first.return_type, first.args) == (own.return_type, own.args)
    assert Function.get_call_type is BaseFunction.get_call_type


def test_what_is_no_number_is_left_to_numba() -> None:
    context = prepared()
    plus = context.resolve_value_type(operator.add)
    texts = (types.unicode_type, types.unicode_type)
    with operator_types.types_of_operators():
        assert plus.get_call_type(context, texts, {}).return_type == types.unicode_type
    assert not any(given == texts for _, given in operator_types._OPERATOR_TYPES)


def mean_of_marked(values: np.ndarray, marked: np.ndarray) -> float:
    """Branches, a loop, an array that is released, and a tuple."""
    total = 0.0, 1
    for i in range(values.size):
        if not marked[i]:
            continue
        rest = values[i:]
        total = total[0] + rest[0], total[1] + 1
    return total[0] / total[1]


def test_code_is_the_same() -> None:
    def code(around: Any) -> str:
        compiled = numba.njit(mean_of_marked)
        with around:
            compiled.compile((ARRAY, types.Array(types.boolean, 1, "C")))
        return re.sub(r"v\d+|\w*0x\w+|[0-9a-f]{9,}|\d{9,}", "", next(iter(compiled.inspect_llvm().values())))

    prepared()
    assert code(nullcontext()) == code(operator_types.types_of_operators())


def test_numba_is_left_as_it_was() -> None:
    with pytest.raises(ZeroDivisionError), operator_types.types_of_operators():
        assert Function.get_call_type is not BaseFunction.get_call_type
        raise ZeroDivisionError
    assert Function.get_call_type is BaseFunction.get_call_type
