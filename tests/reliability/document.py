"""Conformance of the API to its OpenAPI document, tested with generated requests.

    python -m tests.reliability.document 50000 .campaign/document

Each round generates cases for every operation: valid and invalid by the schema, or mutations of the examples with
existing names of runs, batches and plots. Each operation of a round appends a line to ``parts.jsonl``; a restart
continues after the last line and retries failures.
"""

from __future__ import annotations

import itertools
import json
import random
import sys
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

import schemathesis
from httpx import InvalidURL
from hypothesis import HealthCheck, Phase, given, reject, seed, settings
from hypothesis import strategies as st
from schemathesis import Case, GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_schema_conformance,
    status_code_conformance,
)
from starlette.testclient import TestClient

from app.api.contract import PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of, modes_of
from app.main import create_app
from tests.app.serving import serving
from tests.reliability.attacks import spoiled

CHECKED = [not_a_server_error, status_code_conformance, content_type_conformance, response_schema_conformance]
CASES_OF_A_ROUND = 50
"""Cases per operation; a fifth for studies, which take about 1 s each."""
STUDY_S = 0.3
"""Time budget [s] of studies derived from the example."""
DOCUMENT = create_app().openapi()
ROWS = [(kind, mode) for kind in KINDS.values() for mode in modes_of(kind) if mode is not Mode.ACCURACY]
OPERATIONS = [each.ok() for each in schemathesis.openapi.from_dict(DOCUMENT).get_all_operations()]


def known_values(client: TestClient) -> dict[str, list[str]]:
    """Existing parameter values: runs of every kind, a batch with items and an empty one, plots and exports."""
    runs, batches, parts = [], [], {"plots": {"none"}, "exports": {"none"}}
    for kind, mode in ROWS:
        answer = client.post(f"/api/v1/{PATHS[mode]}/{kind.slug}", json=example_of(kind, mode)).json()
        runs.append(answer["id"])
        for part, names in parts.items():
            names.update(answer["links"][part])
    example = json.dumps(KINDS["crank-masses"].example(Mode.ANALYSIS))
    for lines in (f"{example}\n{example}\n", "{}\n"):
        headers = {"Content-Type": "application/x-ndjson"}
        query = {"kind": "crank-masses", "mode": "analysis"}
        batches.append(client.post("/api/v1/batches", content=lines, headers=headers, params=query).json()["id"])
    return {
        "run_id": runs,
        "batch_id": batches,
        "plot": sorted(parts["plots"]),
        "export": sorted(parts["exports"]),
        "kind": list(KINDS),
        "mode": [str(mode) for mode in Mode],
    }


def mixed(example: Any, generated: Any, rng: random.Random) -> Any:
    """The example with one in ten values or groups replaced by generated ones."""
    if not isinstance(example, dict) or not isinstance(generated, dict):
        return generated if rng.random() < 0.1 else example
    found = {key: mixed(value, generated.get(key, value), rng) for key, value in example.items()}
    return found | {key: value for key, value in generated.items() if key not in example and rng.random() < 0.1}


def near(case: Case, known: dict[str, list[str]], rng: random.Random) -> Case:
    """The case with existing names in most parameters and a body derived from the example."""
    for values in (case.path_parameters, case.query):
        for name in known.keys() & (values or {}):
            if rng.random() < 0.9:
                values[name] = rng.choice(known[name])
    if rng.random() < 0.7:  # otherwise most keys would conflict
        (case.headers or {}).pop("idempotency-key", None)
    content = case.operation.definition.raw.get("requestBody", {}).get("content", {})
    if "example" in content.get("application/json", {}):
        case.body = mixed(content["application/json"]["example"], case.body, rng)
        if "study_budget_s" in (case.body if isinstance(case.body, dict) else ()):
            case.body["study_budget_s"] = STUDY_S
    elif case.media_type == "application/x-ndjson" and rng.random() < 0.7:
        kind, mode = rng.choice(ROWS)
        case.query = (case.query or {}) | {"kind": kind.slug, "mode": str(mode)}
        rows = [json.dumps(example_of(kind, mode)).encode() for _ in range(rng.randint(1, 3))]
        case.body = spoiled(rng, b"\n".join(rows)) if rng.random() < 0.5 else b"\n".join(rows)
    return case


def cases_of(operation: Any, known: dict[str, list[str]], turn: int) -> st.SearchStrategy[Case]:
    """Valid and invalid cases by the schema; in two of three turns derived from existing data."""
    cases = st.one_of(operation.as_strategy(generation_mode=mode) for mode in GenerationMode)
    has_values = bool(operation.definition.raw.get("parameters") or operation.body)
    if turn % 3 == 0 or not has_values:
        return cases
    return st.builds(near, cases, st.just(known), st.randoms(use_true_random=False))


def hold(client: TestClient, case: Case) -> int:
    """Send a case, validate the answer against the document and return its status."""
    sent = case.as_transport_kwargs(base_url=str(client.base_url))
    try:
        answer = client.request(
            sent["method"], sent["url"], params=sent.get("params"), headers=sent["headers"],
            content=sent.get("data") or (json.dumps(sent["json"]) if "json" in sent else None),
        )  # fmt: skip
    except InvalidURL:  # too long for this client
        reject()
    case.validate_response(answer, checks=CHECKED)
    return answer.status_code


def part(client: TestClient, operation: Any, known: dict[str, list[str]], turn: int, cases: int) -> Counter[int]:
    """Run cases of one operation; returns counts by status. Raises at the first undocumented answer."""
    statuses = Counter[int]()

    @seed(turn)
    @settings(
        max_examples=cases,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(cases_of(operation, known, turn))
    def one(case: Case) -> None:
        statuses[hold(client, case)] += 1

    one()
    return statuses


def campaign(wanted: int, folder: Path) -> list[dict[str, Any]]:
    """Run until ``wanted`` cases have been sent in total; earlier failures are retried first."""
    folder.mkdir(parents=True, exist_ok=True)
    told = folder / "parts.jsonl"
    lines = [json.loads(line) for line in told.read_text().splitlines()] if told.exists() else []
    done = {(line["turn"], line["operation"]): line for line in lines}
    operations = {operation.label: operation for operation in OPERATIONS}
    failed = [key for key, line in done.items() if line["failure"]]
    rest = ((turn, label) for turn in itertools.count() for label in operations if (turn, label) not in done)
    limits = {"max_accepted": 100_000, "max_accepted_of_one": 100_000, "solve_budget_s": 60.0}
    (folder / "runs.sqlite3").unlink(missing_ok=True)
    with serving(folder, workers=2, **limits) as client, told.open("a") as sink:
        known = known_values(client)
        for turn, label in itertools.chain(failed, rest):
            if (turn, label) not in failed and sum(line["cases"] for line in done.values()) >= wanted:
                break
            line = {"turn": turn, "operation": label, "failure": None}
            try:
                cases = CASES_OF_A_ROUND // (5 if "/accuracy/" in label else 1)
                statuses = part(client, operations[label], known, turn, cases)
            except (Exception, BaseExceptionGroup):
                statuses, line["failure"] = Counter(), traceback.format_exc()
            line |= {"cases": statuses.total(), "statuses": dict(sorted(statuses.items()))}
            done[turn, label] = line
            print(json.dumps(line), file=sink, flush=True)
            print(turn, label, line["statuses"], flush=True)
    return list(done.values())


if __name__ == "__main__":
    parts = campaign(int(sys.argv[1]), Path(sys.argv[2]))
    statuses = Counter()
    for each in parts:
        statuses.update({int(status): number for status, number in each["statuses"].items()})
        if each["failure"]:
            print(each["failure"])
    print(dict(sorted(statuses.items())))
    sys.exit(any(each["failure"] for each in parts))
