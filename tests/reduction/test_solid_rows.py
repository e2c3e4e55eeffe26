"""Bases in space from matrices and modes: rows of six a point, frames of contact nodes."""

import numpy as np
import pytest

from fecontact import ModalBasis, basis_from_matrices, basis_from_modes
from fecontact.core.errors import InputError
from fecontact.fem.faces.frames import turned
from fecontact.reduction import point_masses, rows_from_dofs

MASS, SIDES = 3.0, np.array([0.2, 0.3, 0.1])
# Bodies as the books have them: J = m (b^2 + c^2) / 12 of a cuboid about its centre.
INERTIA = MASS / 12.0 * ((SIDES**2).sum() - SIDES**2)
CORNERS = np.array([(x, y, -0.05) for x in (-0.1, 0.1) for y in (-0.15, 0.15)])


def rigid_rows(places):
    """Rows (n, 6, 6) of a body that is displaced and turned about the origin: u + phi x r."""
    rows = np.tile(np.eye(6), (len(places), 1, 1))
    for row, (x, y, z) in zip(rows, places, strict=True):
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return rows


def block(**options):
    return basis_from_matrices(
        np.diag([MASS] * 3 + [*INERTIA]), np.zeros((6, 6)),
        {"contact": rigid_rows(CORNERS), "B": rigid_rows([(0.0, 0.0, 0.05)])[0]}, dimension=3,
        contact_places=CORNERS, tributary=np.full(4, 0.015),
        translations=np.eye(3, 6), **options)


def test_block_in_space_has_its_mass_at_every_point():
    basis = block()
    assert basis.dimension == 3
    assert basis.T.shape == (6, 6, 6)
    assert basis.boundary_rows.shape == (0, 3, 6)
    assert basis.rigid_modes == 6
    # A unit force at a corner accelerates it by 1/m + |lever|^2 / J about the two other axes.
    arm = CORNERS**2
    exact = 1.0 / MASS + np.stack(
        [arm[:, 2] / INERTIA[1] + arm[:, 1] / INERTIA[2],
         arm[:, 2] / INERTIA[0] + arm[:, 0] / INERTIA[2],
         arm[:, 1] / INERTIA[0] + arm[:, 0] / INERTIA[1]], axis=1)
    assert (basis.contact_T[:, :3] ** 2).sum(axis=2) == pytest.approx(exact, rel=1e-12)
    assert (basis.contact_T[:, 3:] ** 2).sum(axis=2) == pytest.approx(
        np.tile(1.0 / INERTIA, (4, 1)), rel=1e-12)
    assert (basis.inertia_rows**2).sum(axis=1) == pytest.approx([MASS] * 3, rel=1e-12)
    assert (basis.contact_places == CORNERS).all()
    assert (basis.contact_x == CORNERS[:, 0]).all()
    assert basis.contact_areas.sum() == pytest.approx(0.06)
    assert (basis.normals == [0.0, 0.0, 1.0]).all()
    assert (basis.tangents == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).all()
    assert basis.T_matrix.shape == (36, 6)


def test_translations_alone_make_a_block_that_does_not_turn():
    rows = np.tile(np.eye(3), (4, 1, 1))
    basis = basis_from_matrices(MASS * np.eye(3), np.zeros((3, 3)), {"contact": rows},
                                dimension=3, contact_places=CORNERS)
    assert basis.contact_T[:, :3] @ basis.contact_T[0, :3].T == pytest.approx(
        np.tile(np.eye(3) / MASS, (4, 1, 1)))
    assert not basis.contact_T[:, 3:].any()
    modes = basis_from_modes(np.eye(3) / np.sqrt(MASS), {"contact": rows}, modal_mass=1.0,
                             frequencies_hz=np.zeros(3), dimension=3, contact_places=CORNERS)
    assert np.abs(modes.contact_T) == pytest.approx(np.abs(basis.contact_T))
    numbers = basis_from_matrices(
        MASS * np.eye(3), np.zeros((3, 3)),
        rows_from_dofs(3, [(0, 1, 2)] * 4, B=(None, 1, None, 0, -1, -1), dimension=3), dimension=3)
    assert (numbers.contact_T == basis.contact_T).all()
    assert np.count_nonzero(numbers.T[0], axis=1).tolist() == [0, 1, 0, 1, 0, 0]
    mass = point_masses({"a": MASS}, components="xyz", contact="a")
    assert mass.contact_T[0] @ mass.contact_T[0].T == pytest.approx(
        np.diag([1.0 / MASS] * 3 + [0.0] * 3))


def test_frames_of_contact_nodes_are_right_handed_and_follow_x():
    angles = np.radians([0.0, 40.0, 79.0, 81.0, 90.0])
    normals = np.stack([np.sin(angles), np.zeros(5), np.cos(angles)], axis=1)
    normals = np.vstack([normals, [0.6, 0.64, 0.48], [0.0, -1.0, 0.0]])
    basis = ModalBasis(np.zeros(1), np.zeros((1, 1)), np.zeros((9, 6, 1)), np.zeros((9, 3)),
                       np.ones(7), contact_normals=normals)
    t, t2 = basis.tangents[:, 0], basis.tangents[:, 1]
    assert np.cross(t, t2) == pytest.approx(normals, abs=1e-15)
    assert (t * t).sum(axis=1) == pytest.approx(np.ones(7))
    # Where the normal turns about y from z to x, t turns with it until 10 degrees before x.
    assert t[:3] == pytest.approx(
        np.stack([np.cos(angles), 0.0 * angles, -np.sin(angles)], axis=1)[:3], abs=1e-15)
    assert t[3:5] == pytest.approx(np.array([[0.0, 1.0, 0.0]] * 2))
    assert (t[5], t2[6]) == (pytest.approx([0.8, -0.48, -0.36]), pytest.approx([0.0, 0.0, 1.0]))
    # A rotation about the normal stays one about the third axis of the frame.
    spin = np.concatenate([np.zeros((7, 3)), normals], axis=1)[..., None]
    assert turned(spin, normals)[..., 0] == pytest.approx(np.tile([0, 0, 0, 0, 0, 1.0], (7, 1)),
                                                          abs=1e-15)


def test_dashpots_and_selection_keep_three_directions():
    basis = block().with_dashpots({"B": (1.0, 2.0, 3.0)})
    rows = block().T[0]
    assert basis.damping == pytest.approx(
        sum(b * np.outer(row, row) for b, row in zip((1.0, 2.0, 3.0), rows[:3], strict=True)))
    assert block().select([0, 1, 2]).T.shape == (6, 6, 3)
    with pytest.raises(InputError, match="three numbers, b_x, b_y and b_z"):
        block().with_dashpots({"B": (1.0, 2.0)})


@pytest.mark.parametrize(("change", "message"), [
    ({"thickness": 0.1}, "thickness = 0.1 is for bodies in the plane"),
    ({"dimension": 4}, "dimension = 4 must be 2, the plane, or 3, space"),
    ({"dimension": 2}, r"rows\['contact'\] must have shape \(n, 3, d\)"),
    ({"contact_places": CORNERS[:, :2]}, r"contact_places must have shape \(4, 3\)"),
    ({"contact_x": CORNERS[:, 0]}, "Give either contact_x"),
    ({"translations": np.eye(2, 6)}, r"translations must be \(3, 6\)"),
])
def test_what_does_not_fit_space_is_named(change, message):
    given = {"dimension": 3, "contact_places": CORNERS, **change}
    with pytest.raises(InputError, match=message):
        basis_from_matrices(np.eye(6), np.zeros((6, 6)), {"contact": rigid_rows(CORNERS)}, **given)
