"""What the service is made of: all that is locked has hashes and is listed; an audit that saw nothing is no success."""

from __future__ import annotations

import pytest

from scripts.audit import told
from scripts.sbom import components, locked


def test_everything_locked_has_hashes_and_is_listed_with_its_licence():
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
def test_an_audit_says_what_it_saw(dependencies, code, says):
    lines, found = told(dependencies)
    assert found == code and says in "\n".join(lines)
