"""The benchmark of the time integrator, in a short form."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fecontact.integrate import step_loop
from fecontact.integrate.rodas5p import driver

FOLDER = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def problems(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    import integrator_problems

    return integrator_problems


@pytest.mark.parametrize(("name", "part"), [
    ("a", 0.02), ("b", 0.05), ("b2", 0.02), ("c", 0.01), ("d", 0.005)])
def test_every_problem_runs(problems, name, part):
    """The first part of each against scipy's Radau."""
    problem = problems.shortened(problems.PROBLEMS[name](), part)
    run = driver.start(problem.system, problem.state, problem.times, rtol=1e-6, work=False)
    assert run.advance(10**9) == step_loop.FINISHED
    system, times = problem.system, problem.times
    wanted = solve_ivp(system.rhs, times[[0, -1]], problem.state, method="Radau", t_eval=times,
                       jac=system.jacobian, rtol=1e-7, atol=1e-11).y.T
    assert np.abs(wanted[-1]).max() > 0.0
    assert problem.error(run.states, wanted) < 2e-3
