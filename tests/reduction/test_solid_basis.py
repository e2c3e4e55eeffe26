"""Modal bases of solids: rigid modes, static compliance at patches, report, files."""

import numpy as np
import pytest
from solid_blocks import block_body

from fecontact import InputError, Material, modal_basis
from fecontact.fem.body_forces import boundary_forces
from fecontact.fem.contact_face import contact_groups
from fecontact.fem.faces.surface import Surface
from fecontact.io import read_basis, write_basis
from fecontact.reduction import BasisReport, ModeShapes, mode_convergence
from fecontact.reduction.eigenmodes import strain_energies

KINDS = pytest.mark.parametrize("tetrahedra", [False, True])
SIZE = (0.2, 0.1, 0.05)
MASS = 7850.0 * 0.2 * 0.1 * 0.05


@KINDS
@pytest.mark.parametrize("degree", [1, 2])
def test_rigid_modes_of_a_free_block(tetrahedra, degree):
    """Mass m and moments of inertia m (b^2 + c^2) / 12 at every contact node."""
    body = block_body((4, 2, 2), tetrahedra=tetrahedra, degree=degree)
    basis = modal_basis(body, 6, contact_nodes=8)
    assert (basis.dimension, basis.rigid_modes, basis.thickness) == (3, 6, None)
    assert basis.inertia_rows.T @ basis.inertia_rows == pytest.approx(
        np.diag([MASS] * 3 + [0.0] * 3), abs=1e-9)
    inertia = MASS / 12.0 * ((np.array(SIZE) ** 2).sum() - np.array(SIZE) ** 2)
    turning = basis.contact_T[:, 3:]
    assert turning @ turning[0].T == pytest.approx(
        np.tile(np.diag(1.0 / inertia), (8, 1, 1)), rel=1e-9, abs=1e-9)
    arm = basis.contact_places - np.array(SIZE) / 2.0
    about_z = basis.T[2:10, :2, 5] * np.sqrt(inertia[2])
    assert about_z == pytest.approx(np.stack([-arm[:, 1], arm[:, 0]], axis=1), abs=1e-12)
    assert basis.contact_areas.sum() == pytest.approx(0.02)
    assert basis.quality.mass == pytest.approx(MASS)


@KINDS
@pytest.mark.parametrize("degree", [1, 2])
def test_strain_energies_are_those_of_the_stiffness(tetrahedra, degree):
    body = block_body((3, 2, 2), tetrahedra=tetrahedra, degree=degree)
    moved = np.random.default_rng(0).standard_normal((body.nodes.size, 3))
    assert strain_energies(body, moved) == pytest.approx(
        0.5 * (moved * (body.stiffness @ moved)).sum(axis=0), rel=1e-12)


@pytest.mark.parametrize(("fixed", "modes"), [
    ({"left": "xyz"}, 0), ({"left": "x"}, 3), ({"left": "y"}, 4), ({"contact": "z"}, 3),
    ({"contact": "z", "left": "x"}, 1), ({"contact": "z", "left": "x", "front": "y"}, 0),
    ({"left": "hinge_z"}, 1), ({"left": "yz"}, 3)])
def test_supports_leave_the_rigid_modes_that_they_allow(fixed, modes):
    body = block_body((3, 2, 1), fixed=fixed)
    basis = modal_basis(body, modes + 3, contact=())
    assert basis.rigid_modes == modes
    shapes = basis.mode_shapes.shapes.reshape(body.nodes.size, -1)
    assert shapes.T @ (body.mass @ shapes) == pytest.approx(np.eye(modes + 3), abs=1e-9)
    stiffness = shapes.T @ (body.stiffness @ shapes)
    assert stiffness == pytest.approx(np.diag(basis.angular_frequencies**2),
                                      abs=1e-7 * basis.angular_frequencies[-1] ** 2)
    assert not np.asarray(shapes)[body.fixed_dofs].any()


@KINDS
def test_uniform_load_on_patches_compresses_a_column_as_bars_do(tetrahedra):
    """F L / (E A), whatever the patches: linear displacements are exact."""
    body = block_body((2, 2, 2), tetrahedra=tetrahedra,
                      fixed={"top": "z", "left": "x", "front": "y"})
    basis = modal_basis(body, 4, contact_nodes=4, reduction="residual", tolerance=0.0)
    force = np.zeros((4, 6))
    force[:, 2] = basis.tributary * 1e6
    q = np.einsum("nrm,nr->m", basis.contact_T, force) / basis.angular_frequencies**2
    E, nu = body.material.youngs_modulus, body.material.poisson_ratio
    moved = basis.contact_T @ q
    assert moved[:, 2] == pytest.approx(np.full(4, 1e6 * SIZE[2] / E), rel=1e-9)
    assert moved[:, :2] == pytest.approx(1e6 * nu / E * basis.contact_places[:, :2], rel=1e-9)
    fields = basis.fields(q)
    assert fields.stress == pytest.approx(
        np.tile([0.0, 0.0, -1e6, 0.0, 0.0, 0.0], (len(fields.nodes), 1)), abs=1.0)


@KINDS
@pytest.mark.parametrize("reduction", ["residual", "craig-bampton"])
def test_compliance_of_patches_is_that_of_the_finite_elements(tetrahedra, reduction):
    """Against a factorisation of the supported stiffness by itself."""
    from scipy.sparse.linalg import spsolve

    body = block_body((3, 2, 2), tetrahedra=tetrahedra, fixed={"top": "xyz"})
    basis = modal_basis(body, 5, contact_nodes=6, reduction=reduction, tolerance=0.0,
                        loads=("gravity", "right"))
    face = contact_groups(body, "contact", 6)
    moved = np.arange(face.matrix.shape[0]) % 6 < 3
    loads = np.hstack([face.matrix[moved].T.toarray(), boundary_forces(body, "right")])
    free = body.expansion.T
    static = spsolve((free @ body.stiffness @ free.T).tocsc(), free @ loads)
    compliance = (free @ loads).T @ static
    rows = basis.contact_T[:, :3].reshape(18, -1) / basis.angular_frequencies
    assert rows @ rows.T == pytest.approx(compliance[:18, :18], rel=1e-8,
                                          abs=1e-8 * compliance.max())
    assert basis.quality.compliance[2:8].ravel() == pytest.approx(np.diag(compliance)[:18])
    side = list(body.mesh.boundaries).index("right")
    assert basis.elastic_load_compliance[1 + side] == pytest.approx(
        np.diag(compliance)[18:], rel=1e-8)
    report = BasisReport(basis)
    assert report.contact_error.max() < 1e-8
    assert report.load_error[0].max() < 1e-8
    assert "z 0.00% at most" in str(report)


def test_report_names_the_axis_that_is_too_stiff():
    basis = modal_basis(block_body((4, 2, 2)), 12, contact_nodes=8, B="right")
    report = BasisReport(basis)
    assert report.effective_mass.sum(axis=1) == pytest.approx([1.0] * 3, rel=1e-6)
    text = str(report)
    assert "mass z" in text.splitlines()[0]
    assert "effective mass kept: x 100.00%, y 100.00%, z 100.00%" in text
    node, axis = np.unravel_index(report.contact_error.argmax(), (8, 3))
    assert f"Contact node {node} is too stiff" in text
    assert f"compliance in {'xyz'[axis]} is missing" in text
    assert "missing static compliance at B: z" in text


@KINDS
def test_facets_of_the_outline_know_their_contact_node(tetrahedra):
    basis = modal_basis(block_body((4, 2, 1), tetrahedra=tetrahedra), 6, contact_nodes=4)
    shapes = basis.mode_shapes
    surface = Surface(shapes.nodes, shapes.outline)
    for node in range(4):
        own = surface.only(shapes.outline_nodes == node)
        assert own.areas.sum() == pytest.approx(basis.tributary[node])
        assert np.average(own.centres, axis=0, weights=own.areas) == pytest.approx(
            basis.contact_places[node], abs=1e-12)
    assert surface.areas.sum() == pytest.approx(2 * (0.02 + 0.01 + 0.005))


@KINDS
def test_basis_of_a_solid_comes_back_from_a_file(tetrahedra, tmp_path):
    basis = modal_basis(block_body((2, 2, 1), tetrahedra=tetrahedra), 9, contact_nodes=4,
                        B=(0.2, 0.05, 0.025), points={"end": "left"}, damping=0.01)
    write_basis(tmp_path / "basis.h5", basis)
    again = read_basis(tmp_path / "basis.h5")
    for name in ("angular_frequencies", "damping", "T", "positions", "tributary",
                 "inertia_rows", "boundary_rows"):
        assert (getattr(again, name) == getattr(basis, name)).all(), name
    assert (again.extra, again.boundaries, again.groups, again.dimension) == (
        basis.extra, basis.boundaries, basis.groups, 3)
    for name in ("nodes", "cells", "outline", "shapes", "stress", "elements", "outline_nodes"):
        assert (getattr(again.mode_shapes, name) == getattr(basis.mode_shapes, name)).all(), name
    assert (again.quality.load_compliance == basis.quality.load_compliance).all()
    # Rows at a place within an element are those of the same point of the basis.
    assert again.mode_shapes.rows_at((0.2, 0.05, 0.025), "there")[:3] == pytest.approx(
        basis.T[0, :3], abs=1e-12)


def test_compliance_converges_with_the_mesh_and_the_modes():
    """Edges of patches are jumps of traction: energies converge a little below h^2."""
    body = block_body((2, 2, 1), (0.1, 0.1, 0.05), fixed={"top": "xyz"},
                      material=Material(poisson_ratio=0.3))
    found = mode_convergence(
        body, lambda part, count: modal_basis(part, count, contact_nodes=4), 8)
    steps = np.abs(np.diff(found.compliance, axis=0))
    rates = np.log2(steps[0] / steps[1])
    assert found.compliance.shape == (3, 3)
    assert (rates > 1.4).all()
    assert (rates < 3.0).all()
    assert found.compliance[0, 0] == pytest.approx(found.compliance[0, 1])
    assert (np.diff(found.compliance, axis=0) > 0.0).all()
    errors = np.abs(np.diff(found.frequencies_hz[:, 0]))
    assert 1.4 < np.log2(errors[0] / errors[1]) < 4.5
    assert (np.diff(found.missing, axis=0) <= 1e-12).all()
    assert "missing z" in str(found)


def test_what_solids_do_not_have_is_refused():
    body = block_body((2, 1, 1))
    with pytest.raises(InputError, match=r"rows of shape \(3, 4\) must be \(k, 135\)"):
        modal_basis(body, 6, rows=[np.zeros((3, 4))])
    with pytest.raises(InputError, match=r"coordinates x, y, z"):
        modal_basis(body, 6, B=(0.1, 0.1))
    assert isinstance(modal_basis(body, 6).mode_shapes, ModeShapes)


def test_contact_forces_converge_with_the_nodes():
    """A block pressed by its top on a stiff layer with a bulge, against as many nodes as facets."""
    body = block_body((8, 8, 2), (0.1, 0.1, 0.05), fixed={"top": "xyz"})
    forces, arms = [], []
    for count in (4, 16, 64):
        basis = modal_basis(body, 1, contact_nodes=count, reduction="residual", tolerance=0.0)
        rows = basis.contact_T[:, 2] / basis.angular_frequencies
        x, y, _ = basis.contact_places.T
        pressed = 1e-4 - 0.5e-2 * ((x - 0.04) ** 2 + (y - 0.05) ** 2)
        force = np.linalg.solve(rows @ rows.T + np.diag(1e-14 / basis.tributary), pressed)
        assert (force > 0.0).all()
        forces.append(force.sum())
        arms.append((force * x).sum() / force.sum())
    errors = np.abs(np.diff(forces))
    # Errors of second order: the difference of both over the finest solution is 1.2 %, then 0.3 %.
    assert errors / forces[-1] == pytest.approx([0.0119, 0.0035], rel=0.15)
    assert 1.5 < np.log2(errors[0] / errors[1]) < 2.3
    assert np.abs(np.diff(arms))[1] < 0.25 * np.abs(np.diff(arms))[0]
