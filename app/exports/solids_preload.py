"""Imports of the fork server for solids: the modeller."""

from __future__ import annotations

from collections.abc import Iterator

import build123d  # noqa: F401

import app.exports.registry  # noqa: F401


def load_step_by_step() -> Iterator[None]:
    """No idle work: there are no kernels to load."""
    return iter(())
