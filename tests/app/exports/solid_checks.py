"""Test entry point of the solids process: make a run's STEP file, read it back and describe it."""

from __future__ import annotations

import json
import os
import tempfile
import time
from pathlib import Path
from typing import Any

RECIPE = "recipe"


def answer(kind_slug: str, mode: str, payload: bytes, report: Any) -> list[dict[str, Any]]:
    """Makes the file twice, and reads it with OpenCASCADE; or follows a documented recipe."""
    import build123d

    from app.jobs import calls

    if mode == RECIPE:
        return _followed(payload.decode(), kind_slug)
    calls.answer(kind_slug, mode, payload, report)
    begun = time.process_time()
    made = calls.answer(kind_slug, mode, payload, report)
    took = time.process_time() - begun
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "part.step")
        path.write_bytes(made.content)
        shape = build123d.import_step(path)
    asked = json.loads(payload)["run"]
    found = []
    for solid in shape.solids():
        size = solid.bounding_box().size
        found.append(
            {
                "shape": asked["id"], "valid": solid.is_valid, "closed": solid.is_manifold, "volume": solid.volume,
                "size": [size.X, size.Y, size.Z], "took": took, "names": made.content.decode(),
            }
        )  # fmt: skip
    return found


def _followed(code: str, address: str) -> list[dict[str, Any]]:
    """The result of a recipe's code, in its own directory."""
    names: dict[str, Any] = {"SERVICE": address}
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        exec(code, names)
        size = Path("strip.step").stat().st_size
        os.chdir("/")
    return [{"volume": names["strip"].volume, "valid": names["strip"].is_valid, "run": names["run"].id, "size": size}]
