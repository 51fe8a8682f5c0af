"""Run pages and plots are in one language: no English words but names, units and symbols in Russian or Ukrainian."""

from __future__ import annotations

import re
from html import unescape
from xml.etree import ElementTree

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from tests.app.web.test_languages import OTHERS, english_in

JOBS = {Mode.DESIGN: "designs", Mode.CHECK: "checks", Mode.ANALYSIS: "analyses"}
PIN, ROD, LINKAGE = (KINDS[slug].example(Mode.DESIGN) for slug in ("pin-profile", "flexible-rod", "impact-linkage"))
CASES = {
    f"{slug}, {mode}": (f"{JOBS[mode]}/{slug}", kind.example(mode))
    for slug, kind in KINDS.items()
    for mode in kind.jobs
} | {
    "pin, infeasible": ("designs/pin-profile", {**PIN, "load": {"force_n": 1e6}}),
    "pin, too weak": ("checks/pin-profile", {**KINDS["pin-profile"].example(Mode.CHECK), "bore_mm": 21.9}),
    "bushing": ("designs/pin-profile", KINDS["pin-profile"].others(Mode.DESIGN)["a bushing"]),
    "cones": ("designs/pin-profile", {**PIN, "form": {"kind": "double_cone"}, "limits": {"max_deflection_um": 12.0}}),
    "rod, infeasible": (
        "designs/flexible-rod",
        {**ROD, "requirements": {**ROD["requirements"], "min_fatigue_safety": 5.0}},
    ),
    "rod, buckled": (
        "checks/flexible-rod",
        {**KINDS["flexible-rod"].example(Mode.CHECK), "dimensions": {"b_mm": 9.0, "h_mm": 0.1, "l_mm": 40.0}},
    ),
    "linkage, infeasible": ("designs/impact-linkage", {**LINKAGE, "limits": {**LINKAGE["limits"], "width_mm": 20.0}}),
    "study": (
        "accuracy/impact-linkage",
        {"spec": {**KINDS["impact-linkage"].example(Mode.CHECK), "name": ""}, "study_budget_s": 1.0},
    ),
    "study of a pin": ("accuracy/pin-profile", {"spec": {**PIN, "name": ""}, "study_budget_s": 1.0}),
}
_LINKS = re.compile(r'<nav class="languages".*?</nav>|<ul class="downloads">.*?</ul>|<p><a href="/api/.*?</p>', re.S)
"""Native language names, file names, name and version of the solver."""
_FIGURES = re.compile(r"\d+(?:\.\d+)?")
_WORDS_OF_A_PICTURE = re.compile(r"<(?:text|title)[^>]*>([^<]*)<")


@pytest.fixture(scope="module", params=CASES)
def run(client, request) -> dict:
    path, body = CASES[request.param]
    answer = client.post(f"/api/v1/{path}", json=body if "spec" in body else {**body, "name": ""})
    assert answer.status_code == 201, answer.text
    return answer.json()


@pytest.mark.parametrize("code", OTHERS)
def test_no_run_page_mixes_languages(client, run, code):
    page = client.get(f"/runs/{run['id']}", headers={"accept-language": code, "accept": "text/html"}).text
    # No text is marked as untranslated English.
    page = _LINKS.sub("", page).replace(run["id"], "").replace(' lang="en"', "")
    assert f'<html lang="{code}">' in page
    assert english_in(page) == []


_LETTER = 6.4
"""Mean width of a letter of a picture's 13 px, a little less than any font has."""


@pytest.mark.parametrize("code", ["en", *OTHERS])
def test_no_word_leaves_its_picture(client, run, code):
    for name, place in run["links"]["plots"].items():
        picture = ElementTree.fromstring(client.get(place, params={"language": code}).content)
        left, _, width, _ = map(float, picture.attrib["viewBox"].split())
        for text in picture.iter("{http://www.w3.org/2000/svg}text"):
            if "x" in text.attrib and "transform" not in text.attrib and not text.attrib.get("font-size"):
                begin, size = float(text.attrib["x"]), _LETTER * len("".join(text.itertext()))
                begin -= {"middle": 0.5, "end": 1.0}.get(text.attrib.get("text-anchor", ""), 0.0) * size
                assert left <= begin and begin + size <= left + width, (name, "".join(text.itertext()))


@pytest.mark.parametrize("code", OTHERS)
def test_no_plot_mixes_languages(client, run, code):
    for name, place in run["links"]["plots"].items():
        english, spoken = (unescape(client.get(place, params={"language": each}).text) for each in ("en", code))
        told, words = _WORDS_OF_A_PICTURE.findall(english), _WORDS_OF_A_PICTURE.findall(spoken)
        assert english_in("".join(f"<p>{each}</p>" for each in words)) == [], name
        # Same number of words, and all figures.
        assert [_FIGURES.findall(each) for each in words] == [_FIGURES.findall(each) for each in told], name
