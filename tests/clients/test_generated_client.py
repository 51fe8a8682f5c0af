"""A client generated from the OpenAPI document without warnings designs a part."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from starlette.testclient import TestClient

from app.api.contract import document
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.main import create_app

_FILES = (
    "image/svg+xml", "application/x-ndjson", "text/csv", "application/vnd.apache.parquet", "text/event-stream",
)  # fmt: skip
"""Binary media types, for which the generator has no type."""
_CONFIG = {"content_type_overrides": dict.fromkeys(_FILES, "application/octet-stream"), "post_hooks": []}


@pytest.fixture(scope="module")
def described() -> dict:
    return document(create_app())


@pytest.fixture(scope="module")
def generated(described: dict, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("generated")
    (folder / "openapi.json").write_text(json.dumps(described))
    (folder / "config.json").write_text(json.dumps(_CONFIG))
    command = [sys.executable, "-m", "openapi_python_client", "generate", "--meta", "none", "--fail-on-warning"]
    command += ["--path", "openapi.json", "--config", "config.json", "--output-path", "crankwright_generated"]
    made = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    assert made.returncode == 0, made.stdout + made.stderr
    assert "warning" not in made.stdout.lower()
    return folder


def test_every_property_of_every_schema_is_described(described):
    schemas = described["components"]["schemas"]
    bare = [
        f"{name}.{field}"
        for name, schema in schemas.items()
        for field, part in schema.get("properties", {}).items()
        if not part.get("description")
    ]
    assert len(schemas) > 50 and not bare
    assert all(schema.get("title", name) == name for name, schema in schemas.items())


def test_all_operations_are_generated_and_one_designs_a_pin(generated, described, client: TestClient, monkeypatch):
    operations = [operation["operationId"] for methods in described["paths"].values() for operation in methods.values()]
    made = {path.stem for path in (generated / "crankwright_generated/api").rglob("*.py")} - {"__init__"}
    assert len(made) == len(set(operations)) == len(operations)

    monkeypatch.syspath_prepend(str(generated))
    package = importlib.import_module("crankwright_generated")
    models = importlib.import_module("crankwright_generated.models")
    design = importlib.import_module("crankwright_generated.api.pin_profile.design_pin_profile")
    ours = package.Client(base_url="http://testserver")
    ours.set_httpx_client(httpx.Client(base_url="http://testserver", transport=client._transport))
    spec = KINDS["pin-profile"].example(Mode.DESIGN)
    run = design.sync(client=ours, body=models.PinProfileDesignRequest.from_dict(spec))
    assert isinstance(run, models.PinProfileDesignRun)
    assert run.status == "succeeded" and run.verdict.holds
    assert run.result.mass_g == pytest.approx(run.figure.value)
