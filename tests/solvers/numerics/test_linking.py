"""Machine code is generated only for kernels called from Python; loading it needs no compiler."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from operator import attrgetter
from pathlib import Path

from solvers.numerics.linking import _library

ROOT = Path(__file__).parents[3]
SOURCE = """
import math
import numpy as np
from solvers.numerics.jit import kernel

@kernel
def inner(values, factor):
    shifted = np.empty(values.size)
    for i in range(values.size):
        shifted[i] = factor * values[i] + math.sqrt(values[i])
    return shifted.sum()

@kernel
def outer(values):
    return inner(values, 2.0) - inner(values, 1.0)
"""


def test_an_inner_kernel_is_linked_into_its_caller_only(tmp_path: Path) -> None:
    import numpy as np

    file = tmp_path / "of_two.py"
    file.write_text(SOURCE)
    spec = spec_from_file_location("of_two", file)
    assert spec and spec.loader
    module = module_from_spec(spec)
    sys.modules["of_two"] = module
    try:
        spec.loader.exec_module(module)
        assert module.outer(np.array([1.0, 4.0, 0.25])) == 5.25
        assert _library() is not None, "numba looks otherwise than linking.py expects"
        dispatcher = module.inner.inner
        (linked_in,) = map(attrgetter("library"), dispatcher.overloads.values())
        assert linked_in._inner is True
        (compiled,) = module.outer.compiled.overloads.values()
        assert len(compiled._find_referenced_environments()) <= 1, "each is looked up again wherever it is loaded"
        # Called from Python after all, it is compiled for that.
        assert module.inner(np.array([4.0]), 1.0) == 6.0
    finally:
        del sys.modules["of_two"]


def test_a_kernel_on_disk_needs_no_compiler() -> None:
    call = "from solvers.rod.strip.buckling import first_root; first_root(0.4)"
    code = f"import sys; {call}; print('numba.typed.dictimpl' in sys.modules)"
    run = [sys.executable, "-c", code]
    told = [subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=True).stdout for _ in range(2)]
    assert told[1].strip() == "False"
