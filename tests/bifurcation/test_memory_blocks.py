"""Internal variables by harmonic balance, of which some act on each other and others do not."""

import numpy as np
import pytest
from oscillators import jenkins_system, one_mode
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, contact_field
from fecontact.bifurcation.harmonic.layout import kept_by, layout_of
from fecontact.bifurcation.harmonic.memory import LEAK, solve_around
from fecontact.bifurcation.harmonic.starts import converged_orbit, problem_for
from fecontact.laws import DahlFriction, IwanFriction, JenkinsFriction, PrescribedForce

FREQUENCY = "drive.frequency_hz"


def driven(system):
    """Field over the frequency of a system with a drive."""
    return contact_field(system.with_(drive=fc.Drive(
        stiffness_x=1.0, damping_x=0.02, amplitude_x=0.5, frequency_hz=1.1 / TURN)), [FREQUENCY])


def iwan(count):
    """A mass with so many elements on one node."""
    return fc.ContactSystem(one_mode(), normal=PrescribedForce(1.0),
                            friction=IwanFriction(0.5, 1.0, elements=count))


@pytest.mark.parametrize("size", [1, 2, 3])
def test_blocks_of_variables_are_solved_for_alone(size):
    """Against the cyclic equations of all variables as one matrix."""
    rng, N, n, s, T, columns = np.random.default_rng(4), 12, 2, 6, 0.7, 3
    slopes = np.zeros((N, n, s, s))
    for first in range(0, s, size):
        part = slice(first, first + size)
        slopes[:, :, part, part] = rng.normal(size=(N, n, size, size)) - 2.0 * np.eye(size)
    right = rng.normal(size=(N, n * s, columns))
    whole = np.zeros((N, n * s, N, n * s))
    for k in range(N):
        for node in range(n):
            own = slice(node * s, (node + 1) * s)
            whole[k, own, k, own] = (1.5 * N / T + LEAK / T) * np.eye(s) - slopes[k, node]
            whole[k, own, k - 1, own] = -2.0 * N / T * np.eye(s)
            whole[k, own, k - 2, own] = 0.5 * N / T * np.eye(s)
    exact = np.linalg.solve(whole.reshape(N * n * s, -1), right.reshape(N * n * s, -1))
    # All variables of the second node count as one block.
    found = right.copy()
    solve_around(slopes, T, np.array([size, 0]), found)
    assert found.reshape(N * n * s, -1) == pytest.approx(exact, abs=1e-12)


def test_elements_are_blocks_of_their_own():
    """In the plane of one variable; those of other laws act on each other."""
    for system, wanted in ((iwan(5), [1]), (jenkins_system(), [1]),
                           (iwan(5).with_(friction=DahlFriction(0.5, 1.0)), [0])):
        field = driven(system)
        assert kept_by(field, layout_of(field)).blocks.tolist() == wanted


def test_elements_of_one_node_are_those_of_as_many_nodes():
    """Iwan's elements on one node, and a Jenkins element on each of as many nodes."""
    count = 24
    springs, limits = np.full(count, 0.5 / count), (2.0 * np.arange(count) + 1.0) / count**2
    rows = np.zeros((count, 3, 1))
    rows[:, 0] = 1.0
    apart = fc.ContactSystem(
        fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows, "B": rows[0], "C": rows[0]}),
        normal=PrescribedForce(tuple(limits)), friction=JenkinsFriction(tuple(springs), 1.0))
    found = []
    for system in (iwan(count), apart):
        field = driven(system)
        problem = problem_for(field, field.values, 0, HarmonicBalance(5, 128),
                              np.ones(field.dimension + 2))
        problem, u = converged_orbit(problem, np.append(np.zeros(problem.size), 1.1 / TURN))
        here = problem.linearise(u)
        # The last derivatives are those to the angular frequency.
        condensed = here.condensed / np.append(np.ones(problem.size), TURN)
        found.append((u, condensed, here.memory))
    for one, other in zip(*found, strict=True):
        # The leak alone holds the mean of elements that stick.
        assert one == pytest.approx(other, rel=1e-5, abs=1e-9)
    slides = np.abs(found[0][2]) > limits / springs
    assert 1 < np.count_nonzero(slides.any(axis=0)) < count
