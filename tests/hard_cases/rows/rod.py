"""The rod's rows: its check, and the strip's constants."""

from __future__ import annotations

from tests.hard_cases.rows.section import Measured, Row, Section, figure, relative
from tests.hard_cases.test_rod import CASES, REFERENCES, answers, fed_back, kernels, scene_of, units
from tests.hard_cases.textbook import rod as textbook


def kernel_row(case) -> Row:
    reference, measured = REFERENCES[case["name"]], []
    by_book = textbook.kernel(case["coupling"], case["length"], case["rod_length"])
    names = ("clamp_curvature", "clamp_shear", "head_curvature")
    for constants, _ in kernels(case):
        for name, value in zip(names, constants, strict=True):
            measured.append(Measured(units(value, reference[name]), reference[name]["condition"]))
    other = max(relative(by_book[name], reference[name]) for name in names)
    return Row(case, tuple(measured), figure(other))


def check_row(case) -> Row:
    reference = REFERENCES[case["name"]]
    _, found = answers(case, 1e-12)
    measured = tuple(Measured(units(v, reference[name]), reference[name]["condition"]) for name, v in found.items())
    if case["scene"]["effects"]:
        return Row(case, measured, "left out: it has no inertia")
    by_book = textbook.check(*scene_of(case))
    if not by_book.keys() & reference.keys():
        return Row(case, measured, f"answers a safety of {figure(by_book['fatigue_safety'])} where there is none")
    return Row(case, measured, figure(max(relative(v, reference[n]) for n, v in by_book.items() if n in reference)))


def loop_row(case) -> Row:
    reference = REFERENCES[case["name"]]["axial_force"]
    measured = Measured(units(fed_back(case), reference), reference["condition"])
    by_book = textbook.fed_back(*scene_of(case), case["angle"])
    return Row(case, (measured,), figure(relative(by_book, reference)))


SECTIONS = (
    Section(
        "The flexible rod's check",
        "The textbook has one family of functions for each sign of the force, A and B by Cramer's rule, and reads its "
        f"extremes off {textbook.ANGLES} angles and {textbook.SECTIONS} sections.",
        CASES["checks"],
        check_row,
    ),
    Section(
        "The strip's constants",
        "V''(0), V'''(0) and V''(l) at one load, by the solvers' kernels and by numpy; the textbook's "
        "families as above.",
        CASES["kernels"],
        kernel_row,
    ),
    Section(
        "Friction fed back into the axial force",
        f"The textbook puts the friction force into the axial force that it comes from, {textbook.REPEATS} times over.",
        CASES["loops"],
        loop_row,
    ),
)
