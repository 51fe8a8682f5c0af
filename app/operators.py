"""Operator commands: keys, audit log, backup, pruning."""

from __future__ import annotations

import getpass
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from app.store.repository import RunStore
    from app.store.verify import Report

DATABASE = "sqlite:///crankwright.sqlite3"
DatabaseUrl = Annotated[
    str, typer.Option(envvar="CRANKWRIGHT_DATABASE_URL", help="where runs are stored (SQLAlchemy URL)")
]

keys = typer.Typer(name="keys", help="Keys of the API and the pages.", no_args_is_help=True, rich_markup_mode=None)


@contextmanager
def opened(database_url: str) -> Iterator[RunStore]:
    """Open an existing store, migrated. Raises MissingDatabase."""
    from app.store.engine import check_exists
    from app.store.migrate import upgrade
    from app.store.repository import RunStore

    check_exists(database_url)
    upgrade(database_url)
    with RunStore(database_url) as store:
        yield store


def operator() -> str:
    """The operating-system user, for the audit log."""
    try:
        return f"operator {getpass.getuser()}"
    except (OSError, KeyError):
        return "operator"


@keys.command()
def create(
    name: Annotated[str, typer.Argument(help="whose key it is")],
    scope: Annotated[list[str] | None, typer.Option(help="read, design (if none is given), batch or admin")] = None,
    database_url: DatabaseUrl = DATABASE,
) -> None:
    """Create a key. It is shown once, on standard output; the store keeps only its digest."""
    from app.access.keys import new_key
    from app.access.scopes import Scope
    from app.names import cleaned
    from app.store.keys import CreateKey
    from app.store.migrate import upgrade

    try:
        scopes = [Scope(each) for each in scope or ["design"]]
    except ValueError as error:
        typer.echo(f"{error}: there are {', '.join(Scope)}", err=True)
        raise typer.Exit(2) from None
    if not (owner := cleaned(name)[:200]):
        typer.echo("the name of the key is empty: allowed is whose key it is", err=True)
        raise typer.Exit(2)
    shown, record = new_key(owner, scopes)
    upgrade(database_url)
    with opened(database_url) as store:
        store.write_and_wait(CreateKey(record, operator()))
    typer.echo(f"key {record.id} ({record.scopes}); it is shown only once:", err=True)
    typer.echo(shown)


@keys.command("list")
def list_(database_url: DatabaseUrl = DATABASE) -> None:
    """List all keys, revoked ones too."""
    from app.store.keys import list_keys

    with opened(database_url) as store:
        for key in store.read(list_keys):
            ended = f"revoked {key.revoked_at:%Y-%m-%d %H:%M}" if key.revoked_at else "valid"
            typer.echo(f"{key.id}  {key.created_at:%Y-%m-%d %H:%M}  {ended}  {key.scopes}  {key.name}")


@keys.command()
def revoke(key_id: str, database_url: DatabaseUrl = DATABASE) -> None:
    """Revoke a key: a running service refuses it and its sessions within two seconds."""
    from app.store.errors import UnknownKey
    from app.store.keys import RevokeKey

    with opened(database_url) as store:
        try:
            done = store.write_and_wait(RevokeKey(key_id, operator()))
        except UnknownKey as error:
            typer.echo(str(error), err=True)
            raise typer.Exit(2) from None
    typer.echo(f"{key_id} is revoked" if done else f"{key_id} was already revoked")


def audit(
    database_url: DatabaseUrl = DATABASE,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="maximum number of entries")] = 100,
) -> None:
    """Show the audit log, newest first: keys created, revoked and used to log in, and pruning."""
    from app.store.keys import read_audit

    with opened(database_url) as store:
        for each in store.read(lambda connection: read_audit(connection, limit)):
            typer.echo(f"{each.at:%Y-%m-%d %H:%M:%S}  {each.actor}  {each.action}  {each.subject}")


def backup(target: Annotated[Path, typer.Argument(help="a new file")], database_url: DatabaseUrl = DATABASE) -> None:
    """Copy an SQLite store to a new file while it is in use, and verify the copy; exit code 1 if it is damaged."""
    from app.store.backup import backup as copy

    _report(copy(database_url, target), f"copied to {target}")


def restore(source: Annotated[Path, typer.Argument(help="a backup")], database_url: DatabaseUrl = DATABASE) -> None:
    """Restore a backup of an SQLite store. Nothing is overwritten: move an existing database away first."""
    from app.store.backup import restore as copy

    _report(copy(database_url, source), "restored")


def _report(report: Report, done: str) -> None:
    if report.older:
        typer.echo(f"{done}, not verified: it is at revision {report.older} of an earlier version")
        return
    for damage in report.damages:
        typer.echo(str(damage), err=True)
    typer.echo(f"{done}: {report.runs} runs, {'sound' if report.sound else 'DAMAGED'}")
    raise typer.Exit(0 if report.sound else 1)


def prune(
    before: Annotated[datetime, typer.Option(formats=["%Y-%m-%d"], help="runs made before that day (UTC)")],
    yes: Annotated[bool, typer.Option("--yes", help="delete; without it, only count")] = False,
    database_url: DatabaseUrl = DATABASE,
) -> None:
    """Delete ended runs made before a day, with their idempotency keys. Nothing is ever deleted without this."""
    from app.store.maintenance import ROWS_PER_TRANSACTION, Prune, count_before

    moment = before.replace(tzinfo=UTC)
    with opened(database_url) as store:
        if not yes:
            typer.echo(f"{store.read(lambda c: count_before(c, moment))} runs would be deleted; --yes deletes them")
            return
        total = 0
        while (count := store.write_and_wait(Prune(moment, operator()))) > 0:
            total += count
            if count < ROWS_PER_TRANSACTION:
                break
    typer.echo(f"{total} runs were deleted")
