"""Forces of large deflections in compiled methods: by closed forms and by differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from fecontact import (
    ContactSystem,
    InputError,
    Load,
    LoadPath,
    ModalBasis,
    PointLoad,
    equilibrium,
    load_history,
    sensitivity,
    simulate,
)
from fecontact.integrate import EventDriven, PowerSeries, Rodas5P, SetValued, TimeStepping
from fecontact.laws import ConstantFriction, JenkinsFriction, LinearContact, PrescribedForce
from fecontact.reduction.large_deflections.forces import LargeDeflectionForces


def forces(coordinates, pairs, cubic, quartic):
    """Forces of large deflections with a potential."""
    d = len(coordinates)
    return LargeDeflectionForces(
        np.array(coordinates, float), np.array(pairs), np.array(cubic, float),
        np.array(quartic, float), np.outer(np.ones(d), [-10.0, 10.0]), 1.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        1)


def basis(w, given, nodes=0, damping=0.0):
    """Modes with frequencies w (m,); B moves with the first, contact nodes with all along x."""
    m = len(w)
    T = np.zeros((2 + nodes, 3, m))
    T[0, 1, 0] = 1.0
    T[2:, 0] = np.linspace(1.0, 0.5, m)
    T[2:, 1, -1] = 1.0
    return ModalBasis(np.array(w, float), damping * np.diag(w), T, np.zeros((2 + nodes, 2)),
                      np.ones(nodes), large_deflections=(given,))


def duffing(cubic, w=1.0):
    """Oscillator x'' + w^2 x + c x^3 = 0."""
    return ContactSystem(basis([w], forces([[1.0]], [[0, 0]], [[0.0]], [[0.5 * cubic]])))


def three_modes(nodes=0):
    """Two modes with all coefficients of the degrees three and four, and a linear third."""
    quartic = 0.5 * np.array([[8.0, 2.0, 6.0], [2.0, 12.0, 1.0], [6.0, 1.0, 9.0]])
    # Symmetric tensor: the coefficient of x^2 y^2 stands in two places.
    quartic[0, 2] = quartic[2, 0] = 0.25 * quartic[1, 1]
    return basis([1.0, 1.7, 6.0], forces(
        np.eye(2, 3), [[0, 0], [0, 1], [1, 1]],
        [[0.3, 0.2, -2.0], [0.4, 0.5, 1.0], [0.25, -0.1, -3.0]], quartic), nodes, 0.02)


@pytest.mark.parametrize("solver", [Rodas5P(), PowerSeries(), EventDriven(), TimeStepping()],
                         ids=lambda one: type(one).__name__)
def test_period_of_duffings_oscillator(solver):
    """A quarter of the exact period later x = 0; energy is kept at all times."""
    c, a = 3.0, 1.2
    k2 = 0.5 * c * a**2 / (1.0 + c * a**2)
    quarter = ellipk(k2) / np.sqrt(1.0 + c * a**2)
    run = simulate(duffing(c), quarter, initial=np.array([a, 0.0]), outputs=9, rtol=1e-8,
                   solver=solver)
    assert run.states[-1, 0] == pytest.approx(0.0, abs=1e-6)
    energy = 0.5 * a**2 + 0.25 * c * a**4
    assert run.energies.kinetic + run.energies.elastic == pytest.approx(energy, rel=1e-6)
    assert run.states[-1, 1] == pytest.approx(-np.sqrt(2.0 * energy), rel=1e-6)


def differences(system, end, start):
    """Derivatives of the end of a run to its start, by differences."""
    h, found = 1e-5, []
    for k in range(len(start)):
        ends = [simulate(system, end, initial=start + sign * h * np.eye(len(start))[k], outputs=2,
                         rtol=1e-11, solver=Rodas5P()).states[-1] for sign in (1.0, -1.0)]
        found.append((ends[0] - ends[1]) / (2.0 * h))
    return np.array(found).T


@pytest.mark.parametrize("memory", [False, True])
def test_derivatives_of_runs(memory):
    """Along the motion, and by the stages of its steps where friction has memory."""
    given = three_modes(int(memory))
    system = ContactSystem(given, PrescribedForce(1e3), JenkinsFriction(2.0, 1.0)) if memory else (
        ContactSystem(given))
    start = np.zeros(system.size)
    start[:6] = 0.5, -0.4, 0.1, 0.2, 0.3, -0.1
    found = sensitivity(system, 1.5, initial=start, rtol=1e-9, solver=Rodas5P())
    assert not found.note
    exact = differences(system, 1.5, start)
    assert found.transitions[-1] == pytest.approx(exact, abs=2e-6 * np.abs(exact).max())


def test_rest_states():
    """K q + V'(q) = f, by loading in steps too; work is what the body stores."""
    given = three_modes()
    system = ContactSystem(given, load=Load(forces=(PointLoad("B", "y", signal=4.0),)))
    rest = equilibrium(system)
    q = rest.modal_coordinates
    residual = system.rhs(0.0, np.append(q, np.zeros(3)))[3:]
    assert residual == pytest.approx(np.zeros(3), abs=1e-9)
    # Without the forces of large deflections it would be 4.
    assert 0.5 < q[0] < 1.5
    history = load_history(system, LoadPath(load_scale=(0.0, 1.0)))
    assert history.modal_coordinates[-1] == pytest.approx(q, rel=1e-7)
    assert np.abs(history.imbalance).max() < 1e-3 * history.work[-1]
    linear = load_history(ContactSystem(replace(given, large_deflections=()), load=system.load),
                          LoadPath(load_scale=(0.0, 1.0)))
    assert linear.modal_coordinates[-1, 0] == pytest.approx(4.0)


def test_two_wells():
    """x'' - x + x^3 = 0 rests at one of +-1, never on the crest."""
    given = forces([[1.0]], [[0, 0]], [[0.0]], [[0.5]])
    negative = replace(basis([0.0], given), stiffness=np.array([[-1.0]]))
    assert abs(equilibrium(ContactSystem(negative)).modal_coordinates[0]) == pytest.approx(1.0)


def test_impacts_are_refused():
    system = ContactSystem(three_modes(1), LinearContact(1e3), ConstantFriction(0.3))
    with pytest.raises(InputError, match="but the basis has large deflections"):
        simulate(system, 1.0, initial=np.zeros(6), solver=SetValued(restitution=0.5))
