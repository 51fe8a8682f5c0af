"""Formatting of runs as tables for the terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TaskID, TextColumn
from rich.progress import Progress as Live
from rich.table import Table

from app.designs.progress import Progress, Report
from app.designs.schema import LARGEST_INFLUENCE
from app.designs.verdict import accuracy_met
from app.words.verdicts import margin

Row = tuple[str, str]

_SHORT = 4
"""Maximum length of a list printed in full."""


def _figure(value: Any) -> str:
    if isinstance(value, list) and (len(value) > _SHORT or any(isinstance(item, dict) for item in value)):
        return f"({len(value)} of them)"
    return f"{value:.6g}" if isinstance(value, float) else "none" if value is None else str(value)


def _dimensions(value: dict[str, float]) -> Iterator[Row]:
    names = " × ".join(name.partition("_")[0] for name in value)
    yield "dimensions", " × ".join(f"{v:.4g}" for v in value.values()) + f" mm  ({names})"


def _active(value: list[dict[str, Any]]) -> Iterator[Row]:
    for item in value:
        yield f"active: {item['name']}", f"+1 % of it moves the objective by {item['sensitivity']:+.2f} %"


def _diagnosis(value: list[dict[str, Any]]) -> Iterator[Row]:
    for item in value:
        best = "nothing" if item["attainable"] is None else f"{item['attainable']:.4g}"
        yield item["requirement"], f"required {item['required']:.4g}, attainable {best}; {item['advice']}"


def _certificate(value: dict[str, Any] | None) -> Iterator[Row]:
    if value is not None and "method" in value:
        bound = "none exists" if value["bound"] is None else f"bound {value['bound']:.6g}"
        text = "no bound is known" if value["gap"] is None else f"{bound}, gap {value['gap']:.1e}"
        yield "certificate", f"{text}, by {value['method']}"


def _worst(value: list[dict[str, Any]]) -> Iterator[Row]:
    for item in value:
        yield item["name"], f"{item['force_n']:.6g} N at {item['angle_deg']:.4g}°"


def _repairs(value: list[dict[str, Any]]) -> Iterator[Row]:
    for item in value:
        yield f"repaired {item['pointer']}", item["what"]


def _levels(value: list[dict[str, Any]]) -> Iterator[Row]:
    for level in value:
        error = "failed" if level["error"] is None else f"error {'≤ ' if level['at_most'] else ''}{level['error']:.1e}"
        if level["proven_gap"] is not None:
            error += f", proven to {level['proven_gap']:.1e}"
        yield (
            f"accuracy {level['accuracy']:g}",
            f"{error}, {level['time_median_s'] * 1e3:.1f} ms ({level['runs']} runs)",
        )


def _effect_costs(value: list[dict[str, Any]]) -> Iterator[Row]:
    for cost in value:
        if cost["change"] is None:
            yield f"turning {cost['name']} about", "no answer, or out of time"
        else:
            extra = (cost["time_with_s"] - cost["time_without_s"]) * 1e3
            brings = f", {len(cost['brings'])} results exist only with it" if cost["brings"] else ""
            yield f"with {cost['name']}", f"results change by {cost['change']:.2g}{brings}, time by {extra:+.1f} ms"


def _recommended(value: dict[str, Any] | None) -> Iterator[Row]:
    yield "cheapest that will do", "none" if value is None else f"accuracy {value['accuracy']:g}"


def _certified(value: dict[str, Any] | None) -> Iterator[Row]:
    if value is not None:
        settings = ", ".join(f"{name} {_figure(inner)}" for name, inner in value["settings"].items())
        text = f"accuracy {value['accuracy']:g}, proven to {value['proven_gap']:.1e}"
        yield "cheapest proof that will do, or the closest", f"{text} ({settings})" if settings else text


_SHOWN: dict[str, Callable[[Any], Iterator[Row]]] = {
    "dimensions": _dimensions,
    "active_constraints": _active,
    "diagnosis": _diagnosis,
    "certificate": _certificate,
    "worst": _worst,
    "repairs": _repairs,
    "levels": _levels,
    "recommended": _recommended,
    "certified": _certified,
    "effect_costs": _effect_costs,
}
"""Parts of results with their own formatting."""


def _rows(result: dict[str, Any]) -> Iterator[Row]:
    for name, value in result.items():
        if name in _SHOWN:
            yield from _SHOWN[name](value)
        elif isinstance(value, dict):
            yield name, ", ".join(f"{key} {_figure(inner)}" for key, inner in value.items())
        elif isinstance(value, list) and any(isinstance(item, (dict, list)) for item in value):
            yield name, f"{len(value)} rows; --json prints them"
        elif isinstance(value, list):
            yield from ((name, _figure(item)) for item in value)
        elif value is not None:
            yield name, _figure(value)


def _bound(influence: float) -> str:
    return "unbounded" if influence >= LARGEST_INFLUENCE else f"bound {influence:.2g}"


def _accuracy(accuracy: dict[str, Any]) -> str:
    met = "" if accuracy_met(accuracy) else ", NOT MET"
    return f"requested {accuracy['requested']:g}, estimated {accuracy['estimated']:.2g}{met}"


@contextmanager
def shown_progress(console: Console | None = None) -> Iterator[Report]:
    """Show the progress of a long solve on a terminal; no output elsewhere."""
    console = console or Console(stderr=True)
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
    line, tasks = Live(*columns, console=console, transient=True), list[TaskID]()

    def report(progress: Progress) -> None:
        if not console.is_terminal:
            return
        if not tasks:
            line.start()
            tasks.append(line.add_task(""))
        line.update(tasks[0], description=progress.doing, completed=progress.done, total=progress.of)

    try:
        yield report
    finally:
        if tasks:
            line.stop()


def _reached(item: dict[str, Any]) -> str:
    sign = {"at_least": "≥", "at_most": "≤", "equal": "=", "yes": "="}[item["sense"]]
    found = "none" if item["reached"] is None else f"{item['reached']:.5g}"
    spare = "" if item["margin"] is None else f", margin {margin(item)}"
    return (
        f"{'holds' if item['holds'] else 'DOES NOT HOLD'}: {found}, {sign} {item['required']:.5g} {item['unit']}{spare}"
    )


def _verdict(verdict: dict[str, Any]) -> Iterator[Row]:
    """All criteria, then the cautions."""
    for item in verdict["criteria"]:
        yield item["name"], _reached(item)
    yield from (("caution", text) for text in verdict["cautions"])


def print_run(run: dict[str, Any]) -> None:
    """Print a run: verdict, results, effects, accuracy and time."""
    console = Console(file=sys.stdout)
    if run["verdict"]:
        console.print(run["verdict"]["summary"], style="bold", highlight=False)
    elif run["status"] == "infeasible":
        console.print("No design meets all requirements.", style="bold", highlight=False)
    table = Table(title=f"{run['kind']} · {run['mode']} · {run['status']}", title_justify="left", show_header=False)
    verdict = run["verdict"]
    for row in _verdict(verdict) if verdict else ():
        table.add_row(*row)
    # The verdict's cautions include the warnings.
    shown = {name: value for name, value in (run["result"] or {}).items() if not (verdict and name == "warnings")}
    for row in _rows(shown):
        table.add_row(*row)
    if run["problem"]:
        table.add_row("problem", run["problem"]["detail"])
    for effect in run["effects"]:
        table.add_row(f"effect {effect['name']}", f"{effect['state']}, {_bound(effect['influence'])}: {effect['why']}")
    if run["accuracy"]:
        table.add_row("accuracy", _accuracy(run["accuracy"]))
    table.add_row("time", f"{run['timing'].get('solve_s', run['timing']['total_s']):.3f} s")
    table.add_row("run", run["id"])
    console.print(table)


@contextmanager
def shown_batch(console: Console | None = None) -> Iterator[Callable[[dict[str, Any]], None]]:
    """Show the progress of a batch as a bar on a terminal; no output elsewhere."""
    console = console or Console(stderr=True)
    with Live(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), console=console, transient=True,
        disable=not console.is_terminal,
    ) as live:  # fmt: skip
        task = live.add_task("items", total=None)

        def on_progress(batch: dict[str, Any]) -> None:
            live.update(task, total=batch["items"]["total"], completed=batch["items"]["done"])

        yield on_progress
