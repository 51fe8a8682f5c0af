"""TypeScript types generated from the OpenAPI document compile with a program that uses them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

from app.api.contract import document
from app.main import create_app

_PROGRAM = """
import type { operations, components } from "./schema";
type Run = operations["%s"]["responses"][201]["content"]["application/json"];
type Body = NonNullable<operations["%s"]["requestBody"]>["content"]["application/json"];
export const mass = (run: Run): number | null => (run.result && "mass_g" in run.result ? run.result.mass_g : null);
export const named = (body: Body): Body => ({ ...body, name: "from a program" });
export const told = (problem: components["schemas"]["ProblemDetails"]): string => problem.detail;
"""


def _run(*command: str, cwd: Path) -> None:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_operation_is_typed_and_a_program_compiles(tmp_path: Path) -> None:
    for file in (Path(__file__).parent / "typescript").glob("package*.json"):
        shutil.copy(file, tmp_path)
    described = document(create_app())
    (tmp_path / "openapi.json").write_text(json.dumps(described))
    _run("npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", cwd=tmp_path)
    _run("npx", "--no-install", "openapi-typescript", "openapi.json", "--output", "schema.ts", cwd=tmp_path)
    names = [operation["operationId"] for path in described["paths"].values() for operation in path.values()]
    schema = (tmp_path / "schema.ts").read_text()
    assert all(f"    {name}: {{" in schema for name in names)
    design = described["paths"]["/api/v1/designs/pin-profile"]["post"]["operationId"]
    (tmp_path / "program.ts").write_text(_PROGRAM % (design, design))
    (tmp_path / "wrong.ts").write_text(_PROGRAM.replace("run.result.mass_g", "run.result.weight") % (design, design))
    compiled = subprocess.run(
        ["npx", "--no-install", "tsc", "--strict", "--noEmit", "--skipLibCheck", "program.ts", "wrong.ts"],
        cwd=tmp_path, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    # Only the program that asks for a result there is not.
    faults = re.findall(r"^(\S+)\(.*error TS", compiled.stdout, re.MULTILINE)
    assert faults and set(faults) == {"wrong.ts"}, compiled.stdout + compiled.stderr
