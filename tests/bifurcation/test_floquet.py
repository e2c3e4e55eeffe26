"""Floquet multipliers against products, linear periodic systems and the Stuart-Landau orbit."""

import numpy as np
import pytest

from fecontact.bifurcation import vector_field
from fecontact.bifurcation.linalg.periodic_schur import eigenvalues_of_product
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.floquet import Floquet
from fecontact.bifurcation.orbits.mesh import node_times


def planted(multipliers, factors, seed=1):
    """Factors (N, d, d) with eigenvalues of their product given as real numbers or pairs."""
    rng = np.random.default_rng(seed)
    blocks, roots = [], []
    for mu in multipliers:
        if np.iscomplexobj(mu):
            r, angle = abs(mu), np.angle(mu)
            root, turn = r ** (1.0 / factors), angle / factors
            blocks.append(root * np.array([[np.cos(turn), -np.sin(turn)],
                                           [np.sin(turn), np.cos(turn)]]))
            roots.append(blocks[-1])
        else:
            roots.append(np.array([[abs(mu) ** (1.0 / factors)]]))
            blocks.append(np.sign(mu) * roots[-1])
    d = sum(len(part) for part in roots)

    def diagonal(parts):
        D, at = np.zeros((d, d)), 0
        for part in parts:
            D[at:at + len(part), at:at + len(part)] = part
            at += len(part)
        return D

    bases = [np.linalg.qr(rng.normal(size=(d, d)))[0] + 0.2 * rng.normal(size=(d, d))
             for _ in range(factors)]
    return np.array([bases[(j + 1) % factors] @ diagonal(blocks if j == 0 else roots)
                     @ np.linalg.inv(bases[j]) for j in range(factors)])


@pytest.mark.parametrize("multipliers", [
    [1e10, 1e3, 1.0, 1e-5, 1e-15, 1e-30],
    [1e10, 1.0, -1.0, -1e-8, 0.99e-8, 1e-30],
    [1e6, 0.5 + 0.8j, 1e-12 * (0.3 - 1.1j), 1e-25],
    [1e-200, 1e200],
])
def test_product_keeps_large_and_small_eigenvalues(multipliers):
    found = eigenvalues_of_product(planted(multipliers, 80))
    expected = [z for mu in multipliers
                for z in ((mu, np.conj(mu)) if np.iscomplexobj(mu) else (mu,))]
    assert len(found) == len(expected)
    assert (np.diff(np.abs(found)) <= 1e-9 * np.abs(found[:-1])).all()
    for mu in expected:
        # The last product is one of 80 factors with condition numbers of 1e5 each.
        within = 1e-10 if abs(mu) == 1e-200 else 3e-11
        assert np.abs(found - mu).min() < within * abs(mu)


def test_product_of_random_matrices_agrees_with_the_product():
    rng = np.random.default_rng(3)
    for d in (1, 2, 5, 12):
        M = np.eye(d) + 0.1 * rng.normal(size=(30, d, d))
        product = np.linalg.multi_dot(M[::-1]) if d > 1 else np.array([[np.prod(M)]])
        expected = np.linalg.eigvals(product)
        found = eigenvalues_of_product(M)
        for mu in expected:
            assert np.abs(found - mu).min() < 1e-11 * abs(mu)


def test_singular_factor_gives_zero():
    M = planted([3.0, 0.5, 1e-3], 10)
    M[4] = M[4] @ np.diag([1.0, 1.0, 0.0])
    assert np.abs(eigenvalues_of_product(M)).min() < 1e-14


def turning(t, x, p, out):
    # x = Q(t) y with Q a rotation by t in the plane of the axes 1, 2 and one of 2 t in that of
    # 3, 4; y' = diag(e) y with e = ln(mu) / (2 pi), so that the multipliers are mu.
    c, s = np.cos(t), np.sin(t)
    C, S = np.cos(2.0 * t), np.sin(2.0 * t)
    y1, y2 = c * x[0] + s * x[1], c * x[1] - s * x[0]
    y3, y4 = C * x[2] + S * x[3], C * x[3] - S * x[2]
    e = p[0] / (2.0 * np.pi)
    y1, y2, y3, y4 = e * 10.0 * y1, -e * 30.0 * y2, e * 3.0 * y3, -e * 8.0 * y4
    out[0] = c * y1 - s * y2 - x[1]
    out[1] = s * y1 + c * y2 + x[0]
    out[2] = C * y3 - S * y4 - 2.0 * x[3]
    out[3] = S * y3 + C * y4 + 2.0 * x[2]


def test_linear_periodic_system_from_1e_30_to_1e10():
    field = vector_field(turning, {"decades": np.log(10.0)}, 4,
                         period=lambda p: 2.0 * np.pi)
    errors = []
    for intervals in (40, 80):
        mesh = np.linspace(0.0, 1.0, intervals + 1)
        zero = np.zeros((4 * intervals, 4))
        problem = CollocationProblem(field, field.values, 0, mesh, 4, zero, np.ones(6))
        found = problem.linearise(np.append(zero.reshape(-1), np.log(10.0))).floquet
        assert found.trivial is None
        ratio = np.sort(np.abs(found.multipliers))[::-1] / [1e10, 1e3, 1e-8, 1e-30]
        errors.append(np.abs(ratio - 1.0).max())
        assert np.abs(found.multipliers.imag / found.multipliers.real).max() < 1e-12
    assert errors[1] < 2e-6
    # Order 2 m of Gauss collocation, on multipliers forty decades apart.
    assert errors[0] / errors[1] == pytest.approx(2.0**8, rel=0.1)


def stuart_landau(t, x, p, out):
    s = x[0] * x[0] + x[1] * x[1]
    out[0] = (p[0] - s) * x[0] - p[1] * x[1]
    out[1] = p[1] * x[0] + (p[0] - s) * x[1]


def test_stuart_landau():
    r, w = 0.7, 3.0
    field = vector_field(stuart_landau, {"r": r, "w": w}, 2)
    mesh = np.linspace(0.0, 1.0, 41)
    t = 2.0 * np.pi * node_times(mesh, 4)
    orbit = np.sqrt(r) * np.stack([np.cos(t), np.sin(t)], axis=1)
    problem = CollocationProblem(field, field.values, 0, mesh, 4, orbit, np.ones(4))
    found = problem.linearise(np.concatenate([orbit.reshape(-1), [2.0 * np.pi / w, r]])).floquet
    assert found.trivial_error < 3e-10
    assert found.others == pytest.approx([np.exp(-4.0 * np.pi * r / w)], rel=1e-9)
    assert found.stable
    assert found.unstable == 0


def test_test_functions_change_sign_where_they_should():
    def at(*mu):
        return Floquet(np.array([1.0, *mu], dtype=complex), 0)

    pair = 0.6 + 0.79j
    assert at(-0.99, 0.2).products()[0] * at(-1.01, 0.2).products()[0] < 0.0
    assert at(0.99, 0.2).products()[1] * at(1.01, 0.2).products()[1] < 0.0
    inside, outside = pair / abs(pair) * 0.99, pair / abs(pair) * 1.01
    assert (at(inside, inside.conjugate(), 0.3).products()[2]
            * at(outside, outside.conjugate(), 0.3).products()[2]) < 0.0
    assert at(outside, outside.conjugate(), 0.3).unstable == 2
