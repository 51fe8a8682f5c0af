"""The most expensive valid requests, for floods, and the time of each on an idle service.

    python -m tests.reliability.worst

The most expensive request of a kind has the smallest accuracy and effect tolerance allowed, the longest tables and the
most steps, points, cylinders and stock sizes. Each is made unique to bypass the cache; settings are the defaults.
"""

from __future__ import annotations

import copy
import json
import math
import tempfile
import time
from pathlib import Path
from typing import Any

from app.api.contract import PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of
from tests.app.running import Running, wait_until

LEAST = 1e-12


def _table(period_deg: float, number: int = 10_000) -> dict[str, Any]:
    """A periodic pressure table [MPa over deg] of maximum length."""
    angles = [round(k * period_deg / number, 6) for k in range(number)]
    pressures = [round(1.0 + 0.3 * math.sin(math.radians(angle)) + 0.1 * math.cos(math.radians(5 * angle)), 6)
                 for angle in angles]  # fmt: skip
    return {"kind": "table", "angle_deg": angles, "pressure_mpa": pressures}


def _profile(pin: dict[str, Any], number: int = 5000) -> list[dict[str, float]]:
    """A half-pin bore profile [mm], widening towards the end, of maximum length."""
    geometry = pin["geometry"]
    half = geometry["boss_length_mm"] + geometry["gap_mm"] + geometry["small_end_length_mm"] / 2
    least, rest = 0.6 * geometry["outer_diameter_mm"], 0.1 * geometry["outer_diameter_mm"]
    share = [k / (number - 1) for k in range(number)]
    return [{"x_mm": round(each * half, 6), "bore_mm": round(least + rest * (1 - each) ** 2, 6)} for each in share]


def dearest() -> dict[str, tuple[str, dict[str, Any]]]:
    """Path and body of each expensive request, by name."""
    found: dict[str, tuple[str, dict[str, Any]]] = {}

    def put(name: str, slug: str, mode: Mode, **changes: Any) -> None:
        body = copy.deepcopy(example_of(KINDS[slug], mode)) | {"accuracy": LEAST, "effect_tolerance": LEAST} | changes
        found[name] = (f"/api/v1/{PATHS[mode]}/{slug}", body)

    rod, pin = "flexible-rod", "pin-profile"
    put("rod check", rod, Mode.CHECK, load=_table(360.0))
    put("rod design", rod, Mode.DESIGN, load=_table(360.0))
    put("rod design from stock", rod, Mode.DESIGN, stock_h_mm=[round(0.2 + 0.004 * k, 3) for k in range(200)])
    put("pin check", pin, Mode.CHECK, bore_mm=None, profile=_profile(example_of(KINDS[pin], Mode.CHECK)))
    for form in ("free", "drillable", "double_cone"):
        put(f"pin design, {form}", pin, Mode.DESIGN, form={"kind": form})
    put("pin design, 12 steps", pin, Mode.DESIGN, form={"kind": "stepped", "steps": 12})
    put("linkage check", "impact-linkage", Mode.CHECK)
    put("linkage front", "impact-linkage", Mode.DESIGN, front={"against": "pin_force", "points": 25},
        coupler_stiffness_n_m=2e7)  # fmt: skip
    engine = {
        "cylinders": 64,
        "phases_deg": [11.25 * k for k in range(64)],
        "positions_mm": [90.0 * k for k in range(64)],
    }
    put("crank", "crank-dynamics", Mode.ANALYSIS, pressure=_table(720.0), engine=engine)
    put("masses", "crank-masses", Mode.ANALYSIS)
    for slug in (rod, "impact-linkage"):
        put(f"study of {slug}", slug, Mode.ACCURACY)
        path, body = found[f"study of {slug}"]
        found[f"study of {slug}"] = (path, {"spec": body["spec"] | {"accuracy": LEAST}})
    return found


_PLACE = 0.123456789
"""Stands for the number in a template; appears in no example."""


def template(body: dict[str, Any]) -> bytes:
    """The request as JSON, to be completed by ``unlike``: long tables are encoded once."""
    tolerance = {"effect_tolerance": _PLACE}
    spec = body["spec"] | tolerance if "spec" in body else None
    return json.dumps(body | ({"spec": spec} if spec else tolerance)).encode()


def unlike(form: bytes, number: int) -> bytes:
    """The request made unique, so that no cached answer serves it."""
    return form.replace(repr(_PLACE).encode(), f"{LEAST * (1.0 + 1e-6 * number):.11e}".encode(), 1)


def each_alone() -> None:
    """Print the solve time of each request on an otherwise idle service."""
    with tempfile.TemporaryDirectory() as folder, Running(Path(folder)) as running, running.client() as client:
        wait_until(lambda: running.ready(client), 170.0)
        for name, (path, body) in dearest().items():
            for number in range(2):
                began = time.monotonic()
                sent = unlike(template(body), number)
                answer = client.post(path, content=sent, headers={"Content-Type": "application/json"})
                took = time.monotonic() - began
            told = f"{answer.status_code} {answer.json()['status']}"
            print(f"{name}: {told}, {took:.2f} s, {len(sent)} bytes", flush=True)


if __name__ == "__main__":
    each_alone()
