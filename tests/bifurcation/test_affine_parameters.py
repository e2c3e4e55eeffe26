"""Numbers of drives and loads in which the arrays of a system are known to be affine."""

from dataclasses import dataclass, fields

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, contact_field, frequency_response
from fecontact.bifurcation.fields.contact_field import field_between
from fecontact.bifurcation.harmonic.compiled.arrays import RESTS
from fecontact.bifurcation.harmonic.starts import problem_for, timing_of
from fecontact.laws import (
    BilateralPolynomial,
    ConstantFriction,
    Harmonic,
    Harmonics,
    LinearContact,
    PrescribedForce,
    Sine,
)
from fecontact.system.arrays import multilinear
from fecontact.system.contact_system import ContactSystem

FREQUENCY = "drive.frequency_hz"


def masses(**parts):
    """Two modes, in both directions, on a stiff foundation."""
    rng = np.random.default_rng(5)
    rows = rng.normal(size=(3, 2))
    basis = fc.basis_from_matrices(np.eye(2), [[3.0, -1.0], [-1.0, 2.0]], {
        "contact": rows[None], "B": rng.normal(size=(3, 2)), "C": rng.normal(size=(3, 2))},
        damping=[[0.1, -0.02], [-0.02, 0.1]])
    return ContactSystem(basis, normal=LinearContact(50.0, 0.1),
                         friction=ConstantFriction(0.2, smoothing_slope=10.0), **parts)


def test_names_of_parameters_from_an_iterator():
    assert dict(contact_field(masses(), iter(["friction.friction_coefficient"])).parameters) == {
        "friction.friction_coefficient": 0.2}


def driven(**more):
    return fc.Drive(**{"stiffness_x": 1.0, "stiffness_y": 0.5, "damping_x": 0.2, "amplitude_x": 0.3,
                       "amplitude_y": 0.1, "frequency_hz": 1.3 / TURN, **more})


def loaded():
    return fc.Load(2.0, forces=(
        fc.PointLoad("C", "x", signal=Harmonic(0.4, 0.9 / TURN, 0.3)),
        fc.PointLoad("B", "y", signal=Harmonics((1.0, 0.2), (1.0 / TURN, 3.0 / TURN)))))


@pytest.mark.parametrize("names", [
    *[(f"drive.{entry.name}",) for entry in fields(fc.Drive)
      if entry.name.startswith(("stiffness", "damping", "amplitude", "frequency"))
      and not entry.name.endswith("_z")],
    ("load.normal",), ("load.forces.0.signal.amplitude",),
    ("load.forces.0.signal.frequency_hz",), ("load.forces.0.signal.phase",),
    ("drive.stiffness_x", "drive.damping_x", "drive.amplitude_x"),
    (FREQUENCY, "drive.amplitude_y", "load.normal", "load.forces.0.signal.amplitude"),
])
@pytest.mark.parametrize("dashpots", ["absolute", "relative"])
def test_arrays_between_two_systems_are_those_of_systems_made_there(names, dashpots):
    system = masses(drive=driven(dashpots=dashpots), load=loaded())
    assert multilinear(names, system.drive, system.load)
    ranges = tuple((name, (0.4, 2.9)) for name in names)
    field, rng = field_between(system, ranges), np.random.default_rng(1)
    assert field.family.varying
    for _ in range(5):
        values = rng.uniform(0.35, 2.95, len(names))
        made = system.with_(**dict(zip(names, values.tolist(), strict=True))).arrays
        for name, one, other in zip(made._fields, made, field.arrays(values), strict=True):
            assert np.allclose(one, other, rtol=1e-14, atol=1e-14), name


def test_a_field_over_a_drive_looks_at_the_ends_of_its_range_alone(monkeypatch):
    made, plain = [], ContactSystem.arrays_with
    monkeypatch.setattr(ContactSystem, "arrays_with", lambda self, parts: made.append(
        parts["drive"].frequency_hz) or plain(self, parts))
    field_between(masses(drive=driven(), load=fc.Load(20.0)), ((FREQUENCY, (0.5, 1.5)),))
    assert made == pytest.approx([0.48, 1.52], rel=1e-12)


def test_values_beyond_what_a_drive_allows_are_still_refused():
    field = field_between(masses(drive=driven()), (("drive.damping_x", (0.0, 1.0)),))
    x = np.ones((1, 4))
    assert np.isfinite(field.rates(np.zeros(1), x, np.array([0.0]))).all()
    with pytest.raises(fc.InputError, match=r"damping_x = -0\.01 must be"):
        field.rates(np.zeros(1), x, np.array([-0.01]))


@dataclass(frozen=True)
class Unbalance(fc.Drive):
    """A drive whose amplitude grows with the square of the frequency."""

    @property
    def motions(self):
        f = self.frequency_hz
        return tuple(Harmonic(getattr(self, f"amplitude_{axis}") * (TURN * f) ** 2, f)
                     for axis in "xyz")


@dataclass(frozen=True)
class Turning(Harmonic):
    """A sine of twice the frequency that it is given."""

    def parameters(self):
        return np.array([self.amplitude, (TURN * self.frequency_hz) ** 2, self.phase])


@pytest.mark.parametrize(("drive", "name"), [
    (Unbalance(stiffness_x=1.0, amplitude_x=0.3, frequency_hz=1.3 / TURN), FREQUENCY),
    (fc.Drive(stiffness_x=1.0, motion_x=Turning(0.3, 1.2 / TURN)), "drive.motion_x.frequency_hz"),
])
def test_drives_and_signals_of_other_classes_are_looked_at(drive, name):
    system = masses(drive=drive)
    assert not multilinear([name], system.drive, system.load)
    assert not multilinear(["friction.coefficient"], system.drive, system.load)
    field = field_between(system, ((name, (0.5 / TURN, 2.0 / TURN)),))
    times, x = np.linspace(0.0, 7.0, 8), np.random.default_rng(3).normal(size=(8, 4))
    for value in (0.6 / TURN, 1.0 / TURN, 1.9 / TURN):
        made = system.with_(**{name: value})
        expected = np.array([made.rhs(t, y) for t, y in zip(times, x, strict=True)])
        found = field.rates(times, x, np.array([value]))
        assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize(("parts", "turn", "period"), [
    ({"drive": driven()}, 1.0, None),
    ({"drive": driven(), "load": fc.Load(2.0)}, 1.0, None),
    # A drive that does not act, and loads and waves at frequencies of their own.
    ({"drive": fc.Drive(frequency_hz=1.3 / TURN, amplitude_x=0.1), "load": loaded()}, None, "load"),
    ({"drive": driven(), "load": fc.Load(forces=(
        fc.PointLoad("C", "x", signal=Harmonic(0.4, 1.3 / TURN)),))}, None, None),
    ({"drive": driven(), "ground": fc.Ground(0.1, profile=Sine(1e-3, 0.05))}, None, None),
])
def test_the_period_over_the_frequency_of_the_drive(parts, turn, period):
    """Known where nothing else repeats, else found by comparison or not at all."""
    if period == "load":
        parts = {**parts, "load": fc.Load(forces=(
            fc.PointLoad("C", "x", signal=Harmonic(0.4, 0.9 / TURN)),))}
        period = 2.0 * np.pi / 0.9
    field = field_between(masses(**parts), ((FREQUENCY, (0.5 / TURN, 2.0 / TURN)),))
    found = timing_of(field, np.array([1.3 / TURN]), 0)
    assert found == (pytest.approx(turn, rel=1e-15) if turn else None,
                     pytest.approx(period, rel=1e-15) if period else None)


def test_a_function_of_the_user_may_have_the_name_of_a_parameter():
    def in_radians(system, value):
        return system.with_(**{FREQUENCY: value / TURN})

    system = masses(drive=driven())
    field = contact_field(system, {FREQUENCY: (1.3, in_radians)})
    assert not field.family.multilinear
    turn, period = timing_of(field, np.array([1.3]), 0)
    assert (turn, period) == (pytest.approx(TURN, rel=1e-14), None)


def test_values_that_differ_by_rounding_do_not_tell_how_the_period_varies():
    """Systems may have been made there before; results must not depend on it."""
    def stronger(system, value):
        return system.with_(**{"drive.amplitude_x": value})

    field = contact_field(masses(drive=driven()), {"p": (1.3, stronger)})
    for k in range(1, 100):
        field.system(np.array([1.3 * (1.0 + 2e-15 * k)]))
    turn, period = timing_of(field, np.array([1.3]), 0)
    assert (turn, period) == (None, field.forcing_period(np.array([1.3])))


@pytest.mark.parametrize(("load", "rests"), [(fc.Load(), True), (fc.Load(0.3), False)])
def test_forces_at_rest_have_a_mean_only_where_a_load_is_constant(load, rests):
    rows = np.zeros((3, 1))
    rows[1, 0] = 1.0
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows},
                                   damping=[[0.05]])
    drive = fc.Drive(stiffness_y=1.0, amplitude_y=0.18, frequency_hz=0.8 / TURN)
    system = fc.ContactSystem(basis, normal=BilateralPolynomial(0.0, 0.1), load=load, drive=drive)
    field = field_between(system, ((FREQUENCY, (0.6 / TURN, 1.8 / TURN)),))
    problem = problem_for(field, np.array([0.8 / TURN]), 0, HarmonicBalance(5), np.ones(4))
    e = problem.equations(0.8 / TURN)
    assert bool(e.numbers[RESTS]) == rests
    times = 2.0 * np.pi / 0.8 * problem.series.times
    pushed = e.given[0, :, 0] + 0.8 / TURN * e.given[1, :, 0]
    assert pushed == pytest.approx(0.18 * np.sin(0.8 * times) - load.normal, abs=1e-15)
    assert e.body[:, 0, 0] == pytest.approx([1.0, 0.05, 0.0, 0.0], abs=1e-15)


def test_over_a_stiffness_that_grows_from_nothing_the_amplitude_is_that_of_a_mass():
    """q'' + .1 q' + c q = c sin 2 t in closed form, c from the parameter."""
    rows = np.zeros((3, 1))
    rows[0, 0] = 1.0
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows},
                                   damping=[[0.1]])
    system = ContactSystem(
        basis, normal=PrescribedForce(0.0), friction=ConstantFriction(0.0),
        drive=fc.Drive(stiffness_x=0.5, amplitude_x=1.0, frequency_hz=2.0 / TURN))
    found = frequency_response(system, (0.1, 9.0), parameter="drive.stiffness_x",
                               method=HarmonicBalance(3, stability=None))
    c = found.branches[0].parameter
    expected = c / np.abs(c - 4.0 + 0.2j)
    assert np.abs(found.harmonic(1)) == pytest.approx(expected, rel=1e-6)
    assert found.amplitude() == pytest.approx(expected, rel=1e-5)
