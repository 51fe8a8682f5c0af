"""When the service requires keys, and when it refuses to start without."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from app.access.protection import UnprotectedService, check_protected
from app.cli import app
from app.settings import Settings
from app.store.repository import RunStore
from tests.app.access.keyed import bearer, keyed
from tests.databases import sqlite_database


@pytest.fixture
def url(tmp_path: Path) -> str:
    return sqlite_database(tmp_path)


def command(*words: str):
    return CliRunner().invoke(app, list(words))


@pytest.mark.parametrize("host", ["127.0.0.1", "::1", "localhost"])
def test_loopback_needs_no_keys(url, host):
    with RunStore(url) as store:
        check_protected(Settings(host=host), store)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.1", "a.example"])
def test_other_addresses_need_a_key_or_the_open_setting(url, host):
    with RunStore(url) as store:
        with pytest.raises(UnprotectedService, match="keys create"):
            check_protected(Settings(host=host), store)
        check_protected(Settings(host=host, open=True), store)
    made = command("keys", "create", "first", "--database-url", url)
    with RunStore(url) as store:
        check_protected(Settings(host=host), store)
    assert command("keys", "revoke", made.stderr.split()[1], "--database-url", url).exit_code == 0
    with RunStore(url) as store, pytest.raises(UnprotectedService):
        check_protected(Settings(host=host), store)


def test_keys_on_the_command_line(url):
    made = command("keys", "create", "the\x1b[31m lab", "--scope", "read", "--scope", "batch", "--database-url", url)
    assert made.exit_code == 0 and made.stdout.strip().startswith("cw_")
    listed = command("keys", "list", "--database-url", url).stdout
    assert "read batch  the[31m lab" in listed and "valid" in listed and made.stdout.strip() not in listed
    assert command("keys", "create", "x", "--scope", "all", "--database-url", url).exit_code == 2
    for nobody in ("", " ", "\u200b"):
        assert command("keys", "create", nobody, "--database-url", url).exit_code == 2
    key_id = listed.split()[0]
    assert "is revoked" in command("keys", "revoke", key_id, "--database-url", url).stdout
    assert "already" in command("keys", "revoke", key_id, "--database-url", url).stdout
    assert command("keys", "revoke", "none", "--database-url", url).exit_code == 2
    noted = command("audit", "--database-url", url).stdout
    assert noted.index("key.revoke") < noted.index("key.create")


def test_a_local_service_requires_keys_once_any_exist_unless_open(tmp_path):
    for is_open, statuses in ((False, [200, 401, 200]), (True, [200, 200, 200])):
        folder = tmp_path / str(is_open)
        folder.mkdir()
        with keyed(folder, open=is_open) as service:
            found = [service.client.get("/api/v1/runs").status_code]
            from app.access import keys as keys_module
            from app.access.scopes import Scope

            service.client.app.state.keys._any = (0.0, False)
            assert keys_module._CACHE_S <= 5
            key, _ = service.key(Scope.READ)
            found.append(service.client.get("/api/v1/runs").status_code)
            found.append(service.client.get("/api/v1/runs", headers=bearer(key)).status_code)
            assert found == statuses
