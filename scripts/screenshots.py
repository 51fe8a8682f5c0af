"""Screenshots for the documentation: ``python -m scripts.screenshots`` writes docs/screenshots/*.png.

Starts a service with a temporary store and drives Chromium with playwright.
"""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Page, sync_playwright

from app.designs.kind import Mode
from app.designs.registry import KINDS

OUT = Path(__file__).parent.parent / "docs" / "screenshots"
_WIDE, _HIGH = 1280, 900
_START_TIMEOUT_S, _ANSWER_TIMEOUT_S = 120, 120


@contextmanager
def service() -> Iterator[str]:
    """Start a service and return its address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    base = f"http://127.0.0.1:{port}"
    with tempfile.TemporaryDirectory() as folder:
        command = [str(Path(sys.executable).with_name("crankwright")), "serve", "--port", str(port)]
        server = subprocess.Popen([*command, "--database-url", f"sqlite:///{folder}/runs.sqlite3"])
        try:
            deadline = time.monotonic() + _START_TIMEOUT_S
            while not _answers(f"{base}/healthz"):
                if server.poll() is not None or time.monotonic() > deadline:
                    raise SystemExit("the service does not start")
                time.sleep(0.2)
            yield base
        finally:
            server.terminate()
            server.wait(30)


def _answers(url: str) -> bool:
    try:
        urllib.request.urlopen(url, timeout=1)
    except OSError:
        return False
    return True


def solved(base: str, path: str, body: dict[str, Any]) -> str:
    """Create a run to be shown and return its id."""
    sent = urllib.request.Request(
        f"{base}/api/v1/{path}", json.dumps(body).encode(), {"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(sent, timeout=_ANSWER_TIMEOUT_S) as answer:
        return json.load(answer)["id"]


def taken(page: Page, url: str, name: str, high: int = _HIGH) -> None:
    """Take a screenshot once the page has loaded."""
    page.set_viewport_size({"width": _WIDE, "height": high})
    page.goto(url)
    page.wait_for_load_state("networkidle")
    for image in page.locator("figure img").all():
        image.scroll_into_view_if_needed()
    page.evaluate("scrollTo(0, 0)")
    page.wait_for_load_state("networkidle")
    page.screenshot(path=OUT / f"{name}.png")


def main() -> None:
    path = shutil.which("chromium-headless-shell") or shutil.which("chromium")
    if path is None:
        raise SystemExit("chromium is missing: run scripts/system-packages")
    OUT.mkdir(parents=True, exist_ok=True)
    with service() as base, sync_playwright() as playwright:
        rod = solved(base, "designs/flexible-rod", KINDS["flexible-rod"].example(Mode.DESIGN))
        pin = KINDS["pin-profile"].example(Mode.DESIGN)
        best = solved(base, "designs/pin-profile", {**pin, "name": "Pin, any bore", "form": {"kind": "free"}})
        plain = solved(base, "designs/pin-profile", {**pin, "name": "Pin, one bore", "form": {"kind": "constant"}})
        struck = solved(base, "designs/impact-linkage", KINDS["impact-linkage"].example(Mode.DESIGN))
        solved(base, "analyses/crank-dynamics", KINDS["crank-dynamics"].example(Mode.ANALYSIS))
        chromium = playwright.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-gpu"])
        page = chromium.new_page(color_scheme="light", reduced_motion="reduce")
        taken(page, f"{base}/", "start", 1000)
        taken(page, f"{base}/designs/flexible-rod?mode=check", "form")
        taken(page, f"{base}/runs/{rod}", "rod", 1500)
        taken(page, f"{base}/runs/{best}", "pin", 1500)
        taken(page, f"{base}/runs/{struck}", "linkage", 1500)
        taken(page, f"{base}/runs/compare?a={best}&b={plain}", "comparison", 1000)
        chromium.close()
    for picture in sorted(OUT.glob("*.png")):
        print(f"{picture.name}: {picture.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
