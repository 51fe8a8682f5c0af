"""Every page for everybody: no violation that axe-core knows, light and dark, at a desk and on a phone; nothing wider
than a phone; no error in the console, no request to elsewhere."""

from __future__ import annotations

import json
import re
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import axe_core_python
import pytest
from playwright.sync_api import Page, Response, expect

from app.designs.kind import Mode
from app.designs.registry import KINDS

AXE = (Path(axe_core_python.__file__).parent / "axe.min.js").read_text("utf-8")
_DESK, _PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
_NARROW = {"width": 320, "height": 640}
"""The narrowest phone, and a desk's page at 400 % (WCAG 1.4.10)."""
_FOUND = """async () => {
    const {violations} = await axe.run(document, {resultTypes: ["violations"]});
    const told = node => `${node.target.join(" ")} ${node.any.map(reason => reason.message)}`;
    return violations.map(each => `${each.id}: ${each.nodes.map(told).join(" | ")}`);
}"""
# Only the first few sections of the reference and the first rows of their tables, because all are generated in the
# same way: the contrast of thousands of cells takes half a minute.
_FEW = """() => {
    [...document.querySelectorAll("section.card")].slice(6).forEach(section => section.remove());
    for (const table of document.querySelectorAll("section.card tbody"))
        [...table.rows].slice(12).forEach(row => row.remove());
    [...document.querySelectorAll("details")].slice(0, 4).forEach(details => { details.open = true; });
}"""
_FORMS = [(slug, mode) for slug, kind in KINDS.items() for mode in kind.jobs]
_JOBS = {Mode.DESIGN: "designs", Mode.CHECK: "checks", Mode.ANALYSIS: "analyses"}


@pytest.fixture(scope="module")
def desk(browser, address) -> Iterator[Page]:
    """A page that records errors."""
    page = browser.new_page(viewport=_DESK)
    page.heard = []
    page.on("console", lambda told: page.heard.append(told.text) if told.type == "error" else None)
    page.on("pageerror", lambda error: page.heard.append(str(error)))
    page.on("request", lambda sent: None if sent.url.startswith(address) else page.heard.append(sent.url))
    yield page
    page.close()


def look_at(page: Page, url: str, status: int = 200) -> None:
    """One page, light at a desk and dark on a phone."""
    page.heard.clear()
    page.set_viewport_size(_DESK)
    page.emulate_media(color_scheme="light")
    answer: Response | None = page.goto(url)
    assert answer is not None and answer.status == status
    judge(page, status)


def judge(page: Page, status: int = 200) -> None:
    page.set_viewport_size(_PHONE)
    wide = page.evaluate("document.documentElement.scrollWidth - window.innerWidth")
    page.evaluate(_FEW)
    page.evaluate(AXE)
    page.emulate_media(color_scheme="dark")
    faults = page.evaluate(_FOUND)
    page.emulate_media(color_scheme="light")
    page.set_viewport_size(_DESK)
    faults += page.evaluate(_FOUND)
    assert faults == []
    assert wide <= 0, f"wider than a phone by {wide}"
    # A refusal is one answer of that status, which the browser tells of in its console.
    assert [told for told in page.heard if status == 200 or str(status) not in told] == []


def stored(address: str, path: str, body: object, **headers: str) -> str:
    """The id of a run made beforehand."""
    sent = {"Content-Type": "application/json", **headers}
    request = urllib.request.Request(f"{address}/api/v1/{path}", json.dumps(body).encode(), sent)
    with urllib.request.urlopen(request, timeout=90) as answer:
        return json.load(answer)["id"]


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/", 200), ("/docs", 200), ("/runs", 200), ("/runs?status=done", 422), ("/runs/compare", 200),
        ("/runs/none", 404), ("/nowhere", 404), ("/batches", 200), ("/login", 200),
    ],
)  # fmt: skip
def test_pages(desk, address, path, status):
    look_at(desk, address + path, status)


@pytest.mark.parametrize(("slug", "mode"), _FORMS)
def test_forms_and_their_runs(desk, address, slug, mode):
    look_at(desk, f"{address}/designs/{slug}?mode={mode}")
    run = stored(address, f"{_JOBS[mode]}/{slug}", {**KINDS[slug].example(mode), "name": "for all"})
    look_at(desk, f"{address}/runs/{run}")


@pytest.mark.parametrize("language", ["en", "ru", "uk"])
def test_nothing_is_wider_than_the_screen_in_any_language(browser, address, language):
    phone = browser.new_page(viewport=_PHONE, locale=language)
    for slug, mode in _FORMS:
        run = stored(address, f"{_JOBS[mode]}/{slug}", {**KINDS[slug].example(mode), "name": "part_" * 20})
        phone.goto(f"{address}/runs/{run}")
        phone.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
        for size in (_PHONE, _NARROW):
            phone.set_viewport_size(size)
            wide = phone.evaluate("document.documentElement.scrollWidth - window.innerWidth")
            assert wide <= 0, f"{slug} {mode}: wider than {size['width']} by {wide}"
        phone.set_viewport_size(_DESK)
        sections = "document.querySelectorAll('.columns > section, .inputs section')"
        over = phone.evaluate(f"[...{sections}].map((s) => s.scrollWidth - s.clientWidth)")
        assert max(over, default=0) <= 0, f"{slug} {mode}: a column over the next one by {over}"
    phone.set_viewport_size({"width": 820, "height": 1180})
    for path in ("/", "/runs", "/batches"):
        phone.goto(address + path)
        wide = phone.evaluate("document.documentElement.scrollWidth - window.innerWidth")
        assert wide <= 0, f"{path}: wider than a tablet by {wide}"
    phone.close()


def test_a_dark_page_is_printed_dark_on_light(desk, address):
    desk.emulate_media(media="print", color_scheme="dark")
    desk.goto(f"{address}/designs/flexible-rod?mode=check")
    colours = "e => [getComputedStyle(e).color, getComputedStyle(e).colorScheme]"
    assert desk.eval_on_selector("body", colours) == ["rgb(29, 36, 48)", "light"]
    desk.emulate_media(media="screen")
    assert desk.eval_on_selector("body", colours) == ["rgb(231, 233, 238)", "dark"]


def test_a_form_with_faults(desk, address):
    desk.heard.clear()
    desk.goto(f"{address}/designs/pin-profile?mode=check")
    desk.fill('[name="geometry.outer_diameter_mm"]', "thick")
    desk.get_by_role("button", name="Check", exact=True).click()
    desk.wait_for_selector("#the-faults")
    judge(desk, 422)
    desk.fill('[name="geometry.outer_diameter_mm"]', "22")
    desk.wait_for_selector("#the-faults", state="detached")


def test_two_runs_side_by_side_and_what_cannot_be(desk, address):
    pin = KINDS["pin-profile"].example(Mode.DESIGN)
    narrow = {**pin, "geometry": {**pin["geometry"], "outer_diameter_mm": 8.0}}
    first, second = (stored(address, "designs/pin-profile", {**each, "name": "side"}) for each in (pin, narrow))
    for path in (f"/runs/{second}", f"/runs/compare?a={first}&b={second}", f"/runs/compare?a={first}"):
        look_at(desk, address + path)


def test_a_batch_with_its_map(desk, address):
    vary = {"bore_mm": [10, 14, 20], "load.force_n": [9000, 15000], "accuracy": [1e-6]}
    vary = {name: {"values": values} for name, values in vary.items()}
    sweep = {"kind": "pin-profile", "mode": "check", "base": KINDS["pin-profile"].example(Mode.CHECK), "vary": vary}
    batch = stored(address, "batches", sweep)
    desk.heard.clear()
    desk.goto(f"{address}/batches/{batch}")
    # The page loads itself again once the batch has ended; judged while it does so, it is lost halfway.
    expect(desk.locator("#progress")).not_to_have_attribute("data-events", re.compile("."), timeout=60_000)
    expect(desk.locator("#map > svg circle")).to_have_count(6)
    expect(desk.locator("#map > svg circle.fails")).to_have_count(3)
    expect(desk.locator(".legend")).to_contain_text("hollow: does not hold")
    judge(desk)


def test_a_map_tells_items_without_an_answer_by_their_status(desk, address):
    vary = {"load.force_n": {"values": [9000, 60000]}, "limits.min_wall_mm": {"values": [2.5, 3.0]}}
    sweep = {"kind": "pin-profile", "mode": "design", "base": KINDS["pin-profile"].example(Mode.DESIGN), "vary": vary}
    desk.goto(f"{address}/batches/{stored(address, 'batches', sweep)}")
    expect(desk.locator("#progress")).not_to_have_attribute("data-events", re.compile("."), timeout=60_000)
    expect(desk.locator(".legend li")).to_have_count(2)
    expect(desk.locator(".legend")).to_contain_text("infeasible")


def test_a_study_under_way_and_done(desk, address):
    study = {"spec": KINDS["impact-linkage"].example(Mode.CHECK), "study_budget_s": 2.0}
    run = stored(address, "accuracy/impact-linkage", study, Prefer="respond-async")
    under_way = f"{address}/api/v1/runs/{run}"
    # Told that the run goes on, the page does not load itself again while it is judged.
    desk.route(under_way, lambda route: route.fulfill(json={"status": "running", "progress": None}))
    look_at(desk, f"{address}/runs/{run}")
    look_at(desk, f"{address}/runs/compare?a={run}&b={run}")
    # A page that learns of the end loads itself again, which would abort going elsewhere.
    desk.goto("about:blank")
    desk.unroute(under_way)
    desk.goto(f"{address}/runs/{run}")
    desk.wait_for_selector("text=Accuracy and computing time", timeout=60_000)
    judge(desk)
