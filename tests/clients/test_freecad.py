"""FreeCAD without a GUI: request, part, and mass compared with the result."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from app.designs.fields import fields_of
from app.designs.kind import Mode
from app.designs.registry import KINDS
from tests.clients.bridge import on_a_port

FOLDER = Path(__file__).parents[2] / "clients" / "freecad"
FREECAD = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
PIN = KINDS["pin-profile"].example(Mode.DESIGN)


def asked(address: str, folder: Path, kind: str, mode: str, request: dict) -> str:
    (folder / "request.json").write_text(json.dumps(request))
    told = {"URL": address, "KIND": kind, "MODE": mode, "REQUEST": folder / "request.json", "OUT": folder / "part"}
    environment = {**os.environ, "HOME": str(folder), **{f"CRANKWRIGHT_{k}": str(v) for k, v in told.items()}}
    assert FREECAD is not None, "make test installs FreeCAD"
    done = subprocess.run(
        [str(FREECAD), str(FOLDER / "headless.py")], env=environment, capture_output=True, text=True, timeout=150
    )
    return done.stdout.strip().splitlines()[-1]


@pytest.mark.parametrize(
    ("kind", "mode", "request_"),
    [
        ("flexible-rod", "check", KINDS["flexible-rod"].example(Mode.CHECK)),
        ("pin-profile", "design", PIN),
        ("pin-profile", "design", {**PIN, "form": {"kind": "double_cone"}}),
        ("pin-profile", "design", {**PIN, "form": {"kind": "free"}}),
        ("impact-linkage", "check", KINDS["impact-linkage"].example(Mode.CHECK)),
    ],
    ids=["strip", "stepped", "cones", "curve", "links"],
)
def test_a_part_is_built_and_driven(client, tmp_path, kind, mode, request_):
    with on_a_port(client) as address:
        said = asked(address, tmp_path, kind, mode, request_)
    assert said.startswith("CRANKWRIGHT-OK "), said
    made = json.loads(said.removeprefix("CRANKWRIGHT-OK "))
    assert (tmp_path / "part.FCStd").stat().st_size and (tmp_path / "part.step").stat().st_size
    if kind == "impact-linkage":
        assert made["solids"] == 4
        limits, lengths = request_["limits"], client.get(f"/api/v1/runs/{made['run']}").json()["result"]["lengths_mm"]
        r = limits["joint_radius_mm"]
        flat = sum(2 * r * length + math.pi * r * r * (1 - 2 * 0.25) for length in lengths.values())
        assert made["volume_mm3"] == pytest.approx(flat * r, rel=1e-6)
    else:
        assert abs(made["mass_off"]) < 1e-6
    curve = request_.get("form", {}).get("kind") == "free"
    assert (made["driven"] == 0.0) if curve else (made["driven"] > 0.01)


def test_errors_are_reported_in_the_last_line(client, tmp_path):
    with on_a_port(client) as address:
        said = asked(address, tmp_path, "pin-profile", "design", {**PIN, "load": {"force_n": -1}})
        assert said.startswith("CRANKWRIGHT-FAILED")
        assert "/load/force_n" in said
        said = asked(address, tmp_path, "pin-profile", "design", {**PIN, "load": {"force_n": 1e6}})
        assert "There is no such part" in said


def test_the_api_client_needs_no_freecad(client, monkeypatch):
    """Data for the dialog: kinds, fields, a valid example, parameters."""
    monkeypatch.syspath_prepend(str(FOLDER))
    import crankwright_freecad as cw

    with on_a_port(client) as address:
        service = cw.Service(address)
        assert [kind["kind"] for kind in service.kinds()] == ["flexible-rod", "pin-profile", "impact-linkage"]
        asked = next(r for r in service.kind("flexible-rod")["requests"] if r["mode"] == "check")
        run = service.solve("flexible-rod", "check", asked["example"])
        assert cw.verdict(run) == run["verdict"]["summary"]
        assert [name for name, _, _ in service.parameters(run)] == ["b_mm", "h_mm", "l_mm"]
        with pytest.raises(cw.Refused, match="/dimensions/b_mm"):
            service.solve("flexible-rod", "check", {**asked["example"], "dimensions": {"b_mm": -1}})
    with pytest.raises(cw.Refused, match="no service answers"):
        cw.Service(address).kinds()
    with pytest.raises(cw.Refused):
        cw.Service("file:///etc")
    assert "FreeCAD" not in sys.modules


def _form(monkeypatch, slug, mode):
    monkeypatch.syspath_prepend(str(FOLDER))
    from crankwright_form import Form

    kind = KINDS[slug]
    return Form([field.model_dump() for field in fields_of(kind, mode)], kind.example(mode))


@pytest.mark.parametrize(
    ("slug", "mode"), [(kind.slug, mode) for kind in KINDS.values() for mode in kind.jobs if mode != Mode.ANALYSIS]
)
def test_the_initial_form_yields_the_example(monkeypatch, slug, mode):
    job = KINDS[slug].jobs[mode]
    made = job.request.model_validate(_form(monkeypatch, slug, mode).request())
    assert made == job.request.model_validate(KINDS[slug].example(mode))


def test_forms_are_switched_in_the_dialog(monkeypatch):
    """Entered values are kept, those of the previous alternative are dropped, and the request is valid."""
    form = _form(monkeypatch, "flexible-rod", Mode.CHECK)
    assert form.chosen["load.kind"] == "schmidt" and form.chosen["material"] == "custommaterial"
    form.keep({"mechanism.speed_hz": 40.0})
    form.choose("load.kind", "constant")
    form.choose("material", "cataloguematerial")
    paths = [field["path"] for field in form.shown()]
    assert "load.constant_pressure_mpa" in paths and "load.p_min_mpa" not in paths
    assert "material.name" in paths and "material.density_kg_m3" not in paths
    assert form.value("load.back_pressure_mpa") is None
    form.keep({"load.constant_pressure_mpa": 0.5, "material.name": "stainless-1.4310"})
    request = KINDS["flexible-rod"].jobs[Mode.CHECK].request.model_validate(form.request())
    assert request.load.kind == "constant" and request.load.constant_pressure_mpa == 0.5
    assert request.material.name == "stainless-1.4310" and request.mechanism.speed_hz == 40.0
    form.choose("load.kind", "schmidt")
    assert form.value("load.p_min_mpa") is None

    pin = _form(monkeypatch, "pin-profile", Mode.DESIGN)
    assert pin.chosen["material"] == "pinmaterial"
    pin.choose("material", "pinsteel")
    pin.choose("effects", "all")
    pin.keep({"material.name": "pin-steel-17Cr3", "form.kind": "free", "form.steps": None})
    made = KINDS["pin-profile"].jobs[Mode.DESIGN].request.model_validate(pin.request())
    assert made.material.name == "pin-steel-17Cr3" and made.effects == "all" and made.form.kind == "free"

    linkage = _form(monkeypatch, "impact-linkage", Mode.CHECK)
    other = next(c for f in linkage.shown() if f["path"] == "restitution" for c in f["choices"]
                 if c != linkage.chosen["restitution"])  # fmt: skip
    linkage.choose("restitution", other)
    below = [f["path"] for f in linkage.shown() if f["path"].startswith("restitution")]
    linkage.keep({p: 0.5 for p in below if "." in p or other == "number"})
    KINDS["impact-linkage"].jobs[Mode.CHECK].request.model_validate(linkage.request())


def test_the_macro_is_python():
    compile((FOLDER / "Crankwright.FCMacro").read_text("utf-8"), "Crankwright.FCMacro", "exec")
