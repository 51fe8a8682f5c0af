"""What the service is made of: all that is locked has hashes and is listed; an audit that saw nothing is no success."""

from __future__ import annotations

import json
import subprocess

import pytest

from scripts import audit, sbom
from scripts.audit import told
from scripts.sbom import components, locked


def test_locked_packages_have_hashes_and_licences():
    packages = locked()
    assert len(packages) > 30 and all(hashes for _version, hashes in packages.values())
    listed = {each["name"]: each for each in components()}
    assert listed.keys() == packages.keys()


@pytest.mark.parametrize(
    ("dependencies", "code", "says"),
    [
        ([{"name": "a", "version": "1", "vulns": []}], 0, "1 of 1 packages were looked up, 0 known faults"),
        ([{"name": "a", "skip_reason": "not found"}], 2, "0 of 1 packages were looked up"),
        ([{"name": "a", "version": "1", "vulns": [{"id": "X-1", "fix_versions": ["2"]}]}], 1, "a 1: X-1, mended in 2"),
        ([], 2, "0 of 0 packages"),
    ],
)
def test_an_audit_reports_its_findings(dependencies, code, says):
    lines, found = told(dependencies)
    assert found == code and says in "\n".join(lines)


def test_an_audit_without_its_database_fails(monkeypatch, capsys):
    def unreachable(words, **_options):
        assert "pip_audit" in words and "--require-hashes" in words
        return subprocess.CompletedProcess(words, 1, "", "Traceback …\nConnectionError: no route to host\n")

    monkeypatch.setattr(subprocess, "run", unreachable)
    assert audit.main() == 2
    assert "were not looked up: ConnectionError: no route to host" in capsys.readouterr().out


def test_the_bill_of_materials_is_valid(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["sbom"])
    sbom.main()
    told = json.loads(capsys.readouterr().out)
    assert (told["bomFormat"], told["specVersion"]) == ("CycloneDX", "1.6")
    assert told["metadata"]["component"]["name"] == "crankwright"
    for each in told["components"]:
        assert (
            each["type"] == "library"
            and each["bom-ref"] == each["purl"] == f"pkg:pypi/{each['name']}@{each['version']}"
        )
        assert all(len(found["value"]) == 64 for found in each["properties"])
    monkeypatch.setattr("sys.argv", ["sbom", "--licences"])
    sbom.main()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(told["components"])
    assert any(line.startswith("numpy ") and "BSD" in line for line in lines)
