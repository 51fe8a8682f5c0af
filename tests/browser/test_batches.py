"""A person looks at a batch that varies three fields: the map, and every item as a line across parallel axes."""

from __future__ import annotations

import time

from playwright.sync_api import Page, Route, expect

from app.designs.kind import Mode
from tests.browser.test_runs import example, solved

SWEEP = {
    "kind": "crank-masses",
    "mode": "analysis",
    "base": example("crank-masses", Mode.ANALYSIS),
    "combine": "grid",
    "vary": {
        "pivot_distance_mm": {"from": 160.0, "to": 160.1, "steps": 2},
        "rod_mass_kg": {"from": 0.6, "to": 0.64, "steps": 3},
        "period_small_end_s": {"from": 0.795, "to": 0.7951, "steps": 2},
    },
}


def test_more_than_two_varied_fields_have_axes_side_by_side(address: str, page: Page) -> None:
    batch = solved(address, "batches", SWEEP)
    page.goto(f"{address}/batches/{batch['id']}")
    axes = page.locator("#beside")
    expect(axes.locator("polyline")).to_have_count(12)
    expect(page.locator("#map > svg circle")).to_have_count(12)
    # Three varied fields and a result.
    expect(axes.locator("line")).to_have_count(4)
    expect(axes).to_contain_text("Period, hung at the small end, s")
    expect(axes.locator("a").first).to_have_attribute("href", f"/runs/{batch['id'][:-8]}00000001")
    # While a batch runs, its state is told with its counters.
    items = {"done": 3, "total": 12, "succeeded": 3, "infeasible": 0, "failed": 0, "refused": 0, "cancelled": 0}
    page.evaluate("batch => show(batch)", {"status": "running", "items": items})
    expect(page.locator("#progress p").first).to_contain_text("running: 3 / 12")


def test_a_batch_is_followed_further_after_a_busy_moment(address: str, page: Page) -> None:
    run = {"kind": "flexible-rod", "mode": "design", "base": example("flexible-rod", Mode.DESIGN), "combine": "grid"}
    batch = solved(address, "batches", run | {"vary": {"load.p_min_mpa": {"from": 1.2, "to": 1.5, "steps": 100}}})
    page.route("**/events", lambda route: route.fulfill(status=503), times=1)
    with page.expect_response(lambda answer: answer.url.endswith("/events") and answer.ok):
        page.goto(f"{address}/batches/{batch['id']}")
    page.get_by_role("button", name="Cancel the rest").click()


def test_two_clicks_start_one_sweep(address: str, page: Page) -> None:
    sent: list[str] = []

    def held(route: Route) -> None:
        sent.append(route.request.url)
        time.sleep(0.2)
        route.continue_()

    page.goto(f"{address}/batches?kind=crank-masses&mode=analysis")
    page.fill("#field0", "rod_mass_kg")
    for name, text in (("from", "0.6"), ("to", "0.64"), ("steps", "2")):
        page.fill(f"#{name}0", text)
    page.fill("#sweep-name", "clicked twice")
    page.route("**/batches/sweep", held)
    button = page.get_by_role("button", name="Start the sweep")
    button.evaluate("button => { button.click(); setTimeout(() => button.click(), 50); }")
    expect(page.locator("h1")).to_have_text("clicked twice")
    assert len(sent) == 1
    page.unroute("**/batches/sweep")
