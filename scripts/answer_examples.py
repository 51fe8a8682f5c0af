"""Regenerate the example responses of the API reference: the kinds' examples, solved, with shortened lists.

python -m scripts.answer_examples
"""

from __future__ import annotations

import json
import tempfile
import time
from typing import Any

from app.api.contract import ANSWERS, PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS

_MAX_ITEMS = 2
_FIXED = {
    "id": "0193ab52-7c00-7000-8000-000000000000",
    "created_at": "2026-11-01T12:00:00.000000Z",
    "timing": {"solve_s": 0.05},
}
"""Fixed values for fields that differ between runs."""


def shortened(found: Any) -> Any:
    """Truncate every list to its first entries."""
    if isinstance(found, dict):
        return {key: shortened(value) for key, value in found.items()}
    return [shortened(value) for value in found[:_MAX_ITEMS]] if isinstance(found, list) else found


def answers() -> dict[str, Any]:
    """Example responses by kind and mode."""
    from starlette.testclient import TestClient

    from app.main import create_app
    from app.settings import Settings

    found = {}
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{folder}/runs.sqlite3"
        with TestClient(create_app(Settings(database_url=url, workers=1, allowed_hosts="testserver"))) as client:
            for slug, kind in KINDS.items():
                for mode in kind.jobs:
                    run = _answer(client, f"/api/v1/{PATHS[Mode(mode)]}/{slug}", kind.example(mode))
                    text = json.dumps(shortened(run)).replace(run["id"], _FIXED["id"])
                    found[f"{slug} {mode}"] = json.loads(text) | _FIXED
    return found


def _answer(client: Any, path: str, body: Any) -> Any:
    """The response, once the kernels are compiled."""
    while (response := client.post(path, json=body)).status_code == 503:
        time.sleep(1.0)
    return response.json()


def main() -> None:
    ANSWERS.write_text(json.dumps(answers(), indent=1, ensure_ascii=False) + "\n", "utf-8")


if __name__ == "__main__":
    main()
