"""Filter and order of the run list, parsed from the query string."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from urllib.parse import urlencode

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.record import ITEM_ORDERS, RunFilter, RunOrder, RunStatus
from app.words.languages import gettext as _

FIELDS = ("kind", "mode", "status", "holds", "text", "since", "until", "order", "batch_id")
ORDERS = {
    RunOrder.NEWEST: "newest first",
    RunOrder.OLDEST: "oldest first",
    RunOrder.NAME: "by name",
    RunOrder.LEAST: "by figure, least first",
    RunOrder.GREATEST: "by figure, greatest first",
}
CHOICES: dict[str, dict[str, str]] = {
    "kind": {slug: kind.title for slug, kind in KINDS.items()},
    "mode": {str(mode): str(mode) for mode in Mode},
    "status": {str(status): str(status) for status in RunStatus},
    "holds": {"true": "holds", "false": "does not hold"},
    "order": {str(order): words for order, words in ORDERS.items()},
}
_MAX_TEXT_LENGTH = 200


@dataclass(frozen=True)
class Listing:
    """Filter and order; ``given``: the entered values by field, ``errors``: messages by field."""

    wanted: RunFilter
    order: RunOrder
    cursor: str | None
    given: Mapping[str, str]
    errors: Mapping[str, str]

    @property
    def choices(self) -> Mapping[str, Mapping[str, str]]:
        """Values and labels of the fields that are selected."""
        choices = {field: {value: _(words) for value, words in found.items()} for field, found in CHOICES.items()}
        if "batch_id" in self.given:
            choices["order"] = {str(order): choices["order"][order] for order in ITEM_ORDERS}
        return choices

    @property
    def filtered(self) -> bool:
        """Whether any filter is set."""
        return any(name != "order" for name in self.given)

    def link(self, **more: str) -> str:
        """URL of this list with parameters overridden."""
        found = {**self.given, **more}
        return "/runs" + ("?" + urlencode(found) if found else "")


def asked_of(query: Mapping[str, str]) -> Listing:
    """Parse a query; an invalid value is reported in ``errors`` and ignored."""
    given = {name: query[name].strip() for name in FIELDS if query.get(name, "").strip()}
    errors = {
        name: _("is none of %(values)s") % {"values": ", ".join(CHOICES[name])}
        for name in CHOICES
        if name in given and given[name] not in CHOICES[name]
    }
    days: dict[str, datetime] = {}
    for name in ("since", "until"):
        if name in given:
            try:
                days[name] = datetime.combine(date.fromisoformat(given[name]), datetime.min.time(), UTC)
            except ValueError:
                errors[name] = _("is no date such as 2026-01-31")
    if len(given.get("text", "")) > _MAX_TEXT_LENGTH or "\0" in given.get("text", ""):
        errors["text"] = _("is at most %(most)s characters") % {"most": _MAX_TEXT_LENGTH}
    if "batch_id" in given and given.get("order") == RunOrder.NAME:
        errors["order"] = _("is no order of the items of a batch")
    sound = {name: value for name, value in given.items() if name not in errors}
    # The filter bounds are exclusive, so a day begins just before midnight.
    wanted = RunFilter(
        kind=sound.get("kind"),
        mode=sound.get("mode"),
        status=sound.get("status"),
        created_after=_just_before(days.get("since")),
        created_before=_next_day(days.get("until")),
        holds={"true": True, "false": False}.get(sound.get("holds", "")),
        text=sound.get("text"),
        batch_id=sound.get("batch_id"),
    )
    order = RunOrder(sound.get("order", RunOrder.NEWEST))
    return Listing(wanted, order, query.get("cursor") or None, given, errors)


def _just_before(day: datetime | None) -> datetime | None:
    return None if day is None or day == datetime.min.replace(tzinfo=UTC) else day - timedelta(microseconds=1)


def _next_day(day: datetime | None) -> datetime | None:
    return None if day is None or day.year == date.max.year else day + timedelta(days=1)
