"""Make anew the answers that the API reference shows: every kind's own examples, solved, lists cut short.

python -m scripts.answer_examples
"""

from __future__ import annotations

import json
import tempfile
from typing import Any

from app.api.contract import ANSWERS, PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS

_LONGEST = 2
_ALWAYS = {
    "id": "0193ab52-7c00-7000-8000-000000000000",
    "created_at": "2026-11-01T12:00:00.000000Z",
    "timing": {"solve_s": 0.05},
}
"""What no two solves have alike."""


def shortened(found: Any) -> Any:
    """The same with the first few entries of every list."""
    if isinstance(found, dict):
        return {key: shortened(value) for key, value in found.items()}
    return [shortened(value) for value in found[:_LONGEST]] if isinstance(found, list) else found


def answers() -> dict[str, Any]:
    """By kind and mode, as the service answers them."""
    from starlette.testclient import TestClient

    from app.main import create_app
    from app.settings import Settings

    found = {}
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{folder}/runs.sqlite3"
        with TestClient(create_app(Settings(database_url=url, workers=1, allowed_hosts="testserver"))) as client:
            for slug, kind in KINDS.items():
                for mode in kind.jobs:
                    run = client.post(f"/api/v1/{PATHS[Mode(mode)]}/{slug}", json=kind.example(mode)).json()
                    text = json.dumps(shortened(run)).replace(run["id"], _ALWAYS["id"])
                    found[f"{slug} {mode}"] = json.loads(text) | _ALWAYS
    return found


def main() -> None:
    ANSWERS.write_text(json.dumps(answers(), indent=1, ensure_ascii=False) + "\n", "utf-8")


if __name__ == "__main__":
    main()
