"""The crank's rows: motions, cycles and pendulums."""

from __future__ import annotations

from tests.hard_cases.rows.section import EPS, Measured, Row, Section, figure, relative
from tests.hard_cases.test_crank import CASES, REFERENCES, answers, motions, off, units
from tests.hard_cases.textbook import crank as textbook


def motion_row(case) -> Row:
    reference = REFERENCES[case["name"]]
    measured = [Measured(units(v, reference[n]), reference[n]["condition"]) for n, v in motions(case["inputs"])]
    by_book = textbook.motion(case["inputs"])
    return Row(case, tuple(measured), figure(max(relative(v, reference[n]) for n, v in by_book.items())))


def pendulum_row(case) -> Row:
    from solvers import crank

    reference = REFERENCES[case["name"]]
    found = crank.swing(crank.Pendulum(**case["inputs"])).values
    measured = tuple(Measured(units(found[n], entry), entry["condition"]) for n, entry in reference.items())
    by_book = textbook.pendulum(case["inputs"])
    return Row(case, measured, figure(max(relative(v, reference[n]) for n, v in by_book.items())))


def cycle_row(case) -> Row:
    """kappa is the sum of the magnitudes of a value's terms, relative to the value."""
    reference, measured = REFERENCES[case["name"]], []
    _, found = answers(case, 1e-12)
    for name, value in found.items():
        entry = reference[name]
        exact = abs(float(entry["value"]))
        whole = max(exact, entry["size"], 2.0**-1022)
        condition = entry["size"] / exact if exact else 1.0
        measured.append(Measured(float(off(value, entry)) / whole / EPS, condition))
    by_book = textbook.cycle(case["scene"])
    other = max(relative(v, reference[n]) for n, v in by_book.items() if float(reference[n]["value"]))
    return Row(case, tuple(measured), figure(other))


SECTIONS = (
    Section(
        "The crank's motion",
        "Position, speed, acceleration and the rod's angle at one crank angle, and the angle of one position. The "
        "textbook has x = H - r cos(phi) - L cos(beta), and arccosines for the way back.",
        CASES["motions"],
        motion_row,
    ),
    Section(
        "The crank's cycle",
        "Worst forces, power and the work to be stored. κ is the sum of the magnitudes of what is added up to a "
        f"value, over the value. The textbook reads {textbook.ANGLES} even angles of the cycle and adds up the torque.",
        CASES["cycles"],
        cycle_row,
    ),
    Section(
        "The rod as a pendulum",
        "Centre of mass, inertia and the two masses from two periods. The textbook corrects the periods by "
        "1 + θ²/16 + 11 θ⁴/3072.",
        CASES["pendulums"],
        pendulum_row,
    ),
)
