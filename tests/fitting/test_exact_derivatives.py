"""Exact derivatives of frequencies and linear responses beside differences and closed forms."""

import numpy as np
import pytest

import fecontact as fc
from fecontact.fitting import FrequencyData, ReceptanceData
from fecontact.laws import ConstantFriction, LinearContact

HERTZ = np.linspace(3.0, 40.0, 12)


@pytest.fixture(scope="module")
def model():
    """Three modes with damping that couples them, a spring and a dashpot, and a contact."""
    rng = np.random.default_rng(3)
    rows = rng.standard_normal((3, 3, 3))
    C = rng.standard_normal((3, 3))
    body = fc.basis_from_matrices(
        np.diag([1.0, 2.0, 3.0]), np.diag([1e3, 3e4, 9e4]),
        {"contact": rows[0][None], "B": rows[1], "C": rows[2]}, damping=3.0 * (C @ C.T))
    return fc.ContactSystem(
        body, normal=LinearContact(1e4), friction=ConstantFriction(0.3),
        drive=fc.Drive(stiffness_x=4e3, stiffness_y=2e3, damping_x=5.0))


def differences(data, model, name, part=1e-4):
    value = model.parameter(name)
    ends = [data.predicted(model.with_({name: value * (1.0 + side * part)})) for side in (-1, 1)]
    return (ends[1] - ends[0]) / (2.0 * part * value)


PARAMETERS = ["drive.stiffness_x", "drive.stiffness_y", "drive.damping_x", "basis.stiffness.0.0",
              "basis.damping.1.1"]


@pytest.mark.parametrize("name", PARAMETERS)
@pytest.mark.parametrize("data", [
    FrequencyData([5.0, 20.0, 25.0], modes=[1, 3, 2]),
    *(ReceptanceData(HERTZ, np.zeros(12, complex), ("B", "x"), ("C", "y"), kind=kind)
      for kind in ("receptance", "mobility", "accelerance"))], ids=lambda one: getattr(
          one, "kind", "frequencies"))
def test_derivatives_are_those_of_differences(data, name, model):
    exact = data.derivative(model, name)
    assert exact == pytest.approx(differences(data, model, name), rel=1e-5,
                                  abs=1e-6 * np.abs(exact).max())
    assert np.abs(exact).max() > 0.0


def test_a_mass_on_a_spring_has_its_closed_forms():
    """f = sqrt((k + c) / m) / (2 pi), H = 1 / (k + c - w^2 m): derivatives over c."""
    row = np.array([[1.0], [0.0], [0.0]])
    body = fc.basis_from_matrices([[2.0]], [[1e4]], {"B": row, "C": row})
    held = fc.ContactSystem(body, drive=fc.Drive(stiffness_x=5e3))
    w = np.sqrt(1.5e4 / 2.0)
    assert FrequencyData([10.0]).derivative(held, "drive.stiffness_x") == pytest.approx(
        [1.0 / (2.0 * w * 2.0) / (2.0 * np.pi)], rel=1e-9)
    data = ReceptanceData(HERTZ, np.zeros(12, complex))
    H = 1.0 / (1.5e4 - 2.0 * (2.0 * np.pi * HERTZ) ** 2)
    assert data.derivative(held, "drive.stiffness_x")[:12] == pytest.approx(-(H**2), rel=1e-9)


@pytest.mark.parametrize(("data", "name"), [
    (FrequencyData([5.0], about="rest"), "drive.stiffness_x"),  # the equilibrium moves
    (FrequencyData([5.0]), "drive.damping_y"),  # zero: its scale is unknown
    (FrequencyData([5.0]), "body.thickness"),  # one of a study: other modes
    (ReceptanceData([5.0], [0j], about="rest"), "drive.stiffness_x")])
def test_other_derivatives_are_left_to_differences(data, name, model):
    assert data.derivative(model, name) is None


def test_frequencies_that_coincide_are_left_to_differences():
    row = np.array([[1.0, 0.5], [0.0, 0.0], [0.0, 0.0]])
    twice = fc.ContactSystem(fc.basis_from_matrices(np.eye(2), 1e4 * np.eye(2), {
        "B": row, "C": row}), drive=fc.Drive(stiffness_x=1e-6))
    assert FrequencyData([16.0]).derivative(twice, "drive.stiffness_x") is None


def test_a_contact_that_is_left_out_does_not_matter(model):
    data = FrequencyData([5.0, 20.0, 25.0])
    assert not data.derivative(model, "normal.stiffness").any()


def test_a_fit_says_which_are_exact_and_finds_the_same(model):
    hertz = FrequencyData([1.0, 1.0, 1.0]).predicted(model)
    H = ReceptanceData(HERTZ, np.zeros(12, complex)).predicted(model)
    noise = np.random.default_rng(1).standard_normal(24) * 1e-7
    data = [FrequencyData(hertz + 0.01, 0.02),
            ReceptanceData(HERTZ, (H + noise)[:12] + 1j * (H + noise)[12:], deviation=1e-7)]
    ranges = {"drive.stiffness_x": (1e3, 1e4), "drive.damping_x": (1.0, 20.0)}
    start = model.with_({"drive.stiffness_x": 8e3, "drive.damping_x": 15.0})
    exact, rough = (fc.fit(start, ranges, data, exact=how) for how in (True, False))
    assert set(exact.derivatives.values()) == {"exact"}
    assert set(rough.derivatives.values()) == {"differences"}
    assert exact.estimates == pytest.approx(rough.estimates, rel=1e-4)
    assert exact.deviations == pytest.approx(rough.deviations, rel=1e-3)
    assert sum(one.evaluations for one in exact.starts) < sum(
        one.evaluations for one in rough.starts) / 2
