"""Bases of several bodies: blocks, relative rows, shapes, files, statics of an interface."""

import dataclasses

import numpy as np
import pytest
from meshes_for_tests import rectangle

from fecontact import (
    ContactSystem,
    ElasticBody,
    InputError,
    Interface,
    Load,
    Mesh,
    basis_from_matrices,
    equilibrium,
    modal_basis,
)
from fecontact.fem import Rotation, pair_faces
from fecontact.fem.body_forces import inertia_forces
from fecontact.io import read_basis, write_basis
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import BasisReport, PointPairing, assembled_basis, reduce_bodies
from fecontact.reduction.eigenmodes import FreeSystem


def moved(mesh, x=0.0, y=0.0):
    return Mesh(mesh.nodes + np.array([x, y]), mesh.cells, mesh.boundaries, mesh.points)


def blocks(above=5, below=3, triangles=True):
    """A block of triangles on a wider one of quadrilaterals, which is held."""
    return {"pad": ElasticBody(moved(rectangle(1.0, 0.4, above, 2, triangles=triangles), 0.3)),
            "disc": ElasticBody(moved(rectangle(2.0, 0.5, 2 * below, 3), 0.0, -0.5),
                                fixed={"bottom": "xy"})}


@pytest.fixture(scope="module")
def pair():
    bodies = blocks()
    pairing = pair_faces(bodies, "pad.bottom", "disc.top")
    bases = reduce_bodies(bodies, [pairing], modes={"pad": 6, "disc": 4}, damping=0.01,
                          each={"pad": {"points": {"corner": (0.3, 0.4)}, "C": (1.3, 0.4)}})
    return bodies, pairing, bases, assembled_basis(bases, {"face": pairing})


def test_modes_stand_side_by_side(pair):
    _, _, bases, whole = pair
    pad, disc = bases["pad"], bases["disc"]
    assert pad.modes > 6
    assert disc.modes > 4  # residual vectors of nodes, and of feet
    assert [part.modes for part in whole.parts] == [(0, pad.modes), (pad.modes, disc.modes)]
    assert (whole.angular_frequencies == np.concatenate(
        [pad.angular_frequencies, disc.angular_frequencies])).all()
    assert (whole.damping[: pad.modes, : pad.modes] == pad.damping).all()
    assert (whole.damping[pad.modes :, pad.modes :] == disc.damping).all()
    assert not whole.damping[: pad.modes, pad.modes :].any()
    assert whole.stiffness is None
    assert (whole.inertia_rows == np.hstack([pad.inertia_rows, disc.inertia_rows])).all()
    assert whole.boundaries[0].startswith("pad.")
    assert whole.thickness == 1.0
    assert whole.groups == (("face", len(pair[1].gaps)),)
    assert not whole.on_ground.any()
    assert whole.extra == ("pad.C", "pad.corner")
    assert (whole.T[1] == whole.T[whole.point_index("pad.C")]).all()


def test_contact_rows_are_relative_motions_of_the_shapes(pair):
    """Against displacements interpolated from the shapes of both bodies at nodes and feet."""
    bodies, pairing, bases, whole = pair
    q = np.random.default_rng(1).normal(size=whole.modes)
    moved_nodes = (whole.mode_shapes.shapes @ q)
    assert len(moved_nodes) == len(bodies["pad"].nodes) + len(bodies["disc"].nodes)
    assert (whole.mode_shapes.nodes[: len(bodies["pad"].nodes)] == bodies["pad"].nodes).all()
    relative = (whole.contact_T @ q)[:, :2]
    fields = {name: bases[name].fields(q[slice(part.modes[0], sum(part.modes))])
              for name, part in zip(bases, whole.parts, strict=True)}
    for j, (place, foot) in enumerate(zip(pairing.places, pairing.feet_places, strict=True)):
        difference = (fields[pairing.body].at(place)[0]
                      - fields[pairing.other].at(foot)[0])
        assert relative[j] == pytest.approx(
            [pairing.tangents[j] @ difference, pairing.normals[j] @ difference], abs=1e-9)


def test_restriction_gives_the_rows_and_spreads_forces_over_both_bodies(pair):
    _, pairing, _, whole = pair
    shapes = whole.mode_shapes
    given = shapes.restriction @ shapes.shapes.reshape(-1, whole.modes)
    wanted = whole.T.reshape(-1, whole.modes)
    assert given == pytest.approx(wanted, abs=1e-12 * np.abs(whole.T).max())
    rows = shapes.restriction.tocsr()[6 : 6 + 3 * len(pairing.gaps)]
    force = np.zeros(rows.shape[0])
    force[1::3] = 1.0
    spread = (rows.T @ force).reshape(-1, 2)
    first = whole.parts[1].nodes[0]
    assert spread[:first].sum(axis=0) == pytest.approx([0.0, len(pairing.gaps)], abs=1e-10)
    assert spread[first:].sum(axis=0) == pytest.approx([0.0, -len(pairing.gaps)], abs=1e-10)


def test_shapes_of_triangles_and_quadrilaterals_are_joined(pair):
    bodies, _, bases, whole = pair
    shapes = whole.mode_shapes
    area = sum(body.mesh.area for body in bodies.values())
    x, y = shapes.nodes[shapes.cells].transpose(2, 0, 1)
    assert 0.5 * np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(
        axis=1)).sum() == pytest.approx(area, rel=1e-12)
    inside = shapes.rows_at((1.0, -0.25), "place")
    assert inside[:2, : bases["pad"].modes] == pytest.approx(0.0, abs=1e-15)
    same = assembled_basis(dict.fromkeys(("a", "b"), bases["disc"]), {})
    assert same.mode_shapes.elements.shape[1] == 9
    assert same.contact_nodes == 0
    assert same.groups == ()


def test_pad_pressed_on_a_disc_sinks_as_statics_of_both_meshes_say(pair):
    """Residual vectors of nodes and feet make the deflection that of the full models."""
    bodies, pairing, _, _ = pair
    bases = reduce_bodies(bodies, [pairing], modes=4, tolerance=0.0)
    k = 1e11
    system = ContactSystem(bodies=bases, interfaces=[
        Interface("face", pairing, LinearContact(k), ConstantFriction(0.0))],
        load=Load(gravity=(0.0, -1e4)))
    q = equilibrium(system).modal_coordinates
    weight = 1e4 * 7850.0 * 0.4
    forces = k * pairing.tributary / pairing.tributary.sum() * np.maximum(
        -(system.basis.contact_T[:, 1] @ q), 0.0)
    assert forces.sum() == pytest.approx(weight, rel=1e-9)
    # The same forces on the finite elements of the disc.
    disc = bodies["disc"]
    rows = pairing.feet if pairing.other == "disc" else pairing.nodes
    moved = np.arange(rows.shape[0]) % 3 < 2
    normal = pairing.normals if pairing.other == "disc" else -pairing.normals
    three = np.zeros((len(forces), 3))
    three[:, :2] = -forces[:, None] * normal
    force = rows.T @ three.ravel()
    force = force + inertia_forces(disc) @ [0.0, -1e4]
    fixed = FreeSystem.of(disc)
    full = (disc.expansion @ fixed.deflection(disc.expansion.T @ force)).reshape(-1, 2)
    part = {one.name: one for one in system.basis.parts}["disc"]
    nodes = slice(part.nodes[0], sum(part.nodes))
    reduced = (system.basis.mode_shapes.shapes @ q)[nodes]
    assert (rows @ reduced.ravel())[moved] == pytest.approx(
        (rows @ full.ravel())[moved], abs=1e-8 * np.abs(full).max())


def test_a_body_may_touch_itself():
    """Two points of one body: rows are their difference."""
    rows = {"p": np.eye(3, 4), "q": np.eye(3, 4, 2)[:3]}
    rows["q"][2] = 0.0
    rows["p"][2] = 0.0
    basis = basis_from_matrices(np.eye(4), np.eye(4), rows)
    whole = assembled_basis({"a": basis}, {"gap": PointPairing("a", "p", "a", "q")})
    difference = basis.T[basis.point_index("p")] - basis.T[basis.point_index("q")]
    assert whole.contact_T[0, :2] == pytest.approx(difference[:2], abs=1e-15)


def test_bases_of_several_bodies_are_stored(pair, tmp_path):
    whole = pair[3]
    assert whole.normals.shape == (whole.contact_nodes, 2)
    write_basis(tmp_path / "basis.h5", whole)
    found = read_basis(tmp_path / "basis.h5")
    assert found.parts == whole.parts
    assert (found.contact_normals == whole.contact_normals).all()
    assert found.on_ground.dtype == bool
    assert (found.on_ground == whole.on_ground).all()
    assert (found.mode_shapes.restriction != whole.mode_shapes.restriction).nnz == 0
    none = assembled_basis(pair[2], {})
    write_basis(tmp_path / "none.h5", none)
    assert read_basis(tmp_path / "none.h5").groups == ()


def test_selecting_modes_keeps_the_bodies_apart(pair):
    _, _, bases, whole = pair
    m = bases["pad"].modes
    some = whole.select([0, 2, m - 1, m + 1])
    assert [part.modes for part in some.parts] == [(0, 3), (3, 1)]
    assert (some.contact_T == whole.contact_T[:, :, [0, 2, m - 1, m + 1]]).all()
    assert dict(some.summary())["bodies"] == "pad (3 modes), disc (1 mode)"
    assert some.rigid_modes == 2  # of the pad, first of its block


def test_basis_without_contact_nodes():
    body = ElasticBody(rectangle(1.0, 0.2, 4, 1))
    basis = modal_basis(body, 5, contact=())
    assert basis.contact_nodes == 0
    assert basis.T.shape == (2, 3, 5)
    assert "no contact nodes" in str(BasisReport(basis))
    assert basis_from_matrices(np.eye(2), np.eye(2), {"p": np.eye(3, 2)}).contact_nodes == 0


def test_bad_bodies_are_named(pair):
    bodies, pairing, bases, whole = pair
    turning = modal_basis(bodies["pad"], 6, contact=(), rotation=Rotation(10.0))
    for message, given, pairings in (
        ("rotates with the stress that its supports", {**bases, "pad": turning}, {}),
        ("Body 'both' consists of several", {"both": whole}, {}),
        ("'disc', 'pad' all have a point C",
         {**bases, "disc": modal_basis(bodies["disc"], 4, contact=(), C=(1.0, -0.25))}, {}),
        ("made for another mesh of body", {**bases, "disc": bases["pad"]}, {"face": pairing}),
        ("holds no shapes", {**bases, "disc": dataclasses.replace(
            bases["disc"], mode_shapes=None)}, {"face": pairing}),
        ("'a.b' of an interface", bases, {"a.b": pairing}),
        ("is empty", {}, {}),
    ):
        with pytest.raises(InputError, match=message):
            assembled_basis(given, pairings)
    with pytest.raises(InputError, match="length 2; contact_normals must be of length one"):
        dataclasses.replace(whole, contact_normals=2.0 * whole.contact_normals)
    with pytest.raises(InputError, match="modes names the body 'pat'"):
        reduce_bodies(bodies, [pairing], modes={"pat": 3})
    with pytest.raises(InputError, match="Body 'disc': modes = 500"):
        reduce_bodies(bodies, [pairing], modes={"pad": 3, "disc": 500})
    for message, arguments in (("points is empty", {"points": ()}),
                               ("other_points must be 1 points", {"other": "b"}),
                               ("longer than zero", {"normals": (0.0, 0.0)}),
                               ("gaps must be zero", {"gaps": -1.0}),
                               ("finite numbers of shape", {"gaps": [0.0, 0.0]})):
        with pytest.raises(InputError, match=message):
            PointPairing(**{"body": "a", "points": "p", **arguments})
