"""Base excitation through a spring and a dashpot that share their driven end: transmissibility."""

import numpy as np
import pytest
from systems import TURN

from fecontact import (
    ContactSystem,
    Drive,
    InputError,
    Status,
    Study,
    basis_from_matrices,
    simulate,
)
from fecontact.analysis import receptance
from fecontact.integrate import Rodas5P, Scipy, SetValued
from fecontact.laws import ConstantFriction, Harmonic, PrescribedForce

MASS, STIFFNESS, ZETA, AMPLITUDE = 2.0, 800.0, 0.15, 1e-3
W0 = np.sqrt(STIFFNESS / MASS)
DAMPING = 2.0 * ZETA * np.sqrt(STIFFNESS * MASS)


def system(r, dashpots="relative", **drive):
    """A mass on spring and dashpot along x, whose contact carries no force."""
    row = np.array([[[1.0], [0.0], [0.0]]])
    basis = basis_from_matrices([[MASS]], [[0.0]], {"contact": row, "B": row[0]})
    drive = drive or {"amplitude_x": AMPLITUDE, "frequency_hz": r * W0 / TURN}
    return ContactSystem(basis, normal=PrescribedForce(0.0), friction=ConstantFriction(0.3),
                         drive=Drive(STIFFNESS, 0.0, DAMPING, dashpots=dashpots, **drive))


def response(r, dashpots="relative"):
    """Complex amplitude of the mass over that of the base."""
    carried = 2j * ZETA * r if dashpots == "relative" else 0.0
    return (1.0 + carried) / (1.0 - r**2 + 2j * ZETA * r)


def steady(r, times, dashpots="relative"):
    """Displacement and velocity of the forced vibration."""
    turning = AMPLITUDE * response(r, dashpots) * np.exp(1j * r * W0 * times)
    return turning.imag, (1j * r * W0 * turning).imag


def test_transmissibility_is_that_of_the_textbook():
    for r in (0.5, 1.0, np.sqrt(2.0), 3.0):
        assert abs(response(r)) == pytest.approx(np.sqrt(
            (1.0 + (2.0 * ZETA * r) ** 2) / ((1.0 - r**2) ** 2 + (2.0 * ZETA * r) ** 2)))
    assert abs(response(np.sqrt(2.0))) == pytest.approx(1.0)


@pytest.mark.parametrize("solver", [Rodas5P(), Scipy("Radau"), SetValued()],
                         ids=lambda solver: solver.name)
@pytest.mark.parametrize("r", [0.7, np.sqrt(2.0), 3.0])
def test_mass_follows_its_base(solver, r):
    driven = system(r)
    period = 2.0 * np.pi / (r * W0)
    times = np.linspace(0.0, 3.0 * period, 301)
    x, v = steady(r, times)
    run = simulate(driven, times[-1], outputs=times, rtol=1e-9, solver=solver,
                   initial=np.sqrt(MASS) * np.array([x[0], v[0]]))
    assert run.status is Status.FINISHED
    size = np.abs(x).max()
    np.testing.assert_allclose(run.displacement("B")[:, 0], x, atol=1e-6 * size)
    np.testing.assert_allclose(run.velocity("B")[:, 0], v, atol=1e-6 * size * r * W0)
    energies = run.energies
    assert energies.imbalance < 1e-6
    # The dashpot turns its relative motion into heat, which the base has put in.
    relative = AMPLITUDE * abs(response(r) - 1.0)
    heat = 3.0 * np.pi * DAMPING * r * W0 * relative**2
    assert energies.dashpots[-1] == pytest.approx(heat, rel=1e-5)
    assert energies.drive_work[-1] == pytest.approx(heat, rel=1e-5)
    # Absolute dashpots give another motion, by far.
    assert abs(abs(response(r, "absolute")) / abs(response(r)) - 1.0) > 0.02


def test_base_that_drags_by_a_dashpot_alone():
    """Without spring: m v' = -b (v - u'), the harmonic base of speed a w cos(w t)."""
    w, rate = 30.0, DAMPING / MASS
    row = np.array([[[1.0], [0.0], [0.0]]])
    basis = basis_from_matrices([[MASS]], [[0.0]], {"contact": row, "B": row[0]})
    dragged = ContactSystem(
        basis, normal=PrescribedForce(0.0), friction=ConstantFriction(0.3),
        drive=Drive(damping_x=DAMPING, dashpots="relative", motion_x=Harmonic(AMPLITUDE, w / TURN)))
    run = simulate(dragged, 1.0, initial=np.zeros(2), outputs=101, rtol=1e-9)
    t, amount = run.time, AMPLITUDE * w * rate / (rate**2 + w**2)
    exact = amount * (rate * np.cos(w * t) + w * np.sin(w * t) - rate * np.exp(-rate * t))
    np.testing.assert_allclose(run.velocity("B")[:, 0], exact, atol=1e-7 * AMPLITUDE * w)
    assert run.energies.imbalance < 1e-6


def test_receptance_is_that_of_a_held_base():
    """A force on the mass does not see how the base moves."""
    frequencies = np.array([0.5, 1.0, 2.0]) * W0 / (2.0 * np.pi)
    found = [receptance(system(1.0, kind), frequencies, [("B", "x")]).values[:, 0, 0]
             for kind in ("relative", "absolute")]
    w = 2.0 * np.pi * frequencies
    exact = 1.0 / (STIFFNESS - MASS * w**2 + 1j * DAMPING * w)
    for values in found:
        np.testing.assert_allclose(values, exact, rtol=1e-9)


def test_dashpots_in_a_study(tmp_path):
    text = """
[geometry]
shape = "beam"
length = 0.2
height = 0.02
element_size = 0.01

[basis]
modes = 4
contact_nodes = 2

[body]
thickness = 1.0

[normal]
stiffness = 1e6
roughness_height = 5e-6

[friction]
law = "frictionless"

[drive]
stiffness_x = 1e4
damping_x = 5.0
amplitude_x = 1e-4
frequency_hz = 47.75
dashpots = "relative"
"""
    study = Study.from_toml(text)
    assert study.system().drive.dashpots == "relative"
    assert Study.from_toml(study.to_toml()).drive == study.drive
    assert Study.from_toml(text.replace('dashpots = "relative"\n', "")).drive.dashpots == "absolute"
    with pytest.raises(InputError, match='dashpots = "relativ" must be "absolute" or "relative"'):
        Study.from_toml(text.replace('"relative"', '"relativ"'))
