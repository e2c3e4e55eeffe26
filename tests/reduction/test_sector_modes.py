"""Modes of one sector against those of the whole wheel, closed forms, and bad faces."""

import numpy as np
import pytest
from meshes_for_tests import grid
from sectors import hexagon_sector, ring_sector, whole_wheel

from fecontact import ElasticBody, InputError, Material, Mesh, MeshError, modal_basis
from fecontact.analysis import complex_modes
from fecontact.fem import CyclicSymmetry, Rotation
from fecontact.reduction import eigenfrequencies_hz, sector_modes

STEEL = Material(2.1e11, 0.3, 7850.0)
HEXAGON = CyclicSymmetry("low", "high", 6)


def ring_symmetry(sectors):
    return CyclicSymmetry("bottom", "top", sectors)


CASES = {
    "odd": (lambda: ring_sector(5), ring_symmetry(5), {}, {}),
    "even, held": (lambda: ring_sector(4, triangles=True), ring_symmetry(4), {"left": "xy"}, {}),
    "two": (lambda: ring_sector(2, around=8), ring_symmetry(2), {}, {}),
    "axis": (lambda: hexagon_sector(3), HEXAGON, {}, {}),
    "axis, linear": (lambda: hexagon_sector(3), HEXAGON, {}, {"degree": 1}),
    "solid, axis": (lambda: hexagon_sector(2, 0.3), HEXAGON, {}, {}),
    "solid, held": (lambda: hexagon_sector(2, 0.3), HEXAGON, {"bottom": "z"}, {}),
}


@pytest.mark.parametrize("name", CASES)
def test_sector_has_the_frequencies_of_the_whole_wheel(name):
    """To 1e-9, each of the wheel's, double ones twice; rigid modes of the same number."""
    mesh, symmetry, fixed, options = CASES[name]
    sector = ElasticBody(mesh(), STEEL, fixed=fixed, **options)
    wheel = ElasticBody(whole_wheel(sector.mesh, symmetry), STEEL, fixed=fixed, **options)
    found = sector_modes(sector, symmetry, 8)
    count = 14
    expected = eigenfrequencies_hz(wheel, count + 1)[:count]
    assert found.wheel_frequencies_hz[:count] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert (found.wheel_frequencies_hz == 0.0).sum() == (expected == 0.0).sum()


@pytest.mark.parametrize("name", ["odd", "axis", "solid, axis"])
def test_shapes_over_the_wheel_are_modes_of_it(name):
    """Mass-normalised and orthogonal, with a small residual."""
    mesh, symmetry, fixed, options = CASES[name]
    sector = ElasticBody(mesh(), STEEL, fixed=fixed, **options)
    wheel = ElasticBody(whole_wheel(sector.mesh, symmetry), STEEL, fixed=fixed, **options)
    found = sector_modes(sector, symmetry, 4)
    vectors, squares = [], []
    for k in found.diameters:
        for phase in (0.0,) if symmetry.is_real(k) else (0.0, np.pi / 2.0):
            seen = found.on_wheel(k, 3, phase)
            where = np.linalg.norm(seen.nodes[None] - wheel.nodes[:, None], axis=2)
            assert where.min(axis=1).max() < 1e-9
            assert len(seen.nodes) == len(wheel.nodes)
            vectors.append(seen.displacement[where.argmin(axis=1)].ravel())
            squares.append((2.0 * np.pi * found.frequencies_hz[found.row(k), 3]) ** 2)
    X, w2 = np.stack(vectors, axis=1), np.array(squares)
    assert X.T @ wheel.mass @ X == pytest.approx(np.eye(len(w2)), abs=1e-8)
    residual = wheel.stiffness @ X - (wheel.mass @ X) * w2
    assert np.abs(residual).max() < 1e-8 * np.abs(wheel.stiffness @ X).max()


def test_thin_ring_has_its_closed_form():
    """w_n^2 = E I n^2 (n^2 - 1)^2 / (rho A R^4 (n^2 + 1)); n waves have the diameter n mod N."""
    N, R, h = 8, 1.0, 0.02
    mesh = grid(np.array([R - 0.5 * h, R + 0.5 * h]), np.linspace(0.0, 2.0 * np.pi / N, 13),
                warp=lambda at: at[:, :1] * np.column_stack([np.cos(at[:, 1]), np.sin(at[:, 1])]))
    found = sector_modes(ElasticBody(mesh, STEEL), ring_symmetry(N), 3)
    unit = np.sqrt(STEEL.youngs_modulus * h**2 / (12.0 * STEEL.density * R**4)) / (2.0 * np.pi)
    for n in (2, 3, 4):
        expected = unit * n * (n**2 - 1) / np.sqrt(n**2 + 1)
        assert found.frequencies_hz[found.row(n), 0] == pytest.approx(expected, rel=3e-3)
    five = unit * 5 * 24 / np.sqrt(26)
    assert np.abs(found.frequencies_hz[found.row(3)] / five - 1.0).min() < 1e-2
    assert found.frequencies_hz[0, 0] == 0.0
    assert found.frequencies_hz[1, 0] == 0.0


def test_thin_ring_that_rotates_has_its_closed_form():
    """+-2 n W / (n^2 + 1) + sqrt(w_n^2 + (n (n^2 - 1) W / (n^2 + 1))^2), backwards and forwards.

    The one that runs backwards is faster, seen from the ring.
    """
    N, R, h = 8, 1.0, 0.04
    mesh = grid(np.array([R - 0.5 * h, R + 0.5 * h]), np.linspace(0.0, 2.0 * np.pi / N, 13),
                warp=lambda at: at[:, :1] * np.column_stack([np.cos(at[:, 1]), np.sin(at[:, 1])]))
    found = sector_modes(ElasticBody(mesh, STEEL), ring_symmetry(N), 6, rotation=Rotation(0.0))
    w = 2.0 * np.pi * found.frequencies_hz
    W = 0.6 * w[2, 0]
    forward, backward = found.rotation.frequencies_hz(W)
    for n in (2, 3):
        root = np.sqrt(w[n, 0] ** 2 + (n * (n**2 - 1) / (n**2 + 1) * W) ** 2)
        for seen, sign in ((backward, 1.0), (forward, -1.0)):
            expected = (root + sign * 2.0 * n * W / (n**2 + 1)) / (2.0 * np.pi)
            assert seen[n, 0] == pytest.approx(expected, rel=3e-3)
    assert found.rotation.frequencies_hz(0.0)[0][2] == pytest.approx(found.frequencies_hz[2])
    # A free ring that is shifted goes straight on, which the ring sees as waves backwards.
    assert 2.0 * np.pi * backward[1, :2] == pytest.approx([W, W], rel=1e-6)
    assert np.isfinite(forward[2]).all()


@pytest.mark.parametrize("name", ["even, held", "solid, held"])
def test_rotating_sector_is_the_rotating_wheel(name):
    """With modes enough of both."""
    mesh, symmetry, fixed, options = CASES[name]
    fixed = fixed if name == "even, held" else {"bottom": "xyz"}
    sector = ElasticBody(mesh(), STEEL, fixed=fixed, **options)
    wheel = ElasticBody(whole_wheel(sector.mesh, symmetry), STEEL, fixed=fixed, **options)
    W = 0.3 * 2.0 * np.pi * eigenfrequencies_hz(wheel, 3)[-1]
    rotation = Rotation(W)
    found = sector_modes(sector, symmetry, 24, rotation=rotation)
    forward, backward = found.rotation.frequencies_hz(W)
    ours = np.sort(np.concatenate([np.concatenate([backward[k]] if symmetry.is_real(k) else [
        forward[k], backward[k]]) for k in found.diameters]))[:6]
    basis = modal_basis(wheel, 24 * symmetry.sectors, contact=(), rotation=rotation)
    assert ours == pytest.approx(complex_modes(basis).frequencies_hz[:6], rel=2e-4)
    with pytest.raises(InputError, match="same axis and centre"):
        sector_modes(sector, symmetry, 3, rotation=Rotation(W, (0.1, 0.0)))


def uneven_sector(sectors, radial=4):
    """A sector whose nodes stand elsewhere on the two faces, which lie on each other turned."""
    alpha = 2.0 * np.pi / sectors

    def warp(at):
        r = at[:, 0] + 0.25 * (at[:, 0] - 0.6) * (1.0 - at[:, 0]) * at[:, 1] / alpha
        return np.column_stack([r * np.cos(at[:, 1]), r * np.sin(at[:, 1])])

    return grid(np.linspace(0.6, 1.0, radial + 1), np.linspace(0.0, alpha, 7), warp=warp)


@pytest.mark.parametrize("fixed", [{}, {"left": "xy"}])
def test_tied_faces_of_other_meshes(fixed):
    """Tied faces agree with matching ones, the better the finer; without tied they are refused."""
    N = 6
    matching = ElasticBody(ring_sector(N, 4, 6, wavy=0.0), STEEL, fixed=fixed)
    expected = sector_modes(matching, ring_symmetry(N), 4)
    symmetry = CyclicSymmetry("bottom", "top", N, tied=True)
    uneven = ElasticBody(uneven_sector(N), STEEL, fixed=fixed)
    found = sector_modes(uneven, symmetry, 4)
    assert found.frequencies_hz == pytest.approx(expected.frequencies_hz, rel=2e-3)
    assert (found.frequencies_hz == 0.0).sum() == (0 if fixed else 2)
    same = sector_modes(matching, symmetry, 4)
    assert same.frequencies_hz == pytest.approx(expected.frequencies_hz, rel=1e-8)
    assert len(found.on_wheel(2, 0).nodes) == N * len(uneven.nodes)
    with pytest.raises(MeshError, match="or tied = True"):
        sector_modes(uneven, ring_symmetry(N), 4)
    with pytest.raises(MeshError, match=r"is 0\.[0-9]+ m from its partner; check axis"):
        sector_modes(uneven, CyclicSymmetry("bottom", "top", 7, tied=True), 4)


def test_axis_may_point_anywhere():
    mesh = hexagon_sector(2, 0.3)
    turn = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    shift = np.array([0.3, -0.2, 0.5])
    moved = Mesh(mesh.nodes @ turn.T + shift, mesh.cells, mesh.boundaries)
    symmetry = CyclicSymmetry("low", "high", 6, tuple(shift + 0.7 * turn[:, 2]),
                              tuple(2.0 * turn[:, 2]))
    found = sector_modes(ElasticBody(moved, STEEL), symmetry, 5, diameters=(1, 3))
    expected = sector_modes(ElasticBody(mesh, STEEL), HEXAGON, 5, diameters=(1, 3))
    assert found.frequencies_hz == pytest.approx(expected.frequencies_hz, rel=1e-8)
    assert found.diameters == (1, 3)


def test_an_axis_between_nodes_is_told():
    """Half a plate with an odd number of edges on its cut, of which one crosses the axis."""
    half = Mesh.grid(np.linspace(-1.0, 1.0, 8), np.linspace(0.0, 1.0, 4))
    cut = half.boundary("bottom")
    x = half.nodes[cut, 0].mean(axis=1)
    mesh = Mesh(half.nodes, half.cells, {"high": cut[x < 0.1], "low": cut[x > 0.1]})
    with pytest.raises(MeshError, match="nodes off the axis"):
        sector_modes(ElasticBody(mesh, STEEL), CyclicSymmetry("low", "high", 2), 3)


def test_bad_sectors_are_refused():
    sector = ElasticBody(ring_sector(8), STEEL)
    for symmetry, words in (
            (ring_symmetry(9), "0.0[0-9]+ m from its partner; give sectors = 8"),
            (CyclicSymmetry("top", "bottom", 8), "exchange low and high"),
            (CyclicSymmetry("bottom", "top", 8, (0.1, 0.0)), r"node at \(.* m from its partner"),
            (CyclicSymmetry("bottom", "right", 8), "5 and 9 nodes off the axis"),
            (CyclicSymmetry("bottom", "tip", 8), "no boundary named 'tip'")):
        with pytest.raises(MeshError, match=words):
            sector_modes(sector, symmetry, 2)
    for words, call in (
            ("two or more", lambda: CyclicSymmetry("a", "b", 1)),
            ("both 'a'", lambda: CyclicSymmetry("a", "a", 3)),
            ("three components", lambda: CyclicSymmetry("a", "b", 3, axis=(1.0, 0.0))),
            ("axis of a plane body", lambda: sector_modes(
                sector, CyclicSymmetry("bottom", "top", 8, axis=(1.0, 0.0, 0.0)))),
            ("from 0 to N / 2 = 4", lambda: sector_modes(
                sector, ring_symmetry(8), diameters=[5])),
            ("must be one of 0, 1, 2, 3, 4", lambda: sector_modes(
                sector, ring_symmetry(8), 3).row(7)),
            ("hold other directions", lambda: sector_modes(
                ElasticBody(ring_sector(8), STEEL, fixed={"left": "x"}), ring_symmetry(8)))):
        with pytest.raises(InputError, match=words):
            call()
