"""The library's exceptions for invalid input."""

from __future__ import annotations

import math


class InvalidInput(ValueError):
    """A quantity outside the model's range.

    field    dotted path of the quantity, by the names of the scene's dataclasses (``"mechanism.crank_radius"``,
             ``"dimensions.l"``)
    reason   what is wrong, in one sentence
    allowed  what would be accepted: a sentence, or an interval in SI units
    """

    def __init__(self, field: str, reason: str, allowed: str) -> None:
        super().__init__(f"{field}: {reason} (allowed: {allowed})")
        self.field = field
        self.reason = reason
        self.allowed = allowed


class EffectConflict(InvalidInput):
    """An effect was excluded although a limit or objective needs it."""

    def __init__(self, effect: str, needed_by: str) -> None:
        super().__init__(
            "effects.exclude",
            f"the effect {effect!r} is excluded but {needed_by!r} needs it",
            f"keep {effect!r}, or drop {needed_by!r}",
        )
        self.effect = effect
        self.needed_by = needed_by


def require(ok: bool, field: str, reason: str, allowed: str) -> None:
    """Raise InvalidInput unless ``ok``."""
    if not ok:
        raise InvalidInput(field, reason, allowed)


def require_positive(owner: object, prefix: str, *names: str) -> None:
    """Raise InvalidInput for fields of ``owner`` that are neither None nor positive and finite."""
    for name in names:
        value = getattr(owner, name)
        if value is not None and not 0.0 < value < math.inf:
            raise InvalidInput(_dotted(prefix, name), "must be positive", "(0, inf)")


def require_not_negative(owner: object, prefix: str, *names: str) -> None:
    """Raise InvalidInput for fields of ``owner`` that are neither None nor finite and at least zero."""
    for name in names:
        value = getattr(owner, name)
        if value is not None and not 0.0 <= value < math.inf:
            raise InvalidInput(_dotted(prefix, name), "must not be negative", "[0, inf)")


def _dotted(prefix: str, name: str) -> str:
    return f"{prefix}.{name}" if prefix else name
