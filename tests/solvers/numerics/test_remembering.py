"""The type of an operator is kept for numbers and arrays alone, and only while kernels are compiled."""

from __future__ import annotations

import operator
from typing import Any

import pytest
from numba.core import types
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction, Function

from solvers.numerics import remembering

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
    with remembering.types_of_operators():
        first, second = (plus.get_call_type(context, given, {}) for _ in range(2))
    assert second is first
    assert (first.return_type, first.args) == (own.return_type, own.args)
    assert Function.get_call_type is BaseFunction.get_call_type


def test_what_is_no_number_is_left_to_numba() -> None:
    context = prepared()
    plus = context.resolve_value_type(operator.add)
    texts = (types.unicode_type, types.unicode_type)
    with remembering.types_of_operators():
        assert plus.get_call_type(context, texts, {}).return_type == types.unicode_type
    assert not any(given == texts for _, given in remembering._FOUND)
