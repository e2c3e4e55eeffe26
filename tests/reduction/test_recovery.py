"""Superelements seen as the bodies that they were made of, by recovery matrices."""

import numpy as np
import pytest
import scipy.linalg as sl
from libraries import library

import fecontact as fc
from fecontact import InputError
from fecontact.fem.fields import stress_of
from fecontact.io import AssembledMatrix, read_matrix
from fecontact.output.render import offscreen
from fecontact.reduction import Recovery, grid_places, rows_from_dofs

COUNT = 4  # modes with the boundary held


def block():
    return fc.ElasticBody(fc.Mesh.grid(np.linspace(0.0, 0.3, 4), np.linspace(0.0, 0.1, 3),
                                       np.linspace(0.0, 0.05, 3)), degree=1)


def condensed(body, modes=COUNT):
    """Craig and Bampton's reduction: retained nodes at the corners of the base, and its matrices.

    Recovery (3 N, r + modes), stiffness, mass, and labels of the coordinates, points as 11, 12, ...
    """
    x, y, z = body.nodes.T
    corner = (z < 1e-9) & ((x < 1e-9) | (x > 0.29)) & ((y < 1e-9) | (y > 0.09))
    nodes = np.flatnonzero(corner)
    kept = (3 * nodes[:, None] + np.arange(3)).ravel()
    inner = np.setdiff1d(np.arange(body.nodes.size), kept)
    K, M = body.stiffness.toarray(), body.mass.toarray()
    static = np.zeros((body.nodes.size, len(kept)))
    static[kept] = np.eye(len(kept))
    static[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, kept)])
    vibration = np.zeros((body.nodes.size, modes))
    vibration[inner] = sl.eigh(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)],
                               subset_by_index=[0, modes - 1])[1]
    shapes = np.hstack([static, vibration])
    labels = [(11 + node, way) for node in nodes for way in (1, 2, 3)]
    labels += [(9001 + k, 0) for k in range(modes)]
    return shapes, shapes.T @ K @ shapes, shapes.T @ M @ shapes, np.array(labels)


def grid(body):
    return "".join(f"GRID,{11 + k},,{x:.9f},{y:.9f},{z:.9f}\n"
                   for k, (x, y, z) in enumerate(body.nodes))


def punched(body, labels):
    """EXTRN and MUG1 cards of EXTSEOUT: coordinates, and rows of MUG1, last point first."""
    points = dict.fromkeys(labels[labels[:, 1] > 0, 0].tolist())
    words = [word for point in points for word in (point, 123)]
    words += [word for point, way in labels.tolist() if not way for word in (point, 0)]
    lines = ["EXTRN" + "".join(f",{word}" for word in words[:8])]
    lines += ["+" + "".join(f",{word}" for word in words[k : k + 8])
              for k in range(8, len(words), 8)]
    rows = ["TYPE", "ID", "COMP", "ROW"] * 2
    for k in range(len(body.nodes)):
        rows += [1, 11 + len(body.nodes) - 1 - k, 3, 3 * k + 1]
    lines += ["DTI     TUG1    2"]
    rows += ["ENDREC"]
    lines += ["        " + "".join(f"{word:<8}" for word in rows[k : k + 8])
              for k in range(0, len(rows), 8)]
    return "\n".join(lines) + "\n"


def superelement(tmp_path, body):
    """Files of a superelement; rows of its recovery matrix run from the last node to the first."""
    op4 = library("pyyeti.nastran.op4")
    shapes, K, M, labels = condensed(body)
    mug1 = shapes.reshape(-1, 3, shapes.shape[1])[::-1].reshape(-1, shapes.shape[1])
    op4.write(tmp_path / "part.op4", {"kxx": K, "mxx": M, "mug1": mug1})
    (tmp_path / "part.pch").write_text(punched(body, labels))
    (tmp_path / "part.bdf").write_text(f"BEGIN BULK\n{grid(body)}ENDDATA\n")
    return shapes, tmp_path / "part.op4"


def basis_of(path, body):
    K, M = read_matrix(path, "KXX"), read_matrix(path, "MXX")
    recovery = Recovery.of(body, read_matrix(path, "MUG1"), grid_places(path.with_suffix(".bdf")))
    points = np.unique(K.labels[K.labels[:, 1] > 0, 0]).tolist()
    feet = [[K.dof(point, way) for way in (1, 2, 3)] for point in points]
    rows = rows_from_dofs(len(K.labels), feet, B=feet[0], C=feet[-1], dimension=3)
    return fc.basis_from_matrices(M, K, rows, dimension=3, recovery=recovery, damping=0.01, rigid=6,
                                  tributary=np.full(4, 1e-4)), points


def test_superelements_move_as_the_body_that_they_were_made_of(tmp_path):
    body = block()
    shapes, path = superelement(tmp_path, body)
    basis, points = basis_of(path, body)
    field = basis.mode_shapes
    # Rayleigh's quotients and orthogonality over the whole body, which the files do not hold.
    moved = field.shapes.reshape(body.nodes.size, -1)
    w = basis.angular_frequencies
    assert moved.T @ (body.mass @ moved) == pytest.approx(np.eye(basis.modes), abs=1e-9)
    energies = moved.T @ (body.stiffness @ moved)
    assert energies == pytest.approx(np.diag(w**2), abs=1e-9 * w[-1] ** 2)
    # Shapes lie in the span of the condensation.
    left = moved - shapes @ np.linalg.lstsq(shapes, moved, rcond=None)[0]
    assert np.abs(left).max() < 1e-9 * np.abs(moved).max()
    # Points move as the nodes there, lie there, and their forces act there.
    nodes = np.array(points) - 11
    assert basis.contact_places == pytest.approx(body.nodes[nodes], abs=1e-12)
    assert basis.positions[0] == pytest.approx(body.nodes[nodes[0]], abs=1e-12)
    assert basis.contact_T[:, :3] == pytest.approx(field.shapes[nodes], rel=1e-9)
    assert (field.restriction @ moved).reshape(basis.T.shape) == pytest.approx(
        basis.T, abs=1e-9 * np.abs(basis.T).max())


def test_the_stress_of_a_superelement_is_that_of_its_body(tmp_path):
    """Two retained points pulled apart: against the statics of the whole free body."""
    body = block()
    _, path = superelement(tmp_path, body)
    basis, points = basis_of(path, body)
    nodes = np.array(points) - 11
    first, last = nodes[0], nodes[-1]
    pull = 1e3 * (body.nodes[last] - body.nodes[first])
    load = np.zeros((len(body.nodes), 3))
    load[first], load[last] = -pull, pull
    w, rows = basis.angular_frequencies, basis.contact_T[:, :3]
    q = np.zeros(basis.modes)
    q[6:] = (pull @ rows[-1] - pull @ rows[0])[6:] / w[6:] ** 2
    shown = basis.fields(q)
    K, M = body.stiffness.toarray(), body.mass.toarray()
    x, y, z = body.nodes.T
    rigid = np.zeros((body.nodes.size, 6))
    for axis in range(3):
        rigid[axis::3, axis] = 1.0
    rigid[1::3, 3], rigid[2::3, 3] = -z, y
    rigid[2::3, 4], rigid[0::3, 4] = -x, z
    rigid[0::3, 5], rigid[1::3, 5] = -y, x
    inertia = M @ rigid
    exact = np.linalg.solve(K + 1e9 * inertia @ inertia.T, load.ravel())
    assert np.abs(exact @ inertia).max() < 1e-9 * np.abs(exact).max() * np.abs(inertia).max()
    assert shown.displacement.ravel() == pytest.approx(exact, abs=1e-9 * np.abs(exact).max())
    stress = stress_of(body, exact[:, None])[..., 0]
    assert shown.stress == pytest.approx(stress, abs=1e-8 * np.abs(stress).max())


def test_runs_of_superelements_are_drawn_and_written(tmp_path):
    body = block()
    _, path = superelement(tmp_path, body)
    basis, _ = basis_of(path, body)
    system = fc.ContactSystem(
        basis, normal=fc.laws.LinearContact(1e7, 1e2), load=fc.Load(normal=10.0),
        friction=fc.laws.ConstantFriction(0.3, smoothing_slope=1e3))
    run = fc.simulate(system, 1e-4, outputs=3)
    case = fc.write_case(tmp_path / "run.vtkhdf", run)
    back = fc.read_case(case).trajectory.system.basis.mode_shapes
    assert (back.shapes == basis.mode_shapes.shapes).all()
    grid = fc.io.to_pyvista(run)
    assert grid.n_points == len(body.nodes)
    fc.plot.plot_modes(basis, count=7, path=tmp_path / "modes.png")
    assert (tmp_path / "modes.png").stat().st_size > 1000


def test_retained_points_alone_show_a_coarse_body(tmp_path):
    """A cell between the retained corners; rows by labels from the identity."""
    body = fc.ElasticBody(fc.Mesh.grid([0.0, 0.3], [0.0, 0.1]), thickness=0.1, degree=1)
    labels = np.array([(node, way) for node in (5, 6, 7, 8) for way in (1, 2)] + [(0, 1)])
    K = np.diag(np.arange(1.0, 10.0))
    places = {5 + k: place for k, place in enumerate(body.nodes)}
    recovery = Recovery.of(body, AssembledMatrix(np.eye(9), labels, "K.mtx"), places)
    basis = fc.basis_from_matrices(np.eye(9), K, rows_from_dofs(9, [(2, 3)]), recovery=recovery)
    shapes = basis.mode_shapes.shapes.reshape(8, 9)
    assert np.abs(shapes) == pytest.approx(np.eye(9)[:8])
    assert basis.positions[2] == pytest.approx(body.nodes[1])
    # The same by modes, and with a degree of freedom that is held.
    modes = fc.basis_from_modes(np.eye(9), rows_from_dofs(9, [(2, 3)]), modal_mass=1.0,
                                frequencies_hz=np.arange(1.0, 10.0), recovery=recovery)
    assert modes.mode_shapes.shapes == pytest.approx(
        np.eye(9)[:8].reshape(4, 2, 9) * np.sign(modes.mode_shapes.shapes.sum(axis=(0, 1))))
    K[0, 0] = 1e36
    held = fc.basis_from_matrices(np.eye(9), K, rows_from_dofs(9, [(2, 3)]), recovery=recovery)
    assert held.modes == 8
    assert not held.mode_shapes.shapes[0, 0].any()


def test_rows_of_nastrans_own_superelement_have_labels():
    """MUG1 of a model by NX Nastran: rows of retained points are those of the identity."""
    from pathlib import Path

    folder = Path(library("pyyeti.nastran.op4").__file__).parents[1] / "tests" / "nas2cam_extseout"
    if not (folder / "inboard.op4").is_file():
        pytest.skip("this pyYeti was installed without its tests")
    K, found = (read_matrix(folder / "inboard.op4", name) for name in ("KXX", "MUG1"))
    assert found.matrix.shape == (36, 32)
    assert found.labels[[0, 5, 6, 35]].tolist() == [[3, 1], [3, 6], [4, 1], [27, 6]]
    rows = found.matrix.toarray()
    for point, way in [(3, 1), (11, 5), (27, 3)]:
        unit = np.zeros(32)
        unit[K.dof(point, way)] = 1.0
        assert rows[found.dof(point, way)] == pytest.approx(unit, abs=1e-12)
    with pytest.raises(InputError, match="point 11 is in the local coordinate system 10"):
        grid_places(folder / "inboard.pch")


BODY = block()
NAMED = AssembledMatrix(np.zeros((3, 2)), np.array([[1, 1], [1, 2], [1, 3]]), "r.op4")


@pytest.mark.parametrize(("attempt", "message"), [
    (lambda: Recovery(BODY, np.eye(5)), r"must have 108 rows of finite numbers.*not the shape"),
    (lambda: Recovery(BODY, "abc"), r"must be an array of real numbers or a sparse matrix"),
    (lambda: Recovery(None, np.eye(5)), r"body"),
    (lambda: Recovery.of(BODY, AssembledMatrix(np.eye(3), None, "r.mtx"), {}),
     r"r\.mtx does not name the rows"),
    (lambda: Recovery.of(BODY, NAMED, {}), r"108|36 of the 36 nodes of the body have no point"),
    (lambda: Recovery.of(BODY, NAMED, {1: (0.0, 0.0, 0.0)}), r"35 of the 36 nodes of the body"),
    (lambda: Recovery.of(BODY, NAMED, {1: (0.0,), 2: (0.0, 1.0, 2.0)}),
     r"places must hold 3 coordinates"),
    (lambda: Recovery.of(BODY, NAMED, dict(enumerate(BODY.nodes))),
     r"has no row for direction 1 at node 0, nor for 104 other"),
    (lambda: fc.basis_from_matrices(np.eye(4), np.eye(4), {}, dimension=3,
                                    recovery=Recovery(BODY, np.ones((108, 5)))),
     r"must have 4 columns"),
    (lambda: fc.basis_from_matrices(np.eye(5), np.eye(5), {},
                                    recovery=Recovery(BODY, np.ones((108, 5)))),
     r"dimension=3"),
    (lambda: fc.basis_from_matrices(np.eye(5), np.eye(5), {}, recovery=np.eye(5)), r"recovery"),
])
def test_bad_recoveries(attempt, message):
    with pytest.raises(InputError, match=message) as caught:
        attempt()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("text", "message"), [
    ("BEGIN BULK\n", r"holds no cards GRID"),
    ("GRID,1,,0.0,x,0.0\n", r"line 1: 'x' is not a number"),
    ("GRID,1,,0.0,1.0,0.0\nGRID,1,,0.0,2.0,0.0\n", r"point 1 is given a second time"),
    ("GRID,1,7,0.0,1.0,0.0\n", r"local coordinate system 7"),
])
def test_bad_grid_points(tmp_path, text, message):
    (tmp_path / "a.bdf").write_text(text)
    with pytest.raises(InputError, match=rf"a\.bdf: .*{message}"):
        grid_places(tmp_path / "a.bdf")


def test_damaged_tables_of_rows_are_said(tmp_path):
    op4 = library("pyyeti.nastran.op4")
    op4.write(tmp_path / "s.op4", {"mug1": np.ones((6, 2))})
    for rows, message in [("1       5       6", "no groups of type"),
                          ("1       5       3       1       1       6       3       5",
                           "rows that do not follow")]:
        (tmp_path / "s.pch").write_text(f"DTI     TUG1    2\n        {rows}\n        ENDREC\n")
        with pytest.raises(InputError, match=message):
            read_matrix(tmp_path / "s.op4", "MUG1")


@pytest.mark.parametrize(("suffix", "remedy"), [(".sub", r"\*EXPORT,K,MMF"),
                                                (".fil", "OUTPUT FILE=USER DEFINED")])
def test_files_that_no_library_reads_say_the_way_round(tmp_path, suffix, remedy):
    path = tmp_path / f"part{suffix}"
    path.write_bytes(b"any")
    with pytest.raises(InputError, match=remedy):
        read_matrix(path, "STIFFNESS")


def test_recovery_in_the_text_of_abaqus_is_refused(tmp_path):
    path = tmp_path / "z1.mtx"
    path.write_text("*USER ELEMENT, NODES=1, LINEAR\n** ELEMENT NODES\n** 7\n 1, 2\n"
                    "*MATRIX, TYPE=STIFFNESS\n1.0, 0.0, 1.0\n"
                    "*MATRIX, TYPE=RECOVERY\n1.0, 0.0, 1.0, 5.0\n")
    with pytest.raises(InputError, match="'RECOVERY' is none of 'DAMPING', 'MASS'"):
        read_matrix(path, "RECOVERY")
    assert read_matrix(path, "STIFFNESS").matrix.tolist() == [[1.0, 0.0], [0.0, 1.0]]


@pytest.mark.skipif(offscreen.rendering_problem() is not None,
                    reason=str(offscreen.rendering_problem()))
def test_pictures_show_the_body(tmp_path):
    body = block()
    _, path = superelement(tmp_path, body)
    basis, _ = basis_of(path, body)
    fc.plot.render_mode(basis, tmp_path / "mode.png", 6, frames=2, periods=1, size=(320, 180))
    assert len(list(tmp_path.glob("mode*.png"))) == 2
