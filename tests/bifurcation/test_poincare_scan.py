"""Lyapunov exponents, diagrams by brute force, basins: linear systems, known regimes."""

import numpy as np
import pytest
from systems import TURN, basis, impact_oscillator, mass_in_y

from fecontact import (
    AnalysisError,
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    sensitivity,
    simulate,
)
from fecontact.bifurcation import Axis, basins, lyapunov_exponents, poincare_scan
from fecontact.integrate import Crossing, strobe
from fecontact.laws import ConstantFriction, PowerContact, PrescribedForce, ProductFriction


def test_exponents_of_a_linear_oscillator():
    """Out of contact: both pairs decay with half the damping over the mass, and 2 D w over two."""
    system = impact_oscillator(2).with_(gap=1.0)
    found = lyapunov_exponents(system, 2.0, initial=np.array([1e-4, 1e-5, 0.0, 0.0]), count=4,
                               interval=0.01, rtol=1e-10)
    A = np.block([[np.zeros((2, 2)), np.eye(2)],
                  [-system.arrays.stiffness, -system.arrays.damping]])
    wanted = np.sort(np.linalg.eigvals(A).real)[::-1]
    # Pairs rotate, which blurs each exponent but not the sum of a pair.
    assert found.exponents[:2].sum() == pytest.approx(wanted[:2].sum(), abs=2.0)
    assert found.exponents.sum() == pytest.approx(np.trace(A), rel=1e-3)
    assert found.history.shape == (200, 4)


@pytest.mark.parametrize(("w", "low", "high"), [
    (64.32, -7.3, -5.2), (30.84, -4.1, -3.0), (23.63, 4.5, 8.0)])
def test_exponents_of_the_impact_oscillator(w, low, high):
    """Multipliers of the orbits give -6.254 and -3.574 1/s; chaos at 23.63 rad/s, about +6 1/s."""
    period = 2.0 * np.pi / w
    found = lyapunov_exponents(impact_oscillator(2, w), 200 * period, transient=50 * period,
                               initial=np.zeros(4))
    assert low < found.exponents[0] < high
    assert found.uncertainty[0] < 2.0


def test_growth_is_that_of_the_derivative_of_the_motion():
    """Over one interval: the length of the derivative times the first direction."""
    system = impact_oscillator(2)
    found = lyapunov_exponents(system, 0.05, interval=0.05, initial=np.zeros(4))
    first = np.linalg.qr(np.random.default_rng(0).normal(size=(4, 1)))[0]
    carried = sensitivity(system, 0.05, initial=np.zeros(4), rtol=1e-6).monodromy @ first
    assert found.exponents[0] == pytest.approx(np.log(np.linalg.norm(carried)) / 0.05, rel=1e-9)


@pytest.mark.parametrize(("w", "periods", "wanted"), [(64.32, 1, -6.254192), (30.84, 2, -3.573516)])
def test_multipliers_at_loose_tolerance(w, periods, wanted):
    """Near rtol = 1e-6 they are what they are at 1e-11, impacts and all.

    Which error a single tolerance has there is chance.
    """
    system, period = impact_oscillator(2, w), 2.0 * np.pi / w * periods
    orbit = strobe(system, transient_periods=300, keep=1, initial=np.zeros(4),
                   rtol=1e-10).states[0, 0]
    for rtol, relative in ((1e-6, 5e-4), (1e-10, 5e-7)):
        errors = []
        for part in (0.6, 0.8, 1.0, 1.25, 1.6):
            found = sensitivity(system, period, initial=orbit, rtol=part * rtol).monodromy
            largest = np.log(np.abs(np.linalg.eigvals(found)).max()) / period
            errors.append(abs(largest / wanted - 1.0))
        assert np.median(errors) < relative
        assert max(errors) < 4.0 * relative


def test_brute_force_meets_single_runs():
    system = impact_oscillator(2)
    values = np.linspace(60.0, 65.0, 5) / TURN
    found = poincare_scan(system, "drive.frequency_hz", values, transient_periods=60, keep=4,
                          initial=np.zeros(4), chains=2)
    assert found.up.shape == found.down.shape == (5, 4, 4)
    alone = strobe(system.with_(**{"drive.frequency_hz": 60.0 / TURN}), transient_periods=60,
                   keep=4, initial=np.zeros(4), rtol=1e-5)
    assert (found.up[0] == alone.states[0]).all()
    # The way down begins at the last value.
    last = strobe(system.with_(**{"drive.frequency_hz": 65.0 / TURN}), transient_periods=60,
                  keep=4, initial=np.zeros(4), rtol=1e-5)
    assert (found.down[-1] == last.states[0]).all()
    assert (found.up[-1] != last.states[0]).any()
    y, _ = found.observed("B", "y")
    assert y[0] == pytest.approx(found.up[0, :, :2] @ system.basis.T[0, 1])
    # Period one at all of these values: up and down meet.
    assert np.abs(found.up - found.down).max() < 1e-3 * np.abs(found.up).max()

    def faster(system, value):
        return system.with_(**{"drive.frequency_hz": value})

    same = poincare_scan(system, faster, values, transient_periods=60, keep=4, initial=np.zeros(4),
                         chains=2, down=False)
    assert same.parameter == "faster"
    assert (same.up == found.up).all()
    assert len(same.down) == 0


def belt(B=1.0, **changes):
    """One mass on a belt with the product law: steady sliding and stick-slip beside each other."""
    shape = np.array([[1.0], [0.0]])
    return ContactSystem(
        basis([0.0], [0.0], shape, shape), normal=PrescribedForce(B),
        friction=ProductFriction(0.14, 1.14, 2.0, 100.0), ground=Ground(speed=1.0),
        drive=Drive(stiffness_x=1.0, damping_x=0.04), load=Load(0.0), **changes)


def test_basins_of_sliding_and_stick_slip():
    """Steady sliding inside an unstable cycle, stick-slip outside: as single runs end up."""
    system = belt().with_(**{"drive.damping_x": 0.09})
    x, v = np.array([0.2, 0.8, 1.6, 2.4]), np.array([-1.2, -0.4, 0.5])
    found = basins(system, (Axis("B", "x"), x), (Axis("B", "x", "velocity"), v), transient=600.0,
                   keep=8, section=Crossing("B", "x", value=0.05, of="velocity",
                                            sense="falling"))
    assert [one.kind for one in found.attractors] == ["periodic", "equilibrium"]
    swings = np.array([[np.ptp(simulate(system, 600.0, initial=np.array([place, speed]),
                                        outputs=6001).states[-600:, 0]) for speed in v]
                       for place in x])
    assert (found.label == np.where(swings > 0.5, 0, 1)).all()
    assert [one.share for one in found.attractors] == pytest.approx([8 / 12, 4 / 12])
    # Sliding: the spring holds the friction, x = R / c.
    force = 0.14 * (1.0 + 1.14 * np.exp(-2.0)) * np.arctan(100.0)
    assert found.attractors[1].points[0, 0] == pytest.approx(force, rel=1e-6)


def test_basins_of_an_excited_system():
    """Impacts at 64.32 rad/s: one motion of period one from everywhere."""
    found = basins(impact_oscillator(2), (Axis("B", "y"), [0.0, 2e-4, 4e-4]),
                   (Axis("B", "y", "velocity"), [-0.01, 0.02]), transient_periods=120, keep=6)
    assert len(found.attractors) == 1
    assert found.attractors[0].kind == "periodic"
    assert len(found.attractors[0].points) == 1
    assert found.attractors[0].share == 1.0


def test_a_damped_mass_comes_to_rest():
    shape = np.array([[1.0], [0.0]])
    system = ContactSystem(
        basis([0.0], [0.0], shape, shape), normal=PrescribedForce(1.0),
        friction=ConstantFriction(0.0), drive=Drive(stiffness_x=4.0, damping_x=0.8))
    found = basins(system, (Axis("B", "x"), [0.5, 1.0]), (Axis("B", "x", "velocity"), [0.0, 1.0]),
                   transient=60.0, section=Crossing("B", "x", value=1e-3, sense="rising"))
    assert [one.kind for one in found.attractors] == ["equilibrium"]
    assert np.abs(found.attractors[0].points).max() < 1e-6


def test_bad_input():
    system = impact_oscillator(2)
    with pytest.raises(InputError, match="ascending order"):
        poincare_scan(system, "drive.frequency_hz", [2.0, 1.0])
    with pytest.raises(InputError, match=r"no parameter 'drive\.frequency'"):
        poincare_scan(system, "drive.frequency", [1.0, 2.0])
    with pytest.raises(InputError, match="duration = 0"):
        lyapunov_exponents(system, 0)
    with pytest.raises(InputError, match="count = 5"):
        lyapunov_exponents(system, 1.0, count=5)
    with pytest.raises(AnalysisError, match="before its end"):
        lyapunov_exponents(mass_in_y(normal=PowerContact(1e6, exponent=6.0)), 1.0,
                           initial=[0.0, -9e59])
    with pytest.raises(InputError, match="keep = 2"):
        basins(system, (Axis("B", "y"), [0.0]), (Axis("B", "y", "velocity"), [0.0]),
               transient_periods=1, keep=2)
