"""Every format checked with the tools that read it, at any size and with any name."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import time
import xml.etree.ElementTree as ET
import zipfile

import ezdxf
import numpy as np
import pytest

from app.designs.drawing import Arc, Bezier, Outline
from app.designs.kind import Mode
from app.designs.part import Extrusion, Revolution
from app.designs.registry import KINDS
from app.exports.export import ExportOptions, ExportProcess, Refusal, Tool
from app.exports.registry import EXPORTS, exports_for
from tests.app.exports.cases import HOSTILE, parts, scaled, solved

PARTS = parts()
SIZES = {"10 µm": 1e-2, "own": None, "10 m": 1e4}


def sized(run, length):
    """A part's run scaled to a longest side of about ``length`` mm."""
    if length is None:
        return run
    part = KINDS[run["kind"]].part(run, None)
    return scaled(run, length / max(p.value for p in part.parameters if p.unit == "mm"))


def file(run, name, tool=Tool.FREECAD, angle=None):
    return EXPORTS[name].file(KINDS[run["kind"]], run, ExportOptions(tool, angle))


def drawn(run):
    content = file(run, "dxf").content
    return ezdxf.read(io.StringIO(content.decode("utf-8")))


def by_name(run):
    return {p.name: p.value for p in KINDS[run["kind"]].part(run, None).parameters}


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("shape", PARTS)
def test_drawings_are_valid_and_dimensions_match_the_result(shape, size):
    run = sized(PARTS[shape], SIZES[size])
    document = drawn(run)
    auditor = document.audit()
    assert not auditor.errors
    assert not auditor.fixes
    assert document.dxfversion == "AC1024"
    assert document.header["$INSUNITS"] == 4
    assert {layer.dxf.name for layer in document.layers} >= {"OUTLINE", "CENTER", "DIMENSIONS", "HIDDEN", "TITLE"}
    used = {entity.dxf.layer for entity in document.modelspace()}
    assert used <= {"OUTLINE", "CENTER", "DIMENSIONS", "HIDDEN", "TITLE"}
    measured = sorted(d.get_measurement() for d in document.modelspace().query("DIMENSION"))
    p = by_name(run)
    expected = {
        "strip": lambda: [p["b_mm"], p["h_mm"], p["l_mm"]],
        "linkage": lambda: [p[f"{name}_mm"] for name in ("base", "crank", "coupler", "rocker")],
        "constant": lambda: [p["length_mm"], p["outer_diameter_mm"], p["bore_mm"]],
        "constant bushing": lambda: [p["length_mm"], p["outer_diameter_mm"], p["bore_mm"]],
        "bushing": lambda: [p[f"{name}_mm"] for name in ("length", "outer_end", "outer_mid", "max_outer", "bore")],
        **dict.fromkeys(
            ("drillable bushing", "stepped bushing"),
            lambda: [p["length_mm"], p["outer_end_mm"], p["outer_mid_mm"], p["bore_mm"]],
        ),
        "stepped": lambda: [p["length_mm"], p["outer_diameter_mm"], p["bore_end_mm"], p["bore_mid_mm"],
                            p["drill_2_depth_mm"]],
    }.get(shape, lambda: [p["length_mm"], p["outer_diameter_mm"], p["bore_end_mm"], p["bore_mid_mm"]])()  # fmt: skip
    # Where a step or a cone ends, measured from the end of the part.
    corners = {"cone_cylinder": ["bore_1_to_mm"], "stepped bushing": ["outer_1_to_mm", "outer_2_to_mm"]}
    expected += [p[corner] for corner in corners.get(shape, [])]
    assert measured == pytest.approx(sorted(expected), rel=1e-9)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("shape", PARTS)
def test_svg_is_true_to_scale(shape, size):
    run = sized(PARTS[shape], SIZES[size])
    root = ET.fromstring(file(run, "svg").content)
    wide, high = (float(root.attrib[side].removesuffix("mm")) for side in ("width", "height"))
    w, h = map(float, root.attrib["viewBox"].split()[2:])
    assert (w, h) == pytest.approx((wide, high))
    p = by_name(run)
    longest = {"strip": "l_mm", "linkage": "base_mm"}.get(shape, "length_mm")
    # The outline's own coordinates are millimetres.
    outlines = [path for path in root.iter("{http://www.w3.org/2000/svg}path") if path.get("d")]
    first = [float(x) for x in re.findall(r"[-\d.e]+(?=,)", outlines[0].get("d"))]
    if shape != "linkage":
        assert max(first) - min(first) == pytest.approx(p[longest], rel=1e-6)
    assert p[longest] < w < 3.0 * p[longest] + 10.0 * p.get("joint_radius_mm", 0.0)


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_are_escaped(name):
    run = {**PARTS["strip"], "name": name}
    rows = list(csv.reader(io.StringIO(file(run, "csv").content.decode("utf-8-sig"))))
    told = {row[0]: row[1] for row in rows if len(row) == 3}
    assert told["run.name"].lstrip("'") == name
    for row in rows:
        for value in row:
            if value[:1] in ("=", "+", "-", "@", "\t", "\r"):
                float(value)
    ET.fromstring(file(run, "svg").content)
    document = drawn(run)
    assert not document.audit().errors
    texts = [text.plain_text() for text in document.modelspace().query("TEXT")]
    assert all("\n" not in text for text in texts)
    if name.isascii() and name.isalnum():
        assert name in texts
    for tool in Tool:
        assert file(run, "parameters", tool).content == file(PARTS["strip"], "parameters", tool).content


@pytest.mark.parametrize("tool", Tool)
def test_parameters_carry_no_rounding_errors_of_binary_numbers(tool):
    run = PARTS["strip"]
    result = {**run["result"], "dimensions": {**run["result"]["dimensions"], "h_mm": 0.1 + 0.2}}
    assert READERS[tool](file({**run, "result": result}, "parameters", tool).content)["h_mm"] == 0.3


def test_csv_keeps_every_number():
    run = PARTS["linkage"]
    rows = list(csv.reader(io.StringIO(file(run, "csv").content.decode("utf-8-sig"))))
    told = {row[0]: row for row in rows if len(row) == 3}
    for name, value in run["result"]["lengths_mm"].items():
        assert float(told[f"result.lengths_mm.{name}"][1]) == value
    assert told["result.pin_force_n"][2] == "N"
    start = rows.index(["result.transfer"])
    assert rows[start + 1] == ["phi_deg", "u31"]
    table = rows[start + 2 : start + 2 + len(run["result"]["transfer"])]
    assert [[float(v) for v in row] for row in table] == [list(sample.values()) for sample in run["result"]["transfer"]]


def test_csv_gives_the_elements_of_an_array_its_unit():
    rows = csv.reader(io.StringIO(file(solved("flexible-rod", Mode.DESIGN), "csv").content.decode("utf-8-sig")))
    units = {row[0]: row[2] for row in rows if len(row) == 3}
    assert [units[f"spec.bounds.{name}.1"] for name in ("b_mm", "h_mm", "l_mm")] == ["mm", "mm", "mm"]
    assert (units["spec.step_mm.b"], units["result.fatigue_safety"]) == ("mm", "")


def test_an_infeasible_run_exports_its_diagnosis():
    run = solved("pin-profile", Mode.DESIGN, load={"force_n": 1e6})
    assert run["status"] == "infeasible"
    assert set(exports_for(run)) >= {"json", "csv"}
    assert not set(exports_for(run)) & {"svg", "dxf", "step", "parameters"}
    assert b"result.diagnosis" in file(run, "csv").content


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("shape", PARTS)
def test_parameters_as_each_program_reads_them(shape, size):
    run = sized(PARTS[shape], SIZES[size])
    wanted = by_name(run)
    found = {tool: READERS[tool](file(run, "parameters", tool).content) for tool in Tool}
    for tool, read in found.items():
        assert read == pytest.approx(wanted, rel=1e-12), tool


def _of_quantity(text):
    number, _, unit = text.partition(" ")
    assert unit in ("mm", "deg")
    return float(number)


def _freecad(content):
    rows = [line.split("\t") for line in content.decode().splitlines()]
    return {name: _of_quantity(value.removeprefix("=")) for name, value, _ in rows}


def _fusion(content):
    rows = list(csv.DictReader(io.StringIO(content.decode())))
    assert list(rows[0]) == ["Name", "Unit", "Expression", "Value", "Comments", "Favorite"]
    return {row["Name"]: _of_quantity(row["Expression"]) for row in rows}


def _onshape(content):
    rows = json.loads(content)
    assert {row["type"] for row in rows} <= {"LENGTH", "ANGLE"}
    return {row["name"]: _of_quantity(row["expression"]) for row in rows}


def _solidworks(content):
    lines = content.decode("utf-8-sig").splitlines()
    pairs = [re.fullmatch(r'"([a-z]\w*)"= ([\d.]+)(mm|deg)', line).groups() for line in lines]
    return {name: float(number) for name, number, _ in pairs}


def _inventor(content):
    space = {"s": "http://schemas.openxmlformats.org/spreadsheetml/2006/main"}
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        sheet = ET.fromstring(archive.read("xl/worksheets/sheet1.xml"))
        for name in archive.namelist():
            ET.fromstring(archive.read(name))
    found = {}
    for row in sheet.iterfind(".//s:row", space):
        name, value, unit, _ = row
        assert "".join(unit.itertext()) in ("mm", "deg")
        found["".join(name.itertext())] = float("".join(value.itertext()))
    return found


READERS = {
    Tool.FREECAD: _freecad,
    Tool.FUSION: _fusion,
    Tool.ONSHAPE: _onshape,
    Tool.SOLIDWORKS: _solidworks,
    Tool.INVENTOR: _inventor,
}


def along(outline: Outline, count: int = 24) -> np.ndarray:
    """Points of an outline from its segments' equations."""
    points, here = [], np.array(outline.start)
    for piece in outline.pieces:
        t = np.linspace(0.0, 1.0, count)[:, None]
        end = np.array(piece.end)
        if isinstance(piece, Bezier):
            s = 1.0 - t
            points.append(s**3 * here + 3 * s * s * t * piece.first + 3 * s * t * t * piece.second + t**3 * end)
        elif isinstance(piece, Arc):
            angle = 4.0 * math.atan(piece.bulge)
            chord = end - here
            center = here + 0.5 * chord + 0.5 / math.tan(0.5 * angle) * np.array([-chord[1], chord[0]])
            turn = t[:, 0] * angle
            (x, y), (c, s) = here - center, (np.cos(turn), np.sin(turn))
            points.append(center + np.stack([c * x - s * y, s * x + c * y], axis=1))
        else:
            points.append(here + t * (end - here))
        here = end
    return np.concatenate(points)


@pytest.mark.parametrize("shape", [shape for shape, run in PARTS.items() if run["kind"] == "pin-profile"])
def test_the_mass_of_a_turned_part_matches_the_result(shape):
    """By Pappus' theorem on a fine polygon, without a modeller."""
    part = KINDS["pin-profile"].part(PARTS[shape], None)
    (solid,) = part.solids
    assert isinstance(solid, Revolution)
    points = along(solid.profile, 400)
    (x1, r1), (x2, r2) = points.T, np.roll(points, -1, axis=0).T
    volume = math.pi / 3.0 * abs(np.sum((x2 - x1) * (r1 * r1 + r1 * r2 + r2 * r2)))
    assert volume * 1e-6 * part.density_kg_m3 == pytest.approx(part.mass_g, rel=1e-6)


def test_the_drawn_curve_matches_the_result():
    """The table's stations lie on it within a micrometre, except at steps of the bore."""
    run = PARTS["free"]
    pieces = run["result"]["contour"]
    off = []
    for row in run["result"]["profile"]:
        near = [p for p in pieces if p["x_from_mm"] - 1e-9 <= row["x_mm"] <= p["x_to_mm"] + 1e-9]
        values = []
        for p in near:
            h = p["x_to_mm"] - p["x_from_mm"]
            t = (row["x_mm"] - p["x_from_mm"]) / h
            s = 1.0 - t
            values.append(
                p["diameter_from_mm"] * s * s * (1 + 2 * t) + p["diameter_to_mm"] * t * t * (1 + 2 * s)
                + h * t * s * (p["slope_from"] * s - p["slope_to"] * t)
            )  # fmt: skip
        off.append(min(abs(value - row["bore_mm"]) for value in values))
    assert max(off) < 1e-3


@pytest.mark.parametrize("angle", [None, 40.0, 180.0, -75.0, 400.0])
def test_the_links_meet_at_every_angle(angle):
    run = PARTS["linkage"]
    part = KINDS["impact-linkage"].part(run, angle)
    ends = {}
    for solid in part.solids:
        assert isinstance(solid, Extrusion)
        (a, b), turn = (np.array(hole.center) for hole in solid.holes), math.radians(solid.turn_deg)
        way = np.array([math.cos(turn), math.sin(turn)])
        ends[solid.name] = np.array(solid.shift) + a, np.array(solid.shift) + way * b[0]
        assert math.dist(a, b) == pytest.approx(run["result"]["lengths_mm"][solid.name])
    size = run["result"]["longest_link_mm"]
    for one, other in (("base", "crank"), ("base", "rocker")):
        index = 0 if other == "crank" else 1
        assert np.allclose(ends[one][index], ends[other][0], atol=1e-9 * size)
    assert np.allclose(ends["crank"][1], ends["coupler"][0], atol=1e-9 * size)
    assert np.allclose(ends["coupler"][1], ends["rocker"][1], atol=1e-6 * size)
    if angle is not None:
        first = KINDS["impact-linkage"].part(run, None).solids[1].turn_deg
        turned = math.remainder(part.solids[1].turn_deg - first - angle, 360.0)
        assert turned == pytest.approx(0.0, abs=1e-6)


def test_what_is_swept_lies_within_the_outline_and_fills_its_box():
    run = PARTS["linkage"]
    part = KINDS["impact-linkage"].part(run, None)
    outline = next(s for s in part.drawing.shapes if isinstance(s, Outline) and s.layer == "HIDDEN")
    points = along(outline)
    box = run["result"]["box_mm"]
    turn = math.radians(box["angle_deg"])
    across = points @ np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    assert np.ptp(across[:, 0]) == pytest.approx(box["width"], rel=1e-4)
    assert np.ptp(across[:, 1]) == pytest.approx(box["height"], rel=1e-4)


def test_an_angle_out_of_reach_is_refused():
    lengths = {"base": 60.0, "crank": 20.0, "coupler": 50.0, "rocker": 35.0}
    run = solved("impact-linkage", Mode.CHECK, lengths_mm=lengths, ratios={}, type="largest_base")
    assert not run["result"]["closure"]["closes"]
    assert not isinstance(file(run, "svg"), Refusal)
    refused = file(run, "dxf", angle=30.0)
    assert isinstance(refused, Refusal)
    assert refused.pointer == "/angle_deg"


@pytest.mark.parametrize("high", [0.86, 0.88, 0.9, 0.92, 0.95])
def test_a_crank_that_cannot_turn_is_drawn_up_to_its_stops(high):
    run = solved("impact-linkage", Mode.CHECK, restitution={"low": 0.2, "high": high})
    reach = run["result"]["confined_deg"]
    assert reach is not None
    for angle in (None, reach, -reach):
        part = KINDS["impact-linkage"].part(run, angle)
        for solid in part.solids:
            assert all(map(math.isfinite, (*solid.shift, solid.turn_deg)))


def test_each_takes_less_than_a_second():
    """Ten times as much as it needs, for machines under load."""
    for name, export in EXPORTS.items():
        if export.where is ExportProcess.SOLIDS:
            continue
        for run in PARTS.values():
            for _ in range(3):
                begun = time.process_time()
                file(run, name)
                if (took := time.process_time() - begun) < 1.0:
                    break
            assert took < 1.0, name
