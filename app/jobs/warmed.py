"""Importing this module warms up: the fork server imports it once, and every worker is born warm."""

from __future__ import annotations

import contextlib

from app.jobs.calls import warm_up

# What goes wrong here goes wrong again in the worker, which reports it; the fork server itself must live.
with contextlib.suppress(Exception):
    warm_up()
