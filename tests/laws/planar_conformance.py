"""Requirements on every friction law in two directions: checks that raise AssertionError."""

from typing import NamedTuple

import numpy as np
from friction_conformance import memory_outputs, parameters, sliding_memory

from fecontact.core.compiled import kernel
from fecontact.core.records import Matrix, Vector
from fecontact.laws.friction.planar import along_slip
from fecontact.laws.signatures import planar_at

EPS = np.finfo(float).eps
FORCES = (0.3, 14.0)
ANGLES = (0.0, 0.4, 1.9, 3.3, 5.1)
_TURN = 0.7


@kernel
def _compiled(
    address: int, law: int, v1: float, v2: float, F: float, z: Vector, p: Vector, force: Vector,
    rates: Matrix,
) -> None:
    planar_at(address)(law, v1, v2, F, z, p, force, rates)


class Planar(NamedTuple):
    """Friction R (2,) and rates of z (S,), and their derivatives to slip, load and memory."""

    force: np.ndarray
    by_slip: np.ndarray
    by_load: np.ndarray
    by_memory: np.ndarray
    rates: np.ndarray
    rates_by_slip: np.ndarray
    rates_by_load: np.ndarray
    rates_by_memory: np.ndarray


def planar_outputs(law, slip, F, z, p):
    """The law at a slip velocity (2,) and internal variables z (s, 2), as kernels see it."""
    z = np.ascontiguousarray(z, dtype=float).ravel()
    S = len(z)
    force, rates = np.full(2 * (4 + S), np.nan), np.full((S, 4 + S), np.nan)
    kernel_in_space = type(law).planar_kernel if law.memory else along_slip
    _compiled(kernel_in_space.address, law.kernel.address if law.memory == 0 else 0,
              float(slip[0]), float(slip[1]), float(F), z, np.ascontiguousarray(p), force, rates)
    R = force.reshape(2, 4 + S)
    return Planar(R[:, 0], R[:, [1, 3 + S]], R[:, 2], R[:, 3 : 3 + S],
                  rates[:, 0], rates[:, [1, 3 + S]], rates[:, 2], rates[:, 3 : 3 + S])


def scalar_outputs(law, v, F, z, p):
    """Force and rates of the law of one direction, with their derivatives: (3 + s,), (s, 3 + s)."""
    if law.memory:
        return memory_outputs(law, v, F, z, p)
    return np.array(law.kernel.python(v, F, p)), np.zeros((0, 3))


def unit(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def check_planar_law(law, fastest=None):
    """Straight paths, turned frames, derivatives, loss, rest and open contact.

    ``fastest`` [m/s] is the largest slip velocity, by default 100 velocity scales.
    """
    fastest = fastest or 100.0 * law.velocity_scale
    rows = parameters(law)
    share = np.full(len(rows), 1.0 / len(rows))
    for node, p in enumerate(rows):
        stored = law.bristle_stiffness_of(share)[:, node]
        for F in (force * share[node] for force in FORCES):
            size = np.abs(sliding_memory(law, F, fastest, p)) if law.memory else np.zeros(0)
            size = np.where(size > 0.0, size, law.state_scale)
            check_straight_paths(law, fastest, F, size, p)
            check_limit_of_rest(law, F, p)
            for slip, z in states(law.memory, fastest, size):
                check_turned_frame(law, slip, F, z, p)
                check_loss(law, slip, F, z, p, stored)
                check_derivatives(law, slip, F, z, p, size, fastest)
            check_open_contact(law, fastest, F, size, p)


def states(count, fastest, size):
    """Slip velocities (2,) and internal variables (s, 2) in all branches of the laws.

    Deflections along the slip, against it, nearly across it and askew; none, tiny ones, those of
    sticking contacts, and beyond sliding; at rest too.
    """
    rng = np.random.default_rng(4)
    for speed in (0.0, 1e-3, 0.05, 1.0):
        if not count:
            for angle in ANGLES:
                yield fastest * speed * unit(angle), np.zeros((0, 2))
            continue
        for factor in (0.0, 1e-5, 0.4, 1.7):
            for turned in (0.0, np.pi, 1.55, 0.8):
                angle = rng.uniform(0.0, 2.0 * np.pi)
                spread = 0.3 * rng.standard_normal(count) * (count > 1)
                directions = np.stack([unit(angle + turned + part) for part in spread])
                yield (fastest * speed * unit(angle), factor * size[:, None] * directions
                       * rng.uniform(0.8, 1.0, (count, 1)))


def check_straight_paths(law, fastest, F, size, p):
    """Along every line the law of one direction, to round-off."""
    rng = np.random.default_rng(9)
    for angle in ANGLES:
        e = unit(angle)
        for v in fastest * np.array([-1.0, -0.07, -1e-4, 1e-4, 0.3]):
            z = size * rng.uniform(-1.5, 1.5, law.memory)
            force, rates = scalar_outputs(law, v, F, z, p)
            found = planar_outputs(law, v * e, F, z[:, None] * e, p)
            assert_near(found.force, force[0] * e, abs(force[0]))
            assert_near(found.by_load, force[2] * e, abs(force[2]))
            # In steady sliding rates are small differences of large terms.
            moved = (np.abs(found.rates_by_slip).max(initial=0.0) * np.abs(v)
                     + np.abs(found.rates_by_memory) @ np.abs(z[:, None] * e).ravel()).max(
                         initial=0.0)
            assert_near(found.rates.reshape(-1, 2), rates[:, :1] * e, moved)
            assert_near(found.rates_by_load.reshape(-1, 2), rates[:, 2:3] * e,
                        np.abs(rates[:, 2:3]))
            # Derivatives along the line.
            assert_near(e @ found.by_slip @ e, force[1], np.abs(found.by_slip).max())
            by_memory = (found.by_memory.reshape(2, -1, 2) @ e).T @ e
            assert_near(by_memory, force[3:], np.abs(found.by_memory).max(initial=0.0))
            along = found.rates_by_slip.reshape(-1, 2, 2) @ e @ e
            assert_near(along, rates[:, 1], np.abs(found.rates_by_slip).max(initial=0.0))
            own = np.einsum("jckd,c,d->jk", found.rates_by_memory.reshape(
                law.memory, 2, law.memory, 2), e, e)
            assert_near(own, rates[:, 3:], np.abs(found.rates_by_memory).max(initial=0.0))


def check_turned_frame(law, slip, F, z, p):
    """A turned frame turns the force, the rates and all derivatives, to round-off."""
    Q = np.array([[np.cos(_TURN), -np.sin(_TURN)], [np.sin(_TURN), np.cos(_TURN)]])
    both = np.kron(np.eye(law.memory), Q)
    here, there = planar_outputs(law, slip, F, z, p), planar_outputs(law, Q @ slip, F, z @ Q.T, p)
    terms = (np.abs(here.rates_by_slip) @ np.abs(slip)
             + np.abs(here.rates_by_memory) @ np.abs(z).ravel()).max(initial=0.0)
    for name, expected in (
            ("force", Q @ here.force), ("by_slip", Q @ here.by_slip @ Q.T),
            ("by_load", Q @ here.by_load), ("by_memory", Q @ here.by_memory @ both.T),
            ("rates", both @ here.rates), ("rates_by_slip", both @ here.rates_by_slip @ Q.T),
            ("rates_by_load", both @ here.rates_by_load),
            ("rates_by_memory", both @ here.rates_by_memory @ both.T)):
        size = np.abs(expected).max(initial=0.0)
        if name == "rates":
            size += terms
        # Divided differences across the deflection lose some digits more, in the Jacobian alone.
        part = 1e-11 if name in ("rates_by_slip", "rates_by_memory") else 64.0 * EPS
        assert_near(getattr(there, name), expected, size, name, part)


def check_loss(law, slip, F, z, p, stored):
    """Power of friction less what the internal variables store is zero or above."""
    found = planar_outputs(law, slip, F, z, p)
    power = found.force @ slip
    if not law.memory:
        assert power >= 0.0
        across = found.force[0] * slip[1] - found.force[1] * slip[0]
        assert abs(across) <= 10.0 * EPS * abs(power)
        return
    stiffness, rates = stored[0] + stored[1] * F, found.rates.reshape(-1, 2)
    kept = stiffness @ (z * rates).sum(axis=1)
    size = np.hypot(*found.force) * np.hypot(*slip) + stiffness @ (
        np.hypot(*z.T) * np.hypot(*rates.T))
    assert power - kept >= -64.0 * EPS * size


def check_limit_of_rest(law, F, p):
    """At rest the derivative to the slip is R'(0, F) I, and so it is near rest."""
    z = np.zeros((law.memory, 2))
    force, rates = scalar_outputs(law, 0.0, F, np.zeros(law.memory), p)
    slow = 1e-7 * law.velocity_scale
    for angle in ANGLES:
        for speed, tolerance in ((0.0, 1e-14), (slow, 1e-5)):
            found = planar_outputs(law, speed * unit(angle), F, z, p)
            assert_near(found.by_slip, force[1] * np.eye(2), abs(force[1]), part=tolerance)
            for k, rate in enumerate(rates[:, 1]):
                assert_near(found.rates_by_slip[2 * k : 2 * k + 2], rate * np.eye(2), abs(rate),
                            part=tolerance)
    assert not planar_outputs(law, np.zeros(2), F, z, p).force.any()


def check_open_contact(law, fastest, F, size, p):
    """Without normal force there is no friction, and internal variables fade."""
    z = size[:, None] * unit(0.3)
    found = planar_outputs(law, fastest * unit(1.0), 0.0, z, p)
    assert not found.force.any()
    assert not found.by_slip.any()
    if law.memory:
        error_floor = np.linalg.eigvals(found.rates_by_memory).real
        assert error_floor.max() <= -1e3
        still = planar_outputs(law, np.zeros(2), 0.0, z, p)
        assert (still.rates.reshape(-1, 2) * z <= 0.0).all()
        assert (still.rates.reshape(-1, 2) @ unit(0.3) < 0.0).all()


def check_derivatives(law, slip, F, z, p, size, fastest):
    """All derivatives are those of differences; at a corner, between those of its two sides."""
    s = law.memory
    point = np.concatenate([slip, [F], z.ravel()])

    def outputs(x):
        found = planar_outputs(law, x[:2], x[2], x[3:].reshape(s, 2), p)
        return np.concatenate([found.force, found.rates])

    given = planar_outputs(law, slip, F, z, p)
    gradient = np.block([[given.by_slip, given.by_load[:, None], given.by_memory],
                         [given.rates_by_slip, given.rates_by_load[:, None],
                          given.rates_by_memory]])
    speed = max(float(np.hypot(*slip)), 0.1 * law.velocity_scale if not s else 1e-4 * fastest)
    deflection = np.maximum(np.hypot(*z.T), 1e-3 * size)
    steps = 1e-3 * np.concatenate([[speed, speed, F], np.repeat(deflection, 2)])
    here = outputs(point)
    for k, step in enumerate(steps):
        def at(part, k=k, step=step):
            moved = point.copy()
            moved[k] += part * step
            return outputs(moved)

        far = {part: at(part) for part in (-2.0, -1.0, 1.0, 2.0)}
        central = (8.0 * (far[1.0] - far[-1.0]) - (far[2.0] - far[-2.0])) / (12.0 * step)
        near = np.array([(at(part) - here) / (part * step) for part in (-1e-3, 1e-3)])
        largest = np.maximum(np.abs(far[-1.0]), np.abs(far[1.0]))
        slack = 2e-6 * np.abs(gradient[:, k]) + 1e-6 * np.abs(gradient[:, k]).max() + (
            1e-9 * largest / step)
        smooth = np.abs(central - gradient[:, k]) <= slack
        slack = slack + 1e-3 * np.abs(near).max(axis=0) + 1e-9 * largest / step
        between = (near.min(axis=0) - slack <= gradient[:, k]) & (
            gradient[:, k] <= near.max(axis=0) + slack)
        wrong = ~(smooth | between)
        assert not wrong.any(), (k, slip, F, z, gradient[wrong, k], central[wrong], near[:, wrong])


def assert_near(found, expected, size, name="", part=64.0 * EPS):
    """Check that two values agree to round-off of a size."""
    error = np.abs(np.asarray(found) - expected)
    assert (error <= part * np.asarray(size)).all(), (name, found, expected)
