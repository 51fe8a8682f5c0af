"""Follow-up runs: check of a designed part, refilled form; long runs can be followed and cancelled."""

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
    """The request JSON shown by a form."""
    return json.loads(html.unescape(re.search(r'<pre[^>]*id="the-json">(.*?)</pre>', page, re.S)[1]))


def filled(kind: str, mode: Mode, **changes: object) -> dict[str, str]:
    """The form data of the example, as a browser sends it."""
    texts: dict[str, str] = {}
    form_of(KINDS[kind], mode).take({**KINDS[kind].example(mode), **changes}, texts)
    return texts


@pytest.mark.parametrize(("slug", "example"), DESIGNS, ids=lambda value: str(value))
def test_a_designed_part_is_checked_by_one_click(client, slug, example):
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


def posted(client, name: str, **changes: object) -> str:
    """Submit a new design and return the URL of its page."""
    texts = filled("flexible-rod", Mode.DESIGN, name=name, **changes)
    answer = client.post("/designs/flexible-rod?mode=design", data=texts, follow_redirects=False)
    assert answer.status_code == 303, answer.text
    return answer.headers["location"]


def test_a_long_design_is_followed_on_its_page(client, impatient):
    at = posted(client, "followed", accuracy=2e-6)
    deadline = time.monotonic() + 60
    while (run := client.get(f"/api/v1{at}").json())["status"] in ("queued", "running"):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert (run["status"], run["name"], run["verdict"]["holds"]) == ("succeeded", "followed", True)


def test_a_long_design_is_cancelled_from_its_page(client, impatient):
    # Seconds of work on any processor.
    at = posted(client, "ended", effects="all", accuracy=1e-10)
    assert f'action="{at}/cancel"' in client.get(at).text
    client.post(f"{at}/cancel")
    assert client.get(f"/api/v1{at}").json()["status"] == "cancelled"


def test_solver_refusals_are_shown_in_the_form_even_with_short_patience(client):
    texts = filled("flexible-rod", Mode.CHECK) | {"dimensions.l_mm": "80"}
    answer = client.post("/designs/flexible-rod?mode=check", data=texts)
    assert answer.status_code == 422
    assert 'id="the-faults"' in answer.text
