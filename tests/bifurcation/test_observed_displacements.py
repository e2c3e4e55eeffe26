"""Several displacements of one response, against linear responses and responses of each."""

import csv

import numpy as np
import pytest
from oscillators import duffing
from response_study import STUDY
from systems import TURN

from fecontact import ContactSystem, Drive, basis_from_matrices
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    contact_field,
    controlled_response,
    frequency_response,
)
from fecontact.core.errors import InputError
from fecontact.laws import BilateralPolynomial

STIFFNESS = np.array([[2.0, -1.0], [-1.0, 1.0]])
BOUNDS = (0.4 / TURN, 0.6 / TURN)
FEW = ContinuationOptions(points=8, largest_step=0.2, locate=False)


def two_masses(cubic):
    """Two masses in a row, the first driven through a spring of 1, damping .1 of the stiffness."""
    first, second = np.zeros((3, 2)), np.zeros((3, 2))
    first[1, 0] = second[1, 1] = 1.0
    links = STIFFNESS - np.diag([1.0, 0.0])
    basis = basis_from_matrices(
        np.eye(2), links, {"contact": second[None], "B": first, "C": second},
        damping=0.1 * links)
    return ContactSystem(basis, normal=BilateralPolynomial(0.0, cubic), drive=Drive(
        stiffness_y=1.0, damping_y=0.1, amplitude_y=1.0, frequency_hz=1.0 / TURN))


def test_linear_response():
    """Both displacements of a linear system, in closed form, from one response."""
    system = two_masses(1e-9)
    response = frequency_response(system, (0.3 / TURN, 2.0 / TURN), observe=("B", "y"),
                                  options=FEW, method=HarmonicBalance(2))
    w = TURN * response.branches[0].parameter
    exact = np.array([np.linalg.solve(STIFFNESS * (1.0 + 0.1j * one) - np.eye(2) * one**2,
                                      [1.0, 0.0]) for one in w])
    assert response.observed == "B y"
    for name, column in (("B", 0), ("C", 1)):
        one = response.of(system, (name, "y"))
        assert one.observed == f"{name} y"
        np.testing.assert_allclose(one.amplitude(), np.abs(exact[:, column]), rtol=1e-5)
        turn = np.exp(1j * one.phase())
        np.testing.assert_allclose(turn, np.exp(1j * np.angle(exact[:, column])), atol=1e-5)


@pytest.mark.parametrize("method", [HarmonicBalance(5), Collocation(intervals=20),
                                    Shooting(segments=1)])
def test_responses_observed_one_by_one(method):
    """A response of one displacement, observed at another one, is a response of the other."""
    system = two_masses(0.3)
    whole, other = (frequency_response(system, BOUNDS, observe=(name, "y"), options=FEW,
                                       method=method) for name in ("B", "C"))
    found = whole.of(system, ("C", "y"))
    np.testing.assert_allclose(found.amplitude(), other.amplitude(), rtol=1e-8)
    np.testing.assert_allclose(found.harmonic(3), other.harmonic(3), rtol=1e-8, atol=1e-12)
    assert found.branches[0].attributes["observed"] == found.observed == "C y"
    np.testing.assert_array_equal(found.branches[0].column("maximum"),
                                  whole.branches[0].column("maximum"))
    assert whole.observed == "B y"


def test_held_amplitudes_and_vector_fields():
    system = two_masses(0.3)
    held = controlled_response(system, BOUNDS, [0.5], "drive.amplitude_y", observe=("B", "y"),
                               options=FEW, method=HarmonicBalance(3))
    other = held.of(system, ("C", "y"))
    np.testing.assert_array_equal(other.force(), held.force())
    assert not np.allclose(other.amplitude(), 0.5, rtol=0.01)
    field = duffing()
    response = frequency_response(field, (0.5, 0.6), "W", options=FEW)
    speeds = response.of(field, [0.0, 1.0])
    assert speeds.observed == "v"
    np.testing.assert_allclose(np.abs(speeds.harmonic()), response.branches[0].parameter * np.abs(
        response.harmonic()), rtol=1e-7)
    with pytest.raises(InputError, match=r"has no parameter 'drive\.amplitude_y'"):
        held.of(field, [1.0, 0.0])


@pytest.mark.parametrize("method", [HarmonicBalance(3), Shooting(segments=1)])
def test_a_system_in_place_of_its_field(method):
    """Points between those of a branch, orbits and trajectories, from the system alone."""
    system = two_masses(0.3)
    branch = frequency_response(system, BOUNDS, observe=("B", "y"), options=FEW,
                                method=method).branches[0]
    field = contact_field(system, ["drive.frequency_hz"])
    one, other = (branch.at(given, 0.45 / TURN) for given in (system, field))
    np.testing.assert_array_equal(one.u, other.u)
    assert one.parameter == 0.45 / TURN
    np.testing.assert_array_equal(one.orbit(system).states, one.orbit(field).states)
    assert one.trajectory(system).time[-1] == pytest.approx(2.0 * np.pi / 0.45)
    with pytest.raises(InputError, match="field"):
        branch.at(None, 0.45 / TURN)


def test_bad_points():
    system = two_masses(0.3)
    response = frequency_response(system, BOUNDS, observe=("B", "y"), options=FEW)
    with pytest.raises(InputError, match="D"):
        response.of(system, ("D", "y"))
    with pytest.raises(InputError, match="system"):
        response.of(response, ("C", "y"))


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "block.toml"
    path.write_text(STUDY)
    return path


def test_further_displacements_of_a_study(cli, file):
    """Amplitude and phase of further points are columns of the CSV file."""
    code, _, _ = cli("response", file, "--bounds", 9, 10, "--set", 'response.also=["C x", "0 y"]')
    assert code == 0
    with (file.parent / "results" / "block-response.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    # The block is rigid: its top moves with its side.
    for row in rows:
        assert float(row["amplitude C x"]) == pytest.approx(float(row["amplitude"]), rel=1e-6)
        assert float(row["phase C x"]) == pytest.approx(float(row["phase"]), abs=1e-6)
        assert float(row["amplitude 0 y"]) < 1e-3 * float(row["amplitude"])


@pytest.mark.parametrize(("also", "told"), [
    ('["C"]', "also = ['C'] must name a point and a component each, like 'C x'"),
    ('["D x"]', "'D'"), ('["C q"]', "q"), ("3", "also")])
def test_bad_further_displacements(cli, file, also, told):
    code, _, said = cli("response", file, "--set", f"response.also={also}")
    assert code == 1
    assert told in said
    assert said.count("\n") == 1
    assert not list(file.parent.rglob("*.h5"))
