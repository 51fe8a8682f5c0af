"""A person at a real browser: fill in the machine, submit, see the numbers and the stability map."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, sync_playwright

FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
]


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The service as its command starts it."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    folder = tmp_path_factory.mktemp("browser")
    command = [
        str(Path(sys.executable).with_name("crankwright")), "serve", "--port", str(port),
        "--database-url", f"sqlite:///{folder}/runs.sqlite3",
    ]  # fmt: skip
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    base = f"http://127.0.0.1:{port}"
    try:
        deadline = time.monotonic() + 60
        while True:
            try:
                urllib.request.urlopen(f"{base}/healthz", timeout=1)
                break
            except OSError:
                assert server.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.1)
        yield base
    finally:
        server.terminate()
        server.wait(20)


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    path = shutil.which("chromium")
    assert path, "chromium is missing: run scripts/system-packages"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser.new_page(viewport={"width": 420, "height": 900})
        browser.close()


def test_a_person_checks_his_machine(page, address):
    page.goto(f"{address}/designs/flexible-rod?mode=check")
    page.fill('[name="load.delta"]', "1.5")
    page.get_by_role("button", name="Check").click()
    assert "less than 1" in page.locator(".error").inner_text()
    page.fill('[name="load.delta"]', "0.25")
    page.fill('[name="name"]', "mine")
    page.get_by_role("button", name="Check").click()
    page.wait_for_selector(".headline", timeout=60_000)
    assert page.locator("h1").inner_text() == "mine"
    assert page.get_by_role("row", name="fatigue safety").locator("td").first.inner_text().startswith("2.70")
    page.wait_for_load_state("networkidle")
    drawn = page.locator("figure img").evaluate_all("images => images.map(i => i.complete && i.naturalWidth > 0)")
    assert drawn == [True, True]
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), "the page is wider than a phone"
