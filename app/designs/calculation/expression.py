"""Formulas: written once as arithmetic, evaluated, and typeset with symbols or numbers.

A formula is an expression such as ``(s_max - s_min) / 2``: + - * / **, the functions below, ``pi``, numbers and names.
A name is a symbol with an optional subscript after an underscore: ``sigma_a``, ``P_cr``, ``lam``.
"""

from __future__ import annotations

import ast
import math
import sys
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Protocol

from app.designs.calculation.printed import NotANumber, Printed


def _zero_kept(function: Callable[[float], float]) -> Callable[[float], float]:
    """A function of an angle in radians that is 0 where it would be but for the rounding of the angle: sin(180°)."""

    def value(angle: float) -> float:
        found = function(angle)
        return 0.0 if abs(found) < sys.float_info.epsilon * abs(angle) else found

    return value


FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "sin": _zero_kept(math.sin), "cos": _zero_kept(math.cos), "tan": math.tan,
    "asin": math.asin, "acos": math.acos, "atan": math.atan, "sinh": math.sinh, "cosh": math.cosh,
    "exp": math.exp, "log": math.log, "sqrt": math.sqrt, "abs": abs, "max": max, "min": min,
}  # fmt: skip
_NAMED = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "log": "ln"}
_ARITHMETIC: Mapping[type, Callable[[float, float], float]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}
_SUM, _SIGN, _PRODUCT, _FRACTION, _POWER, _ATOM = range(6)
"""Operator precedences; an operand of lower precedence is put in parentheses."""


class Notation(Protocol):
    """A mathematical notation."""

    pi: str
    plus: str
    minus: str
    times: str
    """visible multiplication sign"""
    apart: str
    """separator of implicit multiplication"""

    def number(self, number: Printed) -> str: ...
    def symbol(self, name: str) -> str: ...
    def parenthesis(self, inner: str) -> str: ...
    def fraction(self, over: str, under: str) -> str: ...
    def power(self, base: str, exponent: str) -> str: ...
    def root(self, inner: str) -> str: ...
    def magnitude(self, inner: str) -> str: ...
    def function(self, name: str, arguments: list[str]) -> str: ...
    def function_to_power(self, name: str, exponent: str, argument: str) -> str: ...


@lru_cache(maxsize=1024)
def parsed(formula: str) -> ast.expr:
    """Parse a formula. Raises SyntaxError."""
    return ast.parse(formula, mode="eval").body


def names_in(formula: str) -> list[str]:
    """The distinct symbols of a formula in order."""
    called = {id(node.func) for node in ast.walk(parsed(formula)) if isinstance(node, ast.Call)}
    found = [n for n in ast.walk(parsed(formula)) if isinstance(n, ast.Name) and id(n) not in called and n.id != "pi"]
    return list(dict.fromkeys(n.id for n in sorted(found, key=lambda n: (n.lineno, n.col_offset))))


def calculated(formula: str, values: Mapping[str, float]) -> float:
    """Evaluate a formula. Raises NotANumber for a non-finite result."""
    try:
        return float(_value(parsed(formula), values))
    except (ArithmeticError, ValueError, TypeError) as error:
        raise NotANumber(formula) from error


def _value(node: ast.expr, values: Mapping[str, float]) -> float:
    if isinstance(node, ast.Constant):
        return float(node.value)
    if isinstance(node, ast.Name):
        return math.pi if node.id == "pi" else values[node.id]
    if isinstance(node, ast.UnaryOp):
        return -_value(node.operand, values)
    if isinstance(node, ast.BinOp):
        return _ARITHMETIC[type(node.op)](_value(node.left, values), _value(node.right, values))
    assert isinstance(node, ast.Call)
    return FUNCTIONS[node.func.id](*(_value(each, values) for each in node.args))


def written(formula: str, notation: Notation, numbers: Mapping[str, Printed] | None = None) -> str:
    """Typeset a formula with its symbols, or with numbers substituted."""
    return _Writer(notation, numbers).write(parsed(formula))[0]


class _Writer:
    def __init__(self, notation: Notation, numbers: Mapping[str, Printed] | None) -> None:
        self.to, self.numbers = notation, numbers

    def write(self, node: ast.expr) -> tuple[str, int]:
        """Typeset a node; returns text and precedence."""
        if isinstance(node, ast.Constant):
            return self._number(_literal(node.value))
        if isinstance(node, ast.Name):
            if node.id == "pi":
                return self.to.pi, _ATOM
            return (self.to.symbol(node.id), _ATOM) if self.numbers is None else self._number(self.numbers[node.id])
        if isinstance(node, ast.UnaryOp):
            return self.to.minus + self._within(node.operand, _PRODUCT), _SIGN
        if isinstance(node, ast.Call):
            return self._call(node)
        assert isinstance(node, ast.BinOp)
        return self._joined(node)

    def _joined(self, node: ast.BinOp) -> tuple[str, int]:
        if isinstance(node.op, (ast.Add, ast.Sub)):
            sign = self.to.plus if isinstance(node.op, ast.Add) else self.to.minus
            return self._within(node.left, _SUM) + sign + self._within(node.right, _PRODUCT), _SUM
        if isinstance(node.op, ast.Div):
            return self.to.fraction(self.write(node.left)[0], self.write(node.right)[0]), _FRACTION
        if isinstance(node.op, ast.Pow):
            exponent = self.write(node.right)[0]
            base = node.left
            if isinstance(base, ast.Call) and base.func.id not in ("sqrt", "abs", "max", "min", "exp"):
                name, argument = _NAMED.get(base.func.id, base.func.id), self.write(base.args[0])[0]
                return self.to.function_to_power(name, exponent, argument), _ATOM
            return self.to.power(self._within(base, _ATOM), exponent), _POWER
        seen = self.numbers is not None or _begins_with_digit(node.right)
        left, strength = self.write(node.left)
        if strength < _SIGN:
            left, strength = self.to.parenthesis(left), _ATOM
        right = self._within(node.right, _PRODUCT)
        # a leading sign belongs to the whole product
        return left + (self.to.times if seen else self.to.apart) + right, min(strength, _PRODUCT)

    def _within(self, node: ast.expr, least: int) -> str:
        text, strength = self.write(node)
        return text if strength >= least else self.to.parenthesis(text)

    def _number(self, number: Printed) -> tuple[str, int]:
        return self.to.number(number), _SIGN if number.negative else _PRODUCT if number.power else _ATOM

    def _call(self, node: ast.Call) -> tuple[str, int]:
        name, arguments = node.func.id, [self.write(each)[0] for each in node.args]
        if name == "sqrt":
            return self.to.root(arguments[0]), _ATOM
        if name == "abs":
            return self.to.magnitude(arguments[0]), _ATOM
        return self.to.function(_NAMED.get(name, name), arguments), _ATOM


def _literal(value: float) -> Printed:
    """A literal of the formula, formatted."""
    digits, _, power = f"{value:g}".partition("e")
    return Printed(digits, int(power or 0))


def _begins_with_digit(node: ast.expr) -> bool:
    while isinstance(node, ast.BinOp) and not isinstance(node.op, ast.Div):
        node = node.left
    return isinstance(node, ast.Constant)
