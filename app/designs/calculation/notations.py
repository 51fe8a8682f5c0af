"""The two notations of reports: MathML for browsers, typst's own for PDF."""

from __future__ import annotations

from html import escape

from app.designs.calculation.printed import Printed
from app.designs.calculation.symbols import symbol


def _operator(sign: str) -> str:
    return f"<mo>{sign}</mo>"


class MathML:
    """MathML Core, presentation only."""

    pi = "<mi>π</mi>"
    plus = _operator("+")
    minus = _operator("−")
    times = _operator("·")
    apart = '<mspace width="0.12em"></mspace>'

    def number(self, number: Printed) -> str:
        sign = self.minus if number.negative else ""
        digits = f"{sign}<mn>{number.digits.lstrip('-')}{'°' if number.degrees else ''}</mn>"
        if not number.power:
            return digits
        power = f"{self.minus if number.power < 0 else ''}<mn>{abs(number.power)}</mn>"
        ten = self.power("<mn>10</mn>", power)
        return ten if number.digits == "1" else digits + self.times + ten

    def symbol(self, name: str) -> str:
        letter, below = symbol(name)
        base = f"<mi>{escape(letter)}</mi>"
        return f"<msub>{base}<mtext>{escape(below)}</mtext></msub>" if below else base

    def parenthesis(self, inner: str) -> str:
        return f"{_operator('(')}{inner}{_operator(')')}"

    def fraction(self, over: str, under: str) -> str:
        return f"<mfrac><mrow>{over}</mrow><mrow>{under}</mrow></mfrac>"

    def power(self, base: str, exponent: str) -> str:
        return f"<msup><mrow>{base}</mrow><mrow>{exponent}</mrow></msup>"

    def root(self, inner: str) -> str:
        return f"<msqrt>{inner}</msqrt>"

    def magnitude(self, inner: str) -> str:
        return f"{_operator('|')}{inner}{_operator('|')}"

    def function(self, name: str, arguments: list[str]) -> str:
        return f"<mi>{name}</mi>{self.parenthesis(_operator(',').join(arguments))}"

    def function_to_power(self, name: str, exponent: str, argument: str) -> str:
        return f"{self.power(f'<mi>{name}</mi>', exponent)}{self.parenthesis(argument)}"


class Typst:
    """Typst's math mode."""

    pi = "π"
    plus = " + "
    minus = " - "
    times = " dot "
    apart = " thin "

    def number(self, number: Printed) -> str:
        digits = number.digits + ("°" if number.degrees else "")
        if not number.power:
            return digits
        ten = f"10^({number.power})"
        return ten if number.digits == "1" else f"{digits} dot {ten}"

    def symbol(self, name: str) -> str:
        letter, below = symbol(name)
        base = letter if len(letter) == 1 else f'op("{letter}")'
        return f'{base}_("{below}")' if below else base

    def parenthesis(self, inner: str) -> str:
        return f"({inner})"

    def fraction(self, over: str, under: str) -> str:
        return f"frac({over}, {under})"

    def power(self, base: str, exponent: str) -> str:
        return f"{base}^({exponent})"

    def root(self, inner: str) -> str:
        return f"sqrt({inner})"

    def magnitude(self, inner: str) -> str:
        return f"abs({inner})"

    def function(self, name: str, arguments: list[str]) -> str:
        return f"{name}({', '.join(arguments)})"

    def function_to_power(self, name: str, exponent: str, argument: str) -> str:
        return f"{name}^({exponent})({argument})"
