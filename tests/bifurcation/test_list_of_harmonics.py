"""Harmonic balance with some harmonics left out, against all harmonics and Galerkin's method."""

import numpy as np
import pytest
from oscillators import duffing, duffing_frequency, jenkins_system, unilateral
from scipy.optimize import fsolve
from systems import TURN

from fecontact import ContactSystem, Drive, Load, PointLoad, basis_from_matrices
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    frequency_response,
    nonlinear_mode,
    orbit_branch,
)
from fecontact.core.errors import InputError
from fecontact.io import read_response, write_response
from fecontact.laws import BilateralPolynomial, Constant

ODD = [1, 3, 5, 7]
ROW = {"observe": ("B", "y")}


def hardening(damping=0.05, force=0.18):
    """x'' + .05 x' + x + .1 x^3 = .18 cos W t, with the cubic spring as a contact node."""
    rows = np.zeros((3, 1))
    rows[1, 0] = 1.0
    return ContactSystem(
        basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows}),
        normal=BilateralPolynomial(0.0, 0.1), drive=Drive(
            stiffness_y=1.0, damping_y=damping, amplitude_y=force, frequency_hz=0.8 / TURN))


def followed(system, harmonics, bounds, **options):
    """Response over angular frequencies."""
    contact = isinstance(system, ContactSystem)
    observe = ("B", "y" if system.drive.stiffness_y else "x") if contact else [1.0, 0.0]
    low, high = np.array(bounds) / (TURN if contact else 1.0)
    return frequency_response(
        system, (low, high), None if contact else "W", observe=observe,
        method=HarmonicBalance(harmonics, **options),
        options=ContinuationOptions(points=400, largest_step=0.05, locate=False))


@pytest.mark.parametrize("stability", ["transitions", None])
@pytest.mark.parametrize("make", [hardening, duffing, jenkins_system])
def test_odd_harmonics_of_symmetric_systems(make, stability):
    """Odd harmonics alone are those of all harmonics, multipliers included."""
    known = {"samples": 64, "stability": stability}
    all_, odd = (followed(make(), harmonics, (0.7, 1.4), **known).branches[0]
                 for harmonics in (7, ODD))
    assert list(odd.method.orders) == ODD
    assert all_.method.orders is None
    assert len(odd) == len(all_)
    np.testing.assert_allclose(odd.column("observed_harmonics"),
                               all_.column("observed_harmonics"), rtol=0.0, atol=2e-6)
    if stability:
        np.testing.assert_allclose(odd.column("unstable"), all_.column("unstable"))
        np.testing.assert_allclose(np.abs(odd.column("multipliers")),
                                   np.abs(all_.column("multipliers")), rtol=0.0, atol=2e-5)


def galerkin(force, orders, load, guess):
    """Coefficients of cosines and sines, x'' + force(x, x') = load cos W t at W = 1.1."""
    w, t = 1.1, np.arange(4096) * 2.0 * np.pi / 4096
    basis = np.concatenate([[np.cos(k * t), np.sin(k * t)] if k else [np.ones_like(t)]
                            for k in orders])
    turns = np.concatenate([[k, k] if k else [0] for k in orders])
    slopes = np.concatenate([[-k * np.sin(k * t), k * np.cos(k * t)] if k else [0.0 * t]
                             for k in orders])

    def residual(X):
        x, v = X @ basis, w * X @ slopes
        return basis @ (-(w * turns) ** 2 * X @ basis + force(x, v) - load * np.cos(t)) / len(t)

    return fsolve(residual, guess, xtol=1e-13)


@pytest.mark.parametrize("orders", [[1], [0, 1], [1, 2], [0, 1, 3]])
def test_harmonics_that_are_left_out_are_zero(orders):
    """A mass on a stop, whose motion has a mean and all harmonics, against Galerkin's method."""
    system = unilateral().system()
    branch = followed(system, orders, (1.0, 1.1), samples=4096).branches[0]
    X = branch.points[-1].values["observed_harmonics"]
    assert branch.points[-1].parameter == 1.1 / TURN
    assert not np.delete(X, orders).any()

    def force(x, v):
        return x + 0.1 * v + 3.0 * np.minimum(x, 0.0)

    # The drive moves as a sine: a quarter of a period later it is a cosine.
    X = X * np.exp(0.5j * np.pi * np.arange(len(X)))
    found = np.concatenate([[X[k].real, -X[k].imag] if k else [X[0].real] for k in orders])
    np.testing.assert_allclose(galerkin(force, orders, 1.0, found), found, rtol=0.0, atol=2e-6)


@pytest.mark.parametrize("force", [1e-3, 1e-2])
def test_truncation_error_counts_what_is_left_out(force):
    """A weakly nonlinear spring: the estimate is the mean that one harmonic more has."""
    # Its force is -.3 y^2 + .1 y^3.
    spring = BilateralPolynomial(-0.3, 0.1, preload=0.2, shortening=1.0)
    system = hardening(force=force).with_(normal=spring)
    one, two = (followed(system, orders, (0.5, 0.6)).branches[0].points[-1]
                for orders in ([1, 2], [0, 1, 2]))
    mean, first = np.abs(two.values["observed_harmonics"][:2])
    # Root mean squares: that of a harmonic is half its square.
    assert one.values["truncation_error"] == pytest.approx(
        np.sqrt(2.0) * mean / first, rel=0.02)
    assert two.values["truncation_error"] < 0.01 * one.values["truncation_error"]


@pytest.mark.parametrize("orders", [ODD, [1, 3, 5, 7, 9, 11, 13]])
def test_nonlinear_modes(orders):
    """Frequencies of Duffing's family against elliptic integrals, and those of all harmonics."""
    found = nonlinear_mode(hardening(damping=0.0), (0.1, 5.0), **ROW,
                           method=HarmonicBalance(orders))
    error = found.angular_frequency / duffing_frequency(found.amplitude) - 1.0
    assert np.abs(error).max() < (1e-4 if orders is ODD else 1e-8)
    assert found.conservative
    assert not found.coordinates(2).any()
    again = found.at(hardening(damping=0.0), amplitude=2.0)
    assert again.angular_frequency[0] == pytest.approx(duffing_frequency(2.0), rel=1e-5)


def test_damped_modes():
    whole, odd = (nonlinear_mode(jenkins_system(), (0.5, 30.0), method=HarmonicBalance(few, 256))
                  for few in (5, [1, 3, 5]))
    top = [one.at(jenkins_system(), amplitude=20.0) for one in (whole, odd)]
    assert top[1].damping_ratio == pytest.approx(top[0].damping_ratio, rel=1e-7)
    assert top[1].frequency_hz == pytest.approx(top[0].frequency_hz, rel=1e-7)


def test_points_are_restored(tmp_path):
    """Solutions between points, files, branches from points, with other harmonics too."""
    field = duffing()
    response = followed(field, ODD, (0.7, 0.9), samples=64)
    branch = response.branches[0]
    there = branch.at(field, 0.8)
    X = there.u[:-1].reshape(-1, 2)
    assert np.hypot(*X[1:3, 0]) == pytest.approx(0.4748720, abs=2e-7)
    assert not X[[0, 3, 4, 7, 8, 11, 12]].any()
    write_response(tmp_path / "odd.h5", response)
    read = read_response(tmp_path / "odd.h5").branches[0]
    np.testing.assert_array_equal(read.at(field, 0.8).u, there.u)
    few = ContinuationOptions(points=5, largest_step=0.05)
    same, more = (orbit_branch(field, read.points[-1], bounds=(0.7, 1.0), method=method,
                               options=few) for method in (None, HarmonicBalance(7)))
    assert list(same.method.orders) == ODD
    assert more.method.orders is None
    assert same.points[-1].values["maximum"] == pytest.approx(
        more.points[-1].values["maximum"], rel=1e-6)


def test_full_lists_are_numbers():
    assert HarmonicBalance([0, 1, 2]).orders is None
    assert HarmonicBalance((3, 1)).orders == (1, 3)
    assert HarmonicBalance(np.array([1, 3])).highest == 3


def test_a_mean_under_constant_loads_is_needed():
    system = hardening().with_(load=Load(forces=(PointLoad("B", "y", signal=Constant(0.1)),)))
    with pytest.raises(InputError, match=r"harmonics = \[1, 3\] leave out the mean, but"):
        followed(system, [1, 3], (0.7, 0.8))
    with pytest.raises(InputError, match=r"harmonics = \[1, 3\] leave out the mean, but"):
        nonlinear_mode(system, (0.1, 0.5), method=HarmonicBalance([1, 3]), **ROW)
