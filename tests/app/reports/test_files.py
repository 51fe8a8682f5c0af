"""Report files: complete, two to six pages, safe for any user text, fast to make."""

from __future__ import annotations

import json
import re
import time
from datetime import datetime
from html.parser import HTMLParser

import pytest
from pypdfium2 import PdfDocument

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.names import cleaned
from app.reports.build import report_of
from app.reports.html import html
from app.reports.pdf import pdf
from app.reports.text import for_typst
from tests.app.reports.runs import EXAMPLES, OTHERS, example, solved
from tests.app.serving import file_at

HOSTILE = [
    "#import \"/etc/passwd\": *",
    "#read(\"/etc/passwd\") $ #panic() $ ]] } ) \\\" \" ' \\",
    "<script>alert(1)</script><img src=x onerror=alert(1)>",
    "</title></style><b>&amp; \"quoted\" `code` *bold* _soft_ @cite <label> // no comment /* nor this */",
    "a\u202eb\u2066c\x1b[0m\nsecond line\tand a tab",
    "מסמך עברי و عربي 漢字 кириллица",
    "W" * 200,
    "",
]  # fmt: skip


def pdf_of(run: dict) -> PdfDocument:
    return PdfDocument(pdf(report_of(run), datetime.fromisoformat(run["created_at"])))


def text_of(document: PdfDocument) -> str:
    return " ".join(" ".join(page.get_textpage().get_text_bounded() for page in document).split())


def request_in(document: PdfDocument) -> dict:
    """The request that is attached to a report, its only attachment."""
    assert document.count_attachments() == 1
    attachment = document.get_attachment(0)
    assert attachment.get_name() == "request.json"
    return json.loads(bytes(attachment.get_data()))


class Page(HTMLParser):
    """Collects the elements of a page and the URLs in its attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags, self.points, self.handlers, self.words = set(), set(), set(), []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list) -> None:
        self.tags.add(tag)
        self.points |= {value for name, value in attributes if name in ("src", "href", "srcset", "action", "data")}
        self.handlers |= {name for name, _ in attributes if name.startswith("on")}

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.mark.parametrize(("slug", "mode", "title"), EXAMPLES + OTHERS)
def test_a_report_has_its_parts_in_order_on_two_to_six_pages(slug, mode, title):
    run = example(slug, mode, title)
    document = pdf_of(run)
    text = text_of(document)
    assert 2 <= len(document) <= 6
    parts = ["Inputs", "The calculation, step by step", "Results", "Accuracy", "Sources", "To repeat this"]
    place = 0
    for part in parts:
        place = text.index(part, place)
    if run["verdict"]:
        assert text.index(run["verdict"]["summary"][:40]) < text.index(parts[0])
    if run["effects"]:
        assert all(e["name"].replace("_", " ") in text for e in run["effects"])
    assert run["spec_hash"] in text and run["id"] in text
    assert request_in(document) == run["spec"]


@pytest.mark.parametrize("name", HOSTILE)
def test_user_text_is_never_markup(name):
    spec = {**KINDS["crank-masses"].example(Mode.ANALYSIS), "name": name}
    run = solved("crank-masses", Mode.ANALYSIS, spec)
    page = Page(html(report_of(run)))
    plain = Page(html(report_of(example("crank-masses", Mode.ANALYSIS))))
    assert page.tags == plain.tags and not page.handlers
    assert "root:" not in "".join(page.words)
    document = pdf_of(run)
    text = text_of(document)
    assert "root:" not in text
    assert request_in(document)["name"] == cleaned(name)
    if name.startswith(("#", "<")):
        squeezed = re.sub(r"\s", "", text)
        assert re.sub(r"\s", "", name)[:40] in squeezed
        assert name in "".join(page.words)


def test_the_page_is_self_contained():
    for slug, mode, title in EXAMPLES:
        page = html(report_of(example(slug, mode, title)))
        found = Page(page)
        assert not {"script", "link", "iframe", "object", "form", "base"} & found.tags
        assert all(point.startswith("data:image/svg+xml;base64,") for point in found.points)
        assert not re.search(r"url\(|@import", page)


def test_strings_are_escaped():
    assert for_typst('a"b\\c\n') == '"a\\"b\\\\c "'


def test_reports_of_missing_runs_and_of_studies():
    spec = KINDS["pin-profile"].example(Mode.DESIGN)
    infeasible = solved("pin-profile", Mode.DESIGN, {**spec, "load": {"force_n": 1e6}})
    assert infeasible["status"] == "infeasible"
    text = text_of(pdf_of(infeasible))
    assert "No design meets all requirements" in text and "attainable" in text
    spec = {"spec": KINDS["pin-profile"].example(Mode.CHECK), "study_budget_s": 0.5}
    text = text_of(pdf_of(solved("pin-profile", Mode.ACCURACY, spec)))
    assert "greatest error" in text
    buckled = {**KINDS["flexible-rod"].example(Mode.CHECK), "dimensions": {"b_mm": 9.0, "h_mm": 0.2, "l_mm": 40.0}}
    text = text_of(pdf_of(solved("flexible-rod", Mode.CHECK, buckled)))
    assert "Does not hold" in text and "The strip buckles" in text


def test_the_same_run_gives_the_same_file_within_a_second():
    run = example("flexible-rod", Mode.CHECK)
    made = datetime.fromisoformat(run["created_at"])
    first = pdf(report_of(run), made)
    began = time.process_time()
    again, page = pdf(report_of(run), made), html(report_of(run))
    assert time.process_time() - began < 1.0
    assert again == first and page == html(report_of(run))


def test_the_service_serves_both_files(client):
    run = client.post("/api/v1/checks/flexible-rod", json=KINDS["flexible-rod"].example(Mode.CHECK)).json()
    page = file_at(client, run["links"]["exports"]["html"])
    assert page.status_code == 200 and page.headers["content-type"].startswith("text/html")
    assert run["verdict"]["summary"] in "".join(Page(page.text).words)
    file = file_at(client, run["links"]["exports"]["pdf"])
    assert file.headers["content-type"] == "application/pdf"
    assert f"flexible-rod-{run['id']}.pdf" in file.headers["content-disposition"]
    assert len(PdfDocument(file.content)) <= 6


def test_a_run_from_before_answers_said_whether_their_accuracy_was_met_has_a_report() -> None:
    run = example("pin-profile", Mode.CHECK) | {"verdict": None, "holds": None}
    del run["accuracy"]["met"]
    assert ": met (sections" in text_of(pdf_of(run))
    run["accuracy"]["estimated"] = 1e-3
    assert ": not met (sections" in text_of(pdf_of(run))
