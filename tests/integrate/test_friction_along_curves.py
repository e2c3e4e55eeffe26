"""Friction with memory along circles and figures of eight, beside an integration of its own.

A mass too heavy to be moved stands on ground that travels along a closed curve. The vector
equations of the laws are written here a second time and integrated by Radau's method; springs with
sliders, whose limits are sharp, from one change between stick and slip to the next.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from systems import TURN

import fecontact as fc
from fecontact.laws import (
    BoucWenFriction,
    DahlFriction,
    FourParameterIwanFriction,
    HarmonicSpeed,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    LuGreFriction,
)
from fecontact.reduction import point_masses

F, W = 25.0, 2.0 * np.pi * 20.0  # normal force [N], angular frequency [rad/s]
END = 0.08
TIMES = np.linspace(0.0, END, 161)
# Amplitudes along x and y as parts of the first, multiples of the frequency along y, phases.
CURVES = {"circle": (1.0, 1, (0.5 * np.pi, 0.0)), "eight": (0.6, 2, (0.5 * np.pi, 0.5 * np.pi))}


class Curve:
    """Slip of the mass over the ground: v = -V, from travels of some size [m]."""

    def __init__(self, name, size):
        part, multiple, self.phases = CURVES[name]
        self.speeds, self.rates = W * size * np.array([1.0, part * multiple]), W * np.array(
            [1.0, multiple])

    @property
    def ground(self):
        along, across = (HarmonicSpeed(speed, rate / TURN, phase) for speed, rate, phase in zip(
            self.speeds, self.rates, self.phases, strict=True))
        return fc.Ground(motion=along, motion_y=across)

    def slip(self, t):
        return -self.speeds * np.sin(self.rates * t + np.array(self.phases))

    def way(self, t):
        phases = np.array(self.phases)
        return self.speeds / self.rates * (np.cos(self.rates * t + phases) - np.cos(phases))


def run_of(law, curve):
    mass = 1e9
    system = fc.ContactSystem(point_masses({"a": mass}, components="xyz", contact="a"),
                              normal=LinearContact(stiffness=1e6), friction=law,
                              ground=curve.ground, load=fc.Load(gravity=(0.0, 0.0, -F / mass)))
    return fc.simulate(system, END, initial="rest", outputs=TIMES, rtol=1e-7)


def dahl(law, v, z):
    s = law.presliding_stiffness / law.friction_coefficient * (z @ v) / np.linalg.norm(v)
    i = law.exponent
    h = (1.0 - np.abs(1.0 - s) ** (i - 1.0) * (1.0 - s)) / s if abs(s) > 1e-9 else i
    rate = v - np.linalg.norm(v) * h * law.presliding_stiffness / law.friction_coefficient * z
    return rate, F * law.presliding_stiffness * z


def lugre(law, v, z):
    speed = np.linalg.norm(v)
    g = law.kinetic_coefficient + (law.static_coefficient - law.kinetic_coefficient) * np.exp(
        -(speed / law.stribeck_velocity) ** law.stribeck_exponent)
    rate = v - law.bristle_stiffness * speed * z / g
    damping = law.bristle_damping * np.exp(-(law.damping_decay * speed) ** 2)
    return rate, F * (law.bristle_stiffness * z + damping * rate + law.viscous_coefficient * v)


def bouc_wen(law, v, z):
    pull, size = v @ z, np.linalg.norm(z)
    growth = law.beta * abs(pull) + (1.0 - law.beta) * pull
    held = growth * size ** (law.exponent - 2.0) * z if size > 0.0 else 0.0 * z
    return (v - held) / law.yield_displacement, law.friction_coefficient * F * z


BRISTLES = [
    (dahl, DahlFriction(0.4, 2e5), 2e-6), (dahl, DahlFriction(0.4, 2e5, 2.5), 2e-6),
    (lugre, LuGreFriction(0.8, 0.5, 2e-3, 2.0, 1e5, 30.0, 20.0), 5e-6),
    (lugre, LuGreFriction(0.8, 0.5, 2e-3, 0.7, 1e5, 30.0, 0.0, 10.0), 5e-6),
    (bouc_wen, BoucWenFriction(0.4, 5e-6, 0.7, 2.0), 5e-6),
    (bouc_wen, BoucWenFriction(0.4, 5e-6, 0.5, 1.3), 5e-6),
]


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize(("equations", "law", "size"), BRISTLES,
                         ids=lambda given: getattr(given, "__name__", None))
def test_bristles(equations, law, size, curve):
    # On the circle they bend less than it takes them to slide, on the eight more.
    path = Curve(curve, {"circle": 0.5, "eight": 3.0}[curve] * size)

    def rate(t, y):
        v = path.slip(t)
        change, force = equations(law, v, y[:2])
        return np.append(change, force @ v)

    found = solve_ivp(rate, (0.0, END), np.zeros(3), method="Radau", t_eval=TIMES, rtol=1e-9,
                      atol=1e-9 * np.array([*2 * [law.state_scale[0]], F * size]))
    forces = np.array([equations(law, path.slip(t), z)[1]
                       for t, z in zip(TIMES, found.y[:2].T, strict=True)])
    run = run_of(law, path)
    assert run.friction_forces[:, 0] == pytest.approx(forces, abs=2e-5 * np.abs(forces).max())
    # The loss is the work of friction without the energy that the bristles store.
    a, b = law.bristle_stiffness_of(np.ones(1))[:, 0, 0]
    kept = 0.5 * (a + b * F) * (found.y[:2, -1] ** 2).sum()
    lost = found.y[2, -1] - kept
    assert run.friction_work[-1, 0] == pytest.approx(lost, rel=2e-5)
    assert lost > 0.0


def slider(path, stiffness, limit):
    """Force (N, 2) of a spring with a slider at TIMES, and its loss, phase by phase."""
    length, force = limit / stiffness, np.empty((len(TIMES), 2))
    t, z, lost = 0.0, np.zeros(2), 0.0
    sticks = True
    while t < END:
        if sticks:
            start, begin = z, t

            def deflection(at, start=start, begin=begin):
                return start + path.way(at) - path.way(begin)

            fine = np.linspace(t, END, 4001)[1:]
            beyond = np.linalg.norm(deflection(fine[:, None]), axis=1) - length
            # At the start of stick the spring leaves its limit.
            out = np.flatnonzero((beyond[1:] > 0.0) & (beyond[:-1] <= 0.0))
            end = END if not len(out) else brentq(
                lambda at: np.linalg.norm(deflection(at)) - length, fine[out[0]],
                fine[out[0] + 1], xtol=1e-16)
            inside = (t <= TIMES) & (end >= TIMES)
            force[inside] = stiffness * deflection(TIMES[inside, None])
            z = deflection(end)
        else:
            def turn(at, y):
                v, e = path.slip(at), np.array([np.cos(y[0]), np.sin(y[0])])
                return [(v[1] * e[0] - v[0] * e[1]) / length, limit * (v @ e)]

            def back(at, y):
                return path.slip(at) @ [np.cos(y[0]), np.sin(y[0])]

            back.terminal, back.direction = True, -1.0
            found = solve_ivp(turn, (t, END), [np.arctan2(z[1], z[0]), 0.0], method="Radau",
                              events=back, rtol=1e-8, atol=1e-10, dense_output=True)
            end = found.t[-1]
            inside = (t <= TIMES) & (end >= TIMES)
            angle = found.sol(TIMES[inside])[0]
            force[inside] = limit * np.column_stack([np.cos(angle), np.sin(angle)])
            lost += found.y[1, -1]
            z = length * np.array([np.cos(found.y[0, -1]), np.sin(found.y[0, -1])])
        t, sticks = end, not sticks
    return force, lost


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("law", [
    JenkinsFriction(2e6, 0.4), IwanFriction(2e6, 0.4, elements=3),
    FourParameterIwanFriction(2e6, 0.4, -0.5, 0.1, elements=4, spacing_ratio=1.5)],
    ids=lambda law: type(law).__name__)
def test_springs_with_sliders(law, curve):
    table = law.table(np.ones(1))[0]
    springs, limits = table[1 : 1 + law.memory], F * table[1 + law.memory :]
    assert springs.sum() == pytest.approx(2e6)
    assert limits.sum() == pytest.approx(0.4 * F)
    path = Curve(curve, {"circle": 1.5, "eight": 4.0}[curve] * 0.4 * F / 2e6)
    parts = [slider(path, spring, limit) for spring, limit in zip(springs, limits, strict=True)]
    force, lost = (sum(part[k] for part in parts) for k in (0, 1))
    run = run_of(law, path)
    # Elements follow their limits within the relaxation time of 0.1 us.
    assert run.friction_forces[:, 0] == pytest.approx(force, abs=2e-4 * 0.4 * F)
    assert run.friction_work[-1, 0] == pytest.approx(lost, rel=5e-4)
    assert lost > 0.0
