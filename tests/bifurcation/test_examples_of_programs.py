"""Examples of pyHarm, tmdsimpy, Exudyn and Siconos, against SciPy or closed forms."""

import numpy as np
import pytest
from fourier import Structure, half_range
from numba import njit
from scipy.integrate import solve_ivp
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, contact_field, frequency_response, vector_field
from fecontact.integrate import ContactEvents, SetValued
from fecontact.laws import (
    ConstantFriction,
    Harmonic,
    JenkinsFriction,
    LinearContact,
    RoughSurface,
)

FREQUENCY = "load.forces.0.signal.frequency_hz"


def test_duffings_oscillator_of_pyharm():
    """x'' + .3 x' + x + x^3 = cos W t with 12 harmonics, from superharmonics to beyond the fold."""
    def rates(t, x, p, out):
        out[0] = x[1]
        out[1] = np.cos(p[0] * t) - 0.3 * x[1] - x[0] - x[0]**3

    field = vector_field(rates, {"W": 0.2}, ("x", "v"), period=lambda p: TURN / p["W"])
    branch = frequency_response(field, (0.2, 3.0), method=HarmonicBalance(12)).branches[0]
    folds = branch.of_kind("fold")
    assert len(folds) == 2
    for W in (0.4, 1.0, 1.6, 2.8):
        found = branch.at(field, W, 0)
        assert found.values["stable"]
        states, period = found.orbit(field, 101).states, TURN / W
        run = solve_ivp(lambda t, x, W=W: [x[1], np.cos(W * t) - 0.3 * x[1] - x[0] - x[0]**3],
                        (0.0, 20.0 * period), states[0], rtol=1e-9, atol=1e-11,
                        t_eval=19.0 * period + np.linspace(0.0, period, 101))
        assert np.abs(states[:, 0] - run.y[0]).max() < 2e-4 * np.abs(states[:, 0]).max()


@njit
def dry(u, limit):
    """Forces (N,) of a spring with a slider over a period, after another one."""
    f, before, found = 0.0, u[-1], np.empty_like(u)
    for _ in range(2):
        for k in range(len(u)):
            f = min(max(f + 5.0 * (u[k] - before), -limit[k]), limit[k])
            before = u[k]
            found[k] = f
    return found


@pytest.mark.parametrize("level", [50.0, 100.0])
def test_elastic_dry_friction_of_tmdsimpy(level):
    """A mass pressed on a base by 100 N, driven along it, and by a tenth of that across."""
    M, K = np.eye(2), np.diag([12.0, 21.0])
    C, load = np.diag([0.1 * np.sqrt(12.0), 2.0]), level * np.array([1.0, -0.1])

    def forces(u, v):
        normal = 21.0 * np.maximum(-u[:, 1], 0.0)
        return np.stack([dry(u[:, 0], 0.85 * normal), -normal], axis=1)

    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    pushed = np.zeros((3, 2))
    pushed[1] = load
    basis = fc.basis_from_matrices(M, K, {"contact": rows[None], "B": rows, "force": pushed},
                                   damping=C)
    system = fc.ContactSystem(
        basis, normal=LinearContact(21.0), friction=JenkinsFriction(5.0, 0.85), load=fc.Load(
            forces=(fc.PointLoad("force", "y", signal=Harmonic(1.0, 1.0)),
                    fc.PointLoad("B", "y", signal=-100.0))))
    branch = frequency_response(system, (1.0 / TURN, 6.0 / TURN), FREQUENCY,
                                method=HarmonicBalance(8, 512, stability=None)).branches[0]
    field, other = contact_field(system, [FREQUENCY]), Structure(M, C, K, np.eye(2), forces)
    slid = []
    for w in (1.5, 3.5, 5.5):
        states = branch.at(field, w / TURN).orbit(field, 1025).states[:-1, :2]
        begin = np.fft.rfft(states, axis=0)[:9] / 512.0
        begin[0] /= 2.0
        _, u = other.response(-1j * load, w, 8, 4096, seen=[1.0, 0.0], start=begin,
                              mean=[0.0, -100.0])
        assert np.abs(begin[1:] - u[1:]).max() < 2e-3 * np.abs(u[1:]).max()
        assert begin[0, 1] == pytest.approx(u[0, 1], rel=2e-3)
        slid.append(5.0 * half_range(u[:, 0]) > 50.0)
    assert any(slid)


def test_a_mass_between_two_stops_of_exudyn():
    """0.5 kg at 10 m/s between stops of 1e4 N/m and 10 N s/m, 0.95 m to both sides.

    It leaves a stop where spring and dashpot pull no more: always after the same time, with the
    same part of its velocity.
    """
    m, k, d, clear = 0.5, 1e4, 10.0, 0.95
    decay = 0.5 * d / m
    w = np.sqrt(k / m - decay**2)
    # u = exp(-decay t) sin(w t) / w for a unit velocity; k u + d u' is zero at the end.
    lasts = (np.pi - np.arctan2(d * w, k - d * decay)) / w
    deep = np.exp(-decay * lasts) * np.sin(w * lasts) / w
    back = -np.exp(-decay * lasts) * (np.cos(w * lasts) - decay / w * np.sin(w * lasts))
    time, speed, side, place, touches = 0.0, 10.0, 1.0, 0.0, []
    while time + (clear - place) / speed < 2.0:
        time += (clear - place) / speed
        touches.append(time)
        time, place, speed = time + lasts, -clear - speed * deep, back * speed
        side = -side
    wanted = side * (place + speed * (2.0 - time))
    rows = np.zeros((2, 3, 1))
    rows[:, 1, 0] = 1.0, -1.0
    basis = fc.basis_from_matrices([[m]], [[0.0]], {"contact": rows, "B": rows[0]})
    system = fc.ContactSystem(basis, normal=LinearContact([k, k], [d, d]), gap=clear)
    run = fc.simulate(system, 2.0, initial=[0.0, 10.0 * np.sqrt(m)], rtol=1e-10,
                      events=ContactEvents())
    assert run.events.only("touch-down").time == pytest.approx(touches, abs=1e-7)
    assert run.states[-1] / np.sqrt(m) == pytest.approx([wanted, side * speed], rel=1e-6)
    assert len(touches) == 5


def test_the_bouncing_ball_of_siconos():
    """Dropped from 1 m with restitution 0.9 it is at rest after 8.58 s, 19 times the first fall."""
    e, g, fall = 0.9, 9.81, np.sqrt(2.0 / 9.81)
    rows = np.array([[0.0], [1.0], [0.0]])
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "C": rows})
    system = fc.ContactSystem(basis, normal=RoughSurface(1e5, 1e-4), load=fc.Load(g),
                              friction=ConstantFriction(0.0))
    run = fc.simulate(system, 10.0, initial=[1.0, 0.0], outputs=1001, rtol=1e-10,
                      solver=SetValued(restitution=e), events=ContactEvents())
    moments = fall * (1.0 + 2.0 * np.cumsum(np.concatenate([[0.0], e ** np.arange(1, 60)])))
    down = run.events.only("touch-down")
    assert down.time[:60] == pytest.approx(moments, abs=1e-8)
    assert down.time[-1] == pytest.approx(19.0 * fall, rel=1e-4)
    assert run.states[-1] == pytest.approx([0.0, 0.0], abs=1e-9)
