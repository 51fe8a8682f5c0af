"""Writes docs/hard-cases.md: ``python -m tests.hard_cases.page``."""

from __future__ import annotations

from pathlib import Path

import mpmath as mp
import numpy as np

from tests.hard_cases import textbook
from tests.hard_cases.test_rod import CASES, CHECK_LIMIT, EPS, REFERENCES, answers, kernels, scene_of, units

PAGE = Path(__file__).parents[2] / "docs" / "hard-cases.md"
GOAL = CHECK_LIMIT
COLUMNS = ("case", "why it is hard", "condition number", "error, ε", "error, ε max(1, κ)", "the textbook's error")
HEAD = "| " + " | ".join(COLUMNS) + " |\n" + "|---" * len(COLUMNS) + "|"


def figure(value: float) -> str:
    return f"{value:.2g}" if np.isfinite(value) else "not finite"


def row(case, errors, other: str) -> str:
    """``errors`` holds (error in eps max(1, kappa), kappa) of every value."""
    worst, condition = max(error for error, _ in errors), max(kappa for _, kappa in errors)
    plain = max(error * max(1.0, kappa) for error, kappa in errors)
    return f"| {case['name']} | {case['why']} | {condition:.2g} | {plain:.2g} | {worst:.2g} | {other} |"


def kernel_row(case) -> str:
    reference, errors, other = REFERENCES[case["name"]], [], []
    by_book = textbook.kernel(case["coupling"], case["length"], case["rod_length"])
    names = ("clamp_curvature", "clamp_shear", "head_curvature")
    for constants, _, _ in kernels(case):
        errors += [(units(v, reference[n]), reference[n]["condition"]) for n, v in zip(names, constants, strict=True)]
    for name in names:
        other.append(relative(by_book[name], reference[name]))
    return row(case, errors, figure(max(other)))


def check_row(case) -> str:
    reference = REFERENCES[case["name"]]
    _, found = answers(case, 1e-12)
    errors = [(units(value, reference[name]), reference[name]["condition"]) for name, value in found.items()]
    if case["scene"]["effects"]:
        return row(case, errors, "left out: it has no inertia")
    by_book = {n: v for n, v in textbook.check(*scene_of(case)).items()}
    if not by_book.keys() & reference.keys():
        return row(case, errors, f"answers a safety of {figure(by_book['fatigue_safety'])} where there is none")
    return row(case, errors, figure(max(relative(v, reference[n]) for n, v in by_book.items() if n in reference)))


def relative(found, reference) -> float:
    exact = mp.mpf(reference["value"])
    if not np.isfinite(found):
        return float("inf")
    return float(abs(mp.mpf(float(found)) - exact) / abs(exact)) if exact else float(abs(found))


def page() -> str:
    return "\n".join(
        [
            "# Hard cases",
            "",
            "Written by `python -m tests.hard_cases.page` from `tests/hard_cases/rod_cases.json` and the references at",
            f"50 digits that `make_rod_references.py` makes beside it. ε is {EPS:.3g}; κ is the relative",
            "condition number: what a change of the inputs' last digits does to the result anyway. Each column shows",
            f"the greatest of all results of a case; the goal is an error below {GOAL:g} ε max(1, κ). The last column",
            "is the relative error of the formulas as textbooks have them, one family of functions for each sign of",
            "the force, in the same floats.",
            "",
            f"## The flexible rod's check ({len(CASES['checks'])} cases)",
            "",
            f"The textbook's column reads its extremes off {textbook.ANGLES} angles and {textbook.SECTIONS} sections.",
            "",
            HEAD,
            *(check_row(case) for case in CASES["checks"]),
            "",
            f"## The strip's constants ({len(CASES['kernels'])} cases)",
            "",
            "V''(0), V'''(0) and V''(l) at one load, by all three ways in which the solvers compute them.",
            "",
            HEAD,
            *(kernel_row(case) for case in CASES["kernels"]),
            "",
        ]
    )


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
