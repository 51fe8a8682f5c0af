"""Imports of the fork server for solids: the modeller."""

from __future__ import annotations

import build123d  # noqa: F401

import app.exports.registry  # noqa: F401
