"""Recalculation of a report's printed formulas from its MathML and its typst source."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

_NAMES = {
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "arcsin": math.asin, "arccos": math.acos, "arctan": math.atan,
    "sinh": math.sinh, "cosh": math.cosh, "exp": math.exp, "ln": math.log, "sqrt": math.sqrt, "abs": abs, "max": max,
    "min": min, "radians": math.radians, "frac": lambda a, b: a / b, "π": math.pi,
}  # fmt: skip
_SIGNS = {"−": "-", "·": "*", "+": "+", "(": "(", ")": ")", ",": ","}


def _python(node: ElementTree.Element) -> str:
    """Convert MathML to a Python expression."""
    inside = list(node)
    if node.tag == "mn":
        return f"radians({node.text[:-1]})" if node.text.endswith("°") else node.text
    if node.tag == "mi":
        return node.text
    if node.tag == "mo":
        return _SIGNS[node.text]
    if node.tag == "mfrac":
        return f"(({_python(inside[0])})/({_python(inside[1])}))"
    if node.tag == "msqrt":
        return f"sqrt({''.join(map(_python, inside))})"
    if node.tag == "msup":
        return f"{_python(inside[0])}**({_python(inside[1])})"
    if node.tag in ("mrow", "math"):
        return "".join(map(_python, inside))
    if node.tag in ("mspace", "mtext"):
        return ""
    raise AssertionError(node.tag)


def value_of(text: str) -> float:
    """Evaluate an expression; sin**(2)(x) is the square of sin(x)."""
    text = re.sub(r"(?<![\w.])0+(?=\d)", "", text)
    while found := re.search(r"\b(sin|cos|tan|sinh|cosh)\*\*\((\d+)\)\(", text):
        end, depth = found.end(), 1
        while depth:
            depth += {"(": 1, ")": -1}.get(text[end], 0)
            end += 1
        text = f"{text[: found.start()]}({found[1]}({text[found.end() : end - 1]}))**({found[2]}){text[end:]}"
    while "|" in text:
        text = re.sub(r"\|([^|]*)\|", r"abs(\1)", text, count=1)
    return eval(text, {"__builtins__": {}}, _NAMES)


def steps_in_html(page: str) -> list[tuple[float, float]]:
    """Recalculated and printed result of every step with substituted numbers, in the same unit."""
    found = []
    for text in re.findall(r'<math displaystyle="true" class=numbers>.*?</math>', page):
        math_node = ElementTree.fromstring(text.replace("class=numbers", ""))
        row = next(iter(math_node))
        parts, result = [[]], None
        for child in row:
            if child.tag == "mrow" and child.get("class") == "result":
                result = child
            elif child.tag == "mo" and child.text == "=":
                parts.append([])
            else:
                parts[-1].append(child)
        # The result follows the last equals sign.
        numbers = "".join(_magnitudes(parts[-2]))
        found.append((value_of(numbers), value_of(_python(result))))
    return found


def _magnitudes(nodes: list[ElementTree.Element]) -> list[str]:
    _SIGNS["|"] = "|"
    return [_python(node) for node in nodes]


def steps_in_typst(source: str) -> list[tuple[float, float]]:
    """As above, from the typst source."""
    found = []
    for text in re.findall(r"^#step\(\$.*?\)\$, \$display\(= (.*?)\)\$, \"", source, re.M):
        found.append(_of_typst(text))
    for text in re.findall(r"^#again\(\$display\((.*?)\)\$, \"", source, re.M):
        found.append(_of_typst(text.partition(" = ")[2]))
    return found


def _of_typst(text: str) -> tuple[float, float]:
    numbers, _, result = text.rpartition(" = bold(")
    depth, end = 1, 0
    while depth:
        depth += {"(": 1, ")": -1}.get(result[end], 0)
        end += 1
    return _typst_value(numbers), _typst_value(result[: end - 1])


def _typst_value(text: str) -> float:
    text = re.sub(r"([\d.]+)°", r"radians(\1)", text)
    return value_of(text.replace(" dot ", "*").replace("^(", "**(").replace("- ", "-"))
