"""Pages are fully translated into Russian and Ukrainian; the API stays English."""

from __future__ import annotations

import gettext
import re
from html.parser import HTMLParser

import pytest
from babel.messages.mofile import write_mo
from starlette.datastructures import Headers

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.web.forms.numbers import UNITS
from app.web.forms.tree import form_of
from app.web.languages import preferred
from app.web.rendering import templates
from app.words.languages import DOMAIN, LOCALE
from scripts.messages import TEMPLATES, catalogue, path_of, todo, updated

HTML = {"accept": "text/html"}
OTHERS = ("ru", "uk")
PLACEHOLDER = re.compile(r"%\(\w+\)s|\{\w*\}|%%")
_NOT_TRANSLATED = {
    "ISO", "SQP", "tau", "Clarabel", "Crankwright", "API",
    "JSON", "HTTP", "RFC", "POST", "GET", "UTC", "openapi.json", "problem", "details", "FKM",
    "CSV", "NDJSON", "Parquet", "CrMoV", "MnCr",
    "MPa", "N·m", "N·mm", "mm", "ms", "EN", "RU", "UK", "NUL", "api", "designs", "checks", "analyses", "body",
}  # fmt: skip


@pytest.mark.parametrize("code", OTHERS)
def test_everything_is_translated(code):
    stored, wanted = catalogue(code), updated(code)
    assert {each.id for each in stored} == {each.id for each in wanted}, "run `make messages`"
    assert todo(stored) == []


@pytest.mark.parametrize("code", OTHERS)
def test_the_compiled_catalogue_is_up_to_date(code, tmp_path):
    with (tmp_path / "now.mo").open("wb") as file:
        write_mo(file, catalogue(code))
    assert path_of(code, "mo").read_bytes() == (tmp_path / "now.mo").read_bytes(), "run `make messages`"


@pytest.mark.parametrize("code", OTHERS)
def test_placeholders_agree(code):
    for each in catalogue(code):
        ids = each.id if isinstance(each.id, tuple) else (each.id,)
        for text in each.string if isinstance(each.string, tuple) else (each.string,):
            assert each.id == "" or set(PLACEHOLDER.findall(text)) == set(PLACEHOLDER.findall(ids[0])), each.id


@pytest.mark.parametrize(("count", "ending"), [(1, "ь"), (2, "и"), (5, "ей"), (21, "ь")])
def test_plural_forms(count, ending):
    texts = gettext.translation(DOMAIN, LOCALE, ["ru"])
    said = texts.ngettext("%(count)s entry cannot be accepted", "%(count)s entries cannot be accepted", count)
    assert said.split()[1].endswith(ending)


_UNITS = {unit.lower() for own, others in UNITS.items() for unit in (own, *others)} | {
    "kg·m",
    "cos",
    "p_min",
    "data-off",
}


class _Words(HTMLParser):
    """Visible texts, and attributes read by screen readers."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self._silent = 0

    def handle_starttag(self, tag, attrs):
        known = dict(attrs)
        # User-given names are not translated.
        unspoken = known.get("lang") == "en" or known.get("translate") == "no"
        if tag in ("script", "style", "code", "pre") or unspoken or self._silent:
            self._silent += tag not in ("input", "link", "meta", "br", "img", "source")
        elif known.get("lang") not in ("en", "ru", "uk") or tag == "html":
            self.found += [known[name] for name in ("aria-label", "title", "placeholder", "alt") if known.get(name)]

    def handle_endtag(self, tag):
        self._silent -= bool(self._silent)

    def handle_data(self, data):
        if not self._silent:
            # Attributes written by a macro are separate in its template.
            self.found.append(re.sub(r'[\w-]+="[^"]*"?', "", data))


def english_in(page: str) -> list[str]:
    """Latin words other than names, units and symbols."""
    parser = _Words()
    parser.feed(page)
    found = (word for text in parser.found for word in re.findall(r"[A-Za-z][A-Za-z.·_-]{2,}", text))
    words = (word.rstrip(".") for word in found)
    known = {*_NOT_TRANSLATED, *_UNITS}
    return sorted({word for word in words if len(word) > 2 and not {word, word.lower()} & known})


@pytest.mark.parametrize("path", sorted(TEMPLATES.rglob("*.html")), ids=lambda path: str(path.relative_to(TEMPLATES)))
def test_templates_have_no_untranslated_texts(path):
    source, kept, inside = path.read_text("utf-8"), [], False
    for _line, token, value in templates.env.lexer.tokeniter(source, path.name):
        if token == "name" and value in ("trans", "endtrans"):
            inside = value == "trans"
        # Replace placeholders by a mark that is not a word.
        kept.append(value if token == "data" and not inside else "0" if token == "variable_begin" else "")
    assert english_in("".join(kept)) == []


@pytest.mark.parametrize("code", OTHERS)
@pytest.mark.parametrize(("slug", "mode"), [(slug, mode) for slug, kind in KINDS.items() for mode in kind.jobs])
def test_no_form_mixes_languages(client, code, slug, mode):
    page = client.get(f"/designs/{slug}?mode={mode}", headers={"accept-language": code}).text
    # User-given names, such as the example's, are not translated.
    assert f'<html lang="{code}">' in page
    assert english_in(page) == []


@pytest.fixture(scope="module")
def pin(client) -> dict:
    request = {**KINDS["pin-profile"].example(Mode.CHECK), "name": "", "load": {"force_n": 60000.0}}
    return client.post("/api/v1/checks/pin-profile", json=request, headers={"accept-language": "ru"}).json()


def test_a_verdict_is_worded_in_every_language(client, pin):
    assert pin["verdict"]["summary"].startswith("It does not hold: the equivalent stress of bending and shear is ")
    said = {code: client.get(f"/runs/{pin['id']}", headers={"accept-language": code}).text for code in OTHERS}
    figure = f"{next(c['reached'] for c in pin['verdict']['criteria'] if not c['holds']):.4g} MPa"
    assert (
        f"Условия не выполнены: эквивалентное напряжение изгиба и сдвига – {figure}, допускается не более" in said["ru"]
    )
    assert f"Умови не виконано: еквівалентне напруження згину та зсуву – {figure}, допускається не більше" in said["uk"]


def test_errors_are_in_the_language_of_the_form(client):
    headers = {"accept-language": "ru", **HTML}
    filled = {"variable": "bore", "given": "one", "geometry.outer_diameter_mm": "thick", "geometry.gap_mm": "-1"}
    page = client.post("/designs/pin-profile?mode=check", data=filled, headers=headers)
    assert page.status_code == 422
    assert "не число; числа – это 1.5, 1,5 и 1 500" in page.text
    assert "не заполнено" in page.text
    assert "вне допустимого: не менее 0" in page.text


@pytest.mark.parametrize(
    ("slug", "mode", "change", "said"),
    [
        ("flexible-rod", "design", {"bounds.h_mm.0": "7"}, "больше наибольшего (допускается: не более наибольшего)"),
        ("pin-profile", "check", {"bore_mm": ""}, "отверстие или профиль (допускается: одно из двух)"),
        ("impact-linkage", "check", {"ratios.lambda0": ""}, "отношения или длины (допускается: одно из двух)"),
        ("crank-dynamics", "analysis", {"pressure.indicator.strokes": "1\t2\tx"}, "ход 1, его точка 1, давление"),
    ],
)
def test_what_is_allowed_is_said_in_the_words_of_the_form(client, slug, mode, change, said):
    texts: dict[str, str] = {}
    form_of(KINDS[slug], Mode(mode)).take(KINDS[slug].example(Mode(mode)), texts)
    answer = client.post(f"/designs/{slug}/drawing?mode={mode}", data=texts | change, headers={"accept-language": "ru"})
    assert any(said in words for words in answer.json()["faults"].values()), answer.json()["faults"]


@pytest.mark.parametrize(
    ("cookie", "asked", "spoken"),
    [
        ("", "", "en"), ("", "ru", "ru"), ("", "uk-UA,uk;q=0.9,en;q=0.8", "uk"), ("", "de, en;q=0.2, ru;q=0.7", "ru"),
        ("uk", "ru", "uk"), ("xx", "ru", "ru"), ("", "ru;q=nonsense", "en"), ("", "ru;q=0", "en"), ("\0;=", "ru", "ru"),
    ],
)  # fmt: skip
def test_the_cookie_overrides_the_browser_language(cookie, asked, spoken):
    assert preferred(Headers({"cookie": f"language={cookie}", "accept-language": asked})) == spoken


@pytest.mark.parametrize("back", ["//elsewhere.example/", "https://elsewhere.example/", "/\\elsewhere.example", "x"])
def test_choosing_a_language_redirects_only_within_the_service(client, back):
    answer = client.get("/language/uk", params={"back": back}, follow_redirects=False)
    client.cookies.delete("language")
    assert (answer.status_code, answer.headers["location"]) == (303, "/")


def test_a_language_is_chosen_and_kept(client):
    answer = client.get("/language/uk", params={"back": "/runs?kind=pin-profile"}, follow_redirects=False)
    assert answer.headers["location"] == "/runs?kind=pin-profile"
    assert "language=uk" in answer.headers["set-cookie"]
    client.cookies.delete("language")
    assert client.get("/language/xx", headers=HTML).status_code == 404
