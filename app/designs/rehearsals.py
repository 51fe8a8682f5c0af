"""Rehearsals: requests that together call every compiled kernel, solved once per machine ahead of use."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from app.designs.kind import Job, Mode
from app.designs.registry import KINDS

_LOOSE = 1e-2
_PLAIN: dict[str, Any] = {"limits": {}, "form": {"kind": "free"}}
_STIFF = {"limits": {"max_deflection_um": 12.0, "min_wall_mm": 1.0}}  # stiffer than strength alone makes any form
_BUSHING = {"variable": "outer", "bore_mm": 12.0}
_TWO_STEPS = {"form": {"kind": "stepped", "steps": 2}}

_DIAGRAM = {
    "kind": "indicator",
    "clearance_volume_cm3": 2.0,
    "strokes": [
        {"volume_cm3": [2.0, 2.4, 2.942], "pressure_mpa": [2.4, 2.0, 1.6]},
        {"volume_cm3": [2.942, 2.4, 2.0], "pressure_mpa": [1.5, 1.8, 2.2]},
    ],
}  # the pressure jumps at the dead centres

_MEASURED = {
    "kind": "table",
    "angle_deg": [10.0 * k for k in range(36)],
    "pressure_mpa": [round(1.7 + 0.3 * math.cos(math.radians(10.0 * k)), 3) for k in range(36)],
}  # more points than a load with few corners has

_VARIANTS: Mapping[tuple[str, Mode], tuple[dict[str, Any], ...]] = {
    ("flexible-rod", Mode.CHECK): (
        {"effects": "all"},
        {"load": {"kind": "constant", "constant_pressure_mpa": 0.3}},
        {"load": {"kind": "table", "angle_deg": [0.0, 120.0, 240.0], "pressure_mpa": [2.0, 1.0, 1.5]}},
        {"load": _DIAGRAM, "effects": "all"},
    ),
    ("flexible-rod", Mode.DESIGN): (
        {"objective": "friction_power"},
        {"objective": "contact_pressure"},
        {"objective": "fatigue_safety", "accuracy": _LOOSE},
        {"objective": "fatigue_safety", "effects": {"include": ["beam_column"], "exclude": ["rod_inertia"]}},
        {"requirements": {"min_fatigue_safety": 6.0}},  # no strip meets that
        {"load": _MEASURED, "effects": {"include": ["rod_inertia"]}, "accuracy": _LOOSE},
    ),
    ("pin-profile", Mode.DESIGN): (
        _PLAIN,
        _PLAIN | _STIFF,
        _PLAIN | {"limits": {"max_deflection_um": 12.0, "max_slope": 0.3}},
        _STIFF | {"form": {"kind": "drillable"}},
        _PLAIN | _TWO_STEPS,
        _STIFF | _TWO_STEPS,
        _PLAIN | {"form": {"kind": "double_cone"}},
        _STIFF | {"form": {"kind": "cone_cylinder"}},
        _PLAIN | _BUSHING,
        _PLAIN | _BUSHING | _STIFF,
        _PLAIN | _BUSHING | _TWO_STEPS,
        _BUSHING | _STIFF | {"form": {"kind": "drillable"}},
    ),
    ("pin-profile", Mode.CHECK): ({"effects": "all"},),
    ("impact-linkage", Mode.DESIGN): tuple(
        {"objective": objective} for objective in ("longest_link", "enclosing_radius", "peak_torque", "pin_force")
    ),
    ("impact-linkage", Mode.CHECK): ({"effects": "all"},),
    ("crank-dynamics", Mode.ANALYSIS): (
        {"effects": "all"},
        {"pressure": {"kind": "table", "angle_deg": [0.0, 240.0, 480.0], "pressure_mpa": [2.0, 0.5, 1.0]}},
    ),
}
"""Further requests, as changes of the kind's example."""


FIRST_RUN = ("flexible-rod", "first run")
"""The example of a rod's design, which `serve --demo` asks for: three fifths of what is compiled for rods."""

PARTS: tuple[tuple[str, str], ...] = (
    FIRST_RUN,
    *(
        (kind.slug, str(mode))
        for kind in KINDS.values()
        for mode in sorted(kind.jobs, key=lambda each: each is Mode.DESIGN)
    ),
)
"""The first run, then all kinds and modes, in compilation order: checks, which need less, before designs."""

WINGS: Mapping[str, str] = {
    "flexible-rod": "solvers.rod",
    "pin-profile": "solvers.pin",
    "impact-linkage": "solvers.linkage",
    "crank-dynamics": "solvers.crank",
    "crank-masses": "solvers.crank",
}
"""Package of each kind's kernels."""


def example(slug: str, mode: str) -> tuple[Job, Any] | None:
    """A kind's example at low accuracy; None for modes without a job of their own."""
    kind, chosen = KINDS[slug], mode_of(mode)
    job = kind.jobs.get(chosen)
    return job and (job, job.request.model_validate({**kind.example(chosen), "accuracy": _LOOSE}))


def mode_of(name: str) -> Mode:
    """The mode of a part of the warm-up; the first run is a design."""
    return Mode.DESIGN if name == FIRST_RUN[1] else Mode(name)


def rehearsals_of(slug: str, mode: str) -> Iterator[tuple[Job, Any]]:
    """The example of one kind and mode, and its variants; of the first run at its own accuracy and at a low one."""
    kind, chosen = KINDS[slug], mode_of(mode)
    job = kind.jobs[chosen]
    variants = ({"accuracy": _LOOSE},) if (slug, mode) == FIRST_RUN else _VARIANTS.get((slug, chosen), ())
    for variant in ({}, *variants):
        yield job, job.request.model_validate({**kind.example(chosen), **variant})


def rehearsals() -> Iterator[tuple[Job, Any]]:
    """All examples and their variants."""
    for part in PARTS:
        yield from rehearsals_of(*part)
