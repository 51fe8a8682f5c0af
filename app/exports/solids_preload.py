"""What the process that makes solids is forked from: the modeller, imported once."""

from __future__ import annotations

from collections.abc import Iterator

import build123d  # noqa: F401

import app.exports.registry  # noqa: F401


def load_step_by_step() -> Iterator[None]:
    """There are no kernels to load."""
    return iter(())
