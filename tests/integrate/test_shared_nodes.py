"""Contact nodes of large systems in parts, which threads share: the same results for any number."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from test_blocks import MODES, stack, system

import fecontact as fc
from fecontact.core.errors import InputError
from fecontact.integrate import ContactEvents, Rodas5P
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.shared_nodes import helpers, node_work, tasks, team
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    LinearContact,
    LuGreFriction,
    RoughSurface,
)

NODES = 400


def beam(nodes=NODES, friction=None, rise=0.0, height=3e-6):
    """A free beam of seven modes on a belt that tilts onto it, and its state at the start."""
    x = np.concatenate([[-0.5, 0.0], (np.arange(nodes) + 0.5) / nodes - 0.5])
    T = np.zeros((2 + nodes, 3, 7))
    T[:, 0, 0] = T[:, 1, 1] = 1.0
    T[:, 1, 2], T[:, 2, 2] = np.sqrt(12.0) * x, np.sqrt(12.0) / 0.2
    for i in range(3, 7):
        T[:, 1, i] = np.sqrt(2.0) * np.cos((i - 1) * np.pi * (x + 0.5))
        T[:, 0, i] = 0.1 * np.sin((i - 1) * np.pi * (x + 0.5))
    w = np.array([0.0, 0.0, 0.0, 3000.0, 8000.0, 12000.0, 20000.0])
    basis = fc.ModalBasis(w, np.diag(0.02 * w), T, np.column_stack([0.2 * x, 0.0 * x]),
                          np.full(nodes, 0.2 / nodes))
    moving = fc.ContactSystem(
        basis, RoughSurface(2e7, 5e-6, 50.0),
        friction or ExponentialFriction(0.8, 0.55, 1000.0, 1e4), load=fc.Load(200.0),
        ground=fc.Ground(speed=0.01), gap=4.0 * rise * x[2:] ** 2)
    state = np.zeros(moving.size)
    state[1], state[8], state[9] = height, -0.02, 0.01
    return moving, state


def solid():
    """A rigid block of 2 kg on 289 places in space, above the ground, falling on an edge."""
    places = np.array([(x, y, -0.05) for x in np.linspace(-0.1, 0.1, 17)
                       for y in np.linspace(-0.15, 0.15, 17)])
    rows = np.tile(np.eye(6), (len(places), 1, 1))
    for row, (x, y, z) in zip(rows, places, strict=True):
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    mass, sides = 2.0, np.array([0.2, 0.3, 0.1])
    inertia = mass / 12.0 * ((sides**2).sum() - sides**2)
    basis = fc.basis_from_matrices(
        np.diag([mass] * 3 + [*inertia]), np.zeros((6, 6)), {"contact": rows, "B": np.eye(6)},
        dimension=3, contact_places=places, tributary=np.full(289, 0.06 / 289),
        translations=np.eye(3, 6), damping=0.0)
    moving = fc.ContactSystem(
        basis, RoughSurface(2e6, 5e-6, 50.0), ConstantFriction(0.3, smoothing_slope=1e4),
        ground=fc.Ground(speed=0.01))
    state = np.zeros(12)
    state[2], state[8], state[9] = 3e-6, -0.02, 0.01
    return moving, state


def bodies(modes):
    """Four beams on each other and the ground: modes of one move no nodes of the ones apart."""
    whole = system(stack(80, 70, element_size=0.002, modes=modes),
                   ConstantFriction(0.3, smoothing_slope=1e4))
    assert whole.basis.contact_nodes == 290
    return whole, np.zeros(whole.size)


CASES = {
    "all nodes": lambda: (*beam(), 2e-3),
    "some nodes": lambda: (*beam(rise=20e-6), 2e-3),
    "memory": lambda: (*beam(300, LuGreFriction(0.4, 0.3, 0.01, 2.0, 1e6, 300.0), height=-2e-6),
                       2e-5),
    "space": lambda: (*solid(), 5e-3),
    "bodies": lambda: (*bodies(MODES), 2e-3),
    # Shares of the products end within blocks of the Jacobian, which begin at odd modes.
    "bodies of 20 modes": lambda: (*bodies(5), 2e-3),
}


def run_of(case, workers):
    moving, state, end = CASES[case]()
    return fc.simulate(moving, end, initial=state, outputs=9, solver=Rodas5P(workers=workers),
                       events=ContactEvents() if case == "all nodes" else None)


@pytest.fixture
def taken(monkeypatch):
    """Parts that each helper has taken, in a list."""
    counts = []
    assist = node_work.assist
    monkeypatch.setattr(node_work, "assist", lambda *given: counts.append(assist(*given)))
    return counts


@pytest.mark.parametrize("case", CASES)
def test_results_do_not_depend_on_the_number_of_threads(case, taken):
    one = run_of(case, 1)
    assert not taken
    for workers in (2, 3):
        # A helper that is not given a core takes nothing, and shows nothing.
        begin = time.monotonic()
        while time.monotonic() - begin < 120.0:
            taken.clear()
            more = run_of(case, workers)
            assert len(taken) >= workers - 1
            assert np.array_equal(one.states, more.states)
            assert np.array_equal(one.work, more.work)
            assert np.array_equal(one.node_friction_work, more.node_friction_work)
            assert one.statistics["steps"] == more.statistics["steps"]
            if one.events is not None:
                assert np.array_equal(one.events.time, more.events.time)
            if sum(taken):
                break
        assert sum(taken)


@pytest.mark.parametrize("case", CASES)
def test_parts_add_up_to_the_whole(case, monkeypatch):
    """Runs without parts are those of other tests."""
    parts = run_of(case, 1)
    monkeypatch.setattr(driver, "_team", lambda *given: team.ALONE)
    whole = run_of(case, 1)
    assert whole.statistics["steps"] == parts.statistics["steps"]
    m = whole.system.basis.modes
    for kind in (slice(0, m), slice(m, 2 * m), slice(2 * m, None)):
        one, other = parts.states[:, kind], whole.states[:, kind]
        assert one == pytest.approx(other, abs=1e-9 * np.abs(other).max(initial=0.0))
    assert parts.work == pytest.approx(whole.work, abs=1e-9 * np.abs(whole.work).max())


def test_a_body_bounces_on_many_nodes_as_on_one_spring():
    """y = -F/k (1 - cos w t), w^2 = k/m, until it would lift off."""
    mass, stiffness, force = 0.5, 2e6, 30.0
    rows = np.zeros((NODES, 3, 1))
    rows[:, 1] = 1.0
    basis = fc.basis_from_matrices([[mass]], [[0.0]], {"contact": rows, "C": rows[0]},
                                   contact_places=np.column_stack([np.linspace(0, 1, NODES)] * 2),
                                   tributary=np.full(NODES, 1.0 / NODES), damping=0.0)
    moving = fc.ContactSystem(basis, LinearContact(stiffness, 0.0), load=fc.Load(force))
    w = np.sqrt(stiffness / mass)
    run = fc.simulate(moving, 6.0 / w, initial=[0.0, 0.0], outputs=50, rtol=1e-9,
                      solver=Rodas5P(workers=2, series="never", collocation="never"))
    y = run.modal_coordinates[:, 0] / np.sqrt(mass)
    assert y == pytest.approx(-force / stiffness * (1.0 - np.cos(w * run.time)),
                              abs=1e-7 * force / stiffness)


def test_parts_are_all_nodes_once():
    for used in (256, 257, 300, 1000, 4001):
        for parts in (2, 5, 16):
            ends = [team.ends_of.py_func(part, parts, used) for part in range(parts)]
            assert ends[0][0] == 0
            assert ends[-1][1] == used
            assert [end for _, end in ends[:-1]] == [begin for begin, _ in ends[1:]]
            assert all(end - begin >= 8 for begin, end in ends)


def test_tickets_give_each_part_once_from_both_ends():
    words = np.zeros(tasks.WORDS, dtype=np.int64)
    tasks.announce(tasks.JACOBIAN, 5, words)
    assert tasks.take_first(words) == 0
    assert tasks.take_last(words) == (tasks.JACOBIAN, 4, 5)
    assert tasks.take_last(words) == (tasks.JACOBIAN, 3, 5)
    assert [tasks.take_first(words) for _ in range(4)] == [1, 2, -1, -1]
    for _ in range(1000):
        assert tasks.take_last(words)[1] == -1
    tasks.announce(tasks.STAGE, 2, words)
    assert tasks.take_last(words) == (tasks.STAGE, 1, 2)
    assert tasks.take_first(words) == 0
    assert tasks.take_first(words) == -1


def others():
    return [one for one in threading.enumerate() if one is not threading.main_thread()]


def test_no_thread_is_left_after_an_error():
    moving, state = beam()
    seen = []

    def stop(t):
        seen.append(t)
        raise RuntimeError("enough")

    before = others()
    with pytest.raises(RuntimeError, match="enough"):
        fc.simulate(moving, 1.0, initial=state, solver=Rodas5P(workers=3), progress=stop)
    assert seen
    assert others() == before


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs a timer that interrupts")
def test_no_thread_is_left_after_an_interrupt():
    moving, state = beam()

    def interrupt(*_):
        raise KeyboardInterrupt

    kept, before = signal.signal(signal.SIGALRM, interrupt), others()
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.5)
        run = fc.simulate(moving, 100.0, initial=state, outputs=10**5, max_step=1e-6,
                          solver=Rodas5P(workers=3))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, kept)
    assert run.status is fc.Status.INTERRUPTED
    assert others() == before


def test_helpers_that_nobody_tells_to_leave_do_so():
    run = driver.start(*beam(), np.array([0.0, 1.0]), rtol=1e-6, workers=2)
    begin = time.monotonic()
    assert node_work.assist(run.problem, run.progress, run.room) == 0
    assert 0.3 < time.monotonic() - begin < 60.0


def test_ensembles_have_one_thread_a_run(monkeypatch):
    def refuse(**_):
        raise AssertionError("a helper in an ensemble")

    monkeypatch.setattr(helpers, "Thread", refuse)
    moving, state = beam()
    found = fc.ensemble(moving, [0.0, 1e-4], initial=np.vstack([state, state]),
                        solver=Rodas5P(workers=3))
    assert found.finished.all()
    with pytest.raises(AssertionError, match="a helper"):
        fc.simulate(moving, 1e-4, initial=state, solver=Rodas5P(workers=3))


def test_a_run_does_without_threads_that_cannot_be_started(monkeypatch):
    class Refused(threading.Thread):
        def start(self):
            raise RuntimeError("can't start new thread")

    monkeypatch.setattr(helpers, "Thread", Refused)
    assert run_of("all nodes", 3).status is fc.Status.FINISHED


FORKED = """
import os, warnings
import numpy as np
import fecontact as fc
from fecontact.integrate import Rodas5P
from test_shared_nodes import beam
warnings.simplefilter("ignore")
moving, state = beam()
def last():
    return fc.simulate(moving, 3e-4, initial=state, solver=Rodas5P(workers=2)).states[-1]
before = last()
child = os.fork()
if child == 0:
    os._exit(0 if np.array_equal(last(), before) else 3)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), np.array_equal(last(), before))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_runs_after_a_fork_have_helpers_of_their_own():
    found = subprocess.run([sys.executable, "-c", FORKED], cwd=os.path.dirname(__file__),
                           capture_output=True, text=True, timeout=300, check=False)
    assert found.stdout.split() == ["0", "True"], found.stderr


def test_number_of_threads(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)), raising=False)
    assert [helpers.workers_for(n, None) for n in (255, 256, 999, 1000, 10**5)] == [1, 2, 2, 4, 4]
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0}, raising=False)
    assert helpers.workers_for(10**5, None) == 1
    assert helpers.workers_for(255, 8) == 1
    assert helpers.workers_for(10**4, 8) == 8
    assert [helpers.workers_for(n, 10**6) for n in (300, 1000, 10**5)] == [4, 4, 16]
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert helpers.workers_for(10**5, None) == 1
    assert helpers.workers_for(10**5, 2) == 2
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)), raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3, 1")
    assert helpers.workers_for(10**5, None) == 3


@pytest.mark.parametrize("workers", [0, -1, 1.5, True, "2"])
def test_bad_numbers_of_threads(workers):
    with pytest.raises(InputError, match=r"workers = .* must be a whole number, 1 or above"):
        Rodas5P(workers=workers)
