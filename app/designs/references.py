"""References to stored runs in requests, filled in before solving.

A filled reference keeps the run's id beside the data taken from it, so a stored request documents its sources and can
be solved without the store.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, Literal, Self, get_args

from pydantic import BaseModel, Field, RootModel

from app.designs.schema import Positive, Strict
from solvers.crank.cycle import LOADS
from solvers.errors import InvalidInput

Path = tuple[str | int, ...]
Run = dict[str, Any]
"""A stored run as its JSON object."""


class UnfitRun(Exception):
    """The referenced run cannot provide the required data."""

    def __init__(self, reason: str, allowed: str) -> None:
        super().__init__(reason)
        self.reason = reason
        self.allowed = allowed


class RunReference(Strict):
    """Base of data taken from a stored run."""

    kind: Literal["run"]
    run_id: str = Field(min_length=1, max_length=64, pattern=r"^[\w-]+$", description="the id of a stored run")

    def filled(self, run: Run) -> Self:
        """The reference with the run's data filled in. Raises UnfitRun."""
        raise NotImplementedError


def references(request: Any, path: Path = ()) -> Iterator[tuple[Path, RunReference]]:
    """All references in a request, with their paths."""
    if isinstance(request, RunReference):
        yield path, request
    elif isinstance(request, RootModel):
        yield from references(request.root, path)
    elif isinstance(request, BaseModel):
        for name in _referring(type(request)):
            yield from references(getattr(request, name), (*path, name))
    elif isinstance(request, (list, tuple)) and request and isinstance(request[0], BaseModel):
        for index, item in enumerate(request):
            yield from references(item, (*path, index))


@cache
def _referring(model: type[BaseModel]) -> tuple[str, ...]:
    """Fields of a model whose type may contain a reference."""
    return tuple(name for name, field in model.model_fields.items() if may_refer(field.annotation))


def may_refer(annotation: Any) -> bool:
    """Whether a value of this type may contain a reference."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return issubclass(annotation, RunReference) or bool(_referring(annotation))
    return any(may_refer(part) for part in get_args(annotation))


def replaced(request: Any, path: Path, value: RunReference) -> Any:
    """The request with the value at a path from ``references`` replaced."""
    if not path:
        return value
    step, rest = path[0], path[1:]
    if isinstance(request, RootModel):
        return type(request).model_construct(root=replaced(request.root, path, value))
    if isinstance(request, BaseModel):
        return request.model_copy(update={str(step): replaced(getattr(request, str(step)), rest, value)})
    return [replaced(item, rest, value) if index == step else item for index, item in enumerate(request)]


def _succeeded_dynamics(run: Run) -> Mapping[str, Any]:
    if run["kind"] != "crank-dynamics" or run["status"] != "succeeded":
        raise UnfitRun(f"is a run of {run['kind']} that {run['status']}", "a succeeded run of crank-dynamics")
    return run["result"]


def cycle_of(run: Run) -> Mapping[str, Any]:
    """Pressures of a crank-dynamics run of two strokes: angle_deg, pressure_mpa. Raises UnfitRun."""
    result = _succeeded_dynamics(run)
    if run["spec"]["cylinder"]["strokes"] != 2:
        raise UnfitRun(
            "has a cycle of four strokes; a flexible rod's cycle is one turn", "a run of two strokes, or load.instant"
        )
    if "cycle" not in result:
        raise UnfitRun("was stored without its curves", "a run of its own, or an item of a batch with detail full")
    return result["cycle"]


def worst_of(run: Run, name: str) -> Mapping[str, Any]:
    """A worst instant of a crank-dynamics run by name: angle_deg, force_n, pressure_mpa. Raises UnfitRun."""
    found = [instant for instant in _succeeded_dynamics(run)["worst"] if instant["name"] == name]
    if not found:
        raise UnfitRun(f"has no instant {name}", "a run with that instant")
    return found[0]


def source_of(run: Run) -> str:
    """Provenance stored with a request: kind and spec hash of the referenced run."""
    return f"{run['kind']} {run['spec_hash']}"


Instant = Literal[LOADS]
"""Worst instants of a crank-dynamics run."""


class RunForce(RunReference):
    """The force at a worst instant of a stored crank-dynamics run; filled in by the service."""

    instant: Instant = Field(default="wrist_pin_load_max", description="which of the maximum forces is used")
    force_n: Positive | None = Field(default=None, description="filled in from the run")
    taken_from: str | None = Field(default=None, description="filled in: kind and hash of the run's own request")

    def filled(self, run: Run) -> Self:
        force = worst_of(run, self.instant)["force_n"]
        if force <= 0:
            raise UnfitRun(f"has no {self.instant}: that force never occurs", "an instant whose force is positive")
        return self.model_copy(update={"force_n": force, "taken_from": source_of(run)})

    @property
    def force(self) -> float:
        """The force [N]. Raises InvalidInput if the reference is not filled in."""
        if self.force_n is None:
            raise InvalidInput("load.run_id", "nothing was taken from the run", "a run of the same store")
        return self.force_n
