"""Insertion of rows by a statement compiled once and run by the driver.

SQLAlchemy prepares each statement anew and describes its result, which takes more than half of an insertion's time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from sqlalchemy import Boolean, Connection, Dialect, LargeBinary, Table, insert
from sqlalchemy.exc import DBAPIError

Row = Mapping[str, Any]


class Insertion:
    """Inserts rows of a table, given with all its columns, in one call.

    A failure ends the whole transaction, not only the statement: by default, SQLite copies all pages that a table with
    a trigger changes, twenty for a run, to be able to undo a single statement.
    """

    def __init__(self, table: Table) -> None:
        self._table = table
        self._compiled = cache(self._compile)

    def __call__(self, connection: Connection, *rows: Row) -> None:
        statement, parameters = self._compiled(connection.dialect)
        driver_error = connection.dialect.loaded_dbapi.Error
        cursor = connection.connection.cursor()
        try:
            cursor.executemany(statement, list(map(parameters, rows)))
        except driver_error as error:
            raise DBAPIError.instance(statement, None, error, driver_error) from error
        finally:
            cursor.close()

    def _compile(self, dialect: Dialect) -> tuple[str, Callable[[Row], Any]]:
        """The statement in the driver's words, and a row as its parameters."""
        types = {column.name: column.type.dialect_impl(dialect) for column in self._table.columns}
        # Every driver takes bytes and truth values as they are.
        unlike = [(name, kind) for name, kind in types.items() if not isinstance(kind, LargeBinary | Boolean)]
        found = ((name, kind.bind_processor(dialect)) for name, kind in unlike)
        converted = [(name, convert) for name, convert in found if convert is not None]

        def parameters(row: Row) -> Any:
            values = dict(row)
            for name, convert in converted:
                values[name] = convert(values[name])
            return tuple(map(values.__getitem__, types)) if dialect.positional else values

        statement = insert(self._table).prefix_with("OR ROLLBACK", dialect="sqlite")
        return str(statement.compile(dialect=dialect)), parameters
