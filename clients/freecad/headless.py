"""Build a part in FreeCAD without a GUI: `freecadcmd headless.py`, configured by environment variables.

CRANKWRIGHT_URL      the service, default http://127.0.0.1:8000
CRANKWRIGHT_KEY      an API key, if required
CRANKWRIGHT_KIND     flexible-rod, pin-profile or impact-linkage
CRANKWRIGHT_MODE     design (default) or check
CRANKWRIGHT_REQUEST  a file with the request as JSON; default: the kind's example
CRANKWRIGHT_OUT      output path without suffix: .FCStd and .step are added

The last line is CRANKWRIGHT-OK and the files, or CRANKWRIGHT-FAILED and the error; the exit code is always 0.
"""

import json
import os
import sys
import traceback

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))


def main():
    import crankwright_freecad as cw
    import FreeCAD
    import Part

    told = os.environ.get
    service = cw.Service(told("CRANKWRIGHT_URL", "http://127.0.0.1:8000"), told("CRANKWRIGHT_KEY", ""))
    kind, mode = told("CRANKWRIGHT_KIND", "flexible-rod"), told("CRANKWRIGHT_MODE", "design")
    if told("CRANKWRIGHT_REQUEST"):
        with open(told("CRANKWRIGHT_REQUEST"), encoding="utf-8") as file:
            request = json.load(file)
    else:
        request = next(r["example"] for r in service.kind(kind)["requests"] if r["mode"] == mode)
    run = service.solve(kind, mode, request)
    print(cw.verdict(run))
    if not run["links"]["exports"].get("parameters"):
        raise cw.Refused({"detail": "the run has no part: " + cw.verdict(run)})
    document = FreeCAD.newDocument("Crankwright")
    made = cw.build(document, run, service.parameters(run))
    out = told("CRANKWRIGHT_OUT", run["kind"] + "-" + run["id"])
    document.saveAs(out + ".FCStd")
    Part.export(made, out + ".step")
    volume = sum(solid.Shape.Volume for solid in made)
    summary = {
        "run": run["id"], "holds": run["holds"], "solids": len(made), "volume_mm3": volume,
        "mass_off": cw.off_by(made, run, service), "driven": drives(document, made, cw),
    }  # fmt: skip
    return "CRANKWRIGHT-OK " + json.dumps(summary)


def drives(document, made, cw):
    """Whether the spreadsheet drives the solid: lengthen its longest dimension by a tenth, compare, and restore it."""
    sheet = document.getObject(cw.SHEET)
    names = ("l_mm", "length_mm", "base_mm")
    cell = next(sheet.getCellFromAlias(name) for name in names if sheet.getCellFromAlias(name))
    before, was = sum(solid.Shape.Volume for solid in made), sheet.getContents(cell)
    sheet.set(cell, "=1.1 * ({})".format(was.lstrip("=")))
    document.recompute()
    changed = sum(solid.Shape.Volume for solid in made) / before - 1.0
    sheet.set(cell, was)
    document.recompute()
    return changed


try:
    SAID = main()
except BaseException as error:
    traceback.print_exc()
    SAID = "CRANKWRIGHT-FAILED " + " ".join(str(error).split())
print("\n" + SAID)
sys.stdout.flush()
