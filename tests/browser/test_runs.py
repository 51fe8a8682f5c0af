"""A person among his runs: filters them, compares two, designs one again, has one studied, ends one."""

from __future__ import annotations

import json
import time
import urllib.request

import pytest
from playwright.sync_api import Page, Route, expect

from app.designs.kind import Mode
from app.designs.registry import KINDS

_A_SOLVE = 60_000


def solved(address: str, path: str, body: dict, **headers: str) -> dict:
    """A run made beforehand, for the pages to show."""
    request = urllib.request.Request(
        f"{address}/api/v1/{path}", json.dumps(body).encode(), {"Content-Type": "application/json", **headers}
    )
    with urllib.request.urlopen(request, timeout=60) as answer:
        return json.load(answer)


def exported(address: str) -> str:
    """A file, asked for again while it is being written: the first one waits for its writer to load."""
    end = time.monotonic() + 60
    while True:
        with urllib.request.urlopen(address, timeout=60) as answer:
            if answer.status == 200:
                return answer.read().decode()
        assert time.monotonic() < end
        time.sleep(float(answer.headers["Retry-After"]))


def example(kind: str, mode: Mode, **changes: object) -> dict:
    return {**KINDS[kind].example(mode), **changes}


@pytest.fixture(scope="module")
def sound(browser, address) -> Page:
    """A desktop page on which no error may appear and nothing may be fetched from elsewhere."""
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    heard: list[str] = []
    page.on("console", lambda message: heard.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: heard.append(request.url) if not request.url.startswith(address) else None)
    yield page
    page.close()
    assert not heard


def no_wider_than(page: Page, width: int) -> bool:
    page.set_viewport_size({"width": width, "height": 900})
    return page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_why_there_is_no_answer_fits_a_phone(browser, address):
    rod = example("flexible-rod", Mode.DESIGN)
    rod["requirements"] = {**rod["requirements"], "min_fatigue_safety": 5.0}
    run = solved(address, "designs/flexible-rod", rod)
    page = browser.new_page(viewport={"width": 390, "height": 844})
    page.goto(f"{address}/runs/{run['id']}")
    region = page.get_by_role("region", name="Why there is no answer")
    assert region.evaluate("box => box.scrollWidth <= box.clientWidth && box.clientHeight < 250")
    page.close()


def test_runs_are_filtered_and_two_of_them_compared(sound, address):
    # Other tests of this service have pins of their own.
    pin = example("pin-profile", Mode.CHECK, name="a <script>bad</script> pin to compare")
    solved(address, "checks/pin-profile", pin)
    solved(address, "checks/pin-profile", {**pin, "name": "The Pin to Compare at less", "load": {"force_n": 9000}})
    solved(address, "checks/impact-linkage", example("impact-linkage", Mode.CHECK, name="no pin to compare at all"))
    sound.goto(f"{address}/runs")
    sound.select_option("#filter-kind", "pin-profile")
    sound.fill("#filter-text", "pin to compare")
    sound.select_option("#filter-order", "oldest")
    sound.get_by_role("button", name="Filter").click()
    links = sound.locator(".runs tbody th a")
    assert links.all_inner_texts() == ["a <script>bad</script> pin to compare", "The Pin to Compare at less"]
    assert sound.input_value("#filter-text") == "pin to compare"
    assert "g mass" in sound.locator(".runs tbody tr").first.inner_text()
    for box in sound.locator(".runs tbody input").all():
        box.check()
    sound.get_by_role("button", name="Compare two").click()
    expect(sound.locator("h1")).to_have_text("Two runs side by side")
    row = sound.get_by_role("row", name="Greatest force on the piston")
    assert row.locator("td").all_inner_texts() == ["15000 N", "9000 N"]
    moment = sound.get_by_role("row", name="greatest bending moment, N·mm").locator("td").last.inner_text()
    assert moment.endswith("(-40 %)")
    assert no_wider_than(sound, 390)
    sound.set_viewport_size({"width": 1200, "height": 900})


def test_a_run_is_begun_again_with_changes_and_with_an_effect_switched(sound, address):
    run = solved(address, "checks/pin-profile", example("pin-profile", Mode.CHECK, name="again"))
    sound.goto(f"{address}/runs/{run['id']}")
    assert sound.locator(".verdict .summary").inner_text() == run["verdict"]["summary"]
    effect = sound.get_by_role("row", name="shear deflection")
    expect(effect.locator(".status")).to_have_text("active")
    effect.get_by_role("button").click()
    expect(sound.locator("h1")).to_have_text("again")
    expect(sound.get_by_role("row", name="shear deflection").locator(".status")).to_have_text("skipped")
    assert run["id"] not in sound.url
    sound.get_by_role("link", name="Check again with changes").click()
    assert sound.locator('[name="name"]').input_value() == "again"


def test_the_mechanism_is_paused_and_scrubbed(sound, address):
    run = solved(address, "checks/impact-linkage", example("impact-linkage", Mode.CHECK))
    sound.goto(f"{address}/runs/{run['id']}")
    figure = sound.locator('figure[data-plot="mechanism"]')
    expect(figure).to_have_attribute("data-ready", "true")
    figure.get_by_role("button", name="Pause").click()
    figure.get_by_role("slider").fill("90")
    assert figure.locator("output").inner_text() == "90°"
    cursor = sound.locator('figure[data-plot="transfer"] .cursor')
    assert float(cursor.get_attribute("x1")) == pytest.approx(70 + 390 / 4, abs=1)
    assert no_wider_than(sound, 390)
    sound.set_viewport_size({"width": 1200, "height": 900})


@pytest.mark.parametrize(("kind", "asked_by"), [("pin-profile", "image"), ("impact-linkage", "fetch")])
def test_pictures_appear_after_a_busy_moment(browser, address, kind, asked_by):
    refused: list[str] = []

    def busy_once(route: Route) -> None:
        if route.request.resource_type == asked_by and not refused:
            refused.append(route.request.url)
            route.fulfill(status=503)
        else:
            route.continue_()

    run = solved(address, f"checks/{kind}", example(kind, Mode.CHECK))
    page = browser.new_page()
    page.add_init_script("const later = setTimeout; setTimeout = (act) => later(act);")
    page.route("**/plots/*", busy_once)
    page.goto(f"{address}/runs/{run['id']}")
    if kind == "impact-linkage":
        expect(page.locator('figure[data-plot="mechanism"]')).to_have_attribute("data-ready", "true")
    else:
        for picture in page.locator(".gallery img").all():
            picture.scroll_into_view_if_needed()
            expect(picture).not_to_have_js_property("naturalWidth", 0)
    assert refused
    page.close()


def test_who_wants_no_motion_gets_none(browser, address):
    run = solved(address, "checks/impact-linkage", example("impact-linkage", Mode.CHECK))
    page = browser.new_page(reduced_motion="reduce")
    page.goto(f"{address}/runs/{run['id']}")
    figure = page.locator('figure[data-plot="mechanism"]')
    expect(figure.get_by_role("button", name="Play")).to_be_visible()
    page.close()


def test_a_study_is_watched_to_its_end(sound, address):
    run = solved(address, "checks/pin-profile", example("pin-profile", Mode.CHECK))
    sound.goto(f"{address}/runs/{run['id']}")
    sound.get_by_role("button", name="Study the accuracy").click()
    expect(sound.get_by_role("heading", name="Accuracy and computing time")).to_be_visible(timeout=_A_SOLVE)
    expect(sound.locator('figure[data-plot="error-against-time"] img')).to_be_visible()


def test_a_run_under_way_is_cancelled(sound, address):
    study = {"spec": example("impact-linkage", Mode.DESIGN), "study_budget_s": 60.0}
    run = solved(address, "accuracy/impact-linkage", study, Prefer="respond-async")
    sound.goto(f"{address}/runs/{run['id']}")
    sound.get_by_role("button", name="Cancel this run").click()
    expect(sound.locator(".about .status")).to_have_text("cancelled")
    expect(sound.get_by_role("button", name="Cancel this run")).to_have_count(0)


def test_a_busy_moment_is_no_end_of_a_run(browser, address):
    study = {"spec": example("impact-linkage", Mode.DESIGN), "study_budget_s": 60.0}
    run = solved(address, "accuracy/impact-linkage", study, Prefer="respond-async")
    page, loads = browser.new_page(), []
    page.on("framenavigated", lambda frame: loads.append(frame.url))
    page.route("**/api/v1/runs/*", lambda route: route.fulfill(status=503, body="{}"), times=1)
    with page.expect_response(lambda answer: "/api/v1/runs/" in answer.url and answer.ok):
        page.goto(f"{address}/runs/{run['id']}")
    assert len(loads) == 1
    page.get_by_role("button", name="Cancel this run").click()
    page.close()


def test_the_reference_stands_by_itself(sound, address):
    sound.goto(f"{address}/docs")
    sound.locator("#post-api-v1-checks-pin-profile details").first.click()
    expect(sound.locator("#post-api-v1-checks-pin-profile").get_by_text("geometry.outer_diameter_mm")).to_be_visible()
    assert no_wider_than(sound, 390)


def test_a_person_works_in_inches_and_learns_what_a_limit_is_worth(sound, address):
    sound.goto(f"{address}/designs/pin-profile?mode=design")
    sound.get_by_role("group", name="Units").get_by_role("button", name="in", exact=True).click()
    diameter = sound.locator('[id="geometry.outer_diameter_mm"]')
    expect(diameter).to_have_value("0.865748031496")
    diameter.fill("0.875")
    sound.locator('[name="material"][value="pinsteel"]').check()
    sound.locator('[name="material.pinsteel.name"][value="pin-steel-31CrMoV9"]').check()
    sound.get_by_role("button", name="Design", exact=True).click()
    sound.wait_for_selector(".verdict", timeout=_A_SOLVE)
    expect(sound.locator(".shaped").first).to_contain_text("1 % more")
    asked = sound.locator(".inputs")
    expect(asked).to_contain_text("0.875 in")
    expect(asked).to_contain_text("31CrMoV9")
    run = sound.url.rpartition("/")[2]
    with urllib.request.urlopen(f"{address}/api/v1/runs/{run}") as answer:
        assert json.load(answer)["spec"]["geometry"]["outer_diameter_mm"] == 22.225
    sound.get_by_role("group", name="Units").get_by_role("link", name="mm", exact=True).click()
    expect(asked).to_contain_text("22.225 mm")
    assert no_wider_than(sound, 390)
    sound.set_viewport_size({"width": 1200, "height": 900})


@pytest.mark.parametrize("width", [390, 900])
def test_no_number_of_a_report_is_broken(browser, address, width):
    run = solved(address, "analyses/crank-dynamics", example("crank-dynamics", Mode.ANALYSIS))
    report = exported(address + run["links"]["exports"]["html"])
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.set_content(report)
    broken = page.evaluate("""() => {
        const lines = (cell) => {
            const range = document.createRange();
            range.selectNodeContents(cell);
            return range.getClientRects().length;
        };
        const number = /^-?[\\d.]+( \\S+)?$/;
        const numbers = [...document.querySelectorAll(".facts dd")].filter((e) => number.test(e.innerText));
        return {seen: numbers.length, broken: numbers.filter((e) => lines(e) > 1).map((e) => e.innerText)};
    }""")
    page.close()
    assert broken["seen"] > 30 and broken["broken"] == []
