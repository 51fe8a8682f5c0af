"""Audit the locked dependencies for known vulnerabilities with pip-audit.

python -m scripts.audit

pip-audit exits with 0 even if its database is unreachable. Here the exit code is 0 only if every locked package was
checked and none is affected; 1 if one is; 2 if a package could not be checked.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

LOCK = Path(__file__).parent.parent / "requirements.lock"
_COMMAND = ("-m", "pip_audit", "--require-hashes", "--disable-pip", "--timeout", "10", "--format", "json", "-r")


def told(dependencies: Sequence[dict[str, Any]]) -> tuple[list[str], int]:
    """Report lines and the exit code."""
    skipped = [each["name"] for each in dependencies if "skip_reason" in each]
    faults = [
        f"{each['name']} {each['version']}: {fault['id']}, mended in {', '.join(fault['fix_versions']) or 'no version'}"
        for each in dependencies
        for fault in each.get("vulns", ())
    ]
    looked_up = len(dependencies) - len(skipped)
    lines = [*faults, f"{looked_up} of {len(dependencies)} packages were looked up, {len(faults)} known faults"]
    if skipped:
        lines.append(f"not looked up, the database does not know or cannot be reached: {', '.join(skipped)}")
    return lines, 1 if faults else 2 if skipped or not dependencies else 0


def main() -> int:
    run = subprocess.run([sys.executable, *_COMMAND, str(LOCK)], capture_output=True, text=True, check=False)
    try:
        dependencies = json.loads(run.stdout)["dependencies"]
    except (ValueError, KeyError):
        last = (run.stderr.strip() or "no answer").splitlines()[-1]
        print(f"known faults were not looked up: {last} (pip install pip-audit; it needs the network)")
        return 2
    lines, code = told(dependencies)
    print("\n".join(lines))
    return code


if __name__ == "__main__":
    sys.exit(main())
