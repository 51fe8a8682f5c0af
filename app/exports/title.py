"""The title block of a drawing."""

from __future__ import annotations

from app.designs.part import Part
from app.exports.export import Run
from app.exports.text import MAX_LENGTH, plain


def title_rows(run: Run, part: Part) -> list[tuple[str, str]]:
    """(label, value) rows, the most important first."""
    verdict = run.get("verdict")
    holds = "not judged" if verdict is None else verdict["summary"]
    material = (run["spec"].get("material") or {}).get("name")
    rows = [
        ("part", part.title),
        ("name", plain(run.get("name") or "")[:MAX_LENGTH] or "-"),
        ("verdict", plain(holds)),
        *([("material", plain(material))] if material else []),
        *([("mass", f"{part.mass_g:.6g} g")] if part.mass_g is not None else []),
        *(("note", plain(remark)) for remark in part.remarks),
        ("units, scale", "mm, 1:1"),
        ("run", f"{run['kind']} {run['mode']} {run['id']}"),
        ("made by", f"{run['solver']['name']} {run['solver']['version']}, {str(run['created_at'])[:10]}"),
    ]
    return rows
