"""Texts of the form script."""

from __future__ import annotations

from app.words.languages import gettext as _


def script_words() -> dict[str, str]:
    """Translated texts by key; the script fills the placeholders in braces."""
    return {
        "add_row": _("add a row"),
        "remove_row": _("remove this row"),
        "as_text": _("as text"),
        "as_cells": _("as cells"),
        "cell": _("{heading}, row {row}"),
        "slider": _("{label}, slider"),
        "refused": _("Entries that cannot be accepted yet: {count}."),
        "last_drawing": _("The last drawing that was possible: something is missing or wrong."),
        "no_drawing": _("Nothing can be drawn yet."),
        "busy": _("Not now: {busy}"),
        "no_answer": _("No answer just now."),
        "silent": _("The service does not answer."),
        "logged_out": _("Your login has ended. Log in, then go back to this form: it keeps what was typed."),
    }
