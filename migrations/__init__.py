"""The history of the database's schema, run by Alembic from inside the service (``app.store.migrate``)."""
