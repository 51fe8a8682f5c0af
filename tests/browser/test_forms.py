"""Every form is filled in through its widgets in a real browser; no request is written in the test or sent
elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Locator, Page, expect

HOSTILE = "</title><img src=x onerror=\"document.title='stolen'\">\u202e\U0001f4a3"

PASTE = """text => {
    const data = new DataTransfer();
    data.setData("text", text);
    const paste = new ClipboardEvent("paste", {clipboardData: data, bubbles: true, cancelable: true});
    document.activeElement.dispatchEvent(paste);
}"""


@pytest.fixture(scope="module")
def tab(browser) -> Iterator[Page]:
    """One for all tests: to begin another takes the processor a second."""
    tab = browser.new_page()
    yield tab
    tab.close()


@pytest.fixture
def page(tab, address) -> Iterator[Page]:
    """The tab without cookies; it fails its test for what the console or a request to elsewhere tells."""
    faults: list[str] = []
    heard = {
        "console": lambda message: faults.append(message.text) if message.type == "error" else None,
        "pageerror": lambda error: faults.append(str(error)),
        "request": lambda sent: None if sent.url.startswith(address) else faults.append(sent.url),
    }
    tab.goto("about:blank")
    tab.context.clear_cookies()
    tab.set_viewport_size({"width": 1300, "height": 900})
    for event, hear in heard.items():
        tab.on(event, hear)
    yield tab
    for event, hear in heard.items():
        tab.remove_listener(event, hear)
    # The icon that browsers ask for on their own, and forms sent back with their faults.
    assert [fault for fault in faults if "404" not in fault and "422" not in fault] == []


def box(page: Page, label: str) -> Locator:
    """The field to type in that has this label and is to be seen."""
    return page.get_by_role("textbox", name=label, exact=True).first


def fill(page: Page, label: str, text: str) -> None:
    box(page, label).fill(text)


def send(page: Page, button: str) -> str:
    """Submit, and the verdict's sentence or, of an analysis, nothing."""
    page.get_by_role("button", name=button, exact=True).click()
    page.wait_for_url("**/runs/*", timeout=60_000)
    # The page of a longer run follows its progress, and shows the result once it is done.
    page.wait_for_selector("text=This run as JSON >> visible=true", timeout=60_000)
    expect(page.locator("[data-live]")).to_have_count(0, timeout=60_000)
    verdict = page.locator(".verdict .summary")
    return verdict.first.inner_text() if verdict.count() else ""


def dimension(page: Page, path: str) -> str:
    return page.locator(f'#the-drawing [data-for="{path}"] text').first.text_content()


def test_rod_check(page, address):
    page.goto(f"{address}/designs/flexible-rod?mode=check")
    live = page.locator("#the-answer")
    expect(live).to_contain_text("It holds", timeout=60_000)
    assert dimension(page, "dimensions.l_mm") == "l 23"
    fill(page, "Free length l", "1 in")
    expect(page.locator('#the-drawing [data-for="dimensions.l_mm"]')).to_contain_text("l 25.4")
    expect(page.locator('#the-drawing [data-for="dimensions.l_mm"]')).to_have_class("dimension lit")
    # A thinner strip, by the slider alone.
    page.get_by_label("Thickness h, slider").focus()
    for _ in range(45):
        page.keyboard.press("ArrowLeft")
    expect(live).to_contain_text("It does not hold", timeout=30_000)
    page.get_by_label("from the list").check()
    page.get_by_label("stainless 1.4310").check()
    page.get_by_label("one pressure at all angles").check()
    assert not box(page, "Compression parameter δ").is_visible()
    fill(page, "Pressure", "0,2")
    fill(page, "Thickness h", "0,46")
    fill(page, "Name of this run", HOSTILE)
    assert "It holds" in send(page, "Check")
    assert page.locator("h1").inner_text().startswith("</title>")
    assert page.title() != "stolen"
    page.go_back()
    expect(box(page, "Thickness h")).to_have_value("0,46")
    assert page.get_by_label("one pressure at all angles").is_checked()
    assert page.get_by_label("stainless 1.4310").is_checked()


def test_rod_check_with_a_table_from_a_spreadsheet(page, address):
    page.goto(f"{address}/designs/flexible-rod?mode=check")
    page.get_by_label("table over the crank angle").check()
    box(page, "crank angle, °, row 1").focus()
    page.evaluate(PASTE, "angle\tp\n0\t1,0\n90\t1,1\n180\t0,8\n270\t0,7\n")
    assert box(page, "pressure, MPa, row 4").input_value() == "0,7"
    for _ in range(2):
        page.get_by_role("button", name="remove this row").last.click()
    box(page, "pressure, MPa, row 3").fill("high")
    error = page.locator('[id="load.table.points-error"]')
    expect(error).to_contain_text("row 3, pressure: is not a number")
    box(page, "pressure, MPa, row 3").fill("0,8")
    expect(error).to_have_text("")
    assert "It holds" in send(page, "Check")
    page.go_back()
    assert box(page, "pressure, MPa, row 4").input_value() == "0,7"


def test_a_pasted_row_without_figures_is_refused_rather_than_left_out(page, address):
    page.goto(f"{address}/designs/flexible-rod?mode=check")
    page.get_by_label("table over the crank angle").check()
    box(page, "crank angle, °, row 1").focus()
    page.evaluate(PASTE, "angle\tp\n0\t1\n60\t2\n#N/A\t2\n\n180\t1\n240\t1\n300\t1\n")
    expect(page.locator('[id="load.table.points-error"]')).to_contain_text("row 3, crank angle: is not a number")
    assert box(page, "crank angle, °, row 4").input_value() == "180"


def test_a_form_is_judged_once_the_service_answers_again(browser, address):
    page = browser.new_page()
    page.route("**/drawing**", lambda route: route.abort(), times=1)
    page.goto(f"{address}/designs/flexible-rod?mode=check")
    expect(page.locator("#the-answer")).to_contain_text("The service does not answer.")
    expect(page.locator("#the-answer")).to_contain_text("It holds.")
    page.close()


def test_a_table_from_csv_and_an_emptied_cell(page, address):
    page.goto(f"{address}/designs/flexible-rod?mode=check")
    page.get_by_label("table over the crank angle").check()
    box(page, "crank angle, °, row 1").focus()
    page.evaluate(PASTE, "angle,p\n0,2\n60,3\n120,2\n180,1")
    assert [box(page, f"{column}, row 2").input_value() for column in ("crank angle, °", "pressure, MPa")] == [
        "60",
        "3",
    ]
    fill(page, "crank angle, °, row 2", "")
    error = page.locator('[id="load.table.points-error"]')
    expect(error).to_contain_text("row 2, crank angle: is not a number")
    page.get_by_role("button", name="Check", exact=True).click()
    expect(page.locator("#the-faults")).to_be_visible()
    assert [box(page, f"{column}, row 2").input_value() for column in ("crank angle, °", "pressure, MPa")] == ["", "3"]


def test_rod_design_with_what_is_added_by_a_click(page, address):
    page.goto(f"{address}/designs/flexible-rod?mode=design")
    limit = page.get_by_role("checkbox", name="Pressure of the skirt on the cylinder, at most")
    limit.check()
    fill(page, "Thicknesses in stock", "0,4; 0.5; 0.6")
    fill(page, "Safety against yield, at least", "1,5")
    page.get_by_role("button", name="Design", exact=True).click()
    error = page.locator('[id="requirements.max_contact_pressure_mpa-error"]')
    expect(error).to_contain_text("is missing")
    assert page.evaluate("document.activeElement.id") == "the-faults"
    assert box(page, "Thicknesses in stock").input_value() == "0,4; 0.5; 0.6"
    limit.uncheck()
    page.get_by_label("Objective").select_option("mass")
    assert "It holds" in send(page, "Design")
    assert "h = 0.5 mm" in page.locator("main").inner_text()


def test_rod_modes_keep_what_is_typed(page, address):
    page.goto(f"{address}/designs/flexible-rod?mode=design")
    fill(page, "Speed", "41")
    page.get_by_role("button", name="Check: dimensions are known").click()
    expect(box(page, "Speed")).to_have_value("41")
    expect(box(page, "Free length l")).to_have_value("23")


def test_language_and_units_keep_what_is_typed(page, address):
    page.goto(f"{address}/designs/pin-profile?mode=check")
    fill(page, "Outer diameter D", "25.4")
    fill(page, "Greatest force on the piston", "lots")
    page.get_by_role("button", name="in", exact=True).click()
    expect(box(page, "Outer diameter D")).to_have_value("1")
    expect(box(page, "Greatest force on the piston")).to_have_value("lots")
    page.get_by_role("button", name="Українська").click()
    expect(page.locator("html")).to_have_attribute("lang", "uk")
    expect(page.locator('[id="geometry.outer_diameter_mm"]')).to_have_value("1")
    page.get_by_role("button", name="English").click()
    page.get_by_role("button", name="mm", exact=True).click()
    expect(box(page, "Outer diameter D")).to_have_value("25.4")
    expect(page.get_by_role("heading", level=1)).to_contain_text("Piston pin")
    page.get_by_label("a bushing").check()
    expect(page.get_by_role("heading", level=1)).to_contain_text("Bushing")
    expect(page).to_have_title(re.compile("^Bushing"))


def test_going_back_to_a_form_fills_in_what_was_typed_unless_its_units_are_others_now(page, address):
    for switched, length in (("metric", "46"), ("inch", "1.791338582677")):
        page.goto(f"{address}/designs/flexible-rod?mode=check")
        fill(page, "Rod length L", "46")
        page.goto(f"{address}/units/{switched}?back=/")
        page.go_back()
        expect(box(page, "Rod length L")).to_have_value(length)
    page.goto(f"{address}/units/metric?back=/")


def test_enter_submits_the_form(page, address):
    """The buttons of the other modes come before the form's own, but Enter is not for them."""
    page.goto(f"{address}/designs/pin-profile?mode=check")
    page.fill('[name="name"]', "by the keyboard")
    page.press('[name="name"]', "Enter")
    page.wait_for_url("**/runs/*")
    assert page.locator("h1").inner_text() == "by the keyboard"


def test_pin_check_by_points_and_bushing(page, address):
    page.goto(f"{address}/designs/pin-profile?mode=check")
    page.get_by_label("a table of points").check()
    page.get_by_role("button", name="add a row").first.click()
    box(page, "from the end, mm, row 1").fill("0")
    box(page, "Bore, mm, row 1").fill("14")
    page.keyboard.press("Enter")
    box(page, "from the end, mm, row 2").fill("40")
    box(page, "Bore, mm, row 2").fill("12")
    expect(page.locator("#the-answer")).to_contain_text("It holds", timeout=60_000)
    assert "It holds" in send(page, "Check")
    page.goto(f"{address}/designs/pin-profile?mode=check")
    page.get_by_label("a bushing: its outside is in question").check()
    fill(page, "Bore", "12")
    expect(page.locator("#the-drawing title")).to_have_text("The bushing, cut along its axis, to scale")
    assert "hold" in send(page, "Check")


def test_pin_design(page, address):
    page.goto(f"{address}/designs/pin-profile?mode=design")
    page.get_by_label("Form sought").select_option("constant")
    assert not box(page, "Steps from each end").is_visible()
    page.get_by_role("checkbox", name="Deflection, at most").check()
    fill(page, "Deflection, at most", "60")
    assert "It holds" in send(page, "Design")


def test_linkage_check_by_its_lengths(page, address):
    page.goto(f"{address}/designs/impact-linkage?mode=check")
    page.get_by_label("its four lengths").check()
    assert not box(page, "Base/crank λ₀").is_visible()
    for label, text in {"Base": "60", "Crank": "20", "Coupler": "50", "Rocker": "30"}.items():
        fill(page, label, text)
    expect(page.locator('#the-drawing [data-for="lengths_mm.crank"]')).to_contain_text("crank 20")
    assert "hold" in send(page, "Check")


def test_linkage_design(page, address):
    page.goto(f"{address}/designs/impact-linkage?mode=design")
    page.get_by_label("longest link: the base").uncheck()
    page.get_by_label("Objective").select_option("longest_link")
    page.get_by_role("checkbox", name="Height of the box, at most").uncheck()
    assert "It holds" in send(page, "Design")


def test_crank_dynamics_and_its_worst_instant_as_the_load_of_a_pin(page, address):
    page.goto(f"{address}/designs/crank-dynamics?mode=analysis")
    page.get_by_role("checkbox", name="Several cylinders on one shaft").uncheck()
    assert not box(page, "Cylinders").is_visible()
    fill(page, "Name of this run", "the engine")
    send(page, "Analyse")
    page.goto(f"{address}/designs/pin-profile?mode=check")
    page.get_by_label("stored run of crank dynamics").check()
    page.get_by_label("Stored run", exact=True).select_option(index=1)
    page.get_by_label("Instant").select_option("gas_force_max")
    assert "hold" in send(page, "Check")


def test_crank_masses_by_weighing(page, address):
    page.goto(f"{address}/designs/crank-masses?mode=analysis")
    page.get_by_label("weighing both ends").check()
    fill(page, "Scale under the big end", "0,45")
    expect(page.locator("#the-answer")).to_contain_text("mass of the rod")
    send(page, "Analyse")
    assert "rod's mass at the crank pin" in page.locator("main").inner_text()


@pytest.mark.parametrize(
    ("slug", "mode", "label", "typed", "path", "drawn", "button"),
    [
        ("flexible-rod", "design", "Crank radius r", "1.4", "mechanism.crank_radius_mm", "r 1.4", "Design"),
        ("flexible-rod", "check", "Free length l", "22", "dimensions.l_mm", "l 22", "Check"),
        ("pin-profile", "design", "Outer diameter D", "22.5", "geometry.outer_diameter_mm", "ø 22.5", "Design"),
        ("pin-profile", "check", "Bore", "13", "bore_mm", "ø 13", "Check"),
        ("impact-linkage", "design", "Height of the box, at most", "140", "limits.height_mm", "≤ 140", "Design"),
        ("impact-linkage", "check", "Base/crank λ₀", "3.2", "ratios.lambda0", "base 74.075", "Check"),
        ("crank-dynamics", "analysis", "Rod length L", "150", "mechanism.rod_length_mm", "L 150", "Analyse"),
        ("crank-masses", "analysis", "Distance between the knife edges", "161", "pivot_distance_mm", "161", "Analyse"),
    ],
)
def test_a_value_is_changed_drawn_judged_and_changed_again(
    page, address, slug, mode, label, typed, path, drawn, button
):
    page.goto(f"{address}/designs/{slug}?mode={mode}")
    fill(page, label, typed)
    expect(page.locator(f'#the-drawing [data-for="{path}"]').first).to_contain_text(drawn)
    summary = send(page, button)
    assert mode == "analysis" or "It holds" in summary
    expect(page.locator("figure.drawing svg")).to_be_visible()
    expect(page.locator(f'.inputs div:has(dt:text-is("{label}")) dd')).to_contain_text(typed)
    first = page.url
    page.get_by_role("link", name=f"{button} again with changes").click()
    expect(box(page, label)).to_have_value(typed)
    fill(page, "Name of this run", "again")
    send(page, button)
    assert page.url != first
    expect(page.locator("h1")).to_have_text("again")


@pytest.mark.parametrize("slug", ["flexible-rod", "pin-profile", "impact-linkage", "crank-dynamics", "crank-masses"])
def test_no_form_is_wider_than_a_phone(page, address, slug):
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(f"{address}/designs/{slug}")
    for closed in page.locator("details").all():
        closed.evaluate("details => { details.open = true; }")
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
