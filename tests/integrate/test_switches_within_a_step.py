"""Begin and end of the force of a node within a step by collocation."""

import numpy as np
import pytest
from systems import mass_in_y

from fecontact import Load
from fecontact.core.compiled import kernel
from fecontact.integrate.collocation.step_polynomials import first_switch
from fecontact.integrate.collocation.workspace import Collocation, collocation_for
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.rodas5p.state import Problem
from fecontact.laws import Frictionless, LinearContact, RoughSurface

STIFFNESS, HEIGHT = 1e6, 1e-5


@kernel
def found(after: float, problem: Problem, c: Collocation) -> float:
    return first_switch(after, problem, c)


def zero(damping, x):
    """Force over c R_Z for the penetration R_Z (1/2 + 2 x^2), where it is not negative."""
    part, speed = 0.5 + 2.0 * x * x, 8.0 * x
    return part - 0.5 + damping * speed if part > 1.0 else part**2 / 2.0 + damping * part * speed


@pytest.mark.parametrize(("damping", "switch"), [
    # Opens before the depth is passed, closes below it: 2 x + 8 b = 0.
    (0.16, -0.64),
    # Open at the begin, closes below the depth: x^2 + 8 b x + 1/4 = 0.
    (0.3, -1.2 + np.sqrt(1.44 - 0.25)),
    # Pressed throughout: the first passage of the depth.
    (0.01, -0.5)])
def test_depth_passed_twice(damping, switch):
    """The penetration falls below the depth of the law and returns within one step of 1 s.

    ``damping`` is that of the law over its stiffness [s].
    """
    system = mass_in_y(normal=RoughSurface(STIFFNESS, HEIGHT, damping * STIFFNESS))
    run = driver.start(system, np.zeros(2), np.array([0.0, 1.0]), rtol=1e-9, method="rodas5p")
    c, row = collocation_for(1, 1, 1e-9), float(run.problem.system.rows[0, 1, 0])
    gap = float(run.problem.system.gap[0])
    c.places[0, 0], c.places[2, 0] = -(0.5 * HEIGHT + gap) / row, -2.0 * HEIGHT / row
    c.rates[1, 0] = -8.0 * HEIGHT / row
    if switch != -0.5:
        assert zero(damping, switch) == pytest.approx(0.0, abs=1e-12)
    assert found(1e-9, run.problem, c) == pytest.approx(0.5 * (switch + 1.0), abs=1e-12)


def test_force_that_vanishes_and_returns_within_a_step():
    """F = c u + d v vanishes by damping at a constant penetration, where v passes -c u / d."""
    c, d, u, begin, width, beyond = 1e4, 100.0, 1e-3, 0.625, 0.05, 1e-3
    system = mass_in_y(normal=LinearContact(c, d), friction=Frictionless(), load=Load(10.0))
    run = driver.start(system, np.array([-u, 0.0]), np.linspace(0.0, 1.0, 3), rtol=1e-8,
                       method="radau")
    # By powers of x = 2 s - 1: y = -u and y' = c u / d + beyond (1 - ((x - middle) / width)^2).
    middle = 2.0 * begin - 1.0 + width
    step, bend = run.collocation, beyond / width**2
    step.places[0, 0] = -u
    step.rates[:3, 0] = c * u / d + beyond - bend * middle**2, 2.0 * bend * middle, -bend
    assert found(1e-9, run.problem, step) == pytest.approx(begin, abs=1e-9)
