"""Nodes clear of the other side are left out of steps, and the results are the same."""

from dataclasses import replace

import numpy as np
import pytest

import fecontact as fc
from fecontact.core.compiled import kernel
from fecontact.core.records import Matrix, Vector
from fecontact.integrate import ContactEvents, Rodas5P, near_nodes
from fecontact.integrate.rodas5p import driver, stage_solver
from fecontact.integrate.rodas5p.blocks import FEW
from fecontact.integrate.rodas5p.state import Problem, Progress, Workspace
from fecontact.laws import (
    ConstantFriction,
    ExponentialContact,
    ExponentialFriction,
    Harmonic,
    LinearContact,
    LuGreFriction,
    RoughSurface,
)

NODES = 60
FRICTION = ExponentialFriction(0.8, 0.55, 1000.0, 1e4)


@kernel
def choose(h: float, problem: Problem, progress: Progress, workspace: Workspace) -> None:
    near_nodes.choose_near(h, problem, progress, workspace)


@kernel
def extend(y: Vector, problem: Problem, progress: Progress, workspace: Workspace) -> None:
    near_nodes.extend_near(y, problem, progress, workspace)


@kernel
def multiply(a: Matrix, b: Matrix, out: Matrix) -> None:
    stage_solver.add_products(a, b, (0, len(a), 0, len(b)), (np.uint64(0), np.uint64(a.shape[1])),
                              out)


def beam(**changes):
    """A free beam of 0.2 m and 1 kg with a crowned face above a belt, and its state at the start.

    It rises by 20 um towards its ends, stands 3 um above the belt and falls at 20 mm/s, tilting.
    """
    x = np.concatenate([[-0.5, 0.0], (np.arange(NODES) + 0.5) / NODES - 0.5])
    T = np.zeros((2 + NODES, 3, 5))
    T[:, 0, 0] = T[:, 1, 1] = 1.0
    T[:, 1, 2], T[:, 2, 2] = np.sqrt(12.0) * x, np.sqrt(12.0) / 0.2
    for i in (3, 4):
        T[:, 1, i] = np.sqrt(2.0) * np.cos((i - 1) * np.pi * (x + 0.5))
        T[:, 0, i] = 0.1 * np.sin((i - 1) * np.pi * (x + 0.5))
    w = np.array([0.0, 0.0, 0.0, 3000.0, 8000.0])
    basis = fc.ModalBasis(w, np.diag(0.02 * w), T, np.column_stack([0.2 * x, 0.0 * x]),
                          np.full(NODES, 0.2 / NODES))
    system = fc.ContactSystem(basis, **{
        "normal": RoughSurface(2e7, 5e-6, 50.0), "friction": FRICTION, "load": fc.Load(200.0),
        "ground": fc.Ground(speed=0.01), "gap": 80e-6 * x[2:]**2, **changes})
    return system, np.array([0.0, 3e-6, 0.0, 0.0, 0.0, 0.0, -0.02, 0.01, 0.0, 0.0])


def solid():
    """A rigid block of 2 kg on 25 places in space, above the ground, falling on an edge."""
    places = np.array([(x, y, -0.05) for x in np.linspace(-0.1, 0.1, 5)
                       for y in np.linspace(-0.15, 0.15, 5)])
    rows = np.tile(np.eye(6), (len(places), 1, 1))
    for row, (x, y, z) in zip(rows, places, strict=True):
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    mass, sides = 2.0, np.array([0.2, 0.3, 0.1])
    inertia = mass / 12.0 * ((sides**2).sum() - sides**2)
    basis = fc.basis_from_matrices(
        np.diag([mass] * 3 + [*inertia]), np.zeros((6, 6)), {"contact": rows, "B": np.eye(6)},
        dimension=3, contact_places=places, tributary=np.full(25, 0.06 / 25),
        translations=np.eye(3, 6), damping=0.0)
    system = fc.ContactSystem(
        basis, RoughSurface(2e6, 5e-6, 50.0), ConstantFriction(0.3, smoothing_slope=1e4),
        ground=fc.Ground(speed=0.02), load=fc.Load(gravity=(0.0, 0.0, -9.81)))
    rigid = basis.contact_T[[0, 4, 20], :3].reshape(9, 6)
    down = np.tile([0.0, 0.01, -0.03], 3)
    lifted = np.concatenate([[0.0, 0.0, 5e-6], [0.0, 0.0, 30e-6], [0.0, 0.0, 205e-6]])
    return system, np.concatenate([np.linalg.lstsq(rigid, lifted)[0],
                                   np.linalg.lstsq(rigid, down)[0]])


def runs_of(system, state, **options):
    """A run, and the same with all nodes taken as near.

    Steps are of one length: where they follow the error, rounding shifts their ends.
    """
    runs = [driver.start(system, state, np.linspace(0.0, 0.004, 101), **{
        "rtol": 1e-3, "max_step": 4e-6, **options}) for _ in range(2)]
    own, other = runs
    control = other.problem.control
    all_near = control._replace(untouched=np.full_like(control.untouched, -np.inf))
    return own, replace(other, problem=other.problem._replace(control=all_near))


CASES = {
    "belt": lambda: beam(),
    "wavy": lambda: beam(ground=fc.Ground(speed=0.01, amplitude=2e-6, wavelength=0.02)),
    "shaken": lambda: beam(load=fc.Load(200.0, (fc.PointLoad("C", "y",
                                                             signal=Harmonic(300.0, 318.3)),))),
    "far-reaching": lambda: beam(normal=ExponentialContact(20.0, 2e-7, 1.0), load=fc.Load(50.0),
                                 friction=ConstantFriction(0.3, smoothing_slope=1e3)),
    "solid": solid,
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("work", [False, True], ids=["states", "work"])
def test_results_are_those_of_all_nodes(case, work):
    own, other = runs_of(*CASES[case](), work=work)
    system = own.problem.system
    n = len(system.gap)
    assert n > FEW
    counts, closed = [], []
    while own.advance(3) == 0:
        counts.append(int(own.workspace.near.used[0]))
        closed.append(np.flatnonzero(own.progress.gradients.partial[:, 1].any(axis=1)))
        assert set(closed[-1]) <= set(own.workspace.near.nodes[: counts[-1]].tolist())
    other.advance(10**6)
    # Few at first and between impacts, most in contact: the list follows.
    assert min(counts) < 0.6 * n
    assert max(map(len, closed)) > 0.8 * n
    assert own.statistics == other.statistics
    assert other.workspace.near.used[0] == n
    for name in ("states", "work"):
        a, b = getattr(own, name), getattr(other, name)
        assert np.abs(a - b).max() <= 1e-8 * np.abs(b).max(), name


@pytest.mark.parametrize("case", ["belt", "shaken", "solid"])
def test_events_are_those_of_all_nodes(case):
    own, other = runs_of(*CASES[case](), events=(ContactEvents(),))
    for run in (own, other):
        while run.advance(50) == 0:
            pass
    assert len(other.events.time) > 20
    assert own.events.kind == other.events.kind
    assert np.array_equal(own.events.node, other.events.node)
    assert own.events.time == pytest.approx(other.events.time, abs=1e-12)


@pytest.mark.long
def test_states_far_from_the_start_find_their_nodes():
    run, _ = runs_of(*beam())
    run.advance(60)
    problem, progress, workspace = run.problem, run.progress, run.workspace
    blocks, near, rng = problem.blocks, workspace.near, np.random.default_rng(1)
    counts = []
    for size in 10.0 ** rng.uniform(-9.0, -4.0, 40):
        choose(1e-12, problem, progress, workspace)
        before = near.nodes[: near.used[0]].tolist()
        y = progress.state + size * rng.normal(size=10)
        extend(y, problem, progress, workspace)
        k = near.used[0]
        found = near.nodes[:k].tolist()
        gaps = problem.system.rows[:, 1] @ y[:5] + problem.system.gap
        touching = np.flatnonzero(gaps < 0.0).tolist()
        assert set(before) | set(touching) <= set(found)
        assert found == sorted(found)
        for tangent in (0, NODES):
            assert np.array_equal(near.shapes[:, tangent : tangent + k],
                                  blocks.shapes[:, np.array(found, dtype=int) + tangent])
        assert near.tiles.tolist() == [[0, 5, 0, k], [0, 5, NODES, NODES + k]]
        counts.append((len(before), k))
    # Some were enough from the start, others not; of these some took not all.
    before, after = np.array(counts).T
    assert (before == after).any()
    assert ((before < after) & (after < NODES)).any()


def test_runs_go_on_bit_for_bit():
    system, state = beam()
    whole, parts = (runs_of(system, state, rtol=1e-6, max_step=1.0)[0] for _ in range(2))
    whole.advance(10**6)
    while parts.advance(7) == 0:
        # A run that goes on from a checkpoint has lost the contents of its work arrays.
        parts = replace(parts, workspace=driver.workspace_for(5, NODES, 0, 2, parts.problem.blocks))
    assert np.array_equal(whole.states, parts.states)
    assert np.array_equal(whole.work, parts.work)


@pytest.mark.filterwarnings("ignore::fecontact.core.errors.ModelWarning")
def test_a_run_too_fast_for_numbers_ends_with_a_status():
    """Alone, and beside others, which go on."""
    system, state = beam()
    wild = state.copy()
    wild[9] = -9e59
    assert fc.simulate(system, 1e-3, initial=wild).status is not fc.Status.FINISHED
    found = fc.ensemble(system, [0.0, 1e-3], initial=np.vstack([state, wild, state]))
    assert found.finished.tolist() == [True, False, True]


def test_nodes_with_memory_and_derivatives_take_all_nodes():
    system, state = beam(friction=LuGreFriction(0.4, 0.3, 0.01, 2.0, 1e6, 300.0))
    for run in (driver.start(system, np.append(state, np.zeros(NODES)), np.array([0.0, 1e-3]),
                             rtol=1e-5),
                driver.start(*beam(), np.array([0.0, 1e-3]), rtol=1e-5, vary=True)):
        assert np.isneginf(run.problem.control.untouched).all()
        run.advance(5)
        assert run.workspace.near.used[0] == NODES


@pytest.mark.parametrize(("rows", "columns", "length"), [
    (1, 2, 3), (3, 6, 40), (4, 8, 512), (5, 9, 513), (6, 4, 7), (7, 14, 1100), (9, 3, 1),
    (4, 4, 0), (2, 5, 600)])
def test_products_of_rows(rows, columns, length):
    rng = np.random.default_rng(rows)
    a, b = rng.normal(size=(rows, length)), rng.normal(size=(columns, length))
    out = np.zeros((rows, columns))
    multiply(a, b, out)
    assert out == pytest.approx(a @ b.T, rel=1e-13, abs=1e-12)


def test_a_body_bounces_on_many_nodes_as_on_one_spring():
    """y = -F/k (1 - cos w t), w^2 = k/m, until it would lift off."""
    mass, stiffness, force, nodes = 0.5, 2e6, 30.0, 400
    rows = np.zeros((nodes, 3, 1))
    rows[:, 1] = 1.0
    basis = fc.basis_from_matrices([[mass]], [[0.0]], {"contact": rows, "C": rows[0]},
                                   contact_places=np.column_stack([np.linspace(0, 1, nodes)] * 2),
                                   tributary=np.full(nodes, 1.0 / nodes), damping=0.0)
    moving = fc.ContactSystem(basis, LinearContact(stiffness, 0.0), load=fc.Load(force), gap=0.0)
    w = np.sqrt(stiffness / mass)
    run = fc.simulate(moving, 6.0 / w, initial=[0.0, 0.0], outputs=50, rtol=1e-9,
                      solver=Rodas5P())
    y = run.modal_coordinates[:, 0] / np.sqrt(mass)
    assert y == pytest.approx(-force / stiffness * (1.0 - np.cos(w * run.time)),
                              abs=1e-7 * force / stiffness)
