"""Sections of bolts: a bar against the closed form, a bolted clamp against CalculiX 2.20.

The numbers of CalculiX are those of ``ccx`` for the deck of ``bolted_clamp``, with the bottom held.
"""

import numpy as np
import pytest
from bolted_clamp import STEP, clamp_deck, clamp_mesh
from meshes_for_tests import rectangle
from solid_blocks import block_mesh, mixed_mesh

from fecontact import (
    BoundaryLoad,
    ContactSystem,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    MeshError,
    PointLoad,
    equilibrium,
    generate,
    read_mesh,
    static_solution,
)
from fecontact.fem import PretensionSection, Ring, Tie, pair_faces, with_pretension
from fecontact.fem.elements.cell_kinds import widths
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import (
    assembled_basis,
    eigenfrequencies_hz,
    point_masses,
    reduce_bodies,
    tightened,
)

L, A, E = 0.4, 0.02, 2.0e11
BAR = Material(E, 0.0, 7800.0)
ACROSS = PretensionSection((0.17, 0.0, 0.0), (2.0, 0.0, 0.0))


def tension(force, point="bolt"):
    return Load(forces=(PointLoad(point, "x", signal=force),))


@pytest.mark.parametrize("elements", [
    {"degree": 1}, {"degree": 2}, {"degree": 2, "bricks": "serendipity"},
    {"degree": 1, "integration": "reduced"},
    {"degree": 2, "bricks": "serendipity", "integration": "reduced"}])
@pytest.mark.parametrize("cells", ["hexahedra", "tetrahedra", "mixed"])
def test_a_bar_between_walls(cells, elements):
    """The force F shortens it by F L / (E A), with the stress F / A; held, it is the whole bar."""
    if cells == "mixed":  # along z, turned to x: the section has triangles and quadrilaterals
        whole = mixed_mesh((1, 2, 6), (A, A, L)).placed(rotation=(0.0, 90.0, 0.0))
        walls_of = ("contact", "top")
    else:
        whole = block_mesh((8, 2, 2), (L, A, A), tetrahedra=cells == "tetrahedra")
        walls_of = ("left", "right")
    mesh = with_pretension(whole, "bolt", ACROSS)
    assert len({*widths(mesh.boundaries["bolt-below"]).tolist()}) == 1 + (cells == "mixed")
    walls = ElasticBody(mesh, BAR, **elements, fixed=dict.fromkeys(walls_of, "xyz"))
    found = static_solution(walls, tension(1e4))
    moved = walls.motion_rows("bolt") @ found.displacement.ravel()
    assert moved == pytest.approx([1e4 * L / (E * A**2), 0.0, 0.0, 0.0, 0.0, 0.0], rel=1e-9)
    assert found.stress[:, 0] == pytest.approx(1e4 / A**2, rel=1e-6)
    held = ElasticBody(mesh, BAR, **elements, fixed={walls_of[0]: "xyz", "bolt": "x"})
    assert eigenfrequencies_hz(held, 4) == pytest.approx(eigenfrequencies_hz(
        ElasticBody(whole, BAR, **elements, fixed={walls_of[0]: "xyz"}), 4), rel=1e-8)


@pytest.mark.parametrize("triangles", [False, lambda at: at[:, 1] > 0.5 * A])
def test_a_plane_strip_and_a_turned_mesh(triangles):
    strip = with_pretension(rectangle(L, A, 10, 2, triangles=triangles), "bolt",
                            PretensionSection((0.2, 0.0), (-1, 0)))
    for mesh in (strip, strip.placed((0.1, -0.2), 35.0), strip.placed((0.0, 0.0), 0.0, "x")):
        body = ElasticBody(mesh, BAR, A, fixed={"left": "xy", "right": "xy"})
        found = static_solution(body, tension(1e4))
        assert body.motion_rows("bolt") @ found.displacement.ravel() == pytest.approx(
            [1e4 * L / (E * A**2), 0.0, 0.0], rel=1e-9)
        assert found.von_mises == pytest.approx(1e4 / A**2, rel=1e-6)


def test_a_cut_keeps_groups_curved_edges_and_materials():
    """Half a ring under its own clamp force: groups, curves and the volume are those of before."""
    ring = generate(Ring(0.1, 0.05, 0.02, 0.03))
    ahead = np.flatnonzero(ring.nodes[ring.cells].mean(axis=1)[:, 0] > 0.0)
    whole = Mesh(ring.nodes, ring.cells, ring.boundaries, {**ring.points, "all": np.arange(
        len(ring.nodes))}, ring.curved_edges, ring.curved_middles, cell_groups={"ahead": ahead})
    cut = with_pretension(whole, "bolt", PretensionSection((0.075, 0.0, 0.01), (0, 1, 0), "ahead"))
    assert cut.volume == pytest.approx(whole.volume, rel=1e-12)
    assert {name: len(faces) for name, faces in cut.boundaries.items()} == {
        **{name: len(faces) for name, faces in whole.boundaries.items()}, "bolt-below": len(
            cut.boundaries["bolt-below"]), "bolt-above": len(cut.boundaries["bolt-below"])}
    assert len(cut.curved_edges) == len(whole.curved_edges)
    assert len(cut.points["all"]) == len(cut.nodes)
    assert cut.constraints == (Tie("bolt-above", "bolt-below", name="section bolt", control="bolt",
                                   direction=(0.0, -1.0, 0.0)),)
    assert eigenfrequencies_hz(ElasticBody(cut, fixed={"bolt": "x"}), 8)[6:] == pytest.approx(
        eigenfrequencies_hz(ElasticBody(whole), 8)[6:], rel=1e-7)


@pytest.mark.parametrize(("kind", "shortening"), [("C3D8", 4.034808e-5), ("C3D8I", 4.225330e-5)])
def test_a_section_of_a_deck_is_that_of_calculix(tmp_path, kind, shortening):
    """The clamp without a joint, tightened with 20 kN."""
    path = tmp_path / "a.inp"
    path.write_text(clamp_deck(clamp_mesh(), {}).replace("C3D8", kind))
    body = ElasticBody(read_mesh(path), degree=1, fixed={"contact": "xyz"})
    assert body.references == ("BOLT",)
    found = static_solution(body, tension(2e4, "BOLT"))
    assert (body.motion_rows("BOLT") @ found.displacement.ravel())[0] == pytest.approx(
        shortening, rel=1e-6)
    path.write_text(path.read_text().replace("NODE=9001\n0., 0., 1.\n", "NODE=9001\n"))
    normal, = read_mesh(path).constraints
    assert np.abs(normal.direction) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


STIFFNESS = 1e13  # of the joint [Pa/m]


@pytest.fixture(scope="module")
def clamp(tmp_path_factory):
    """Body of the deck with an open joint, the pairing of its faces, and the basis."""
    parted = with_pretension(clamp_mesh(), "joint", PretensionSection(
        (0.0, 0.0, 3 * STEP), (0, 0, 1), "sleeve"))
    joint = {name: parted.boundaries[name] for name in ("joint-below", "joint-above")}
    path = tmp_path_factory.mktemp("clamp") / "a.inp"
    path.write_text(clamp_deck(Mesh(parted.nodes, parted.cells, {
        name: parted.boundaries[name] for name in ("contact", "top")},
        cell_groups=parted.cell_groups), joint))
    bodies = {"clamp": ElasticBody(read_mesh(path), degree=1, fixed={"contact": "xyz"})}
    pairing = pair_faces(bodies, "clamp.joint-above", "clamp.joint-below", nodes="all")
    points = {"bolt": "BOLT", "centre": (0.02, 0.02, 0.05), "corner": (0.0, 0.0, 0.05)}
    bases = reduce_bodies(bodies, [pairing], modes=4, each={"clamp": {
        "points": points, "loads": ("bolt", "top")}})
    return pairing, assembled_basis(bases, {"joint": pairing})


def system_of(pairing, basis, load):
    return ContactSystem(basis, LinearContact(STIFFNESS * pairing.tributary.sum()),
                         ConstantFriction(0.0), load=load)


# Pressure that lifts the top, and of CalculiX the displacements in z of centre and corner, with
# *CONTACT PAIR, PRESSURE-OVERCLOSURE=LINEAR of the same stiffness, and the force in the bolt, four
# times that on the control node.
LIFTED = ((-8e6, (-7.440942e-6, 3.112561e-6), 4 * 5675.568),
          (-2e7, (3.535718e-5, 5.867338e-5), 5e4))


def test_a_bolted_joint_is_that_of_calculix(clamp):
    """Tightened with 20 kN, then held; what lifts the top first unloads the joint, then the bolt.

    Where the joint has parted, the bolt carries the load alone. CalculiX has contact forces at
    points of the facets, which tilt a little in ours.
    """
    pairing, basis = clamp
    first = equilibrium(system_of(pairing, basis, tension(2e4, "clamp.bolt")))
    shortening = float(basis.point_row("clamp.bolt", "x") @ first.modal_coordinates)
    assert shortening == pytest.approx(4.299496e-5, rel=1e-2)
    assert first.normal_force.sum() == pytest.approx(2e4, rel=1e-9)
    bolts = tightened(basis, first.modal_coordinates, {"clamp.bolt": 2e4})
    unloaded = equilibrium(system_of(pairing, bolts.basis, Load()))
    assert bolts.forces(unloaded.modal_coordinates)["clamp.bolt"] == pytest.approx(2e4, rel=1e-6)
    assert unloaded.normal_force == pytest.approx(first.normal_force, rel=1e-6)
    area = 25 * STEP**2
    for pressure, moved, force in LIFTED:
        state = equilibrium(system_of(pairing, bolts.basis, Load(boundaries=(
            BoundaryLoad("clamp.top", pressure),))))
        q = state.modal_coordinates
        found = bolts.forces(q)["clamp.bolt"]
        assert found == pytest.approx(force, rel=1.2e-2)
        assert found - state.normal_force.sum() == pytest.approx(-pressure * area, rel=1e-6)
        assert [bolts.basis.point_row(f"clamp.{point}", "z") @ q
                for point in ("centre", "corner")] == pytest.approx(moved, rel=1.5e-2)
    assert bolts.stiffness["clamp.bolt"] > 1e12


def test_a_pair_of_forces_between_two_points():
    """Masses on springs k: s = 2 F / k; held, a load P on the first leaves F - P / 2 in the bolt.

    So do both together as the joint carries half of the load.
    """
    k, force, load = 1e6, 300.0, 80.0
    basis = point_masses({"a": 1.0, "b": 2.0}, {("a", None): k, ("b", None): k}, components="yz")
    rows = {name: basis.point_row(name, "z") for name in "ab"}
    w = basis.angular_frequencies
    q = force * (rows["a"] - rows["b"]) / w**2
    bolt = ("a", "b", "z")
    bolts = tightened(basis, q, {bolt: force})
    assert bolts.shortening[bolt] == pytest.approx(2.0 * force / k, rel=1e-12)
    held = bolts.basis
    for push in (0.0, load):
        rest = (held.constant_load + push * held.point_row("a", "z")) / held.angular_frequencies**2
        assert bolts.forces(rest)[bolt] == pytest.approx(force - 0.5 * push, rel=1e-4)
        assert held.point_row("b", "z") @ rest == pytest.approx((0.5 * push - force) / k, rel=1e-4)
    for wrong in (("a", "b"), ("a", "b", "phi_x"), ("a", "b", 3), 5):
        with pytest.raises(InputError, match=r"the bolt .* must be the name of a control p"):
            tightened(basis, q, {wrong: 1.0})


def test_bolts_that_cannot_be_tightened(clamp):
    _, basis = clamp
    q = np.zeros(basis.modes)
    for arguments, message in (
            (({"clamp.bult": 1.0},), r"There is no point 'clamp\.bult' \(did you mean"),
            (({"B": 1.0},), r"'B' moves in no elastic mode along the bolt; name the contr"),
            (({"clamp.bolt": np.nan},), r"forces of clamp\.bolt = nan must be finite")):
        with pytest.raises(InputError, match=message):
            tightened(basis, q, *arguments)
    with pytest.raises(InputError, match=r"coordinates must have shape \(\d+,\), not \(2,\)"):
        tightened(basis, [0.0, 1.0], {"clamp.bolt": 1.0})
    bolts = tightened(basis, q, {"clamp.bolt": 5.0}, stiffness=1e9)
    assert bolts.stiffness == {"clamp.bolt": 1e9}
    with pytest.raises(InputError, match=r"coordinates must have shape"):
        bolts.forces([1.0])


@pytest.mark.parametrize(("make", "message"), [
    (lambda: PretensionSection((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), r"direction = .* longer than ze"),
    (lambda: with_pretension(clamp_mesh(), "b", PretensionSection((0, 0), (0, 1))),
     r"'b': at and direction must have 3 components, as the mesh"),
    (lambda: with_pretension(clamp_mesh(), "b", PretensionSection((0, 0, 1), (0, 0, 1), "bult")),
     r"no group of cells 'bult' \(did you mean 'bolt'\?\)"),
    (lambda: with_pretension(clamp_mesh(), "b", PretensionSection((0, 0, 1), (0, 0, 1), "bolt")),
     r"the plane through .* cuts no cells of 'bolt'; move it into the bolt"),
    (lambda: with_pretension(clamp_mesh(), "top", PretensionSection((0, 0, .02), (0, 0, 1))),
     r"needs the name 'top', which the mesh has already"),
    (lambda: with_pretension(HALF, "b", PretensionSection((0.17, 0, 0), (1, 0, 0), "half")),
     r"The section 'b' leaves both of its sides joined; let it cut the whole bolt"),
    (lambda: Tie("a", "b", control="c"), r"control and direction belong together; give both or no"),
    (lambda: ElasticBody(block_mesh((1, 1, 1)), constraints=[
        Tie("left", "right", control="top", direction=(1, 0, 0))]), r"'top' is a name of the mesh"),
])
def test_sections_that_cannot_be_cut(make, message):
    with pytest.raises((InputError, MeshError), match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


_BLOCK = block_mesh((8, 2, 2), (L, A, A))
HALF = Mesh(_BLOCK.nodes, _BLOCK.cells, cell_groups={"half": np.flatnonzero(
    _BLOCK.nodes[_BLOCK.cells].mean(axis=1)[:, 1] < A / 2)})


@pytest.mark.parametrize(("old", "new", "message"), [
    ("SURFACE=CUT, NODE=9001", "SURFACE=CUT", r"\*PRE-TENSION SECTION of 'CUT' has no control n"),
    ("SURFACE=CUT, NODE", "SURFACE=CAT, NODE", r"names 'CAT', which is not a surface of element f"),
    ("0., 0., 1.\n", "0., 1.\n", r"has a direction of 2 components; give all of them, or none"),
    ("SURFACE=CUT, NODE", "SURFACE=top, NODE", r"'top' of a section of a bolt lies on the outline"),
])
def test_bad_sections_of_decks(tmp_path, old, new, message):
    path = tmp_path / "a.inp"
    path.write_text(clamp_deck(clamp_mesh(), {}).replace(old, new))
    with pytest.raises(MeshError, match=message) as caught:
        read_mesh(path)
    assert "\n" not in str(caught.value)
