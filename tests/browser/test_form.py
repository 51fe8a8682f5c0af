"""A person at a real browser: fill in the machine, submit, see the numbers and the stability map."""

from __future__ import annotations


def test_a_person_checks_his_machine(browser, address):
    page = browser.new_page(viewport={"width": 420, "height": 900})
    page.goto(f"{address}/designs/flexible-rod?mode=check")
    page.fill('[name="load.schmidt.delta"]', "1.5")
    page.get_by_role("button", name="Check", exact=True).click()
    assert "less than 1" in page.locator('[id="load.schmidt.delta-error"]').inner_text()
    page.fill('[name="load.schmidt.delta"]', "0.25")
    page.fill('[name="name"]', "mine")
    page.get_by_role("button", name="Check", exact=True).click()
    page.wait_for_selector(".headline", timeout=60_000)
    assert page.locator("h1").inner_text() == "mine"
    assert page.get_by_role("row", name="fatigue safety").locator("td").first.inner_text().startswith("2.70")
    page.wait_for_load_state("networkidle")
    pictures = page.locator("figure img").all()
    assert len(pictures) == 5
    for picture in pictures:  # each is loaded when it comes into view
        picture.scroll_into_view_if_needed()
        page.wait_for_function("i => i.complete && i.naturalWidth > 0", arg=picture.element_handle(), timeout=30_000)
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), "the page is wider than a phone"
