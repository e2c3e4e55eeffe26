"""Compliance of interfaces beside that of the whole finite-element models, by dense algebra."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from scipy.linalg import eigh

from fecontact import ElasticBody, InputError, Material, Mesh, modal_basis
from fecontact.fem import pair_faces
from fecontact.reduction import (
    BasisReport,
    PointPairing,
    Spring,
    assembled_basis,
    interface_compliance,
    point_masses,
    reduce_bodies,
)

SOFT = Material(youngs_modulus=5e9, poisson_ratio=0.25, density=2500.0)


@pytest.fixture(scope="module")
def bodies():
    """A free pad on a wider block that is held at its foot, both turned; meshes do not match."""
    pad = rectangle(0.06, 0.02, 5, 2).placed((0.03, 0.04)).placed(rotation=30.0)
    block = rectangle(0.12, 0.04, 7, 3).placed(rotation=30.0)
    return {"pad": ElasticBody(pad, material=SOFT, thickness=0.05),
            "block": ElasticBody(block, thickness=0.05, fixed={"bottom": "xy"})}


@pytest.fixture(scope="module")
def pairing(bodies):
    return pair_faces(bodies, "pad.bottom", "block.top")


def relative_rows(bodies, pairing):
    """Rows (n, 2, f) of each body: along (cos, sin) of 30 degrees and across, node less foot."""
    t = np.array([np.cos(np.pi / 6.0), np.sin(np.pi / 6.0)])
    frame = np.array([t, [-t[1], t[0]]])
    sides = {"pad": pairing.nodes.toarray(), "block": -pairing.feet.toarray()}
    return {name: np.einsum("ab,nbf->naf", frame, rows.reshape(-1, 3, rows.shape[1])[:, :2])
            @ bodies[name].expansion.toarray() for name, rows in sides.items()}


def all_modes(body):
    E = body.expansion.toarray()
    squares, shapes = eigh(E.T @ body.stiffness @ E, E.T @ body.mass @ E)
    elastic = squares > 1e-9 * squares[-1]
    return squares[elastic], shapes[:, elastic]


def works(rows, squares, shapes, tributary):
    """Work of uniform loads (2,) and of unit forces at nodes (n, 2) in some modes."""
    moved = rows @ shapes
    uniform = np.einsum("n,nam->am", tributary / tributary.sum(), moved)
    return (uniform**2 / squares).sum(axis=1), (moved**2 / squares).sum(axis=2)


@pytest.mark.parametrize("count", [4, 9, 25])
def test_missing_compliance_is_that_of_the_modes_left_out(bodies, pairing, count):
    """Over all modes of small meshes, computed densely."""
    bases = reduce_bodies(bodies, [pairing], modes=count, reduction="vibration")
    found = interface_compliance(assembled_basis(bases, {"lining": pairing}), bodies)["lining"]
    rows, whole, missing = relative_rows(bodies, pairing), 0.0, 0.0
    for name, body in bodies.items():
        squares, shapes = all_modes(body)
        kept = count - 3 * (name == "pad")
        both = [np.concatenate([part.reshape(-1, 2) for part in works(
            rows[name], squares[modes], shapes[:, modes], pairing.tributary)])
            for modes in (slice(None), slice(kept, None))]
        whole, missing = whole + both[0], missing + both[1]
    np.testing.assert_allclose(found.uniform_compliance, whole[0], rtol=1e-8)
    np.testing.assert_allclose(found.node_compliance, whole[1:], rtol=1e-8)
    np.testing.assert_allclose(1.0 - found.uniform, missing[0] / whole[0], atol=1e-8)
    np.testing.assert_allclose(1.0 - found.nodes, (missing / whole)[1:], atol=1e-8)
    assert 0.05 < 1.0 - found.worst < 1.0
    assert not found.enough
    assert found.recommendation.startswith("Interface 'lining' is too stiff: only ")
    assert f"{100.0 * found.worst:.3g} %" in found.recommendation
    assert "of body 'pad' with reduction" in found.recommendation


def test_held_bodies_give_as_much_as_their_dense_stiffness(bodies, pairing):
    """Without rigid motions: W K^-1 W^T."""
    held = dict(bodies, pad=ElasticBody(bodies["pad"].mesh, material=SOFT, thickness=0.05,
                                        fixed={"top": "xy"}))
    bases = reduce_bodies(held, [pairing], modes=6)
    found = interface_compliance(assembled_basis(bases, {"lining": pairing}), held)["lining"]
    n, whole = len(pairing.tributary), 0.0
    for name, rows in relative_rows(held, pairing).items():
        E = held[name].expansion.toarray()
        flat = rows.reshape(2 * n, -1)
        whole = whole + flat @ np.linalg.solve(E.T @ held[name].stiffness @ E, flat.T)
    np.testing.assert_allclose(found.node_compliance, np.diag(whole).reshape(n, 2), rtol=1e-9)
    share = pairing.tributary / pairing.tributary.sum()
    uniform = [share @ whole[axis::2, axis::2] @ share for axis in (0, 1)]
    np.testing.assert_allclose(found.uniform_compliance, uniform, rtol=1e-9)


def test_residual_vectors_resolve_all_of_it(bodies, pairing):
    """To 1e-8 with all of them; at each node to about their tolerance with the leading ones."""
    whole, most = (interface_compliance(assembled_basis(reduce_bodies(
        bodies, [pairing], modes=5, tolerance=tolerance), {"lining": pairing}), bodies)["lining"]
        for tolerance in (0.0, 0.1))
    assert whole.worst > 1.0 - 1e-8
    assert whole.recommendation == ""
    assert dict(whole.summary())["normal force at a node"] == (
        "100 % resolved on average, 100 % at worst")
    # Tolerances hold along x and y, these figures along t and n.
    assert 0.8 < most.worst < 0.999
    assert most.bodies == ("pad", "block")


def test_boundaries_of_a_single_body_are_interfaces_too(bodies):
    """The compliance agrees with the contact errors of the basis's report, along x and y."""
    body = ElasticBody(rectangle(0.12, 0.04, 8, 3), thickness=0.05)
    basis = modal_basis(body, 7, contact="bottom", contact_nodes=5)
    found = interface_compliance(basis, body)
    assert list(found) == ["bottom"]
    np.testing.assert_allclose(1.0 - found["bottom"].nodes, BasisReport(basis).contact_error,
                               atol=1e-9)
    assert found["bottom"].bodies == ()
    assert "'bottom' is too stiff" in found["bottom"].recommendation
    assert "of body" not in found["bottom"].recommendation


def test_point_masses_are_exact():
    masses = {name: point_masses({"p": 1.0, "q": 2.0}, {("p", "q"): 1e6, ("q", None): 1e5})
              for name in "ab"}
    basis = assembled_basis(masses, {"touch": PointPairing("a", "p", "b", "p")})
    with pytest.raises(InputError, match="holds no shapes over the body"):
        interface_compliance(basis, {})
    body = ElasticBody(rectangle(0.1, 0.02, 6, 2), thickness=0.05, fixed={"left": "xy"})
    beam = modal_basis(body, 4, contact=(), points={"tip": (0.1, 0.02)})
    mixed = assembled_basis({"mass": masses["a"], "beam": beam},
                            {"touch": PointPairing("mass", "p", "beam", "tip")})
    found = interface_compliance(mixed, {"beam": body})["touch"]
    # Along y the mass has 1 / 1e6 + 1 / 1e5, along x it does not move.
    assert found.stiffest == "beam"
    E = body.expansion.toarray()
    rows = beam.mode_shapes.restriction.toarray()[6:8] @ E
    of_beam = np.diag(rows @ np.linalg.solve(E.T @ body.stiffness @ E, rows.T))
    np.testing.assert_allclose(found.node_compliance[0] - of_beam, [0.0, 1.1e-5], rtol=1e-6,
                               atol=1e-13)
    np.testing.assert_allclose((1.0 - found.nodes[0]) * found.node_compliance[0],
                               of_beam - beam.elastic_compliance[2], rtol=1e-6)


def test_what_cannot_be_compared_is_refused(bodies, pairing):
    bases = reduce_bodies(bodies, [pairing], modes=4)
    basis = assembled_basis(bases, {"lining": pairing})
    with_point = assembled_basis(
        reduce_bodies(bodies, [pairing], modes=4, each={"block": {"C": "right"}}),
        {"lining": pairing}, [Spring("block.C", stiffness=1e6, direction=(1, 0))])
    for wrong, given, told in (
            (basis, bodies["pad"], "the basis is that of the bodies 'block', 'pad'"),
            (basis, {"pad": bodies["pad"], "blok": bodies["block"]}, "bodies lacks 'block'.*blok"),
            (basis, dict(bodies, pad=bodies["block"]), "the mesh of body 'pad' has .* nodes"),
            (basis, dict(bodies, pad=3), r"bodies\['pad'\] must be a.* ElasticBody"),
            (basis, 3, "bodies must be"), (3, bodies, "basis must be a ModalBasis"),
            (bases["pad"], bodies["pad"], "no contact nodes"),
            (with_point, bodies, r"linked bodies.*assembled_basis\(bases, pairings\)")):
        with pytest.raises(InputError, match=f"interface_compliance.*{told}"):
            interface_compliance(wrong, given)


def fork():
    """Two prongs of one body, held at their left end, the upper one above the lower one."""
    nodes = np.array([(0.01 * i, 0.005 * j) for j in range(6) for i in range(9)])
    at = np.arange(len(nodes)).reshape(6, 9)
    cells = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1)
    # Without the middle row of cells but for its first one, which holds the prongs together.
    kept = np.ones(cells.shape[:2], dtype=bool)
    kept[2, 1:] = False
    mesh = Mesh(nodes, cells[kept], {
        "lower": np.column_stack([at[2, 1:-1], at[2, 2:]])[:, ::-1],
        "upper": np.column_stack([at[3, 1:-1], at[3, 2:]]),
        "root": np.column_stack([at[:-1, 0], at[1:, 0]])})
    return ElasticBody(mesh, thickness=0.02, fixed={"root": "xy"})


def test_a_body_that_touches_itself():
    """Both sides move with the same modes: rows of node less foot on one stiffness matrix."""
    bodies = {"fork": fork()}
    touch = pair_faces(bodies, "fork.upper", "fork.lower")
    bases = reduce_bodies(bodies, [touch], modes=5, reduction="vibration")
    found = interface_compliance(assembled_basis(bases, {"gap": touch}), bodies)["gap"]
    E, n = bodies["fork"].expansion.toarray(), len(touch.tributary)
    rows = (touch.nodes - touch.feet).toarray().reshape(n, 3, -1)[:, :2].reshape(2 * n, -1) @ E
    whole = rows @ np.linalg.solve(E.T @ bodies["fork"].stiffness @ E, rows.T)
    np.testing.assert_allclose(found.node_compliance, np.diag(whole).reshape(n, 2), rtol=1e-9)
    assert found.bodies == ("fork",)
    # A few modes bend the prongs, but do not dent them.
    assert found.uniform[1] > 0.99
    assert found.worst < 0.2
