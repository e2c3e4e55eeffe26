"""Uncertainty by rounding of special points and their stability, and guesses in any scales."""

from types import SimpleNamespace

import numpy as np
import pytest

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, contact_field
from fecontact.bifurcation.continuation.predictor import Bent
from fecontact.bifurcation.continuation.rounding import NoFolds, RestingParameter, Rounding
from fecontact.bifurcation.harmonic.starts import problem_for
from fecontact.bifurcation.orbits.floquet import Floquet
from fecontact.bifurcation.orbits.multiplier_rounding import MultiplierRounding
from fecontact.laws import BilateralPolynomial

WIDTH = 5.0


def values(trivial_error=0.0, second=0.5):
    return {"multipliers": np.array([1.0 + trivial_error, second]), "trivial_error": trivial_error}


def kinds(slopes, stored=None, branch=(1.0, -1.0), rounding=MultiplierRounding):
    """Kinds that are uncertain between two points with these slopes, in widths."""
    tangents = tuple(np.array([1.0, slope * WIDTH]) for slope in slopes)
    return set(rounding(WIDTH).kinds(
        tangents, (stored or values(),) * 2, tuple({"branch point": each} for each in branch)))


@pytest.mark.parametrize("rounding", [RestingParameter, MultiplierRounding])
def test_a_parameter_that_rests_has_no_folds(rounding):
    """Slopes count in widths of the diagram, and at both points."""
    assert kinds((0.995e-8, -0.995e-8), rounding=rounding) == {"fold"}
    assert kinds((1.005e-8, -1.005e-8), rounding=rounding) == set()
    assert kinds((0.995e-8, -1.005e-8), branch=(1.0, 1.0), rounding=rounding) == set()


def test_turns_of_a_parameter_that_nearly_rests_may_be_errors_of_its_tangents():
    for slopes, uncertain in (((0.99e-6, -0.99e-6), True), ((0.5e-7, -1.01e-6), False)):
        ends = tuple(np.array([1.0, slope * WIDTH]) for slope in slopes)
        assert RestingParameter(WIDTH).turns(ends, ({}, {})) is uncertain


def test_signs_of_the_test_for_branch_points_beside_a_slope_of_rounding():
    """The test has the sign of the slope, which rounding gives at one of the points."""
    assert kinds((0.995e-8, -1.005e-8), branch=(1.0, -1.0)) == {"branch point"}
    assert kinds((0.995e-8, 1.005e-8), branch=(1.0, -1.0)) == set()
    assert kinds((0.995e-8, 0.995e-8), values(second=1.0 + 0.995e-9)) == {"fold", "branch point"}
    assert kinds((0.995e-8, 0.995e-8), values(second=1.0 + 1.005e-9)) == {"fold"}


def test_lost_multipliers():
    steep = (0.3, -0.3)
    assert kinds(steep, values(0.099)) == set()
    assert kinds(steep, values(0.101)) == {"branch point"}
    assert kinds(steep, values(0.499)) == {"branch point"}
    assert kinds(steep, values(0.501)) == {"branch point", "period doubling", "torus"}
    rounding = MultiplierRounding(WIDTH)
    assert rounding.lost(values(0.101))
    assert not rounding.lost(values(0.099))
    for slope, uncertain in ((0.99e-4, True), (1.01e-4, False)):
        ends = np.array([0.0, slope * WIDTH]), np.array([0.0, -WIDTH])
        assert rounding.turns(ends, (values(0.2), values())) is uncertain
        assert not rounding.turns(ends, (values(), values()))


def test_range_of_unstable_multipliers():
    """Twice the error of the trivial one leaves open what lies so near the unit circle."""
    found = Floquet(np.array([1.5, 1.019, 1.01, 0.981, 0.5], dtype=complex), trivial=2)
    at = SimpleNamespace(floquet=found)
    assert MultiplierRounding(WIDTH).unstable(at, {}) == (1, 3)
    assert Rounding().unstable(at, {"unstable": 2}) == (2, 2)


def test_what_is_certain():
    ends = (np.array([1.0, 0.0]),) * 2
    assert Rounding().steps == NoFolds().steps == 1e-7
    assert not set(Rounding().kinds(ends, ({}, {}), ({}, {})))
    assert set(NoFolds(1e-5).kinds(ends, ({}, {}), ({}, {}))) == {"fold"}
    assert NoFolds(1e-5).steps == 1e-5


def test_orbits_without_stability_have_no_multipliers_to_ask_for():
    row = np.array([[0.0], [1.0], [0.0]])
    system = fc.ContactSystem(
        fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": row[None], "B": row}),
        normal=BilateralPolynomial(1.0, 1.0), drive=fc.Drive(
            stiffness_y=1.0, amplitude_y=1.0, frequency_hz=0.2))
    field = contact_field(system, ["drive.frequency_hz"])
    problem = problem_for(field, field.values, 0, HarmonicBalance(3, stability=None),
                          np.append(np.ones(field.dimension + 1), WIDTH))
    ends = (np.array([1.0, 0.995e-8 * WIDTH]),) * 2
    assert set(problem.rounding.kinds(ends, ({}, {}), ({}, {}))) == {"fold"}


@pytest.mark.parametrize("factor", [1.0, 0.5, 3.0])
def test_guesses_do_not_depend_on_scales(factor):
    """On a circle, in units that change after the step behind: of third order in the step."""
    def at(angle):
        return np.array([np.cos(angle), np.sin(angle)])

    def along(angle):
        return np.array([-np.sin(angle), np.cos(angle)])

    ones, off = np.ones(2), []
    for h in (0.1, 0.05):
        here = Bent().after(ones, at(-h), along(-h)).after(ones, at(0.0), along(0.0))
        weights = factor**2 * ones
        guess = here.ahead(weights, at(0.0), along(0.0) / factor, factor * h)
        assert here.bend == pytest.approx([-1.0, 0.0], abs=0.6 * h)
        off.append(abs(float(np.linalg.norm(guess)) - 1.0))
        assert guess[1] == pytest.approx(h, rel=0.05)
    assert off[0] < 0.5 * 0.1**2 / 2.0
    assert off[1] < off[0] / 3.5
