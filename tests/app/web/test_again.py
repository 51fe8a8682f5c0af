"""From a run to the next one: its part checked, its form filled again; what takes long is followed and can be ended."""

from __future__ import annotations

import html
import json
import re
import time

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.web.forms.tree import form_of

DESIGNS = [
    ("flexible-rod", ""),
    ("pin-profile", ""),
    ("pin-profile", "one diameter all along"),
    ("pin-profile", "a bushing"),
    ("impact-linkage", ""),
]


def request_in(page: str) -> dict:
    """The request that a form shows as JSON."""
    return json.loads(html.unescape(re.search(r'<pre[^>]*id="the-json">(.*?)</pre>', page, re.S)[1]))


def filled(kind: str, mode: Mode, **changes: object) -> dict[str, str]:
    """What a browser sends of a form that holds the example."""
    texts: dict[str, str] = {}
    form_of(KINDS[kind], mode).take({**KINDS[kind].example(mode), **changes}, texts)
    return texts


@pytest.mark.parametrize(("slug", "example"), DESIGNS, ids=lambda value: str(value))
def test_the_part_that_a_design_found_is_checked_with_a_click(client, slug, example):
    kind = KINDS[slug]
    request = kind.others(Mode.DESIGN)[example] if example else kind.example(Mode.DESIGN)
    run = client.post(f"/api/v1/designs/{slug}", json=request).json()
    assert f'href="/designs/{slug}?mode=check&amp;from={run["id"]}"' in client.get(f"/runs/{run['id']}").text
    asked = request_in(client.get(f"/designs/{slug}?mode=check&from={run['id']}").text)
    checked = client.post(f"/api/v1/checks/{slug}", json=asked)
    assert checked.status_code == 201, checked.text
    for name in ("mass_g", "box_area_mm2", "fatigue_safety", "peak_torque_nm"):
        if run["result"].get(name) is not None:
            assert checked.json()["result"][name] == pytest.approx(run["result"][name], rel=1e-4), name
    assert checked.json()["verdict"]["holds"]


@pytest.fixture
def impatient(client, monkeypatch):
    monkeypatch.setattr(client.app.state.settings, "form_patience_s", 0.0)


def posted(client, name: str, speed: str) -> str:
    """Where the page of a design is that nobody has asked for before."""
    texts = filled("flexible-rod", Mode.DESIGN, name=name) | {"mechanism.speed_hz": speed}
    answer = client.post("/designs/flexible-rod?mode=design", data=texts, follow_redirects=False)
    assert answer.status_code == 303, answer.text
    return answer.headers["location"]


def test_a_design_that_takes_long_is_followed_by_its_page(client, impatient):
    at = posted(client, "followed", "47.1")
    deadline = time.monotonic() + 60
    while (run := client.get(f"/api/v1{at}").json())["status"] in ("queued", "running"):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert (run["status"], run["name"], run["verdict"]["holds"]) == ("succeeded", "followed", True)


def test_a_design_that_takes_long_is_ended_from_its_page(client, impatient):
    at = posted(client, "ended", "47.2")
    assert f'action="{at}/cancel"' in client.get(at).text
    client.post(f"{at}/cancel")
    assert client.get(f"/api/v1{at}").json()["status"] == "cancelled"


def test_what_the_solver_refuses_is_told_in_the_form_however_short_the_patience(client):
    texts = filled("flexible-rod", Mode.CHECK) | {"dimensions.l_mm": "80"}
    answer = client.post("/designs/flexible-rod?mode=check", data=texts)
    assert answer.status_code == 422
    assert 'id="the-faults"' in answer.text
