"""The README: its Python example, curl example and links work."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")


def block(language: str, number: int = 0) -> str:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)[number]


def test_the_python_call_prints_what_the_readme_says():
    done = subprocess.run(
        [sys.executable, "-c", block("python")], capture_output=True, text=True, cwd=ROOT, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == block("text").strip()


def test_the_curl_example_returns_what_the_readme_says(client):
    command = block("sh", 1)
    path = re.search(r"127\.0\.0\.1:8000(\S+)", command)
    file = re.search(r"@(\S+)", command)
    assert path
    assert file
    body = (ROOT / file[1].strip("'\"")).read_bytes()
    run = client.post(path[1], content=body, headers={"content-type": "application/json"}).json()
    told = json.loads(block("json"))
    assert {name: run["verdict"][name] for name in told} == told
    for name, value in json.loads(block("json", 1)).items():
        assert run["result"][name] == pytest.approx(value, rel=1e-3), name


def test_the_two_commands_exist():
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    assert {"run", "test"} <= targets
    assert "make run" in block("sh")
    assert "make test" in block("sh")


@pytest.mark.parametrize(
    "page", ["README.md", *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs").rglob("*.md"))]
)
def test_links_between_documents_resolve(page):
    text = (ROOT / page).read_text("utf-8")
    for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", text):
        if not target.startswith("http"):
            assert ((ROOT / page).parent / target).exists(), target


def test_the_index_of_decisions_lists_every_page_with_its_title():
    pages = ROOT / "docs/decisions"
    index = " ".join((pages / "README.md").read_text("utf-8").split())
    for page in sorted(pages.glob("0*.md")):
        number, title = page.read_text("utf-8").partition("\n")[0].removeprefix("# ").split(". ", 1)
        assert f"- [{number}]({page.name}) {title}" in index, page.name


def test_the_map_of_the_code_names_what_exists():
    for name in re.findall(r"`((?:solvers|app|migrations|tests|docs|bench|scripts)/[\w/.]*)`", README):
        assert (ROOT / name).exists(), name


def test_every_effect_setting_command_and_export_is_documented():
    from app.cli import app as cli
    from app.exports.registry import EXPORTS
    from app.settings import Settings
    from solvers import rod

    theory = (ROOT / "docs/theory/flexible-rod.md").read_text("utf-8")
    guide = (ROOT / "docs/service.md").read_text("utf-8")
    for effect in rod.EFFECTS:
        assert f"`{effect.name}`" in theory
    for name in Settings.model_fields:
        assert f"`CRANKWRIGHT_{name.upper()}`" in guide
    for command in cli.registered_commands:
        assert f"crankwright {command.name or command.callback.__name__}" in guide
    exports = (ROOT / "docs/exports.md").read_text("utf-8")
    for name in EXPORTS:
        assert f"| `{name}` |" in exports
