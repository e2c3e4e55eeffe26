"""Laws for eight nodes at once: the same numbers as the laws themselves."""

import math
import os
import subprocess
import sys
from typing import Annotated, NamedTuple

import numpy as np
import pytest

from fecontact.core.compiled import kernel
from fecontact.core.records import ANY, Eights
from fecontact.core.simd.vectors import select
from fecontact.laws import (
    BilateralPiecewise,
    BilateralPlay,
    BilateralPolynomial,
    BoucWenFriction,
    Constant,
    ConstantFriction,
    CosineSurface,
    CubicFriction,
    DahlFriction,
    ExponentialContact,
    ExponentialFriction,
    GalvanettoFriction,
    GaussianFriction,
    GaussianSurface,
    Harmonic,
    HarmonicSpeed,
    HyperbolicFriction,
    LinearContact,
    LuGreFriction,
    ParabolicSurface,
    PowerContact,
    PrescribedForce,
    ProductFriction,
    RestitutionContact,
    RoughSurface,
    TwoSidedStop,
    normal_law,
    simd,
)
from fecontact.laws.ground.motion import constant_speed
from fecontact.laws.signatures import memory_at, normal_at, signal_at


class Nodes(NamedTuple):
    """Eight nodes: what laws take, and rows for what they return."""

    a: Annotated[Eights, None]
    b: Annotated[Eights, None]
    p: Annotated[Eights, ANY]
    out: Annotated[Eights, ANY]


class Memory(NamedTuple):
    """Eight nodes with internal variables."""

    v: Annotated[Eights, None]
    F: Annotated[Eights, None]
    z: Annotated[Eights, ANY]
    p: Annotated[Eights, ANY]
    force: Annotated[Eights, ANY]
    rates: Annotated[Eights, ANY, ANY]


@kernel
def at_nodes(law: int, nodes: Nodes) -> None:
    nodes.out[0], nodes.out[1], nodes.out[2] = normal_at(law)(nodes.a, nodes.b, nodes.p)


@kernel
def at_times(law: int, nodes: Nodes) -> None:
    nodes.out[0], nodes.out[1] = signal_at(law)(nodes.a, nodes.p)


@kernel
def with_memory(law: int, nodes: Memory) -> None:
    memory_at(law)(nodes.v, nodes.F, nodes.z, nodes.p, nodes.force, nodes.rates)


RNG = np.random.default_rng(8)
# Each lane has parameters of its own.
VARIED = tuple(np.linspace(0.5, 1.5, 8))


def varied(factor):
    return tuple(factor * value for value in VARIED)


NORMAL = [
    RoughSurface(varied(1e6), varied(1e-5), varied(30.0)),
    ParabolicSurface(varied(1e6), varied(1e-5), varied(30.0)),
    LinearContact(varied(1e6), varied(30.0)),
    PowerContact(varied(1e9), 1.5, varied(0.5)), PowerContact(varied(1e6), 1.0, varied(0.5)),
    PowerContact(varied(1e9), 2.0), PowerContact(varied(1e8), (1.0, 1.5, 2.0, 1.1) * 2, 0.5),
    RestitutionContact(varied(1e9), 0.8, 1.0),
    PrescribedForce(varied(14.0)),
    TwoSidedStop(varied(1e6), varied(1e-5)),
    TwoSidedStop(varied(1e8), varied(1e-5), (1.0, 1.5, 1.3, 2.0) * 2, varied(0.4)),
    ExponentialContact(varied(10.0), varied(1e-5), 0.4),
    BilateralPolynomial(varied(1e6), 1e16, varied(30.0), 2.0),
    BilateralPlay(varied(1e6), 1e-6, varied(30.0), 2.0),
    BilateralPolynomial(varied(1e6), varied(1e16), varied(3.0), quadratic_stiffness=1e11,
                        quintic_stiffness=1e26, quadratic_damping=2.0,
                        cubic_damping=varied(0.1)),
    # Functions with branches.
    CosineSurface(varied(1e6), varied(1e-5), varied(30.0)),
    GaussianSurface(varied(1e6), varied(1e-5), varied(30.0)),
    BilateralPiecewise((-1e-5, 0.0, 1e-5), (-2.0, 0.0, 1.0), varied(30.0)),
]
BRANCHED = 3
FRICTION = [
    law for smoothing in ("arctan", "tanh", "square-root") for law in (
        ExponentialFriction(0.8, varied(0.5), 1000.0, varied(1e4), 0.1, smoothing=smoothing),
        GaussianFriction(0.8, 0.5, varied(1e-3), 1e4, 0.1, smoothing=smoothing),
        HyperbolicFriction(varied(0.8), 0.5, 1e-3, 1e4, 0.1, smoothing=smoothing),
        ConstantFriction(varied(0.5), 1e4, 0.1, smoothing=smoothing),
        GalvanettoFriction(0.8, 0.5, varied(1000.0), 3.0, 1e4, smoothing=smoothing),
        CubicFriction(0.8, 0.5, varied(1e-2), 1e4, smoothing=smoothing))
] + [ProductFriction(varied(0.3), 0.7, varied(900.0), 1e4)]
MEMORY = [
    DahlFriction(varied(0.5), varied(1e5)), DahlFriction(0.5, 1e5, varied(2.5)),
    LuGreFriction(0.8, varied(0.5), 1e-3, 2.0, varied(1e5), 300.0, 0.4, 1.0),
    BoucWenFriction(varied(0.5), 1e-5, 0.6, 2.0), BoucWenFriction(0.5, varied(1e-5)),
]


def assert_same(law, a, b):
    """Values and derivatives in random states, eight at once and one by one."""
    lane = simd.simd_law(law.kernel)
    assert lane is not None
    table = law.table(np.full(8, 0.125))
    p, seen = np.ascontiguousarray(table.T), []
    for k in range(len(a)):
        out = np.zeros((3, 8))
        at_nodes(lane.address, Nodes(a[k], b[k], p, out))
        seen.append((out, np.array([law.kernel.python(a[k, i], b[k, i], table[i])
                                    for i in range(8)]).T))
    found, wanted = np.array(seen).swapaxes(0, 1)
    size = np.abs(wanted).max(axis=(0, 2), keepdims=True)
    assert (np.abs(found - wanted) <= 3e-15 * size + 2e-14 * np.abs(wanted)).all()
    return wanted


@pytest.mark.parametrize("law", NORMAL, ids=lambda law: type(law).__name__)
def test_normal_laws(law):
    u, v = 1.5e-5 * RNG.normal(size=(200, 8)), 0.5 * RNG.normal(size=(200, 8))
    wanted = assert_same(law, u, v)
    assert (wanted[:, 0] != 0.0).any()


@pytest.mark.parametrize("law", FRICTION, ids=lambda law: type(law).__name__)
def test_friction_laws(law):
    v = np.concatenate([1e-4 * RNG.normal(size=(100, 8)), 5e-3 * RNG.normal(size=(100, 8))])
    v[0] = 0.0
    F = np.abs(RNG.normal(size=(200, 8)))
    F[1] = 0.0
    assert_same(law, v, F)


@pytest.mark.parametrize("law", MEMORY, ids=lambda law: type(law).__name__)
def test_laws_with_memory(law):
    """Forces, rates and their derivatives, of open contacts too."""
    table, states = law.table(np.full(8, 0.125)), len(law.state_scale)
    p = np.ascontiguousarray(table.T)
    address = simd.simd_law(law.kernel).address
    for k in range(200):
        v, F = 1e-2 * RNG.normal(size=8), np.maximum(RNG.normal(size=8), 0.0)
        z = law.state_scale[:, np.newaxis] * RNG.uniform(-1.2, 1.2, (states, 8))
        if k == 0:
            v[:], z[:] = 0.0, 0.0
        force, rates = np.full((3 + states, 8), np.nan), np.full((states, 3 + states, 8), np.nan)
        with_memory(address, Memory(v, F, z, p, force, rates))
        for i in range(8):
            one, change = np.zeros(3 + states), np.zeros((states, 3 + states))
            law.kernel.python(v[i], F[i], z[:, i], table[i], one, change)
            assert force[:, i] == pytest.approx(one, rel=1e-12, abs=1e-13 * np.abs(one).max())
            assert rates[:, :, i] == pytest.approx(change, rel=1e-12,
                                                   abs=1e-13 * np.abs(change).max())


@pytest.mark.parametrize(("kernel_of", "table"), [
    (Constant.kernel, [[3.0]]), (Harmonic.kernel, [[1e-3], [13.8], [0.4]]),
    (constant_speed, [[1e-3]]), (HarmonicSpeed.kernel, [[1e-3], [4e-4], [30.0], [0.4]])])
def test_signals(kernel_of, table):
    p = np.array(table) * np.linspace(0.5, 1.5, 8)
    for t in RNG.uniform(0.0, 100.0, (100, 8)):
        out = np.zeros((2, 8))
        at_times(simd.simd_law(kernel_of).address, Nodes(t, t, p, out))
        wanted = np.array([kernel_of.python(t[i], np.ascontiguousarray(p[:, i]))
                           for i in range(8)]).T
        # Angles of up to 5000 are rounded to 5e-13 in either way.
        assert out == pytest.approx(wanted, rel=1e-12, abs=1e-12 * np.abs(wanted).max())


@normal_law
def capped(u, v, p):
    while u > p[0]:
        u *= 0.5
    return u, 1.0, 0.0


@normal_law
def branchless(u, v, p):
    return p[0] * math.exp(u) + abs(v), p[0] * math.exp(u), select(v > 0.0, 1.0, -1.0)


@pytest.mark.parametrize(("law", "at_once"), [(capped, False), (branchless, True)])
def test_laws_of_users(law, at_once):
    """A law whose branches depend on numbers is called for one lane after the other."""
    assert (simd.simd_law(law).python is law.python) == at_once
    a, b = RNG.normal(size=(2, 8))
    p, out = RNG.uniform(0.1, 1.0, (1, 8)), np.zeros((3, 8))
    at_nodes(simd.simd_address(law.address), Nodes(a, b, p, out))
    wanted = np.array([law.python(a[i], b[i], p[:, i]) for i in range(8)]).T
    assert out == pytest.approx(wanted, rel=1e-14)


def test_laws_that_are_common_are_compiled_for_eight_numbers():
    for law in (*NORMAL[:-BRANCHED], *FRICTION, *MEMORY):
        assert simd.simd_law(law.kernel).python is law.kernel.python, law


@pytest.mark.parametrize("law", NORMAL, ids=lambda law: type(law).__name__)
def test_what_is_no_number_is_not_hidden(law):
    """One lane without a number does not change the others, and is seen in its own force."""
    p = np.ascontiguousarray(law.table(np.full(8, 0.125)).T)
    u, v, out = 1e-6 * RNG.normal(size=8), np.zeros(8), np.zeros((3, 8))
    address = simd.simd_address(law.kernel.address)
    at_nodes(address, Nodes(u, v, p, out))
    before = out.copy()
    u[3] = np.nan
    at_nodes(address, Nodes(u, v, p, out))
    assert (np.delete(out, 3, axis=1) == np.delete(before, 3, axis=1)).all()
    if type(law) is not PrescribedForce:
        assert np.isnan(out[:, 3]).any()


@pytest.mark.slow
def test_code_for_eight_numbers_is_stored_once(tmp_path):
    """A second process finds it."""
    for _ in range(2):
        subprocess.run(
            [sys.executable, "-c", "from fecontact.laws.signals.harmonic import Constant; "
             "from fecontact.laws.simd import simd_law; simd_law(Constant.kernel)"],
            check=True, env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)})
        found = sorted(path.name for path in tmp_path.rglob("*.nbc"))
        assert found == [f"harmonic._constant.py{sys.version_info[0]}{sys.version_info[1]}.1.nbc"]
