"""What was typed survives another language and other units."""

from __future__ import annotations

import html
import json
import re

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.web.forms.switching import in_language, in_units
from app.web.forms.tree import form_of
from app.words.languages import Language, speaking
from app.words.units import System, measuring
from tests.app.web.test_forms import JOBS, inputs, texts_of


@pytest.mark.parametrize(("slug", "mode"), JOBS)
def test_a_form_in_other_units_means_the_same(slug, mode):
    metric = form_of(KINDS[slug], Mode(mode))
    texts = texts_of(slug, mode)
    meant = metric.value(texts)
    converted = in_units(metric, texts, System.INCH)
    with measuring(System.INCH):
        inch = form_of(KINDS[slug], Mode(mode))
        assert inch.value(converted) == meant
        again = in_units(inch, converted, System.METRIC)
    assert metric.value(again) == meant


def test_figures_are_converted_and_everything_else_stays_as_typed():
    form = form_of(KINDS["pin-profile"], Mode.CHECK)
    typed = {
        "geometry.outer_diameter_mm": "12,7",
        "geometry.boss_length_mm": "0.5 in",
        "geometry.gap_mm": "about 2",
        "geometry.small_end_length_mm": "1 270",
        "load.load.force_n": "5e3",
        "name": "25.4",
    }
    found = in_units(form, typed, System.INCH)
    assert {name: found[name] for name in typed} == typed | {
        "geometry.outer_diameter_mm": "0.5",
        "geometry.small_end_length_mm": "50",
    }


def test_tables_are_converted_cell_by_cell():
    form = form_of(KINDS["pin-profile"], Mode.CHECK)
    found = in_units(form, {"profile.bore": "0\t12.7\n25,4\tx\n\n10"}, System.INCH)["profile.bore"]
    assert found.split("\n") == ["0\t0.5", "1\tx", "", "0.393700787402"]


@pytest.mark.parametrize(("now", "chosen"), [(Language.RU, Language.EN), (Language.EN, Language.RU)])
@pytest.mark.parametrize("stock", ["0,5", "0,5; 0,6", "0.5, 0.6", "0,5,0,6", "0,5 0,6 0,7", "1,250"])
def test_commas_mean_the_same_in_another_language(now, chosen, stock):
    typed = {"stock_h_mm": stock, "mechanism.speed_hz": "49,5", "name": "1,5; 2"}
    form = form_of(KINDS["flexible-rod"], Mode.DESIGN)
    with speaking(now):
        meant, texts = form.value(typed), in_language(form, typed, chosen)
    with speaking(chosen):
        assert form.value(texts) == meant
    assert texts["name"] == typed["name"]


@pytest.mark.parametrize(
    ("switch", "cookie", "diameter"), [("language=uk", "language=uk", "12.7"), ("units=inch", "units=inch", "0.5")]
)
def test_the_page_keeps_what_was_typed(client, switch, cookie, diameter):
    page = client.get("/designs/pin-profile?mode=check").text
    buttons = [html.unescape(address) for address in re.findall(r'formaction="([^"]+)"', page)]
    (address,) = [address for address in buttons if address.endswith(switch)]
    texts = texts_of("pin-profile", "check") | {
        "geometry.outer_diameter_mm": "12.7",
        "load.load.force_n": "many",
        "name": "N",
    }
    try:
        answer = client.post(address, data=texts)
    finally:
        client.cookies.clear()
    assert answer.status_code == 200
    assert cookie in answer.headers["set-cookie"]
    shown = inputs(answer.text)
    assert shown["geometry.outer_diameter_mm"] == diameter
    assert shown["load.load.force_n"] == "many"
    assert 'value="N"' in answer.text
    if "uk" in switch:
        assert '<html lang="uk">' in answer.text
        assert answer.headers["content-language"] == "uk"


def test_a_form_means_what_its_page_said_although_units_and_language_were_switched_since(client):
    address = "/designs/flexible-rod/drawing?mode=design"
    texts = texts_of("flexible-rod", "design") | {"mechanism.rod_length_mm": "46", "stock_h_mm": "0,5 0,6"}
    client.cookies.update({"units": "inch", "language": "en"})
    try:
        assert 'name="shown_in.inch" value="en"' in client.get("/designs/flexible-rod?mode=design").text
        spec = json.loads(client.post(address, data=texts | {"shown_in.metric": "ru"}).json()["json"])
        assert (spec["mechanism"]["rod_length_mm"], spec["stock_h_mm"]) == (46.0, [0.5, 0.6])
        spec = json.loads(client.post(address, data=texts).json()["json"])
        assert spec["mechanism"]["rod_length_mm"] == 1168.4
    finally:
        client.cookies.clear()
