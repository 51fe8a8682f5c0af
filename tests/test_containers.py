"""The container files: the compose file against its schema, and what it names against the project."""

from __future__ import annotations

import json
import re
from pathlib import Path

import jsonschema
import pytest
import yaml

ROOT = Path(__file__).parents[1]
COMPOSE = yaml.safe_load((ROOT / "docker-compose.yml").read_text("utf-8"))
SCHEMA = json.loads((ROOT / "tests/data/compose-spec.json").read_text("utf-8"))


def test_the_compose_file_satisfies_the_schema():
    jsonschema.Draft7Validator(SCHEMA).validate(COMPOSE)


def test_the_schema_would_notice_a_fault():
    broken = json.loads(json.dumps(COMPOSE))
    broken["services"]["crankwright"]["no_such_key"] = 1
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft7Validator(SCHEMA).validate(broken)


def test_its_settings_exist_and_its_services_refer_to_one_another():
    from app.settings import Settings

    for service in COMPOSE["services"].values():
        for name in service.get("environment", {}):
            if name.startswith("CRANKWRIGHT_"):
                assert name.removeprefix("CRANKWRIGHT_").lower() in Settings.model_fields
        assert set(service.get("depends_on", {})) <= set(COMPOSE["services"])
        for volume in service.get("volumes", []):
            assert volume.partition(":")[0] in COMPOSE["volumes"]


def test_the_image_copies_what_exists():
    text = (ROOT / "Dockerfile").read_text("utf-8")
    for sources in re.findall(r"^COPY (.+) \S+$", text, re.MULTILINE):
        for source in sources.split():
            assert (ROOT / source).exists(), source
