"""Assembled stiffness and mass against scikit-fem's own assembly, cell by cell."""

import numpy as np
import pytest
import skfem
from skfem import Basis, BilinearForm

import fecontact.fem.assembly as assembly
from fecontact import MeshError
from fecontact.fem.assembly import assembled
from fecontact.fem.element_block import ElementBlock
from fecontact.fem.elements.cell_kinds import CELL_KINDS

LATERAL, SHEAR, DENSITY = 1.3, 0.7, 2.5
TICKS = (np.linspace(0.0, 1.0, 4), np.linspace(0.0, 0.7, 3), np.linspace(0.0, 0.5, 3))
KINDS = [
    (skfem.MeshTri, skfem.ElementTriP1), (skfem.MeshTri, skfem.ElementTriP2),
    (skfem.MeshQuad, skfem.ElementQuad1), (skfem.MeshQuad, skfem.ElementQuad2),
    (skfem.MeshTet, skfem.ElementTetP1), (skfem.MeshTet, skfem.ElementTetP2),
    (skfem.MeshHex, skfem.ElementHex1), (skfem.MeshHex, skfem.ElementHex2),
]


def by_forms(basis):
    """Stiffness, node by node, and mass of one component from vector-valued forms."""
    vector = Basis(basis.mesh, skfem.ElementVector(basis.elem), mapping=basis.mapping,
                   quadrature=(basis.X, basis.W))
    d = basis.mesh.dim()

    def energy(u, v, w):
        slope, virtual = u.grad, v.grad
        opening = sum(slope[i, i] for i in range(d)) * sum(virtual[i, i] for i in range(d))
        strain = slope + np.swapaxes(slope, 0, 1)
        return LATERAL * opening + SHEAR * np.einsum("ij...,ij...", strain, virtual)

    K = BilinearForm(energy).assemble(vector).tocsr()
    place = np.empty(K.shape[0], dtype=int)
    ours = d * basis.element_dofs[:, None, :] + np.arange(d)[:, None]
    place[ours.reshape(-1, basis.nelems)] = vector.element_dofs
    mass = BilinearForm(lambda u, v, w: DENSITY * u * v).assemble(basis).tocsr()
    return K[place][:, place], mass


def distorted(kind, how):
    """A mesh of 12 to 72 cells, sheared, and with displaced nodes if not affine."""
    rng = np.random.default_rng(3)
    dimension = 2 if kind in (skfem.MeshTri, skfem.MeshQuad) else 3
    mesh = kind.init_tensor(*TICKS[:dimension])
    p = (np.eye(dimension) + 0.3 * rng.standard_normal((dimension, dimension))) @ mesh.p
    if how == "wild":
        p += 0.03 * rng.standard_normal(p.shape)
    if how == "one":
        p[:, 0] -= 0.05
    return kind(p, mesh.t)


def block(basis):
    """Elements of a basis; skfem's functions come in the order of the places of a kind."""
    members = np.array(basis.element_dofs.T, dtype=np.int64)
    corners, curved = basis.mesh.t.shape[0], hasattr(basis.mapping, "elem") and (
        basis.mesh.doflocs.shape[1] > basis.mesh.nvertices)
    rule = np.ascontiguousarray(basis.X.T), basis.W
    return ElementBlock(
        CELL_KINDS[basis.mesh.dim(), corners], np.arange(len(members)), members, basis.doflocs.T,
        members.shape[1] if curved else corners, *rule, rule)


def compare(basis, tolerance=1e-14):
    K, mass = assembled([block(basis)], LATERAL, SHEAR, DENSITY)
    expected, expected_mass = by_forms(basis)
    assert abs(K.tocsr() - expected).max() < tolerance * abs(expected).max()
    assert abs(mass - expected_mass).max() < tolerance * abs(expected_mass).max()
    assert abs(K.tocsr() - K.tocsr().T).max() == 0.0
    assert abs(mass - mass.T).max() == 0.0
    assert mass.has_sorted_indices
    return K, mass


@pytest.mark.parametrize(("kind", "element"), KINDS)
@pytest.mark.parametrize("how", ["affine", "one", "wild"])
def test_straight_cells(kind, element, how):
    basis = Basis(distorted(kind, how), element(), intorder=5)
    K, mass = compare(basis)
    # Rigid motions meet no resistance, and have the mass of the body.
    places = basis.doflocs.T
    d = places.shape[1]
    turn = np.zeros((len(places), d))
    turn[:, 0], turn[:, 1] = -places[:, 1], places[:, 0]
    for motion in (turn, np.ones_like(turn)):
        assert np.abs(K @ motion.ravel()).max() < 1e-13 * abs(K.tocsr()).max()
    assert mass.sum() == pytest.approx(DENSITY * basis.dx.sum(), rel=1e-13)


@pytest.mark.parametrize(("mesh", "element"), [
    (skfem.MeshTri2.init_circle(2), skfem.ElementTriP2()),
    (skfem.MeshTet2.init_ball(1), skfem.ElementTetP2()),
])
def test_curved_cells(mesh, element):
    compare(Basis(mesh, element, intorder=4))


def curved(mesh, kind, bulge):
    """A mesh of second-order cells whose nodes follow a smooth map."""
    fine = kind.from_mesh(mesh)
    places = fine.doflocs.copy()
    places[0] += bulge * np.sin(np.pi * fine.doflocs[1])
    return kind(places, fine.t)


@pytest.mark.parametrize(("mesh", "kind", "element"), [
    (skfem.MeshQuad.init_tensor(*TICKS[:2]), skfem.MeshQuad2, skfem.ElementQuad2()),
    (skfem.MeshHex.init_tensor(*TICKS), skfem.MeshHex2, skfem.ElementHex2()),
])
def test_curved_quadrilaterals_and_hexahedra(mesh, kind, element):
    compare(Basis(curved(mesh, kind, 0.05), element, intorder=5))
    # Straight cells of a second-order mesh count as affine.
    straight = Basis(curved(mesh, kind, 0.0), element, intorder=5)
    mass = compare(straight)[1]
    plain = assembled([block(Basis(mesh, element, intorder=5))], LATERAL, SHEAR, DENSITY)
    assert abs(mass - plain[1]).max() < 1e-15


def test_matrices_that_are_too_large(monkeypatch):
    monkeypatch.setattr(assembly, "_MOST", 100)
    basis = Basis(distorted(skfem.MeshTet, "affine"), skfem.ElementTetP2(), intorder=2)
    with pytest.raises(MeshError, match="use a coarser mesh"):
        assembled([block(basis)], LATERAL, SHEAR, DENSITY)
