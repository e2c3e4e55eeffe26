"""Families of periodic orbits of conservative systems, with an unfolding parameter."""

import numpy as np
import pytest
from oscillators import duffing_frequency
from scipy.special import ellipk

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    branch_tree,
    codim2_curve,
    contact_field,
    equilibrium_branch,
    orbit_branch,
    orbit_family,
    vector_field,
    with_normal_form,
)
from fecontact.bifurcation.nonlinear_modes.linear_start import with_mass_damping
from fecontact.core.errors import InputError
from fecontact.integrate.field_runs.stepper import start_field
from fecontact.io import read_branch, write_branch


def pendulum(t, x, p, out):
    out[0] = x[1]
    out[1] = -np.sin(x[0]) - p[0] * x[1]


PENDULUM = vector_field(pendulum, {"damping": 0.0}, ["angle", "speed"])


def henon_heiles(t, x, p, out):
    out[0] = x[2]
    out[1] = x[3]
    out[2] = -x[0] - 2.0 * x[0] * x[1] - p[0] * x[2]
    out[3] = -x[1] - x[0] ** 2 + x[1] ** 2 - p[0] * x[3]


STARS = vector_field(henon_heiles, {"damping": 0.0}, ["x", "y", "u", "v"])


def period_of_swings(angle):
    return 4.0 * ellipk(np.sin(angle / 2.0) ** 2)


def test_periods_of_the_pendulum_over_its_amplitude():
    run = fc.simulate(PENDULUM, 14.0, initial=[1.0, 0.0], outputs=1401, rtol=1e-9)
    family = orbit_family(PENDULUM, run, bounds=(6.3, 18.0), both=True,
                          method=Collocation(intervals=80))
    angle, period = family.column("maximum")[:, 0], family.column("period")
    assert family.status is BranchStatus.BOUND
    assert np.abs(family.parameter).max() < 1e-10
    assert period == pytest.approx(period_of_swings(angle), rel=1e-8)
    assert (period.min(), period.max()) == pytest.approx((6.3, 18.0), abs=1e-9)
    assert (np.diff(period) > 0.0).all()
    assert family.special == ()
    assert family.column("stable").all()


def test_families_begin_at_centres():
    resting = equilibrium_branch(PENDULUM.with_(damping=-0.1), [0.0, 0.0], "damping",
                                 bounds=(-0.2, 0.2))
    (centre,) = resting.of_kind("Hopf")
    family = orbit_family(PENDULUM, centre, bounds=(6.0, 12.0))
    angle = family.column("maximum")[:, 0]
    assert angle[0] < 0.02
    seen = angle > 0.05
    assert np.abs(family.parameter[seen]).max() < 1e-10
    assert family.column("period")[seen] == pytest.approx(period_of_swings(angle[seen]), rel=1e-6)
    # Down again, it ends at the centre.
    smaller = orbit_family(PENDULUM, family.points[20].orbit(PENDULUM), direction=-1.0)
    assert smaller.status is BranchStatus.HOPF
    assert smaller.points[-1].values["period"] == pytest.approx(2.0 * np.pi, abs=1e-6)


@pytest.fixture(scope="module")
def straight():
    """The orbits of Henon and Heiles' potential along its axis of symmetry."""
    run = fc.simulate(STARS, 20.0, initial=[0.0, 0.1, 0.0, 0.0], outputs=2001, rtol=1e-10)
    return orbit_family(STARS, run, bounds=(6.29, 12.0), method=Collocation(intervals=80))


def test_periods_of_straight_orbits(straight):
    assert np.abs(straight.parameter).max() < 1e-10
    energies = [energy_of(point) for point in straight.points]
    for energy, period in zip(energies, straight.column("period"), strict=True):
        low, high, beyond = np.sort(np.roots([-1.0 / 3.0, 0.5, 0.0, -energy]).real)
        exact = 4.0 * np.sqrt(1.5) * ellipk((high - low) / (beyond - low)) / np.sqrt(beyond - low)
        assert period == pytest.approx(exact, rel=1e-7)


def energy_of(point):
    top = point.values["maximum"][1]
    return top**2 / 2.0 - top**3 / 3.0


def test_pitchforks_of_straight_orbits(straight):
    # M. Brack, Foundations of Physics 31 (2001) 209: at 0.969309 and 0.986709 of the energy 1/6.
    forks = straight.of_kind("branch point")
    assert [6.0 * energy_of(point) for point in forks] == pytest.approx([0.969309, 0.986709],
                                                                        abs=1e-6)
    assert [point.parameter for point in forks] == pytest.approx([0.0, 0.0], abs=1e-10)
    # Between these and where two multipliers are -1 the other pair is on the unit circle.
    assert len(straight.of_kind("period doubling")) == 3
    for one in straight.points:
        mu = one.values["multipliers"]
        assert np.prod(mu).real == pytest.approx(1.0, abs=1e-4)
        if one.kind == "period doubling":
            assert np.sort(np.abs(mu + 1.0))[:2] == pytest.approx([0.0, 0.0], abs=2e-3)


def test_multipliers_of_families_are_those_of_runs(straight):
    point = next(one for one in straight.points if one.values["unstable"] == 1)
    orbit = point.orbit(STARS)
    run = start_field(STARS, orbit.states[0], np.array([0.0, orbit.period]), rtol=1e-11, vary=True)
    run.advance(10**6)
    found = np.linalg.eigvals(run.transitions[1])
    assert np.abs(found).max() == pytest.approx(np.abs(point.values["multipliers"]).max(), rel=1e-5)
    assert np.abs(found).max() > 1.001


def test_linear_families_keep_their_period():
    def linear(t, x, p, out):
        out[0] = x[1]
        out[1] = -4.0 * x[0] - p[0] * x[1]

    field = vector_field(linear, {"damping": 0.0}, 2)
    family = orbit_family(field, fc.simulate(field, 10.0, initial=[1.0, 0.0]),
                          options=ContinuationOptions(points=20))
    assert family.column("period") == pytest.approx(np.pi, abs=1e-10)
    assert family.column("maximum")[-1, 0] > 1.5


def damped(t, x, p, out):
    out[0] = x[1] + (p[0] - x[0] ** 2 - x[1] ** 2) * x[0]
    out[1] = -x[0] + (p[0] - x[0] ** 2 - x[1] ** 2) * x[1]


def test_what_is_no_family_is_refused():
    field = vector_field(damped, {"a": 1.0}, 2)
    run = fc.simulate(field, 20.0, initial=[1.0, 0.0])
    with pytest.raises(fc.InputError, match="not conservative"):
        orbit_family(field, run, options=ContinuationOptions(points=20))
    swing = fc.simulate(PENDULUM, 14.0, initial=[1.0, 0.0])
    with pytest.raises(fc.InputError, match="outside the bounds"):
        orbit_family(PENDULUM, swing, bounds=(7.0, 8.0))
    with pytest.raises(fc.InputError, match="no parameter 'c'"):
        orbit_family(PENDULUM, swing, "c")
    forced = vector_field(pendulum, {"damping": 0.0}, 2, period=lambda p: 1.0)
    with pytest.raises(fc.InputError, match="depends on time"):
        orbit_family(forced, swing)


def test_orbits_of_families_are_no_single_orbits(straight, tmp_path):
    again = read_branch(write_branch(tmp_path / "family.h5", straight))
    point, doubling = again.points[5], again.of_kind("period doubling")[0]
    wrong = r"is one of a family of orbits at the same parameters; use orbit_family\(field, point"
    for refused in (lambda: orbit_branch(STARS, point),
                    lambda: orbit_branch(STARS, doubling),
                    lambda: orbit_branch(STARS, point, method=Shooting()),
                    lambda: branch_tree(STARS, again),
                    lambda: with_normal_form(STARS, doubling),
                    lambda: codim2_curve(STARS, point, "other", keep="period"),
                    lambda: again.at(STARS, 0.0)):
        with pytest.raises(InputError, match=wrong):
            refused()
    larger = orbit_family(STARS, point.orbit(STARS), bounds=(6.29, 12.0),
                          method=Collocation(intervals=80), options=ContinuationOptions(points=2))
    assert larger.points[0].values["period"] == pytest.approx(point.values["period"], rel=1e-6)


def mass_on_a_spring():
    """x'' + x + .1 x^3 = 0 as a contact system, with a damping of the mass to unfold its orbits."""
    rows = np.zeros((3, 1))
    rows[1, 0] = 1.0
    return contact_field(fc.ContactSystem(
        fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows}),
        normal=fc.laws.BilateralPolynomial(0.0, 0.1), drive=fc.Drive(stiffness_y=1.0)),
        {"xi": (0.0, with_mass_damping)})


@pytest.mark.parametrize("method", [Collocation(intervals=40), HarmonicBalance(15),
                                    Shooting(segments=2)])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_families_by_any_method(method, direction, tmp_path):
    """Periods of a hardening spring against elliptic integrals, to larger and smaller motions."""
    field = mass_on_a_spring()
    t = np.linspace(0.0, 5.5, 201)
    guess = np.stack([2.0 * np.cos(2.0 * np.pi * t / 5.5), -2.2 * np.sin(2.0 * np.pi * t / 5.5)], 1)
    bounds = (4.5, 5.55) if direction > 0.0 else (5.3, 6.2)
    family = orbit_family(field, (t, guess), method=method, direction=direction, bounds=bounds,
                          options=ContinuationOptions(points=60, largest_step=0.3))
    sizes, period = family.column("maximum")[:, 0], family.column("period")
    assert family.status is BranchStatus.BOUND
    assert np.abs(family.parameter).max() < 1e-8
    assert (np.diff(sizes) * direction > 0.0).all()
    w = np.array([duffing_frequency(size) for size in sizes])
    assert period == pytest.approx(2.0 * np.pi / w, rel=2e-6)
    assert family.column("stable").all()
    read = read_branch(write_branch(tmp_path / "f.h5", family))
    assert read.points[-1].orbit(field).states == pytest.approx(
        family.points[-1].orbit(field).states, abs=1e-9)


def test_families_of_two_stars_by_harmonic_balance():
    """Periods and stability of the straight family are those by collocation."""
    run = fc.simulate(STARS, 8.0, initial=[0.0, 0.2, 0.0, 0.0], outputs=801, rtol=1e-9)
    one, other = (orbit_family(STARS, run, method=method, bounds=(6.0, 7.2),
                               options=ContinuationOptions(points=40, largest_step=0.2))
                  for method in (Collocation(intervals=40), HarmonicBalance(25)))
    assert len(other) > 5
    size, period = one.column("maximum")[:, 1], one.column("period")
    inside = other.column("maximum")[:, 1] < size.max()
    assert np.interp(other.column("maximum")[inside, 1], size, period) == pytest.approx(
        other.column("period")[inside], rel=1e-3)


@pytest.mark.parametrize(("method", "told"), [
    (HarmonicBalance(5, stability=None), "harmonic balance needs stability"),
    (HarmonicBalance(5, tolerance=1e-3), "takes the harmonics and samples that it is given"),
    (Shooting(), "shooting is for contact systems; take Collocation"),
    (3, "method"),
])
def test_methods_of_families_are_checked(method, told):
    run = fc.simulate(PENDULUM, 14.0, initial=[1.0, 0.0], outputs=1401, rtol=1e-9)
    with pytest.raises(InputError, match=told):
        orbit_family(PENDULUM, run, method=method)
