"""Alembic migrations, run by the service (``app.store.migrate``)."""
