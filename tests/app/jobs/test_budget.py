"""Time limits of a solve: the solver's and the process's."""

from __future__ import annotations

import pytest

from app.jobs.budget import Budget, budget


def test_a_solver_without_a_clock_is_killed_at_what_was_asked_for():
    assert budget(10.0, None, False) == Budget(None, 10.0)
    assert budget(10.0, 2.0, False) == Budget(None, 2.0)


def test_a_solver_that_ends_by_itself_is_killed_a_margin_later():
    assert budget(10.0, 2.0, True) == Budget(2.0, 3.0)
    assert budget(10.0, None, True) == Budget(9.0, 10.0)
    assert budget(10.0, 10.0, True) == Budget(9.0, 10.0)


@pytest.mark.parametrize("service", [0.01, 0.5, 3.0, 10.0, 3600.0])
@pytest.mark.parametrize("asked", [None, 0.001, 1.0, 1e4])
def test_the_services_limit_stays_above_both(service, asked):
    found = budget(service, asked, True)
    assert found.solver_s < found.kill_s <= service
    assert found.kill_s - found.solver_s >= min(0.5, 0.5 * service) * (1 - 1e-9)
    assert asked is None or found.solver_s <= asked
