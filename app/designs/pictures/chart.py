"""Charts as SVG: one pair of axes, linear or logarithmic, with lines, areas, markers and labels.

Drawn without a plotting library: a chart takes a millisecond, adapts to light and dark pages, and is byte-identical for
the same run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import Protocol

from app.designs.units import shown_as

WIDTH, HEIGHT = 480, 360
"""Narrow enough for readable text on a phone."""
LEFT, RIGHT, TOP, BOTTOM = 70, 20, 20, 52
_LEGEND_ROW = 20
_LETTER = 7.2
"""Width of a letter, on average."""

_TICK_LETTER, _SHORT_TICK = 8, 5
"""Width of a digit of a tick's label, and digits for which there is room beside the axis' own label."""

BLUE, RED, GREEN, GREY = "#1a5fb4", "#b3261e", "#1c7c54", "#5b6472"
_ON_DARK = {BLUE: "#7fb2f0", RED: "#f2958c", GREEN: "#72cfa4", GREY: "#a3abb8"}
_DARK = "".join(
    f'[fill="{light}"]{{fill:{dark}}}[stroke="{light}"]{{stroke:{dark}}}' for light, dark in _ON_DARK.items()
)
Say = Callable[[str], str]
"""Translates a picture's English labels; ``str`` leaves them unchanged."""


def noted(words: str) -> str:
    """Mark a label for translation."""
    return words


_HALO = "text{paint-order:stroke;stroke-width:3px;stroke-linejoin:round;stroke:#fff}"
STYLE = (
    f"<style>svg{{color:#1d2430;background:#fff}}{_HALO}@media screen and (prefers-color-scheme:dark)"
    f"{{svg{{color:#e7e9ee;background:#1d2128}}text{{stroke:#1d2128}}{_DARK}}}</style>"
)
"""Light and dark colours of a stand-alone picture, and a halo that keeps words readable on lines; programs without CSS
support use the light ones without it."""


def opening(title: str, width: float, height: float, attributes: str = "") -> str:
    """The opening of an SVG: size, accessible name and colours."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" role="img" class="plot" '
        f'font-family="system-ui, sans-serif" font-size="13"{attributes}><title>{escape(title)}</title>{STYLE}'
    )


class Scale(Protocol):
    """Maps values to the unit interval."""

    def place(self, value: float) -> float: ...

    def ticks(self) -> Iterable[tuple[float, str]]: ...


@dataclass(frozen=True)
class Linear:
    """Linear scale; values outside are clamped to the edge."""

    low: float
    high: float

    def place(self, value: float) -> float:
        return min(max((value - self.low) / (self.high - self.low), 0.0), 1.0)

    def ticks(self) -> list[tuple[float, str]]:
        step = self._step()
        digits = max(0, -math.floor(math.log10(step) + 1e-9))
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [(n * step, f"{n * step:.{digits}f}") for n in range(first, last + 1)]

    def _step(self) -> float:
        return _round_step((self.high - self.low) / 6)


class Degrees(Linear):
    """Linear scale of an angle [deg], with ticks at parts of the circle."""

    def _step(self) -> float:
        return next((step for step in (15.0, 30.0, 45.0, 90.0) if 6 * step >= self.high - self.low), 180.0)


@dataclass(frozen=True)
class Logarithmic:
    """Logarithmic scale; both limits are positive."""

    low: float
    high: float

    def place(self, value: float) -> float:
        span = math.log(self.high / self.low)
        return min(max(math.log(max(value, self.low) / self.low) / span, 0.0), 1.0)

    def ticks(self) -> list[tuple[float, str]]:
        first, last = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
        if last - first < 2:
            return self._between(first, (1, 2, 5)) if self.high > 5.0 * self.low else self._between(first, range(1, 10))
        every = max(1, (last - first) // 7 + 1)
        return [(10.0**n, f"1e{n}") for n in range(first, last + 1, every)]

    def _between(self, first: int, digits: Iterable[int]) -> list[tuple[float, str]]:
        """Ticks at multiples of powers of ten, for an axis of few decades."""
        values = [digit * 10.0**n for n in (first - 1, first, first + 1) for digit in digits]
        return [(value, f"{value:g}") for value in values if self.low <= value * (1 + 1e-9) <= self.high * (1 + 2e-9)]


@dataclass(frozen=True)
class Categories:
    """One position per name from top to bottom; the value is the name's index."""

    names: Sequence[str]

    def place(self, value: float) -> float:
        return 1.0 - (value + 0.5) / len(self.names)

    def ticks(self) -> list[tuple[float, str]]:
        return list(enumerate(self.names))


def around(values: Iterable[float], margin: float = 0.06) -> Linear:
    """A linear scale with a margin around all values; valid even if they are all equal."""
    found = list(values)
    low, high = min(found), max(found)
    pad = margin * (high - low) or 0.5 * abs(high) or 1.0
    return Linear(low - pad, high + pad)


def factors_around(values: Iterable[float], margin: float = 1.3) -> Logarithmic:
    """A logarithmic scale with a margin around all (positive) values."""
    found = list(values)
    return Logarithmic(min(found) / margin, max(found) * margin)


def decades_around(values: Iterable[float]) -> Logarithmic:
    """Full decades around all (positive) values."""
    found = [math.log10(value) for value in values]
    return Logarithmic(10.0 ** math.floor(min(found)), 10.0 ** max(math.ceil(max(found)), math.floor(min(found)) + 1))


class Chart:
    """A chart with one pair of axes; each method adds a layer on top.

    An axis whose label ends with a metric unit is in the unit shown for it. ``left`` is the space for the labels of the
    vertical axis, unless they are long. ``legend`` names the colours below the axes, for lines too close for direct
    labels.
    """

    def __init__(
        self,
        title: str,
        x: Scale,
        y: Scale,
        x_label: str,
        y_label: str,
        left: int = LEFT,
        legend: Sequence[tuple[str, str]] = (),
        height: int = HEIGHT,
    ) -> None:
        x_ticks, x_label = _axis(x, x_label)
        y_ticks, y_label = _axis(y, y_label)
        left += _TICK_LETTER * max(
            (len(words) - _SHORT_TICK for _, words in y_ticks if len(words) > _SHORT_TICK), default=0
        )
        self._x, self._y, self._left, self._height = x, y, left, height
        self.height = height + _LEGEND_ROW * len(legend)
        self._layers = [
            # position of the axes, for a page's cursor
            opening(
                title,
                WIDTH,
                self.height,
                f' data-left="{left}" data-right="{WIDTH - RIGHT}" data-top="{TOP}" data-bottom="{height - BOTTOM}"',
            )
        ]
        bottom, right = height - BOTTOM, WIDTH - RIGHT
        for value, words in x_ticks:
            at = f"{self._across(value):.1f}"
            self._layers.append(_grid(at, at, TOP, bottom) + _words(at, bottom + 18, words, "middle"))
        for value, words in y_ticks:
            at = self._up(value)
            self._layers.append(
                _grid(left, right, f"{at:.1f}", f"{at:.1f}") + _words(left - 8, f"{at + 4:.1f}", words, "end")
            )
        middle = (height - BOTTOM + TOP) / 2
        self._layers += [
            _words((left + right) / 2, height - 10, x_label, "middle"),
            f'<text transform="translate(16 {middle}) rotate(-90)" text-anchor="middle" fill="currentColor">'
            f"{escape(y_label)}</text>",
        ]
        for number, (name, color) in enumerate(legend):
            down = height + _LEGEND_ROW * (number + 0.5)
            self._layers.append(f'<circle cx="{LEFT}" cy="{down:.1f}" r="5" fill="{color}"/>')
            self._layers.append(_words(LEFT + 12, f"{down + 4:.1f}", name, "start", color))

    def line(self, xs: Sequence[float], ys: Sequence[float], color: str = BLUE, dashes: str = "") -> None:
        """Add a polyline."""
        style = f' stroke-dasharray="{dashes}"' if dashes else ""
        self._layers.append(f'<path d="{self._path(xs, ys)}" fill="none" stroke="{color}" stroke-width="2"{style}/>')

    def area(self, xs: Sequence[float], ys: Sequence[float], color: str = RED) -> None:
        """Add a filled polygon."""
        self._layers.append(f'<path d="{self._path(xs, ys)}Z" fill="{color}" fill-opacity="0.10"/>')

    def bar(self, x: float, y: float, color: str = BLUE, words: str = "") -> None:
        """Add a bar from the vertical axis to a value, with words above it."""
        width = self._across(x) - self._left
        self._layers.append(
            f'<rect x="{self._left}" y="{self._up(y) - 7:.1f}" width="{width:.1f}" height="14" fill="{color}" '
            'fill-opacity="0.45"/>' + _words(self._left, f"{self._up(y) - 11:.1f}", words, "start")
        )

    def mark(self, x: float, y: float, words: str = "", color: str = BLUE) -> None:
        """Add a marker with a label beside it, or above it where neither side has room."""
        across, up = self._across(x), self._up(y)
        beside, side = self._beside(across, words, 12.0)
        label_up = up + 4 if side else up - 10
        self._layers.append(
            f'<circle cx="{across:.1f}" cy="{up:.1f}" r="5" fill="{color}"/>'
            + _words(f"{beside:.1f}", f"{label_up:.1f}", words, side or "end", color)
        )

    def words(self, x: float, y: float, words: str, color: str = GREY) -> None:
        """Add text on the side that has room."""
        beside, side = self._beside(self._across(x), words, 0.0)
        self._layers.append(_words(f"{beside:.1f}", f"{self._up(y) - 5:.1f}", words, side or "end", color))

    def _beside(self, across: float, words: str, gap: float) -> tuple[float, str]:
        """Position and anchor of a label beside a point, at a distance ``gap``; the anchor is empty if neither side has
        room, and the label then ends at the picture's edge."""
        length = gap + _LETTER * len(words)
        if across + length < WIDTH:
            return across + gap, "start"
        return (across - gap, "end") if across > length else (WIDTH - 4.0, "")

    def svg(self) -> str:
        """The chart as SVG."""
        return "".join(self._layers) + "</svg>"

    def inner(self) -> str:
        """The chart's elements, for composing pictures."""
        return "".join(self._layers[1:])

    def _across(self, value: float) -> float:
        return self._left + self._x.place(value) * (WIDTH - self._left - RIGHT)

    def _up(self, value: float) -> float:
        return self._height - BOTTOM - self._y.place(value) * (self._height - TOP - BOTTOM)

    def _path(self, xs: Sequence[float], ys: Sequence[float]) -> str:
        return "M" + "L".join(f"{self._across(x):.1f},{self._up(y):.1f}" for x, y in zip(xs, ys, strict=True))


def _axis(scale: Scale, label: str) -> tuple[list[tuple[float, str]], str]:
    """Ticks and label of an axis in the units shown."""
    words, comma, unit = label.rpartition(", ")
    shown, size = shown_as(unit)
    if size == 1.0:
        return list(scale.ticks()), label
    shorter = replace(scale, low=scale.low / size, high=scale.high / size)
    return [(value * size, text) for value, text in shorter.ticks()], f"{words}{comma}{shown}"


def stacked(title: str, charts: Sequence[Chart]) -> str:
    """Stack charts vertically into one picture."""
    out, down = [opening(title, WIDTH, sum(chart.height for chart in charts))], 0
    for chart in charts:
        out.append(f'<g transform="translate(0 {down})">{chart.inner()}</g>')
        down += chart.height
    return "".join(out) + "</svg>"


def _words(x: object, y: object, words: str, anchor: str, color: str = "currentColor") -> str:
    return f'<text x="{x}" y="{y}" text-anchor="{anchor}" fill="{color}">{escape(words)}</text>' if words else ""


def _grid(x1: object, x2: object, y1: object, y2: object) -> str:
    return f'<line x1="{x1}" x2="{x2}" y1="{y1}" y2="{y2}" stroke="currentColor" stroke-opacity="0.15"/>'


def _round_step(step: float) -> float:
    """1, 2 or 5 times a power of ten, at least ``step``."""
    unit = 10.0 ** math.floor(math.log10(step))
    return next(n * unit for n in (1, 2, 5, 10) if n * unit >= step * (1 - 1e-9))
