"""Requirements on every normal law, also of users: checks that raise AssertionError."""

import math
import pickle
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.integrate import quad

from fecontact.core.compiled import kernel
from fecontact.core.records import Matrix, Vector
from fecontact.laws.signatures import normal_at


@kernel
def _forces(address: int, u: Vector, v: Vector, p: Vector, out: Matrix) -> None:
    law = normal_at(address)
    for k in range(len(u)):
        out[k, 0], out[k, 1], out[k, 2] = law(u[k], v[k], p)


def compiled_forces(law, u, v, p):
    """F, dF/du, dF/dv (k, 3) by the compiled law."""
    out = np.empty((len(u), 3))
    _forces(law.kernel.address, np.array(u, dtype=float), np.array(v, dtype=float),
            np.array(p, dtype=float), out)
    return out


def force(law, u, v=0.0):
    """F, dF/du, dF/dv of a face with one node, by the function as written."""
    return law.kernel.python(u, v, law.table(np.ones(1))[0])


def check_normal_law(law, u_range, v_range, *, two_sided=False, nodes=1):
    """Raise AssertionError unless a normal law keeps the contract.

    Parameters
    ----------
    law : NormalLaw
    u_range, v_range : (float, float)
        Penetrations [m] and rates [m/s] over which it is used; both should contain zero.
    two_sided : bool
        Whether the force may also push down.
    nodes : int
        Number of contact nodes, for laws with parameters per node.
    """
    share = np.full(nodes, 1.0 / nodes)
    rows = law.table(share)
    assert rows.shape[0] == nodes
    assert rows.dtype == float
    assert rows.flags.c_contiguous
    assert 0.0 < law.penetration_scale < math.inf
    assert hash(law) == hash(replace(law))
    assert pickle.loads(pickle.dumps(law)) == law
    for p in np.unique(rows, axis=0):
        check_forces(law, p, u_range, v_range, two_sided)
    check_stored_energy(law, u_range, share)
    if nodes == 1:
        check_sharing(law, u_range)


def check_forces(law, p, u_range, v_range, two_sided=False):
    """Check the function of the law for one row of parameters."""
    check_values(law, p, u_range, v_range, two_sided)
    check_derivatives(law, p, u_range, v_range)
    check_continuity(law, p, u_range)
    check_cycles(law, p, u_range, v_range)


def _states(u_range, v_range, scale, count=400):
    rng = np.random.default_rng(1)
    low, high = u_range
    u = np.concatenate([rng.uniform(low, high, count), rng.uniform(low, high, count // 4) * 1e-3,
                        scale * rng.uniform(-2.0, 2.0, count),
                        scale * 10.0 ** rng.uniform(-9.0, 0.0, count),
                        scale * np.array([-1.0, -1e-9, 0.0, 1e-9, 0.5, 1.0, 2.0])])
    u = np.clip(u, low, high)
    v = rng.uniform(*v_range, len(u)) * 10.0 ** rng.uniform(-4.0, 0.0, len(u))
    v[::7] = 0.0
    return u, v


def check_values(law, p, u_range, v_range, two_sided=False):
    """Finite, never tensile, more with more penetration and speed, slopes zero where F is."""
    u, v = _states(u_range, v_range, law.penetration_scale)
    plain = np.array([law.kernel.python(*state, p) for state in zip(u, v, strict=True)])
    F, F_u, F_v = compiled_forces(law, u, v, p).T
    assert np.isfinite(plain).all()
    np.testing.assert_allclose(np.column_stack([F, F_u, F_v]), plain, rtol=1e-12,
                               atol=1e-14 * np.abs(plain).max(axis=0).max() * 1e-6)
    assert two_sided or (F >= 0.0).all()
    assert (F_v >= 0.0).all()
    assert (F_u[v == 0.0] >= 0.0).all()
    open_ = F == 0.0
    assert (F_u[open_] == 0.0).all()
    assert (F_v[open_] == 0.0).all()


def check_derivatives(law, p, u_range, v_range, tolerance=2e-6):
    """Derivatives against differences of fourth order, at joints against one of both sides."""
    u, v = _states(u_range, v_range, law.penetration_scale)
    scale = law.penetration_scale
    _, F_u, F_v = compiled_forces(law, u, v, p).T
    step = 2e-4 * np.minimum(np.maximum(np.abs(u), 1e-12 * scale), scale)
    largest = max(map(abs, v_range))
    for given, change_u, change_v in (
            (F_u, step, np.zeros_like(u)),
            (F_v, np.zeros_like(u), 1e-3 * np.maximum(np.abs(v), 1e-3 * largest))):
        h = change_u + change_v
        stencil = {k: compiled_forces(law, u + k * change_u, v + k * change_v, p)[:, 0]
                   for k in range(-4, 5)}
        central = (8.0 * (stencil[1] - stencil[-1]) - (stencil[2] - stencil[-2])) / (12.0 * h)
        sides = [s * (-25.0 * stencil[0] + 48.0 * stencil[s] - 36.0 * stencil[2 * s]
                      + 16.0 * stencil[3 * s] - 3.0 * stencil[4 * s]) / (12.0 * h)
                 for s in (1, -1)]
        size = np.max([np.abs(given), *map(np.abs, (central, *sides))], axis=0)
        rounding = 50.0 * np.finfo(float).eps * np.max(
            [np.abs(value) for value in stencil.values()], axis=0) / h
        error = np.min([np.abs(given - other) for other in (central, *sides)], axis=0)
        worst = int(np.argmax(error - tolerance * size - rounding))
        assert error[worst] <= tolerance * size[worst] + rounding[worst], (
            f"{type(law).__name__}: derivative {given[worst]!r} at u = {u[worst]!r}, "
            f"v = {v[worst]!r}, but differences give {central[worst]!r}, {sides!r}"[:400])


def check_continuity(law, p, u_range):
    """The elastic force rises by the integral of its slope, across all joints."""
    edges = np.unique(np.concatenate([
        np.linspace(*u_range, 2001),
        np.clip(law.penetration_scale * np.linspace(-3.0, 3.0, 2001), *u_range)]))
    points, weights = np.polynomial.legendre.leggauss(6)
    middle, half = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges) / 2.0
    u = (middle[:, None] + half[:, None] * points).reshape(-1)
    slopes = compiled_forces(law, u, np.zeros_like(u), p)[:, 1].reshape(-1, len(points))
    rise = np.concatenate([[0.0], np.cumsum(half * (slopes @ weights))])
    F = compiled_forces(law, edges, np.zeros_like(edges), p)[:, 0]
    np.testing.assert_allclose(rise, F - F[0], rtol=0.0, atol=1e-4 * np.ptp(F))


def check_cycles(law, p, u_range, v_range):
    """No closed motion takes energy out of the contact."""
    rng = np.random.default_rng(2)
    t = np.linspace(0.0, 1.0, 20_000, endpoint=False)
    order = np.arange(1, 6)
    for _ in range(10):
        waves = 2.0 * np.pi * np.outer(t, order)
        a, b = rng.normal(size=(2, 5)) / order
        u, rate = (np.cos(waves) @ a + np.sin(waves) @ b,
                   2.0 * np.pi * (np.cos(waves) @ (b * order) - np.sin(waves) @ (a * order)))
        factor = rng.choice([1.0, 1e-2]) * min(map(abs, u_range)) / np.abs(u).max()
        factor = max(factor, 1e-3 * np.ptp(u_range) / np.ptp(u))
        speed = max(map(abs, v_range)) / np.abs(rate).max() / factor
        F, _, _ = compiled_forces(law, factor * u, factor * speed * rate, p).T
        still, _, _ = compiled_forces(law, factor * u, np.zeros_like(u), p).T
        loss = (F - still) * rate
        assert (loss >= -1e-12 * np.abs(loss).max()).all()
        assert abs((still * rate).mean()) <= 1e-3 * np.abs(still * rate).mean()


def check_stored_energy(law, u_range, share):
    """Energy against adaptive quadrature, for many times at once."""
    scale = law.penetration_scale
    levels = np.unique(np.clip([*np.linspace(*u_range, 7), -scale, 0.0, 0.3 * scale, scale,
                                1.7 * scale], *u_range))
    u = np.tile(levels[:, None], (1, len(share)))
    energy = law.stored_energy(u, share)
    assert energy.shape == u.shape
    rows = law.table(share)
    for j, p in enumerate(rows):
        def elastic(value, p=p):
            return law.kernel.python(value, 0.0, p)[0]

        expected = []
        for end in levels:
            joints = [x for x in (-scale, scale) if min(end, 0.0) < x < max(end, 0.0)]
            grid = np.unique([*joints, *np.linspace(0.0, end, 33)])
            sign = 1.0 if end >= 0.0 else -1.0
            expected.append(sign * sum(
                quad(elastic, a, b, epsabs=0.0, epsrel=1e-9, limit=100)[0]
                for a, b in pairwise(grid) if elastic(a) or elastic(b)))
        np.testing.assert_allclose(energy[:, j], expected, rtol=2e-7,
                                   atol=1e-9 * scale * abs(elastic(scale)))
    np.testing.assert_allclose(law.stored_energy(u[2], share), energy[2], rtol=1e-13, atol=0.0)
    assert law.stored_energy(u[None], share).shape == (1, *u.shape)


def check_sharing(law, u_range):
    """Totals are shared by tributary length: the face carries the same with any nodes."""
    u = np.linspace(*u_range, 23)
    (whole,) = law.table(np.ones(1))
    parts = law.table(np.array([0.2, 0.5, 0.3]))
    total = sum(compiled_forces(law, u, np.zeros_like(u), p)[:, 0] for p in parts)
    np.testing.assert_allclose(total, compiled_forces(law, u, np.zeros_like(u), whole)[:, 0],
                               rtol=1e-12, atol=0.0)
