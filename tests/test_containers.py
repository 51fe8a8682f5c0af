"""The container files: the compose file conforms to its schema, and the names in it exist in the project."""

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


def test_the_schema_detects_an_error():
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


STEPS = [
    (step.partition(" ")[0], step.partition(" ")[2])
    for step in re.sub(r"\\\n\s*", "", (ROOT / "Dockerfile").read_text("utf-8")).splitlines()
    if step and not step.startswith("#")
]
"""Of the Dockerfile: instruction and arguments."""
_PINNED = re.compile(r"[a-z/-]+:\d+\.\d+(\.\d+)?-[a-z-]+@sha256:[0-9a-f]{64}")
_SECRET = re.compile(r"password|secret|token|key", re.IGNORECASE)
SERVICES = COMPOSE["services"].items()


def test_images_are_pinned():
    named = [arguments for instruction, arguments in STEPS if instruction == "FROM"]
    named += [service["image"] for _, service in SERVICES if "image" in service]
    assert named and all(_PINNED.fullmatch(image) for image in named), named
    assert all(("image" in service) != ("build" in service) for _, service in SERVICES)


def test_the_image_runs_as_an_unprivileged_user():
    instructions = [instruction for instruction, _ in STEPS]
    (user,) = (arguments for instruction, arguments in STEPS if instruction == "USER")
    assert user not in ("root", "0")
    assert instructions.index("USER") < instructions.index("CMD")
    made = next(arguments for instruction, arguments in STEPS if instruction == "RUN" and "useradd" in arguments)
    assert f"--uid 10001 --create-home {user}" in made
    # Nothing but its data folder is its own.
    assert re.findall(r"chown (.+)$", made) == [f"{user} data"]
    assert [arguments for instruction, arguments in STEPS if instruction == "VOLUME"] == ["/srv/data"]


def test_the_image_installs_locked_packages_and_contains_no_secret():
    for instruction, arguments in STEPS:
        if instruction == "RUN":
            for installed in re.findall(r"pip install ([^&;]+)", arguments):
                assert any(word in installed for word in ("--require-hashes", "--no-deps", "--constraint")), installed
        if instruction in ("ENV", "ARG"):
            assert not _SECRET.search(arguments), arguments


@pytest.mark.parametrize(("name", "service"), SERVICES, ids=[name for name, _ in SERVICES])
def test_each_service_is_confined(name, service):
    assert service["read_only"] is True and "/tmp" in service["tmpfs"]
    assert service["cap_drop"] == ["ALL"] and "no-new-privileges:true" in service["security_opt"]
    assert not service.get("privileged") and not {"network_mode", "pid", "ipc", "devices"} & service.keys()
    # The database's own start gives its data to its user; no other service gets any right back.
    assert "cap_add" not in service or name == "database"
    assert service["pids_limit"] <= 512 and service["cpus"] <= 4 and service["mem_limit"].endswith("g")
    assert all(volume.partition(":")[0] in COMPOSE["volumes"] for volume in service.get("volumes", []))


@pytest.mark.parametrize(("name", "service"), SERVICES, ids=[name for name, _ in SERVICES])
def test_no_service_has_a_secret_in_its_environment_or_an_open_port(name, service):
    for variable, value in service.get("environment", {}).items():
        if _SECRET.search(variable):
            assert variable.endswith("_FILE") and value.startswith("/run/secrets/"), (name, variable)
        assert not re.search(r"://[^/@]*:[^/@]*@", str(value)), (name, variable)
    assert all(port.startswith("127.0.0.1:") for port in service.get("ports", []))
    assert all(secret in COMPOSE["secrets"] for secret in service.get("secrets", []))
    # Without keys, it may only be reachable from this machine.
    assert "CRANKWRIGHT_OPEN" not in service.get("environment", {}) or service["ports"]


def test_secrets_are_read_from_files_outside_the_image():
    assert all(set(secret) == {"file"} for secret in COMPOSE["secrets"].values())
    copied = " ".join(arguments for instruction, arguments in STEPS if instruction in ("COPY", "ADD"))
    assert "secrets" not in copied and copied.split()[0] != "."


def test_the_service_has_time_to_drain():
    from app.settings import Settings

    for _, service in SERVICES:
        assert int(service["stop_grace_period"].removesuffix("s")) > Settings().drain_s
