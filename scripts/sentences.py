"""The sentences of solvers and requests, extracted from the sources, for translation by `app.words.solver_texts`.

A text with inserted values is a pattern with ``{}`` in place of each of them.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent.parent
_SOLVERS, _APP = ROOT / "solvers", ROOT / "app"
_SILENT = ("numerics", "references", "materials")
"""Packages of the solvers whose texts never appear on a page."""
SOURCES = (
    *(
        path
        for path in sorted(_SOLVERS.rglob("*.py"))
        if not set(path.relative_to(_SOLVERS).with_suffix("").parts) & set(_SILENT)
    ),
    _APP / "designs" / "references.py",
    *sorted(_APP.glob("designs/*/request.py")),
    *sorted(_APP.glob("designs/*/reference.py")),
    *(_APP / "designs" / f"{name}.py" for name in ("accuracy", "claims", "independent", "schema")),
    _APP / "designs" / "crank_masses" / "kind.py",
    *(_APP / name for name in ("run_references.py", "solve_failures.py")),
    *(_APP / "batches" / f"{name}.py" for name in ("chunk", "intake", "parquet", "service", "splitting", "sweep")),
    _APP / "store" / "batch_inputs.py",
    *(_APP / "jobs" / f"{name}.py" for name in ("errors", "warming")),
)
CALCULATIONS = tuple(sorted(_APP.glob("designs/*/chain.py")))
"""Of these modules only the descriptions beside formulas; formulas and names of sources are not translated."""
_FORMULA = re.compile(r"[*=]| [/+-] |\w\(")
_REFUSALS = ("InvalidInput", "entry", "require", "Fault")
"""Calls whose texts are collected even if they are a single word."""
_UNSAID = ("Field", "ValueError", "RuntimeError", "TypeError", "NotImplementedError", "AttributeError", "compile")
"""Calls whose texts never appear on a page, or are worded elsewhere."""
_UNSAID_NAMES = ("measure", "description")
"""Arguments and fields of the same nature."""
_SENTENCE = re.compile(r"(?:[^\W\d_]{2,}|\{\}).*\s.*[^\W\d_]{2}|[^\W\d_]{2}.*\s(?:.*[^\W\d_]{2}|\{\})")
_WORD = re.compile(r"[a-z]{3}")
_NAME = re.compile(r"[a-z]+(?:[._][\w{}]+)+|[\[(].*[\])]|[\d\W]*")
"""Dotted or underscored names of fields, and intervals."""


@cache
def sentences() -> frozenset[str]:
    """The texts and patterns of all sources."""
    found = {text for path in SOURCES for text in _said(_tree(path))}
    for path in CALCULATIONS:
        tree = _tree(path)
        tree.body = [node for node in tree.body if not isinstance(node, (ast.Assign, ast.AnnAssign))]
        found |= {text for text in _said(tree) if not _FORMULA.search(text)}
    return frozenset(found)


def patterns(texts: Iterable[str]) -> list[str]:
    """The texts with placeholders, the most specific first: the one with the most text of its own."""
    return sorted((text for text in texts if "{}" in text), key=lambda text: (-len(text.replace("{}", "")), text))


def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"))


def _said(tree: ast.AST) -> Iterator[str]:
    skipped = _unsaid(tree)
    refused = {
        id(part)
        for call in ast.walk(tree)
        if isinstance(call, ast.Call) and _name(call.func) in _REFUSALS
        for argument in call.args[1:]
        for part in ast.walk(argument)
    }
    for node in ast.walk(tree):
        text = None if id(node) in skipped else _text(node)
        text = text and text.strip(" ,;:")
        if not text or "\n" in text or _NAME.fullmatch(text):
            continue
        if _SENTENCE.search(text) or (id(node) in refused and _WORD.search(text)):
            yield text


def _text(node: ast.AST) -> str | None:
    """The pattern of a string, an f-string or a concatenation of these; None for anything else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        ends = _text(node.left), _text(node.right)
        return None if ends == (None, None) else "".join("{}" if end is None else end for end in ends)
    return None


def _unsaid(tree: ast.AST) -> set[int]:
    """Ids of the nodes to skip: docstrings, parts of f-strings, and texts not meant for users."""
    found: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            found.add(id(node.value))
        elif isinstance(node, ast.BinOp) and _text(node) is not None:
            found |= {id(node.left), id(node.right)}
        elif isinstance(node, ast.JoinedStr):
            found |= {id(part) for part in node.values if isinstance(part, ast.Constant)}
            formats = (part.format_spec for part in node.values if isinstance(part, ast.FormattedValue))
            found |= {id(part) for spec in formats if spec is not None for part in ast.walk(spec)}
        elif (
            (isinstance(node, ast.Call) and _name(node.func) in _UNSAID)
            or (isinstance(node, ast.keyword) and node.arg in _UNSAID_NAMES)
            or (
                isinstance(node, ast.AnnAssign)
                and isinstance(node.target, ast.Name)
                and node.target.id in _UNSAID_NAMES
            )
        ):
            found |= {id(part) for part in ast.walk(node)}
    return found


def _name(function: ast.expr) -> str:
    return function.id if isinstance(function, ast.Name) else getattr(function, "attr", "")
