"""Blocks of bodies and interfaces in the integrator: the same runs as by full matrices."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from systems import TURN

from fecontact import (
    Beam,
    ContactSystem,
    ElasticBody,
    Interface,
    Load,
    PointLoad,
    generate,
    sensitivity,
    simulate,
)
from fecontact.fem import pair_faces
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.rodas5p.blocks import FEW, blocks_of
from fecontact.laws import ConstantFriction, Harmonic, LinearContact, LuGreFriction
from fecontact.reduction import reduce_bodies

HEIGHT = 0.004
ORDER = ("middle", "top", "bottom", "lid")
MODES = {"middle": 4, "top": 3, "bottom": 2, "lid": 3}


@pytest.fixture(scope="module")
def stacked():
    return stack(3, 2)


def stack(nodes, nodes_between, element_size=0.004, modes=MODES):
    """Four beams on each other and the ground, listed in another order than they stand in."""
    mesh = generate(Beam(length=0.1, height=HEIGHT, element_size=element_size))
    upwards = ("bottom", "middle", "top", "lid")
    bodies = {name: ElasticBody(mesh.placed((0.0, upwards.index(name) * HEIGHT)), thickness=0.01,
                                fixed={"left": "xy"}) for name in ORDER}
    faces = [pair_faces(bodies, "bottom.contact", "ground", nodes=nodes, nodes_on="face"),
             *(pair_faces(bodies, f"{upper}.contact", f"{lower}.top", nodes=nodes_between,
                          nodes_on="face")
               for lower, upper in pairwise(upwards))]
    bases = reduce_bodies(bodies, faces, modes=modes, reduction="vibration", damping=0.01,
                          each={name: {"B": "", "C": "top" if name == "lid" else "",
                                       "points": {"end": "right"}} for name in bodies})
    return bases, faces


def system(stacked, friction):
    bases, faces = stacked
    return ContactSystem(
        bodies=bases, interfaces=[
            Interface(f"face{k}", face, LinearContact(2e6, 20.0), friction)
            for k, face in enumerate(faces)],
        load=Load(30.0, (PointLoad("lid.end", "x", signal=Harmonic(20.0, 800.0 / TURN)),
                         PointLoad("middle.end", "y", signal=Harmonic(5.0, 1100.0 / TURN)))))


def in_one_block(whole):
    """Copy of the system without its division into bodies."""
    return replace(whole, basis=replace(whole.basis, parts=()))


def test_blocks_hold_all_that_is_not_zero(stacked):
    whole = system(stacked, ConstantFriction(0.3, smoothing_slope=1e4))
    arrays, found = whole.arrays, blocks_of(whole.basis, whole.arrays)
    m, n = whole.basis.modes, whole.basis.contact_nodes
    covered = np.zeros(found.shapes.shape, dtype=int)
    for top, bottom, left, right in found.tiles:
        covered[top:bottom, left:right] += 1
    # Nine nodes; each moves with the modes of its one or two bodies and no others.
    assert covered.max() == 1
    assert np.array_equal(covered > 0, found.shapes != 0.0)
    wanted = np.zeros((m, m), dtype=bool)
    for j in range(n):
        moved = found.shapes[:, j] != 0.0
        wanted |= np.outer(moved, moved)
        spans = np.concatenate([np.arange(*span) for span in found.spans[j]])
        assert np.array_equal(np.flatnonzero(moved), np.sort(spans))
    coupled = np.zeros((m, m), dtype=bool)
    for top, bottom, left, right, row, column in found.coupled:
        coupled[top:bottom, left:right] = True
        assert np.array_equal(found.position[top:bottom], np.arange(row, row + bottom - top))
        assert found.reach[1, row] >= found.reach[0, row] >= column + right - left
    assert np.array_equal(coupled, wanted)
    assert not arrays.stiffness[~coupled].any()
    assert np.array_equal(np.sort(found.position), np.arange(m))
    # In the order of elimination the beams are a chain: a band of two bodies.
    assert (found.reach[0] - np.arange(m)).max() <= 7


def test_one_body_is_one_block(stacked):
    whole = in_one_block(system(stacked, ConstantFriction(0.3, smoothing_slope=1e4)))
    found = blocks_of(whole.basis, whole.arrays)
    assert found.tiles.tolist() == [[0, 12, 0, 18]]
    assert found.coupled.tolist() == [[0, 12, 0, 12, 0, 0]]


@pytest.mark.parametrize(
    "friction", [ConstantFriction(0.3, smoothing_slope=1e4),
                 LuGreFriction(0.4, 0.3, 0.01, 2.0, 1e6, 300.0)], ids=["slope", "memory"])
def test_runs_are_those_of_full_matrices(stacked, friction):
    whole = system(stacked, friction)
    runs = [simulate(one, 4e-3, outputs=101, rtol=1e-7) for one in (whole, in_one_block(whole))]
    one, other = runs
    assert one.statistics["steps"] == pytest.approx(other.statistics["steps"], rel=0.02)
    assert len(np.unique(one.contact_state)) > 1
    for name in ("modal_coordinates", "modal_velocities", "friction_work"):
        a, b = getattr(one, name), getattr(other, name)
        assert np.abs(a - b).max() < 1e-6 * np.abs(b).max()


def test_nodes_left_out_of_some_blocks():
    # More nodes than are always looked at; the upper faces open and close in turn.
    whole = system(stack(6, 5), ConstantFriction(0.3, smoothing_slope=1e4))
    assert whole.basis.contact_nodes > FEW
    runs, least = [], []
    for one, all_near in ((whole, False), (whole, True), (in_one_block(whole), False)):
        run = driver.start(one, np.zeros(one.size), np.linspace(0.0, 4e-3, 101), rtol=1e-3,
                           max_step=2e-6)
        if all_near:
            run.problem.control.untouched[:] = -np.inf
        counts = []
        while run.advance(20) == 0:
            counts.append(int(run.workspace.near.used[0]))
        runs.append(run)
        least.append(min(counts))
    one, *others = runs
    assert least == [least[0], whole.basis.contact_nodes, least[0]]
    assert least[0] < 0.8 * whole.basis.contact_nodes
    for other in others:
        assert one.statistics == other.statistics
        for name in ("states", "work"):
            a, b = getattr(one, name), getattr(other, name)
            assert np.abs(a - b).max() < 1e-9 * np.abs(b).max()


def test_derivatives_are_those_of_full_matrices(stacked):
    whole = system(stacked, ConstantFriction(0.3, smoothing_slope=1e3))
    runs = [sensitivity(one, 5e-4, outputs=3) for one in (whole, in_one_block(whole))]
    a, b = (run.transitions[-1] for run in runs)
    assert np.abs(a - b).max() < 1e-6 * np.abs(b).max()
