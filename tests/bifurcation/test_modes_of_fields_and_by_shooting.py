"""Nonlinear modes of users' vector fields, and by shooting, against closed forms."""

import numpy as np
import pytest
from oscillators import jenkins_system
from test_nonlinear_modes import duffing_frequency, masses

import fecontact as fc
from fecontact import io, plot
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    contact_field,
    nonlinear_mode,
    vector_field,
)
from fecontact.core.errors import InputError
from fecontact.integrate import SetValued
from fecontact.laws import LinearContact

FEW = ContinuationOptions(step=0.2, largest_step=0.6, points=60)


def _two_masses(t, x, p, out):
    between = x[0] - x[1]
    out[0], out[1] = x[2], x[3]
    out[2] = p[0] * x[2] - x[0] - 0.3 * x[0]**3 - between - 0.5 * between**3 - (
        0.05 * (2.0 * x[2] - x[3]))
    out[3] = p[0] * x[3] - x[1] + between + 0.5 * between**3 - 0.05 * (2.0 * x[3] - x[2])


def _duffing(t, x, p, out):
    out[0] = x[1]
    out[1] = p[1] * x[1] - x[0] - p[0] * x[0]**3


def duffing(loss=0.0, base=0.3):
    """x'' + (loss - xi) x' + x + cubic x^3, at any base value of xi."""
    def rates(t, x, p, out):
        out[0] = x[1]
        out[1] = (p[1] - loss) * x[1] - x[0] - p[0] * x[0]**3

    return vector_field(rates, {"cubic": 0.7, "xi": base}, ("x", "v"))


@pytest.mark.parametrize("loss", [0.0, 0.04])
def test_a_field_has_the_frequency_of_the_elliptic_integral(loss):
    """Damping in proportion to the mass leaves the motion as it is; xi is that damping."""
    mode = nonlinear_mode(duffing(loss), (1e-2, 2.0), unfolding="xi", method=HarmonicBalance(15))
    exact = [duffing_frequency(1.0, 0.7, a) for a in mode.amplitude]
    assert mode.amplitude[-1] == pytest.approx(2.0, rel=1e-9)
    assert mode.angular_frequency == pytest.approx(exact, rel=1e-11)
    assert mode.xi == pytest.approx(np.full(len(mode), loss), abs=1e-9)
    assert mode.conservative == (loss == 0.0)
    assert mode.energy is None
    assert mode.observed == "x"
    assert mode.coordinates().shape == (len(mode), 2)
    if loss == 0.0:
        assert mode.stable.all()


def test_a_field_has_the_modes_of_the_system_that_it_describes():
    system = masses(first=0.3, between=0.5, damping=0.05)
    field = vector_field(_two_masses, {"xi": 0.0}, ("x", "y", "u", "v"))
    for number in (1, 2):
        wanted = nonlinear_mode(system, (0.1, 1.5), number, observe=("a.p", "y"),
                                method=HarmonicBalance(9))
        found = nonlinear_mode(field, (0.1, 1.5), number, method=HarmonicBalance(9))
        assert found.angular_frequency[-1] == pytest.approx(wanted.angular_frequency[-1], rel=1e-9)
        assert found.damping_ratio[-1] == pytest.approx(wanted.damping_ratio[-1], rel=1e-7)


def above_stop(loss):
    """A unit mass on a unit spring, a spring of 10 N/m at a distance of one below it."""
    row = np.array([[0.0], [1.0], [0.0]])
    basis = fc.basis_from_matrices([[1.0]], [[1.0]], {"contact": row[None], "B": row},
                                   damping=[[loss]])
    return fc.ContactSystem(basis, normal=LinearContact(10.0), gap=1.0)


def stop_frequency(amplitude):
    """Angular frequency of that motion at half its range: of two arcs."""
    from scipy.optimize import brentq

    w, middle = np.sqrt(11.0), 10.0 / 11.0

    def motion(top):
        speed = np.sqrt(top**2 - 1.0)
        deep = middle + np.hypot(1.0 - middle, speed / w)
        return (0.5 * (top + deep), np.arccos(-1.0 / top)
                + np.arctan2(speed / w, 1.0 - middle) / w)

    top = brentq(lambda top: motion(top)[0] - amplitude, 1.0, 10.0, xtol=1e-14)
    return np.pi / motion(top)[1]


@pytest.mark.slow
@pytest.mark.parametrize("loss", [0.0, 0.05])
def test_shooting_through_impacts_of_a_stop(loss, tmp_path):
    """The linear motion until it touches, then two arcs; the damping of the mass is xi."""
    mode = nonlinear_mode(above_stop(loss), (0.9, 3.0), observe=("B", "y"), method=Shooting(),
                          options=FEW)
    assert mode.branch.status is BranchStatus.BOUND
    assert mode.amplitude[[0, -1]] == pytest.approx([0.9, 3.0], rel=1e-6)
    for k in range(len(mode)):
        exact = 1.0 if mode.amplitude[k] <= 1.0 else stop_frequency(mode.amplitude[k])
        # Extremes are those between some hundred samples.
        assert mode.angular_frequency[k] == pytest.approx(exact, rel=2e-5)
    assert mode.xi == pytest.approx(np.full(len(mode), loss), abs=1e-7)
    if loss == 0.0:
        # All of it is kinetic or in the springs.
        top = mode.branch.points[-1].values["maximum"][0]
        assert mode.energy[-1] == pytest.approx(0.5 * top**2, rel=5e-3)
        assert mode.stable.all()
        path = io.write_mode(tmp_path / "mode.h5", mode)
        known = io.read_mode(path)
        assert known.angular_frequency == pytest.approx(mode.angular_frequency, rel=1e-15)
        assert len(plot.plot_nonlinear_mode(known).axes) == 2


def test_damped_modes_by_shooting_are_those_by_harmonic_balance():
    """A dashpot between the masses damps the second mode more, and couples both."""
    system = masses(first=0.3, between=0.5, damping=0.05)
    shot = nonlinear_mode(system, (0.1, 1.5), 2, observe=("a.p", "y"), method=Shooting(2),
                          options=FEW)
    wanted = nonlinear_mode(system, (0.1, 1.5), 2, observe=("a.p", "y"),
                            method=HarmonicBalance(13))
    assert shot.amplitude[-1] == pytest.approx(1.5, rel=1e-9)
    assert shot.angular_frequency[-1] == pytest.approx(wanted.angular_frequency[-1], rel=1e-7)
    assert shot.damping_ratio[-1] == pytest.approx(wanted.damping_ratio[-1], rel=1e-6)
    assert shot.loss[-1] == pytest.approx(wanted.loss[-1], rel=1e-6)
    assert abs(shot.harmonic(3)[-1]) == pytest.approx(abs(wanted.harmonic(3)[-1]), rel=1e-5)
    with pytest.raises(InputError, match=r"coordinates: the mode was found by shooting"):
        shot.coordinates()
    with pytest.raises(InputError, match=r"NonlinearMode.at: the mode was found by shooting"):
        shot.at(system, amplitude=1.0)


def test_errors_say_what_helps():
    system, field = masses(between=0.5), duffing()
    forced = vector_field(_duffing, {"cubic": 0.7, "xi": 0.0}, ("x", "v"), period=lambda p: 1.0)
    for given, words in (
            ((field, (0.1, 1.0)), r"parameter is missing"),
            ((forced, (0.1, 1.0), {"unfolding": "xi"}), r"the field depends on time"),
            ((contact_field(system, {}), (0.1, 1.0)), r"give the contact system in place"),
            ((system, (0.1, 1.0), {"unfolding": "xi"}), r"unfolding is for vector fields"),
            ((field, (0.1, 1.0), {"unfolding": "xi", "preload": np.zeros(2)}),
             r"preload is for contact systems"),
            ((field, (0.1, 1.0), {"unfolding": "xi", "method": Shooting()}),
             r"shooting is for contact systems"),
            ((jenkins_system(), (0.1, 1.0), {"method": Shooting()}), r"friction with memory"),
            ((system, (0.1, 1.0), {"observe": ("a.p", "y"), "method": Shooting(
                solver=SetValued())}), r"has no modes"),
            ((field, (0.1, 1.0), {"unfolding": "xi", "mode": 2}), r"from 1 to 1")):
        *first, options = given if isinstance(given[-1], dict) else (*given, {})
        with pytest.raises(InputError, match=words):
            nonlinear_mode(*first, **options)
    moved = vector_field(_moved, {"xi": 0.0}, ("x", "v"))
    with pytest.raises(InputError, match=r"'xi' moves the equilibrium"):
        nonlinear_mode(moved, (0.1, 1.0))


def _moved(t, x, p, out):
    out[0] = x[1]
    out[1] = p[0] - x[0]
