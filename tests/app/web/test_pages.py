"""Pages without JavaScript."""

from __future__ import annotations

import re
import time


def test_start_page_leads_to_every_form(client):
    page = client.get("/").text
    for mode in ("check", "design"):
        assert f'href="/designs/flexible-rod?mode={mode}"' in page


def test_a_run_has_a_page(client, check_request):
    run = client.post("/api/v1/checks/flexible-rod", json=check_request).json()
    page = client.get(f"/runs/{run['id']}")
    assert "fatigue safety" in page.text
    assert "plots/stability-map" in page.text
    assert "default-src 'self'" in page.headers["content-security-policy"]


def test_a_study_is_one_button_away_from_a_run(client, check_request):
    run = client.post("/api/v1/checks/flexible-rod", json=check_request).json()
    assert f'action="/runs/{run["id"]}/accuracy"' in client.get(f"/runs/{run['id']}").text
    answer = client.post(f"/runs/{run['id']}/accuracy", follow_redirects=False)
    assert answer.status_code == 303
    page, looks = client.get(answer.headers["location"]).text, []
    deadline = time.monotonic() + 100
    while 'http-equiv="refresh"' in page:
        looks.append(page)
        assert time.monotonic() < deadline
        time.sleep(0.1)
        page = client.get(answer.headers["location"]).text
    # The page polled for progress while it ran, and no longer does.
    assert any(re.search(r"<progress value=.* of at most \d+ solutions, now ", look) for look in looks)
    assert "Accuracy and computing time" in page
    assert "smaller errors are not stated" in page
    assert "plots/error-against-time" in page
    # A study switches no effects, and its report has no calculation.
    assert "<h2>Effects" in page and "A button solves" not in page
    assert "calculation by hand" not in page and "/exports/html" in page
    study_id = answer.headers["location"].rpartition("/")[2]
    plot = client.get(f"/api/v1/runs/{study_id}/plots/error-against-time")
    assert plot.headers["content-type"] == "image/svg+xml"
    assert "asked for" in plot.text
    assert client.post(f"/runs/{study_id}/accuracy").status_code == 409
    assert client.post("/runs/none/accuracy").status_code == 404


def test_unknown_pages(client):
    assert client.get("/runs/none").status_code == 404
    assert client.get("/designs/none").status_code == 404
