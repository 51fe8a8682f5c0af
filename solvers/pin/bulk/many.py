"""Batch checks of pins and bushings, with the same results as ``check``.

Stepped bores under the rod force alone go through one compiled loop; all others are checked one by one.
"""

from __future__ import annotations

import time
from collections.abc import Iterable

from solvers.errors import InvalidInput
from solvers.outcome import Outcome
from solvers.pin.check import Case, Prepared
from solvers.pin.closed_form.stepped import evaluate_all
from solvers.pin.result import PinCheck


def check_many(cases: Iterable[Case]) -> list[Outcome[PinCheck] | InvalidInput]:
    """Return one outcome per case, in input order; an invalid case yields its InvalidInput."""
    found: list[Outcome[PinCheck] | InvalidInput | None] = []
    rows: list[tuple[int, Prepared]] = []
    for case in cases:
        try:
            prepared = case.prepared()
            if prepared.stepped is None:
                found.append(prepared.on_stations())
            else:
                rows.append((len(found), prepared))
                found.append(None)
        except InvalidInput as refusal:
            found.append(refusal)
    began = time.perf_counter()
    results = evaluate_all([prepared.stepped for _, prepared in rows])
    share = (time.perf_counter() - began) / max(len(rows), 1)
    for row, (place, prepared) in enumerate(rows):
        try:
            found[place] = prepared.in_closed_form(results, row, share)
        except InvalidInput as refusal:
            found[place] = refusal
    return found  # type: ignore[return-value]
