"""Tracked files contain no machine-specific paths or registry hosts."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[1]
FORBIDDEN = re.compile(r"(?<![\w./-])/(?:work|root|home|tmp)/\w|https?://(?:pypi|files\.pythonhosted|registry\.npmjs)")


def test_no_tracked_file_contains_a_machine_path_or_a_registry():
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    for name in filter(None, names.split("\0")):
        text = (ROOT / name).read_text("utf-8", errors="replace") if (ROOT / name).exists() else ""
        found = FORBIDDEN.search(text)
        assert name == "tests/test_words.py" or not found, f"{name}: {found and found.group()}"
