"""Rounded numbers as printed, with which later steps are evaluated."""

from __future__ import annotations

import math
from dataclasses import dataclass

INPUT_DIGITS, RESULT_DIGITS = 10, 6
"""Significant digits of inputs and of results."""
_MIN_EXPONENT, _MAX_EXPONENT = -4, 7
"""Exponents between which a number is printed without a power of ten."""


class NotANumber(ArithmeticError):
    """A step without a finite value."""


@dataclass(frozen=True)
class Printed:
    """A printed number: ``digits`` times ten to the ``power``; shown in degrees if ``degrees``."""

    digits: str
    power: int = 0
    degrees: bool = False

    @property
    def negative(self) -> bool:
        return self.digits.startswith("-")

    @property
    def shown(self) -> float:
        """The printed value, an angle in degrees."""
        return float(f"{self.digits}e{self.power}")

    @property
    def value(self) -> float:
        """The value used in calculations, an angle in radians."""
        return math.radians(self.shown) if self.degrees else self.shown

    def __str__(self) -> str:
        """As plain text, with a minus sign and superscript digits."""
        text = self.digits.replace("-", "−") + ("°" if self.degrees else "")
        if not self.power:
            return text
        return f"{text} · 10{str(self.power).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def printed(value: float, digits: int = RESULT_DIGITS, degrees: bool = False) -> Printed:
    """Round to significant digits; ``value`` is in radians if it is shown in degrees.

    Raises NotANumber for a non-finite value.
    """
    shown = math.degrees(value) if degrees else float(value)
    if not math.isfinite(shown):
        raise NotANumber(str(value))
    mantissa, _, exponent = f"{shown:.{digits - 1}e}".partition("e")
    power = int(exponent)
    if float(mantissa) == 0.0:
        return Printed("0", 0, degrees)
    if _MIN_EXPONENT < power < _MAX_EXPONENT:
        text = f"{float(f'{mantissa}e{power}'):.{max(digits - 1 - power, 0)}f}"
        return Printed(text.rstrip("0").rstrip(".") if "." in text else text, 0, degrees)
    return Printed(mantissa.rstrip("0").rstrip("."), power, degrees)
