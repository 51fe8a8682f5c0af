"""Software bill of materials of the locked dependencies: CycloneDX 1.6 on standard output, or with --licences a table.

python -m scripts.sbom > sbom.json
python -m scripts.sbom --licences
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from importlib.metadata import Distribution, distributions
from pathlib import Path
from typing import Any

LOCK = Path(__file__).parent.parent / "requirements.lock"
_LINE = re.compile(r"^([A-Za-z0-9._-]+)(?:\[[^\]]*\])?==([^\s;\\]+)")
_HASH = re.compile(r"--hash=sha256:([0-9a-f]{64})")


def locked() -> dict[str, tuple[str, list[str]]]:
    """Version and hashes of each locked package, by name."""
    found: dict[str, tuple[str, list[str]]] = {}
    name = ""
    for line in LOCK.read_text("utf-8").splitlines():
        match = _LINE.match(line)
        if match:
            name = normalised(match[1])
            found[name] = (match[2], [])
        if name:
            found[name][1].extend(_HASH.findall(line))
    return found


def normalised(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def licence(package: Distribution) -> str:
    """The declared licence of a package: expression, classifiers, or the first words of its text."""
    told = package.metadata
    classified = [
        each.rpartition(" :: ")[2]
        for each in told.get_all("Classifier") or ()
        if each.startswith("License :: ") and each.count(" :: ") > 1
    ]
    free = (told.get("License") or "").strip().splitlines()
    return told.get("License-Expression") or ", ".join(classified) or (free[0][:80] if free else "not declared")


def components() -> list[dict[str, Any]]:
    """The locked packages with the licences of the installed versions."""
    installed = {normalised(each.metadata["Name"]): each for each in distributions()}
    found = []
    for name, (version, hashes) in sorted(locked().items()):
        package = installed.get(name)
        found.append(
            {
                "type": "library",
                "name": name,
                "version": version,
                "purl": f"pkg:pypi/{name}@{version}",
                "bom-ref": f"pkg:pypi/{name}@{version}",
                "licenses": [{"license": {"name": licence(package)}}] if package else [],
                "properties": [{"name": "crankwright:sha256", "value": each} for each in sorted(hashes)],
            }
        )
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--licences", action="store_true", help="a table of licences instead")
    if parser.parse_args().licences:
        for each in components():
            told = each["licenses"][0]["license"]["name"] if each["licenses"] else "not installed here"
            print(f"{each['name']:32} {each['version']:14} {told}")
        return
    from app.version import NAME, VERSION

    told = {"component": {"type": "application", "name": NAME, "version": VERSION}}
    document = {"bomFormat": "CycloneDX", "specVersion": "1.6", "version": 1, "metadata": told}
    json.dump({**document, "components": components()}, sys.stdout, indent=1)


if __name__ == "__main__":
    main()
