"""An interrupted campaign is resumed; one with changed sources is restarted."""

from __future__ import annotations

import io
import re
import shutil
from pathlib import Path

import pytest

from bench.campaign import __main__ as campaign
from bench.campaign import kept
from bench.campaign.honesty import Judged
from bench.campaign.scenes import DRAWN
from bench.campaign.seeds import CHOICE, CONTEST, ESTIMATE, Part

ROOT = Path(__file__).parents[2]


def parts_of(seed: int) -> list[Part]:
    return [Part(seed, ESTIMATE, 1.5, Judged(1e-3, 1e-4, 1e-5, 0.0)), Part(seed, CHOICE, 0.5, None, "took too long")]


@pytest.fixture
def sources(tmp_path):
    """A copy of all sources that affect verdicts."""
    for folder in kept._SOURCES:
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__", "*.json"))
    return tmp_path


def test_added_results_are_read_back(tmp_path):
    path = tmp_path / "folder" / "parts"
    first = kept.Kept(path)
    assert first.parts == []
    first.add(parts_of(1))
    first.add(parts_of(2))
    again = kept.Kept(path)
    assert again.parts == [*parts_of(1), *parts_of(2)] and again.seeds == {1, 2}


@pytest.mark.parametrize("lost", [1, 20, -1])
def test_a_truncated_batch_is_overwritten_and_others_are_kept(tmp_path, lost):
    path = tmp_path / "parts"
    kept.Kept(path).add(parts_of(1))
    whole = path.stat().st_size
    kept.Kept(path).add(parts_of(2))
    written = path.read_bytes()
    path.write_bytes(written[: whole + lost] if lost > 0 else written[:-1] + b"?")
    torn = kept.Kept(path)
    assert torn.seeds == {1}
    torn.add(parts_of(3))
    assert kept.Kept(path).seeds == {1, 3}


def test_a_failed_write_keeps_earlier_results(tmp_path, monkeypatch):
    path = tmp_path / "parts"
    known = kept.Kept(path)
    known.add(parts_of(1))

    class Full(io.FileIO):
        """A disk that fails after a few more bytes."""

        def write(self, data):
            super().write(bytes(data)[:30])
            raise OSError("no space left")

    with monkeypatch.context() as disk:
        disk.setattr(Path, "open", lambda self, mode: Full(self, mode))
        with pytest.raises(OSError, match="no space"):
            known.add(parts_of(2))
    assert known.seeds == kept.Kept(path).seeds == {1}
    known.add(parts_of(3))
    assert kept.Kept(path).parts == known.parts == [*parts_of(1), *parts_of(3)]


@pytest.mark.parametrize(
    ("source", "concerned"),
    [
        ("solvers/pin/load/macaulay.py", {"pin-profile"}),
        ("solvers/references/rod_check.py", {"flexible-rod"}),
        ("solvers/crank/motion/slider_crank.py", {"crank-dynamics", "flexible-rod"}),
        ("app/designs/impact_linkage/kind.py", {"impact-linkage"}),
        ("bench/campaign/linkage_designs.py", {"impact-linkage"}),
        ("solvers/numerics/periodic.py", set(DRAWN)),
        ("solvers/effects.py", set(DRAWN)),
        ("bench/campaign/honesty.py", set(DRAWN)),
        ("bench/campaign/page.py", set()),
        ("app/designs/pictures/chart.py", set()),
        ("app/designs/impact_linkage/mechanism_picture.py", set()),
    ],
)
def test_changed_sources_restart_only_dependent_kinds(sources, source, concerned):
    before = {slug: kept.fingerprint(slug, 300.0, sources) for slug in DRAWN}
    with (sources / source).open("a") as file:
        file.write("# changed\n")
    assert {slug for slug in DRAWN if kept.fingerprint(slug, 300.0, sources) != before[slug]} == concerned


@pytest.mark.parametrize(
    ("source", "concerned"),
    [
        ("solvers/linkage/loads/crank_torque.py", {"impact-linkage"}),
        ("solvers/rod/piston/pin.py", {"flexible-rod"}),
        ("solvers/fatigue/crank.py", set(DRAWN)),
        ("solvers/references/crank/motion.py", {"crank-dynamics", "flexible-rod"}),
        ("bench/campaign/judging/pin.py", set(DRAWN)),
        ("oracles/dense/rod_states.py", {"flexible-rod"}),
        ("oracles/scenes.py", set(DRAWN)),
    ],
)
def test_a_new_file_belongs_to_the_kind_in_whose_folder_it_lies(sources, source, concerned):
    before = {slug: kept.fingerprint(slug, 300.0, sources) for slug in DRAWN}
    (sources / source).parent.mkdir(parents=True, exist_ok=True)
    (sources / source).write_text("# new\n")
    assert {slug for slug in DRAWN if kept.fingerprint(slug, 300.0, sources) != before[slug]} == concerned


def test_the_fingerprint_covers_all_judging_sources():
    """All repository modules imported by the campaign and the kinds are in the hashed folders."""
    folders = tuple(place.removesuffix(".py").replace("/", ".") for place in (*kept._SOURCES, kept._PROBLEMS))
    wanted = re.compile(r"^\s*(?:from|import) ((?:app|bench|solvers|tests|oracles)[\w.]*)", re.MULTILINE)
    for folder in ("app/designs", "bench/campaign"):
        for path in (ROOT / folder).rglob("*.py"):
            for name in wanted.findall(path.read_text("utf-8")):
                # Names and logging do not affect verdicts.
                assert name.startswith((*folders, "app.names", "app.logging")), f"{path.name} imports {name}"


def test_the_fingerprint_depends_on_kind_and_time_limit(sources):
    assert kept.OWN.keys() == DRAWN.keys()
    assert len({kept.fingerprint(slug, limit, sources) for slug in DRAWN for limit in (1.0, 2.0)}) == 2 * len(DRAWN)


@pytest.mark.parametrize("slug", DRAWN)
def test_the_fingerprint_covers_all_imports(slug):
    """Solver modules imported directly or transitively by the kind's own modules."""
    others = frozenset().union(*kept.OWN.values()) - kept.OWN[slug]
    waiting = [p for name in kept.OWN[slug] for p in ROOT.glob(f"solvers/{name}/**/*.py")]
    waiting += (ROOT / "app/designs" / slug.replace("-", "_")).rglob("*.py")
    text = "\n".join(path.read_text("utf-8") for path in waiting)
    assert waiting
    assert [name for name in others if f"solvers.{name}" in text or f"solvers import {name}" in text] == []


def test_a_campaign_is_resumed(tmp_path, monkeypatch):
    begun = []

    def judged(_slug, seeds, _limit, _seconds, _processes):
        for seed in seeds:
            begun.append(seed)
            yield parts_of(seed)

    class Interrupted(Exception):
        pass

    def interrupted(*given):
        for found in judged(*given):
            if begun[-1] == 13:
                raise Interrupted
            yield found

    monkeypatch.setattr(campaign, "PAGE", tmp_path / "page.md")
    monkeypatch.setattr(campaign, "kept", lambda _slug, _limit: kept.Kept(tmp_path / "parts"))
    monkeypatch.setattr(campaign, "judged", interrupted)
    with pytest.raises(Interrupted):
        campaign.run("pin-profile", 5, 10, 1.0, 60.0, 1)
    monkeypatch.setattr(campaign, "judged", judged)
    campaign.run("pin-profile", 5, 10, 1.0, 60.0, 1)
    assert begun == [10, 11, 12, 13, 13, 14]
    assert "5 scenes, of which 0 have no answer; they took 10 s together" in (tmp_path / "page.md").read_text()
    campaign.run("pin-profile", 2, 13, 1.0, 60.0, 1)
    assert len(begun) == 6
    assert "2 scenes, of which 0 have no answer; they took 4 s together" in (tmp_path / "page.md").read_text()


@pytest.mark.parametrize(("seeds", "told"), [([3, 999], (3, 999)), ([3, 1000], (3, 1000)), ([1464], (1464,))])
def test_contests_of_further_problems_are_printed_and_stay_off_the_page(seeds, told, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(campaign, "PAGE", tmp_path / "page.md")
    monkeypatch.setattr(campaign, "kept", lambda *_: kept.Kept(tmp_path / "parts"))
    monkeypatch.setattr(campaign, "judged", lambda _, seeds, *__, **___: ([Part(s, CONTEST, 1.0, None)] for s in seeds))
    campaign.run_contests(seeds, 1.0, 60.0, 1)
    assert f"{len(told)} problems of `python -m bench.rod_problems`, seeds {told[0]:,} to" in capsys.readouterr().out
    assert (tmp_path / "page.md").exists() == all(seed < 1000 for seed in seeds)
