"""Download links of a run's page."""

from __future__ import annotations

from typing import Any, NamedTuple

from app.exports.export import Tool
from app.exports.registry import EXPORTS
from app.reports.calculation import is_calculated
from app.words.languages import gettext as _
from app.words.languages import language

_TOOLS = {
    Tool.FREECAD: "FreeCAD",
    Tool.FUSION: "Fusion",
    Tool.ONSHAPE: "Onshape",
    Tool.SOLIDWORKS: "SolidWorks",
    Tool.INVENTOR: "Inventor",
}


class Download(NamedTuple):
    """A link: target, name and description."""

    href: str
    name: str
    words: str


def downloads_of(run: dict[str, Any]) -> list[Download]:
    """The run's exports in registry order; the parameters once per CAD program."""
    found = []
    for name, href in run["links"]["exports"].items():
        head, words = (_(part) for part in EXPORTS[name].title.partition(": ")[::2])
        if name in ("html", "pdf") and language() != "en":
            href = f"{href}?language={language()}"
        if name == "html" and not is_calculated(run):
            words = _("the report")
        if name == "parameters":
            found += [Download(f"{href}?for={tool}", f"{head}: {shown}", words) for tool, shown in _TOOLS.items()]
        else:
            found.append(Download(href, head, words))
    return found
