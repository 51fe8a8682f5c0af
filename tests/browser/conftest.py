"""The service as its command starts it, and a real browser, for all browser tests of one process."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from tests.child_processes import die_with_test_runner

FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
]


# A service that has just started loads its kernels while the first answers wait.
expect.set_options(timeout=30_000)


@pytest.fixture(scope="session")
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
    # On a busy machine a plot of many checks may take longer than a user would wait.
    environment = {**os.environ, "CRANKWRIGHT_SOLVE_BUDGET_S": "60"}
    server = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, preexec_fn=die_with_test_runner())
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


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Ended before other tests begin: the loop it runs would be in the way of those with loops of their own."""
    path = shutil.which("chromium-headless-shell") or shutil.which("chromium")
    assert path, "chromium is missing: run scripts/system-packages"
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield found
        found.close()


@pytest.fixture(scope="module")
def page(browser: Browser) -> Iterator[Page]:
    """A phone's width."""
    found = browser.new_page(viewport={"width": 420, "height": 900})
    yield found
    found.close()
