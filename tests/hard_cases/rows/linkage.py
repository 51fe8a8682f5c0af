"""The linkage's rows: ratios, lengths, and limits that no type meets."""

from __future__ import annotations

import math

import mpmath as mp

from tests.hard_cases.rows.section import NO_TEXTBOOK, Measured, Row, Section, figure, relative
from tests.hard_cases.test_linkage import (
    CASES,
    REFERENCES,
    angles,
    attainable,
    bar_of,
    checked,
    closed_forms,
    curve_units,
    searched,
    slope_units,
    told_by_lengths,
    units,
)
from tests.hard_cases.textbook import linkage as textbook


def ratio_row(case) -> Row:
    reference = REFERENCES[case["name"]]
    bar = bar_of(case, reference)
    measured = []
    for name, value in (*closed_forms(bar), *searched(bar)):
        measured.append(Measured(units(value, reference[name]), reference[name]["condition"]))
    errors = []
    for phi, exact in zip(angles(case), reference["curve"], strict=True):
        with mp.workdps(40):
            value, scale = mp.mpf(exact["value"]), mp.mpf(exact["scale"])
            measured.append(Measured(curve_units(bar, phi, exact), float(scale / abs(value))))
            slope = abs(mp.mpf(exact["slope"]))
            measured.append(Measured(slope_units(bar, phi, exact), float(mp.mpf(exact["slope_scale"]) / slope)))
            by_book = textbook.transfer(case["kind"], case["restitution"], float(reference["parameter"]["value"]), phi)
            errors.append(float(abs(by_book - value) / scale) if math.isfinite(by_book) else math.inf)
    lost = sum(error > 0.1 for error in errors)
    kept = max((error for error in errors if error <= 0.1), default=math.inf)
    return Row(case, tuple(measured), f"{figure(kept)}; no digit at {lost} of {len(errors)} angles")


def length_row(case) -> Row:
    if "refused" in case:
        return Row(case, (), NO_TEXTBOOK)
    reference = REFERENCES[case["name"]]
    told = told_by_lengths(checked(case), reference)
    if told is None:
        return Row(case, (Measured(0.0, 1.0),), NO_TEXTBOOK)
    name, value = told
    entry = {"value": reference[name], "condition": reference["condition"]}
    by_book = textbook.told_by_lengths(name, reference["kind"], *(float(text) for text in case["lengths"]))
    return Row(case, (Measured(units(value, entry), entry["condition"]),), figure(relative(by_book, entry)))


def design_row(case) -> Row:
    reference = REFERENCES[case["name"]]
    entry = {"value": reference["value"], "condition": reference["condition"]}
    return Row(case, (Measured(units(attainable(case), entry), entry["condition"]),), NO_TEXTBOOK)


SECTIONS = (
    Section(
        "The linkage's family",
        "Ratios, ends, swing, transmission angle, peak loads, least box, and u31 and its slope at angles down to "
        "1e-15 of the change point, u31 judged by the greater of |u31| and its slope, the slope by the greatest of "
        "both and its own. The textbook has l1 sin(phi - phi2)/(l3 sin(phi3 - phi2)) with phi2 and phi3 from "
        "arccosines; its greatest error where it has a digit at all, and where it has none.",
        CASES["ratios"],
        ratio_row,
    ),
    Section(
        "Lengths as given",
        "Lengths that close, lengths that miss it by a little, and lengths of no mechanism: whether they close, and "
        "R, or the angle at which crank or rocker stops. Where that is a matter of yes or no alone the error is 0. The "
        "textbook has (g - 1)/(g + 1), and the law of cosines.",
        CASES["lengths"],
        length_row,
    ),
    Section(
        "Limits that no type meets",
        "What could be reached, over all types.",
        CASES["designs"],
        design_row,
    ),
)
