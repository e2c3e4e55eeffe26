"""The example of a pad that tips on a belt: statics, lift-off, and a run that settles there."""

import numpy as np
import pytest
import tipping_pad as example

import fecontact as fc
from fecontact import equilibrium

CASES = [(0.1, 0.0), (0.25, 0.0), (0.45, 0.0), (0.25, 35.0), (0.45, 35.0), (0.45, 200.0)]


@pytest.mark.parametrize(("friction", "angle"), CASES)
def test_forces_and_moments_balance(friction, angle):
    """About the middle of the pad at the height of the belt, with the springs' force at the top."""
    system = example.system(friction, angle)
    normal, sliding = example.forces(system)
    a = np.radians(angle)
    way = np.array([np.cos(a), np.sin(a)])
    assert normal.sum() == pytest.approx(example.LOAD, rel=1e-12)
    # On the pad friction acts along the belt's motion.
    assert -sliding == pytest.approx(friction * normal[:, None] * way, abs=1e-11)
    top = system.basis.T[0, :2] @ equilibrium(system, "sliding").modal_coordinates
    assert system.drive.stiffness_x * top == pytest.approx(-sliding.sum(axis=0), rel=1e-10)
    assert example.resultant(normal) == pytest.approx(-friction * example.HEIGHT * way, abs=1e-13)


@pytest.mark.parametrize(("friction", "angle"), CASES)
def test_pressure_is_that_below_a_rigid_pad_on_springs(friction, angle):
    wanted = example.bed(friction, angle)
    rigid, _ = example.forces(example.system(friction, angle, modes=6))
    elastic, _ = example.forces(example.system(friction, angle))
    assert rigid == pytest.approx(wanted, abs=1e-9 * wanted.max())
    assert ((elastic == 0.0) == (wanted == 0.0)).all()
    # Steel gives way by a few 1e-4 of what the bed does.
    assert np.abs(elastic - wanted).max() < 5e-4 * wanted.max()
    assert np.abs(elastic - wanted).max() > 1e-6 * wanted.max()


def test_trailing_edge_lifts_off_where_the_resultant_leaves_the_core():
    """At mu h = L / 6, for nodes in the middle of their patches a little later."""
    x = np.unique(example.pad().contact_places[:, 0].round(9))
    nodes = example.PATCHES[0]
    assert np.ptp(x) == pytest.approx(example.LENGTH * (1.0 - 1.0 / nodes))
    edge = example.LENGTH / 6.0 * (1.0 + 1.0 / nodes) / example.HEIGHT
    for part, lifted in ((0.999, 0), (1.001, example.PATCHES[1])):
        normal, _ = example.forces(example.system(part * edge, modes=6))
        assert np.count_nonzero(normal == 0.0) == lifted


@pytest.mark.parametrize("friction", [0.1, 0.25, 0.45])
def test_pressure_along_the_pad_follows_the_closed_form(friction):
    basis = example.pad()
    normal, _ = example.forces(example.system(friction))
    pressure, x = normal / basis.tributary, basis.contact_places[:, 0]
    wanted = example.pressure(friction, x)
    # Patches take the mean over their length: the closed form has a corner at lift-off.
    assert pressure == pytest.approx(wanted, abs=0.012 * wanted.max())


@pytest.mark.parametrize(("friction", "angle"), [(0.25, 0.0), (0.45, 35.0)])
def test_a_run_from_rest_settles_where_statics_say(friction, angle):
    system = example.system(friction, angle)
    run = fc.simulate(system, 0.15, outputs=31, rtol=1e-7)
    wanted, sliding = example.forces(system)
    assert np.abs(run.normal_force[0] - wanted).max() > 0.1 * wanted.max()
    assert run.normal_force[-1] == pytest.approx(wanted, abs=1e-7 * wanted.max())
    assert run.friction_forces[-1] == pytest.approx(sliding, abs=1e-7 * wanted.max())
    # Friction takes what the belt gives: the work of its force in the slip, mu N V a second.
    power = np.diff(run.friction_work.sum(axis=1)[-2:]) / np.diff(run.time[-2:])
    assert power == pytest.approx(friction * example.LOAD * example.SPEED, rel=1e-6)
    assert abs(run.energies.imbalance) < 1e-5
