"""Event-driven runs of small systems: what they take for granted, and that results are the same."""

from math import comb

import numpy as np
import pytest
from set_valued_runs import start_set_valued
from systems import TURN, two_mass_system

from fecontact import ContactSystem, Drive, Ground, Load, ModalBasis
from fecontact.integrate.bernstein import of_nested
from fecontact.integrate.nonsmooth.event_driven import SMALL, run_events
from fecontact.integrate.nonsmooth.problem import EVENTS, Output
from fecontact.integrate.step_loop import REJECTIONS, RUNNING
from fecontact.laws import ExponentialFriction, PrescribedForce, RoughSurface

FRICTION = ExponentialFriction(0.8, 0.55, 1000.0, 1e6)
DRIVE = Drive(stiffness_x=5610.0, damping_x=0.768, amplitude_x=0.5e-3, frequency_hz=13.8 / TURN)


def system(modes, nodes):
    """Section 4 with one to three modes, or with two masses on the belt."""
    T = np.zeros((2 + nodes, 3, modes))
    T[0, 0, 0] = T[2, 0, 0] = 0.42
    w = np.array([0.0, 0.0, 188.0])[:modes]
    if nodes == 2:
        T[3, 0, 1], w[1] = 0.3, 25.0
    elif modes > 1:
        T[1:, 1, 1] = 0.42
    if modes == 3:
        T[0, 0, 2], T[2, 0, 2] = 0.21, -0.21
    level = nodes == 2 or modes == 1
    return ContactSystem(
        ModalBasis(w, np.diag(0.02 * w), T, np.zeros((2 + nodes, 2)), np.full(nodes, 1.0 / nodes)),
        normal=PrescribedForce(14.0) if level else RoughSurface(10e6, 10e-6, 40.0),
        friction=FRICTION, ground=Ground(speed=1e-3), drive=DRIVE,
        load=Load(0.0 if level else 14.0))


def run_of(system, end=2.0, **options):
    return start_set_valued(system, np.zeros(2 * system.basis.modes), np.linspace(0.0, end, 401),
                        **{"rtol": 1e-7, **options})


def finished(go):
    while go(2000) == RUNNING:
        pass


@pytest.mark.parametrize(("modes", "nodes"), SMALL.sizes)
def test_what_runs_of_small_systems_take_for_granted(modes, nodes):
    said, found = SMALL.values(modes, nodes), 0
    given = run_of(system(modes, nodes)).loop.args
    for values in (*given[0], given[0].problem.system, given[0].workspace.flights):
        for field, expected in said.get(type(values), {}).items():
            value = getattr(values, field)
            if isinstance(expected, tuple):
                for length, wanted in zip(value.shape, expected, strict=True):
                    assert wanted in (length, None), field
            else:
                np.testing.assert_array_equal(value, expected, field)
            found += 1
    # Outputs and what is kept between them are two of one kind.
    assert found == sum(map(len, said.values())) + len(said[Output])


@pytest.mark.parametrize(("modes", "nodes"), SMALL.sizes)
def test_same_results_as_by_the_run_of_all_systems(modes, nodes):
    own, other = (run_of(system(modes, nodes)) for _ in range(2))
    assert own.loop.func is not run_events
    finished(own.advance)
    finished(lambda most: run_events(*other.loop.args, most))
    assert own.progress.counts[EVENTS] == other.progress.counts[EVENTS] > 2
    for name in ("states", "friction", "normal"):
        found, expected = getattr(own.output, name), getattr(other.output, name)
        scale = np.abs(expected).max(axis=0)
        apart = np.abs(found - expected) / np.where(scale > 0.0, scale, 1.0)
        # Rounding shifts the ends of steps, within the tolerance, and those of slip.
        assert np.median(apart) < 1e-7, name
        assert (apart < 1e-5).mean() > 0.99, name


def test_other_systems_have_the_run_of_all():
    plain = system(1, 1)
    T = np.concatenate([plain.basis.T, plain.basis.T[-1:]])
    together = ModalBasis(plain.basis.angular_frequencies, plain.basis.damping, T,
                          np.zeros((4, 2)), np.full(2, 0.5))
    assert run_of(plain.with_(basis=together)).loop.func is run_events
    assert run_of(two_mass_system()).loop.func is not run_events


def test_steps_at_the_limit_of_stability_seldom_fail():
    # The load comes all at once: the normal contact rings at 150 Hz for some seconds.
    run = run_of(system(3, 1), end=9.0, rtol=1e-6)
    finished(run.advance)
    assert run.progress.counts[REJECTIONS] < 0.22 * run.attempts


def test_bernstein_coefficients_of_nested_products():
    s, degree = np.linspace(0.0, 1.0, 9), 7
    bernstein = np.array([comb(degree, i) * s**i * (1.0 - s) ** (degree - i)
                          for i in range(degree + 1)])
    wanted = [np.ones_like(s)]
    for k in range(degree):
        wanted.append(wanted[-1] * (s if k % 2 == 0 else 1.0 - s))
    np.testing.assert_allclose(of_nested(degree) @ bernstein, wanted, rtol=1e-14, atol=1e-15)
