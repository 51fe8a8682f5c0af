"""The only list of kinds."""

from __future__ import annotations

from app.designs.flexible_rod import FLEXIBLE_ROD
from app.designs.kind import Kind

KINDS: dict[str, Kind] = {kind.slug: kind for kind in (FLEXIBLE_ROD,)}
