"""Crankwright in FreeCAD: send a request, write the result into a spreadsheet, and build the part driven by it.

Standard library and FreeCAD only. `Service` is the API client; `build` creates a run's objects in a document.
"""

from __future__ import annotations

import json
import math
import time
import urllib.error
import urllib.parse
import urllib.request

SHEET = "Parameters"
PATHS = {"design": "designs", "check": "checks"}
_WAITS = 120
_SECONDS = 60


class Refused(Exception):
    """An error response; ``errors`` has an entry per invalid field."""

    def __init__(self, problem):
        self.errors = problem.get("errors") or []
        lines = [problem.get("detail") or problem.get("title") or "refused"]
        lines += ["{pointer}: {detail} (allowed: {allowed})".format(**entry) for entry in self.errors]
        super().__init__("\n".join(lines))


class Service:
    """A service, with an API ``key`` if required."""

    def __init__(self, url="http://127.0.0.1:8000", key=""):
        if urllib.parse.urlsplit(url).scheme not in ("http", "https"):
            raise Refused({"detail": "the address of the service begins with http:// or https://"})
        self.url, self.key = url.rstrip("/"), key

    def _ask(self, path, body=None, headers=None):
        request = urllib.request.Request(self.url + path, headers=headers or {})
        if self.key:
            request.add_header("Authorization", "Bearer " + self.key)
        if body is not None:
            request.data = json.dumps(body).encode()
            request.add_header("Content-Type", "application/json")
        for _ in range(_WAITS):
            try:
                with urllib.request.urlopen(request, timeout=_SECONDS) as answer:
                    if answer.status != 202:
                        return answer.read()
                    wait = answer.headers.get("Retry-After")
            except urllib.error.HTTPError as error:
                wait = error.headers.get("Retry-After") if error.code in (429, 503) else None
                if wait is None:
                    raise Refused(_problem(error)) from error
            except (urllib.error.URLError, OSError) as error:
                raise Refused({"detail": f"no service answers at {self.url}: {error}"}) from error
            time.sleep(min(float(wait or 1), 10.0))
        raise Refused({"detail": "the service did not answer in time"})

    def kinds(self):
        """Kinds with a part to build."""
        found = json.loads(self._ask("/api/v1/kinds"))["items"]
        return [kind for kind in found if set(PATHS) & set(kind["modes"])]

    def kind(self, name):
        """Description of a kind: its requests field by field, with an example."""
        return json.loads(self._ask("/api/v1/kinds/" + urllib.parse.quote(name, safe="")))

    def solve(self, kind, mode, request):
        """Run a design or a check."""
        return json.loads(self._ask(f"/api/v1/{PATHS[mode]}/{kind}", request))

    def parameters(self, run):
        """(name, quantity, comment) of the part's parameters in FreeCAD's format."""
        text = self._ask(run["links"]["exports"]["parameters"] + "?for=freecad").decode()
        return [tuple(line.split("\t")) for line in text.splitlines() if line]

    def export(self, run, name):
        """An exported file."""
        return self._ask(run["links"]["exports"][name])


def _problem(error):
    try:
        return json.loads(error.read())
    except ValueError:
        return {"detail": f"{error.code} {error.reason}"}


def verdict(run):
    """The one-sentence summary."""
    if run.get("verdict"):
        return run["verdict"]["summary"]
    if run["status"] == "infeasible":
        return "There is no such part: " + "; ".join(
            "{requirement} needs {required:.4g}, {advice}".format(**item) for item in run["result"]["diagnosis"]
        )
    problem = run.get("problem") or {}
    return problem.get("detail") or "the run is " + run["status"]


def fill_sheet(document, parameters):
    """The spreadsheet driving the model: name (also the alias), quantity, comment."""
    sheet = document.getObject(SHEET) or document.addObject("Spreadsheet::Sheet", SHEET)
    sheet.clearAll()
    for row, (name, quantity, comment) in enumerate(parameters, start=1):
        sheet.set(f"A{row}", "'" + name)
        sheet.set(f"B{row}", quantity)
        sheet.setAlias(f"B{row}", name)
        sheet.set(f"C{row}", "'" + comment)
    document.recompute()
    return sheet


def build(document, run, parameters):
    """Create the part's objects, driven by the spreadsheet; returns the main solids."""
    for old in [each for each in document.Objects if each.Name.startswith("Crankwright")]:
        if document.getObject(old.Name):
            document.removeObject(old.Name)
    fill_sheet(document, parameters)
    made = _BUILDERS[run["kind"]](document, run, {name for name, _, _ in parameters})
    document.recompute()
    for solid in made:
        if not solid.Shape.isValid() or solid.Shape.Volume <= 0.0:
            raise RuntimeError(f"{solid.Label} could not be built")
    return made


def _driven(document, kind, name, **expressions):
    """Add an object with expressions as properties; ``name`` in them refers to a spreadsheet alias."""
    made = document.addObject(kind, "Crankwright" + name)
    made.Label = name
    for property, expression in expressions.items():
        made.setExpression(property.replace("_", "."), expression)
    return made


def _of(name):
    return f"{SHEET}.{name}"


def _strip(document, _run, _names):
    strip = _driven(
        document, "Part::Box", "Strip", Length=_of("l_mm"), Width=_of("b_mm"), Height=_of("h_mm"),
        Placement_Base_y="-{} / 2".format(_of("b_mm")), Placement_Base_z="-{} / 2".format(_of("h_mm")),
    )  # fmt: skip
    return [strip]


def _turned(document, run, names):
    """Outer body minus bore: cylinders and cones for straight spans, otherwise the revolved curve."""
    straight = {"bore_1_from_mm", "outer_1_from_mm"} & names or {"bore_mm", "outer_diameter_mm"} <= names
    if run["result"].get("contour") and not straight:
        return [_curved(document, run)]
    size = _sizes(document)
    outside = _stack(document, "Outside", "outer", "outer_diameter_mm", names, size)
    bore = _stack(document, "Bore", "bore", "bore_mm", names, size)
    if bore is None:
        return [outside]
    pin = _driven(document, "Part::Cut", "Pin")
    pin.Base, pin.Tool = outside, bore
    return [pin]


def _sizes(document):
    """The spreadsheet's values by alias."""
    sheet = document.getObject(SHEET)

    def size(name):
        value = sheet.get(name)
        return float(getattr(value, "Value", value))

    return size


def _stack(document, label, word, even, names, size):
    """Cylinders and cones in a row along z, as one solid; None where there is nothing."""
    count = 0
    while f"{word}_{count + 1}_from_mm" in names:
        count += 1
    parts = []
    if not count:
        if size(even) <= 0.0:
            return None
        return _driven(document, "Part::Cylinder", label, Radius=_of(even) + " / 2", Height=_of("length_mm"))
    for number in range(1, count + 1):
        at = [_of(f"{word}_{number}_{end}_mm") for end in ("from", "to", "first", "last")]
        first, last = (size(f"{word}_{number}_{end}_mm") for end in ("first", "last"))
        if first <= 0.0 and last <= 0.0:
            continue
        height, base = f"{at[1]} - {at[0]}", at[0]
        name = f"{label}{number}"
        if first == last:
            part = _driven(
                document, "Part::Cylinder", name, Radius=at[2] + " / 2", Height=height, Placement_Base_z=base
            )
        else:
            part = _driven(
                document, "Part::Cone", name, Radius1=at[2] + " / 2", Radius2=at[3] + " / 2", Height=height,
                Placement_Base_z=base,
            )  # fmt: skip
        parts.append(part)
    if len(parts) < 2:
        return parts[0] if parts else None
    whole = _driven(document, "Part::MultiFuse", label)
    whole.Shapes = parts
    return whole


def _curved(document, run):
    """The optimised curve as a fixed sketch; the spreadsheet shows its dimensions."""
    import FreeCAD
    import Part

    pieces, result = run["result"]["contour"], run["result"]
    bushing = run["spec"]["variable"] == "outer"
    even = (result["min_bore_mm"] if bushing else result["outer_max_mm"]) / 2.0
    end = pieces[-1]["x_to_mm"]

    def at(x, radius):
        return FreeCAD.Vector(radius, 0.0, x)

    edges, here = [], at(0.0, pieces[0]["diameter_from_mm"] / 2.0)

    def straight(to):
        nonlocal here
        if here.distanceToPoint(to) > 1e-9 * end:
            edges.append(Part.makeLine(here, to))
            here = to

    for p in pieces:
        third = (p["x_to_mm"] - p["x_from_mm"]) / 3.0
        first, last = p["diameter_from_mm"] / 2.0, p["diameter_to_mm"] / 2.0
        straight(at(p["x_from_mm"], first))
        curve = Part.BezierCurve()
        curve.setPoles([
            here,
            at(p["x_from_mm"] + third, first + p["slope_from"] * third / 2.0),
            at(p["x_to_mm"] - third, last - p["slope_to"] * third / 2.0),
            at(p["x_to_mm"], last),
        ])  # fmt: skip
        edges.append(curve.toShape())
        here = at(p["x_to_mm"], last)
    straight(at(end, even))
    straight(at(0.0, even))
    straight(at(0.0, pieces[0]["diameter_from_mm"] / 2.0))
    face = Part.Face(Part.Wire(edges))
    made = document.addObject("Part::Feature", "CrankwrightPin")
    made.Label = "Bushing" if bushing else "Pin"
    made.Shape = face.revolve(FreeCAD.Vector(0, 0, 0), FreeCAD.Vector(0, 0, 1), 360.0)
    return made


def _links(document, _run, _names):
    """The four links side by side, each a flat bar with round ends and two holes."""
    made = []
    radius, hole, thick = (_of(name) for name in ("joint_radius_mm", "joint_hole_radius_mm", "link_thickness_mm"))
    for number, name in enumerate(("base", "crank", "coupler", "rocker")):
        length, aside = _of(name + "_mm"), f"{number} * 3 * {radius}"
        title = name.capitalize()
        bar = _driven(
            document, "Part::Box", title + "Bar", Length=length, Width="2 * " + radius, Height=thick,
            Placement_Base_y=f"{aside} - {radius}",
        )  # fmt: skip
        ends, holes = [], []
        for end, x in (("A", "0 mm"), ("B", length)):
            place = {"Height": thick, "Placement_Base_x": x, "Placement_Base_y": aside}
            ends.append(_driven(document, "Part::Cylinder", title + "Eye" + end, Radius=radius, **place))
            holes.append(_driven(document, "Part::Cylinder", title + "Hole" + end, Radius=hole, **place))
        body = _driven(document, "Part::MultiFuse", title + "Body")
        body.Shapes = [bar, *ends]
        bores = _driven(document, "Part::MultiFuse", title + "Holes")
        bores.Shapes = holes
        link = _driven(document, "Part::Cut", title)
        link.Base, link.Tool = body, bores
        made.append(link)
    return made


_BUILDERS = {"flexible-rod": _strip, "pin-profile": _turned, "impact-linkage": _links}


def density(run, service):
    """Density of the part's material [kg/m^3]; None if the run has none."""
    material = run["spec"].get("material") or {}
    if material.get("name"):
        listed = json.loads(service._ask("/api/v1/materials"))["items"]
        return next(item["density_kg_m3"] for item in listed if item["name"] == material["name"])
    return material.get("density_kg_m3")


def off_by(made, run, service):
    """Relative difference of the solid's mass from the result's; None if the result has no mass."""
    mass, dense = run["result"].get("mass_g"), density(run, service)
    if not mass or not dense:
        return None
    volume = math.fsum(solid.Shape.Volume for solid in made)
    return volume * 1e-6 * dense / mass - 1.0
