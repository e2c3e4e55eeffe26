"""Requirements on every friction law, also of users: checks that raise AssertionError."""

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.records import Matrix, Vector
from fecontact.laws.signatures import friction_at, memory_at

SPEEDS = np.geomspace(1e-4, 1e5, 55)


@kernel
def _compiled_friction(address: int, v: float, F: float, p: Vector, out: Vector) -> None:
    out[0], out[1], out[2] = friction_at(address)(v, F, p)


@kernel
def _compiled_memory(
    address: int, v: float, F: float, z: Vector, p: Vector, force: Vector, rates: Matrix,
) -> None:
    memory_at(address)(v, F, z, p, force, rates)


def parameters(law, nodes=None):
    """Parameter rows of the law, one per node."""
    given = [len(value) for value in vars(law).values() if isinstance(value, tuple)]
    nodes = nodes or max(given, default=1)
    return np.ascontiguousarray(law.table(np.full(nodes, 1.0 / nodes)))


def check_friction_law(law):
    """A law without memory: compiled as written, odd, dissipative, with right derivatives."""
    assert law.memory == 0
    scale = law.velocity_scale
    assert scale > 0.0
    for p in parameters(law):
        def evaluated(v, F, p=p):
            return np.array(law.kernel.python(v, F, p))

        compiled = np.empty(3)
        for v in np.concatenate([-scale * SPEEDS, [0.0], scale * SPEEDS]):
            for F in (0.0, 0.3, 14.0):
                values = evaluated(v, F)
                assert np.isfinite(values).all(), (v, F, values)
                _compiled_friction(law.kernel.address, v, F, p, compiled)
                np.testing.assert_allclose(compiled, values, rtol=1e-9, atol=1e-12)
                np.testing.assert_allclose(evaluated(-v, F) * [-1, 1, -1], values,
                                           rtol=1e-9, atol=1e-12)
                assert values[0] * v >= 0.0, (v, F, values)
                if F == 0.0:
                    assert values[0] == 0.0
                    continue
                size = abs(values[0]) / max(abs(v), scale)
                check_derivative(lambda x, F=F: evaluated(x, F)[0], v, values[1],
                                 1e-3 * max(abs(v), scale), 1e-6 * size)
                check_derivative(lambda x, v=v: evaluated(v, x)[0], F, values[2], 1e-3 * F,
                                 1e-8 * abs(values[0]) / F)
    stick = law.stick_velocity(3 if len(parameters(law)) == 1 else len(parameters(law)))
    assert (stick > 0.0).all()
    assert np.isfinite(stick).all()


def check_derivative(function, x, slope, step, tolerance):
    """The slope is that of differences; at a corner, between those of its two sides."""
    left2, left, right, right2 = (function(x + k * step) for k in (-2, -1, 1, 2))
    central = (8.0 * (right - left) - (right2 - left2)) / (12.0 * step)
    tolerance += 1e-6 * abs(slope)
    if abs(central - slope) <= tolerance:
        return
    small = 1e-3 * step
    sides = [(function(x + s * small) - function(x)) / (s * small) for s in (-1, 1)]
    slack = 1e-3 * max(map(abs, sides)) + tolerance
    assert min(sides) - slack <= slope <= max(sides) + slack, (x, slope, central, sides)


def memory_outputs(law, v, F, z, p):
    """Force (3 + s,) and rates (s, 3 + s) of the law as written."""
    s = len(z)
    force, rates = np.full(3 + s, np.nan), np.full((s, 3 + s), np.nan)
    law.kernel.python(v, F, z, p, force, rates)
    return force, rates


def check_memory_law(law, sliding_velocity=None):
    """A law with memory: derivatives, symmetry, steady sliding, fading, energy of cycles.

    ``sliding_velocity`` [m/s] is the largest one tried, by default 100 velocity scales.
    """
    s = law.memory
    assert s >= 1
    assert law.state_scale.shape == (s,)
    assert (law.state_scale > 0.0).all()
    fastest = sliding_velocity or 100.0 * law.velocity_scale
    rng = np.random.default_rng(1)
    rows = parameters(law)
    share = np.full(len(rows), 1.0 / len(rows))
    for node, p in enumerate(rows):
        for trial in range(40):
            F = float(rng.choice([0.0, 0.2, 1.0, 14.0])) * share[node]
            # Sizes below, about and beyond those of sliding.
            reach = _reach(law, F or 1.0, fastest, p)
            z = reach * rng.uniform(-1.3, 1.3, s)
            v = fastest * float(rng.choice([-1.0, 1.0])) * 10.0 ** rng.uniform(-4.0, 0.0)
            if trial % 10 == 0:
                v = 0.0
            _check_memory_point(law, v, F, z, p)
        _check_steady(law, share, node, p, fastest)
        _check_fading(law, p, fastest)
        for loop in range(3):
            F = 2.0 * share[node]
            reach = _reach(law, F, fastest, p)
            taken, moved = cycle_energy(law, p, F, reach, fastest, loop)
            assert taken >= -1e-5 * moved


def sliding_memory(law, F, v, p):
    """Internal variables of steady sliding, by implicit Euler steps that grow until z' is 0."""
    z, step = np.zeros(law.memory), 1e-9
    while step < 1e12:
        z, step = implicit_step(law, v, F, z, p, step, law.state_scale), 2.0 * step
    return z


def _reach(law, F, v, p):
    z = np.abs(sliding_memory(law, F, v, p))
    return np.where(z == 0.0, law.state_scale, z)


def _check_memory_point(law, v, F, z, p):
    s = len(z)
    force, rates = memory_outputs(law, v, F, z, p)
    assert np.isfinite(force).all()
    assert np.isfinite(rates).all()
    # Work arrays larger than its own, as in systems of several laws: the rest stays untouched.
    wide_force, wide_rates = np.full(5 + s, 7.0), np.full((s + 2, 5 + s), 7.0)
    _compiled_memory(law.kernel.address, v, F, z, p, wide_force, wide_rates)
    np.testing.assert_allclose(wide_force[: 3 + s], force, rtol=1e-8, atol=1e-9 * abs(force[0]))
    np.testing.assert_allclose(wide_rates[:s, : 3 + s], rates, rtol=1e-8, atol=1e-300)
    assert (wide_force[3 + s:] == 7.0).all()
    assert (wide_rates[s:] == 7.0).all()
    assert (wide_rates[:, 3 + s:] == 7.0).all()
    if v:
        mirrored, mirrored_rates = memory_outputs(law, -v, F, -z, p)
        np.testing.assert_allclose(mirrored[0], -force[0], rtol=1e-12)
        np.testing.assert_allclose(mirrored_rates[:, 0], -rates[:, 0], rtol=1e-12)
    if F == 0.0:
        assert force[0] == 0.0
        return
    steps = [1e-3 * max(abs(v), law.velocity_scale), 1e-3 * F, *(1e-3 * np.abs(z))]
    point = np.array([v, F, *z])
    for k, step in enumerate(steps):
        def at(x, k=k):
            moved = point.copy()
            moved[k] = x
            return memory_outputs(law, moved[0], moved[1], moved[2:], p)

        biggest = np.abs(rates[:, 0]).max()
        check_derivative(lambda x, at=at: at(x)[0][0], point[k], force[1 + k], step,
                         1e-8 * abs(force[0]) / step)
        for i in range(s):
            check_derivative(lambda x, at=at, i=i: at(x)[1][i, 0], point[k], rates[i, 1 + k], step,
                             1e-9 * biggest / step)


def _check_steady(law, share, node, p, fastest):
    n = len(share)
    for v in (-fastest, -0.01 * fastest, 0.1 * fastest):
        F = 3.0 * share[node]
        z = sliding_memory(law, F, v, p)
        force, rates = memory_outputs(law, v, F, z, p)
        assert np.abs(rates[:, 0]).max() <= 1e-9 * np.abs(rates[:, 3:] * z).max() + 1e-12
        steady = np.broadcast_to(law.steady_coefficient(v), (n,))[node]
        assert abs(force[0] - steady * F) <= 1e-12 * abs(steady * F)
        speeds, forces = np.full((2, n), v), np.full((2, n), F)
        assert not law.sticks(speeds, forces, np.full((2, n), force[0]))[:, node].any()
        # Sticking is a force below 0.95 of that of steady sliding.
        assert not law.sticks(speeds, forces, np.full((2, n), 0.96 * force[0]))[:, node].any()
        assert steady == 0.0 or law.sticks(
            speeds, forces, np.full((2, n), 0.94 * force[0]))[:, node].all()


def _check_fading(law, p, fastest):
    """Without normal force z falls back to zero, up to what the velocity moves meanwhile."""
    z = 3.0 * law.state_scale
    for v in (0.0, fastest):
        _, rates = memory_outputs(law, v, 0.0, z, p)
        assert (rates[:, 0] <= 0.0).all()
        matrix = rates[:, 3:]
        assert np.linalg.eigvals(matrix).real.max() <= -1e3
        rest = np.linalg.solve(matrix, matrix @ z - rates[:, 0])
        assert (np.abs(rest) <= 1e-3 * law.state_scale + 1e-6 * fastest).all()


def cycle_energy(law, p, F, reach, fastest, loop=0, cycles=3, steps=800):
    """Integrals of R v and of its size [J] over the last of some cycles of a periodic motion.

    The internal variables are moved to and fro by several times ``reach``, those of sliding.
    Implicit Euler steps of z and forces at their middle: exact for springs and sliders but for
    the steps in which one begins or ends to slide, and not disturbed by stiff relaxation.
    """
    rng = np.random.default_rng(loop)
    harmonics = 2.0 * np.pi * np.arange(1, 4)
    weights = rng.normal(size=3) if loop else np.array([1.0, 0.0, 0.0])
    phases = rng.uniform(0.0, 2.0 * np.pi, (3, 1))
    weights *= fastest * 10.0 ** (-loop) / np.abs(weights).sum()
    period = 30.0 * reach.max() / np.abs(weights).max()
    times = np.linspace(0.0, cycles, cycles * steps + 1)
    travel = -period * (weights / harmonics) @ np.cos(harmonics[:, None] * times + phases)
    z, step = np.zeros(law.memory), period / steps
    ends, work = [z], []
    for moved in np.diff(travel):
        after = implicit_step(law, moved / step, F, z, p, step, reach)
        work.append(memory_outputs(law, moved / step, F, 0.5 * (z + after), p)[0][0] * moved)
        z = after
        ends.append(z)
    assert (np.abs(ends[-1] - ends[-1 - steps]) <= 1e-3 * reach).all()
    return np.sum(work[-steps:]), np.sum(np.abs(work[-steps:]))


def implicit_step(law, v, F, z, p, step, reach):
    """Internal variables after an implicit Euler step, by Newton's method."""
    after = z
    for _ in range(50):
        rates = memory_outputs(law, v, F, after, p)[1]
        residual = after - z - step * rates[:, 0]
        change = np.linalg.solve(np.eye(len(z)) - step * rates[:, 3:], residual)
        after = after - change
        if (np.abs(change) <= 1e-10 * reach).all():
            return after
    raise AssertionError(f"no implicit step of {step:g} s from z = {z} at v = {v:g}, F = {F:g}")
