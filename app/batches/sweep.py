"""Parameter sweeps: a base request with fields varied over a grid, in parallel (zip) or by space-filling samples."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from enum import StrEnum
from typing import Any, Literal

from pydantic import ConfigDict, Field, ValidationError

from app.designs.problems import INVALID
from app.designs.schema import Entry, Strict, entry
from app.errors import Problem, invalid
from app.store.batch_inputs import Row
from app.store.hashing import canonical_json

_SLICE = 4096
Number = float | int


class Combine(StrEnum):
    GRID = "grid"
    ZIP = "zip"
    LATIN_HYPERCUBE = "latin_hypercube"
    SOBOL = "sobol"


SAMPLED = (Combine.LATIN_HYPERCUBE, Combine.SOBOL)


class Vary(Strict):
    """The values of one field: told one by one, in steps from one end to the other, or between two ends."""

    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, hide_input_in_errors=True, populate_by_name=True
    )

    values: list[Any] | None = Field(default=None, min_length=1, max_length=100_000)
    from_: float | None = Field(default=None, alias="from", allow_inf_nan=False, ge=-1e12, le=1e12)
    to: float | None = Field(default=None, allow_inf_nan=False, ge=-1e12, le=1e12)
    steps: int | None = Field(default=None, ge=1, le=1_000_000)
    scale: Literal["linear", "log"] = "linear"

    def wrong(self, at: str, sampled: bool) -> list[Entry]:
        """Contradictions within one field's values."""
        if self.values is not None:
            beside = self.from_ is not None or self.to is not None or self.steps is not None
            return [entry(at, "has values and a range", "exactly one of the two")] if beside else []
        if self.from_ is None or self.to is None:
            return [entry(at, "has no values", "values, or from and to")]
        if self.scale == "log" and min(self.from_, self.to) <= 0:
            return [entry(at, "a logarithmic scale reaches no zero", "from and to above 0")]
        if not sampled and self.steps is None:
            return [entry(at + "/steps", "is missing", "how many values there are from one end to the other")]
        if sampled and self.steps is not None:
            return [entry(at + "/steps", "samples have no steps", "from and to only")]
        return []

    @property
    def count(self) -> int:
        return len(self.values) if self.values is not None else self.steps or 0

    def at(self, k: int) -> Any:
        """The value with index ``k``."""
        if self.values is not None:
            return self.values[k]
        assert self.steps is not None
        if k == self.steps - 1 and k > 0:
            return self.to
        return self.between(k / max(1, self.steps - 1))

    def between(self, share: float) -> Any:
        """The value at ``share`` in [0, 1] of the range, interpolated on its scale."""
        if self.values is not None:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        assert self.from_ is not None and self.to is not None
        if share <= 0:
            return self.from_
        if self.scale == "log":
            return self.from_ * math.exp(share * math.log(self.to / self.from_))
        return self.from_ + share * (self.to - self.from_)


class Sweep(Strict):
    """A request of which some fields are varied."""

    kind: str = Field(max_length=64)
    mode: Literal["design", "check", "analysis", "accuracy"]
    name: str = Field(default="", max_length=200, pattern=r"^[^\x00]*$")
    detail: Literal["scalars", "full"] = "scalars"
    base: dict[str, Any] = Field(description="what every request has")
    vary: dict[str, Vary] = Field(min_length=1, max_length=32, description="dotted field: its values")
    combine: Literal["grid", "zip", "latin_hypercube", "sobol"] = "grid"
    samples: int | None = Field(default=None, ge=1, description="number of points of latin_hypercube and sobol")
    seed: int = Field(default=0, ge=0, le=2**32 - 1)

    @classmethod
    def read(cls, body: bytes) -> Sweep:
        """The sweep in a JSON body. Raises Problem."""
        try:
            sweep = cls.model_validate_json(body)
        except ValidationError as error:
            raise invalid(error, cls) from None
        if wrong := sweep.contradictions():
            raise Problem(422, INVALID, "values contradict each other", wrong)
        return sweep

    @property
    def way(self) -> Combine:
        return Combine(self.combine)

    def contradictions(self) -> list[Entry]:
        """Contradictions between fields."""
        sampled = self.way in SAMPLED
        found = [wrong for name, vary in self.vary.items() for wrong in vary.wrong(f"/vary/{name}", sampled)]
        if sampled and self.samples is None:
            found.append(entry("/samples", "is missing", f"how many samples {self.combine} takes"))
        if not sampled and self.samples is not None:
            found.append(entry("/samples", f"{self.combine} takes no samples", "latin_hypercube or sobol"))
        counts = {vary.count for vary in self.vary.values()}
        if self.way is Combine.ZIP and not found and len(counts) > 1:
            found.append(entry("/vary", "the fields have different numbers of values", "as many of every field"))
        return found

    @property
    def total(self) -> int:
        """The number of items."""
        if self.way is Combine.GRID:
            return math.prod(vary.count for vary in self.vary.values())
        return self.samples or next(iter(self.vary.values())).count

    def rows(self) -> Iterator[Row]:
        """The cells of every item; in a grid the last field varies fastest."""
        for cells in self._cells():
            yield Row(None, canonical_json(cells))

    def _cells(self) -> Iterator[list[Any]]:
        varied = list(self.vary.values())
        if self.way is Combine.GRID:
            for place in itertools.product(*(range(vary.count) for vary in varied)):
                yield [vary.at(k) for vary, k in zip(varied, place, strict=True)]
        elif self.way is Combine.ZIP:
            for k in range(self.total):
                yield [vary.at(k) for vary in varied]
        else:
            for point in self._points(len(varied)):
                yield [vary.between(float(share)) for vary, share in zip(varied, point, strict=True)]

    def _points(self, dimensions: int) -> Iterator[Any]:
        """Sample points in the unit hypercube."""
        import warnings

        from scipy.stats import qmc

        if self.way is Combine.LATIN_HYPERCUBE:
            yield from qmc.LatinHypercube(dimensions, seed=self.seed).random(self.total)
            return
        sobol = qmc.Sobol(dimensions, seed=self.seed)
        with warnings.catch_warnings():
            # A sample count that is not a power of two only reduces uniformity slightly.
            warnings.simplefilter("ignore", UserWarning)
            for first in range(0, self.total, _SLICE):
                yield from sobol.random(min(_SLICE, self.total - first))
