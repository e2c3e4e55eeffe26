"""Constraints of Abaqus and CalculiX decks, against CalculiX 2.20 and against each other.

The numbers of CalculiX are those of ``ccx`` for the decks that the tests write, with a fixed end:
*STATIC with *CLOAD and *NODE PRINT, or *FREQUENCY. Ten-node tetrahedra have the same stiffness in
both; CalculiX integrates their mass at fewer points, which changes the lowest frequencies by 1e-5
to 1e-4.
"""

import numpy as np
import pytest
from solid_blocks import block_mesh

from fecontact import (
    ElasticBody,
    Load,
    MeshError,
    ModelWarning,
    PointLoad,
    read_mesh,
    static_solution,
    write_mesh,
)
from fecontact.fem import Coupling, LinearEquation, Tie
from fecontact.laws import Constant
from fecontact.reduction import eigenfrequencies_hz

SIZE = (0.1, 0.04, 0.03)
# Corners of the faces S1, ... of tetrahedra.
SIDES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
FIRST, SECOND = (block_mesh(counts, SIZE, tetrahedra=True).placed((at, 0.0, 0.0))
                 for counts, at in (((3, 2, 2), 0.0), ((4, 3, 2), 0.1)))


def lines(numbers):
    return "".join(f"{number},\n" for number in numbers)


def part(mesh, name, first=1):
    """Nodes and ten-node tetrahedra from ``first``, surfaces and node sets of its boundaries."""
    body = ElasticBody(mesh)
    members = body.elements
    text = f"*NODE, NSET={name}\n" + "".join(
        f"{first + k}, {', '.join(map(repr, place))}\n"
        for k, place in enumerate(body.nodes.tolist()))
    text += f"*ELEMENT, TYPE=C3D10, ELSET=E{name}\n" + "".join(
        f"{first + k}, {', '.join(map(str, row))}\n"
        for k, row in enumerate((members + first).tolist()))
    for boundary, facets in mesh.boundaries.items():
        wanted = {frozenset(facet) for facet in facets.tolist()}
        text += f"*SURFACE, NAME={name}_{boundary}\n" + "".join(
            f"{first + k}, S{side}\n" for k, row in enumerate(members)
            for side, corners in enumerate(SIDES, start=1)
            if frozenset(row[list(corners)].tolist()) in wanted)
        text += f"*NSET, NSET={name}_{boundary}_N\n" + lines(
            first + np.unique(body.facet_nodes(facets)))
    return text


def node_at(mesh, place, first=1):
    return first + int(np.argmin(np.linalg.norm(ElasticBody(mesh).nodes - place, axis=1)))


ONE = part(FIRST, "A")
PAIR = ONE + part(SECOND, "B", 2001)
TIE = "*TIE, NAME=T, POSITION TOLERANCE=1e-4\nB_left, A_right\n"
REFERENCE = "*NODE, NSET=REF\n5000, 0.15, 0.03, 0.01\n"
CORNER, LOW = (node_at(FIRST, place) for place in ((0.1, 0.04, 0.03), (0.1, 0.0, 0.0)))
KINEMATIC = ("*COUPLING, REF NODE=5000, SURFACE=A_right, CONSTRAINT NAME=C1\n"
             "*KINEMATIC\n1, 3\n")


def read(folder, text, **options):
    path = folder / "a.inp"
    path.write_text(text)
    return read_mesh(path, **options)


def body_of(folder, text, **options):
    return ElasticBody(read(folder, text, **options), fixed={"A_left": "xyz"})


def point_loads(point, forces=(300.0, 100.0, -200.0), moments=(0.0, 0.0, 0.0)):
    components = ("x", "y", "z", "phi_x", "phi_y", "phi_z")
    return Load(forces=tuple(PointLoad(point, component, signal=Constant(value))
                             for component, value in zip(components, (*forces, *moments),
                                                         strict=True)))


def displacement(body, load, place):
    """Displacement of the node at a place, of A where A and B meet."""
    found = static_solution(body, load)
    nearest = np.linalg.norm(body.nodes - place, axis=1)
    piece = body.pieces[1]
    if place[0] <= 0.1:
        nearest[piece != piece[body.group_nodes("A_left")[0]]] = np.inf
    return found.displacement[np.argmin(nearest)]


# Force at the reference point (0.15, 0.03, 0.01) as force and moment at the centroid of the face.
AT_CENTROID = tuple(np.cross(np.array([0.05, 0.01, -0.005]), (300.0, 100.0, -200.0)))


@pytest.mark.parametrize(("text", "load", "place", "expected"), [
    (PAIR + TIE, point_loads((0.2, 0.04, 0.03)), (0.2, 0.04, 0.03),
     (4.242232e-06, 5.615941e-06, -3.444473e-05)),
    # The load is on the free block B, whose face is rigid with the reference point.
    (PAIR + REFERENCE + KINEMATIC.replace("KINEMATIC\n1, 3", "DISTRIBUTING\n1, 6")
     + KINEMATIC.replace("A_right", "B_left"), point_loads("B_left", moments=AT_CENTROID),
     (0.1, 0.04, 0.03), (1.146327e-06, 1.431242e-06, -5.895392e-06)),
    (ONE + REFERENCE + KINEMATIC, point_loads("A_right", moments=AT_CENTROID), (0.1, 0.04, 0.03),
     (1.119034e-06, 1.483002e-06, -5.877358e-06)),
    (f"{ONE}*EQUATION\n2\n{CORNER}, 3, 1., {LOW}, 3, -2.\n", point_loads((0.1, 0.04, 0.03)),
     (0.1, 0.04, 0.03), (1.612524e-06, 1.030269e-06, -5.332617e-06)),
], ids=["tie", "distributing coupling", "kinematic coupling", "equation"])
def test_static_displacements_are_those_of_calculix(tmp_path, text, load, place, expected):
    body = body_of(tmp_path, text)
    assert displacement(body, load, np.array(place)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("text", "expected"), [
    (PAIR + TIE, (628.3247, 825.1778, 3605.762, 3645.113)),
    (ONE + REFERENCE + KINEMATIC, (2441.64, 3101.177, 7423.568, 11830.34)),
    (f"{ONE}{REFERENCE}*RIGID BODY, NSET=A_right_N, REF NODE=5000\n",
     (2441.64, 3101.177, 7423.568, 11830.34)),
], ids=["tie", "kinematic coupling", "rigid body"])
def test_frequencies_are_those_of_calculix(tmp_path, text, expected):
    found = eigenfrequencies_hz(body_of(tmp_path, text), 4)
    assert found == pytest.approx(expected, rel=1.5e-3)
    assert found[:3] == pytest.approx(expected[:3], rel=6e-4)


RIGID = ("*NODE\n5000, 0.15, 0.03, 0.01\n*RIGID BODY, NSET=A_right_N, REF NODE=5000\n")
INNER = node_at(FIRST, (0.0667, 0.04, 0.03))
ATTACHED = {
    "mass": "*ELEMENT, TYPE=MASS, ELSET=EM\n9001, 5000\n*MASS, ELSET=EM\n2.5\n",
    "spring to the base": "*ELEMENT, TYPE=SPRING1, ELSET=ES\n9002, 5000\n"
                          "*SPRING, ELSET=ES\n2\n3.e6\n",
    "spring of two directions": f"*ELEMENT, TYPE=SPRING2, ELSET=ED\n9003, 5000, {INNER}\n"
                                "*SPRING, ELSET=ED\n1, 3\n4.e6\n",
    "spring along its line": f"*ELEMENT, TYPE=SPRINGA, ELSET=EB\n9004, {INNER}, 5000\n"
                             "*SPRING, ELSET=EB\n\n2.e7\n"}
ATTACHED["all"] = "".join(ATTACHED.values())


@pytest.mark.parametrize(("kind", "frequencies", "motion"), [
    ("mass", (418.4055, 551.6397, 4493.594),
     (-5.374075e-7, 2.999071e-6, -8.727931e-6, 1.451436e-5, 7.865356e-5, 2.583722e-5)),
    ("spring to the base", (2441.644, 3219.606, 7424.927),
     (-5.139117e-7, 2.735170e-6, -8.729691e-6, 1.428235e-5, 7.864996e-5, 2.348607e-5)),
    ("spring of two directions", (2461.484, 3102.256, 7445.018),
     (-5.392984e-7, 3.021954e-6, -8.641891e-6, 1.503803e-5, 7.809014e-5, 2.604426e-5)),
    ("spring along its line", (2441.681, 3101.217, 7423.578),
     (-5.378156e-7, 3.001463e-6, -8.725083e-6, 1.451762e-5, 7.861480e-5, 2.587197e-5)),
    ("all", (420.9953, 578.2057, 4505.025),
     (-5.160707e-7, 2.758735e-6, -8.639165e-6, 1.481627e-5, 7.803541e-5, 2.371367e-5)),
])
def test_masses_springs_and_loads_at_a_reference_node_are_those_of_calculix(
        tmp_path, kind, frequencies, motion):
    """Force and moment on the reference node of a rigid body, whose displacement and rotation."""
    body = body_of(tmp_path, ONE + RIGID + ATTACHED[kind])
    assert eigenfrequencies_hz(body, 3) == pytest.approx(frequencies, rel=6e-4)
    assert eigenfrequencies_hz(body, 2) == pytest.approx(frequencies[:2], rel=7e-5)
    found = static_solution(body, point_loads("node 5000", moments=(4.0, -3.0, 2.0)))
    moved = body.motion_rows("node 5000") @ found.displacement.ravel()
    assert moved == pytest.approx(motion, rel=1e-6)


def test_attachments_of_parts_instances_and_the_assembly(tmp_path):
    """A mass in each instance of a part; a spring and a dashpot between them, units of the file."""
    mass = f"*ELEMENT, TYPE=MASS, ELSET=M\n9001, {CORNER}\n*MASS, ELSET=M\n2.5\n"
    more = (f"*ELEMENT, TYPE=SPRINGA, ELSET=S\n1, near.{CORNER}, far.{LOW}\n*SPRING, ELSET=S\n\n"
            f"3.\n*ELEMENT, TYPE=DASHPOT1, ELSET=D\n2, far.{LOW}\n*DASHPOT, ELSET=D\n2\n7.\n")
    text = INSTANCES.replace("*END PART", f"{mass}*END PART", 1)
    mesh = read(tmp_path, text + more + TIED, scale=1e-3)
    masses, others = mesh.attachments[:2], mesh.attachments[2:]
    assert [one.mass for one in masses] == pytest.approx([2500.0, 2500.0])
    assert [tuple(mesh.nodes[one.at]) for one in masses] == [
        pytest.approx((at, 4e-5, 3e-5)) for at in (1e-4, 2e-4)]
    spring, dashpot = others
    assert (spring.stiffness, dashpot.damping) == pytest.approx((3000.0, 7000.0))
    assert np.linalg.norm(spring.terms[0].displacement) == pytest.approx(1.0)
    assert dashpot.terms[0].displacement == (0.0, 1.0, 0.0)
    with pytest.warns(ModelWarning, match=r"2 constraints reach beyond the part 'near'"):
        near = read(tmp_path, text + more.partition("*ELEMENT, TYPE=DASH")[0] + TIED, part="near")
    assert len(near.attachments) == 1
    with pytest.warns(ModelWarning, match=r"^1 mass or spring is at nodes that belong to no elem"):
        read(tmp_path, f"{ONE}*NODE\n5000, 1, 1, 1\n{ATTACHED['mass']}")


@pytest.mark.parametrize(("text", "message"), [
    (ATTACHED["mass"].replace("2.5\n", "heavy\n"), r"\*MASS of the set 'EM' holds 'heavy' in "),
    (ATTACHED["mass"].replace("2.5\n", ""), r"\*MASS of the set 'EM' has 0 of at least 1 numbers"),
    (ATTACHED["mass"].replace("*MASS", "*SPRING"),
     r"holds the element 9001 of type MASS; its types are SPRING1, SPRING2, SPRINGA\.$"),
    (ATTACHED["mass"].replace("5000\n", "7777\n"), r"'7777', which holds no nodes of the file"),
    (ATTACHED["spring to the base"].replace("\n2\n", "\n9\n"), r"must give the degree of freedom"),
    (ATTACHED["spring along its line"].replace("5000", str(INNER)), r"two nodes at one place"),
    (ATTACHED["mass"].replace("*MASS", "*ROTARY INERTIA").replace("MASS", "ROTARYI").replace(
        "2.5", "1, 1, 1").replace("5000", str(CORNER)),
     r"PointMass 'of element 9001' turns with '\d+', which has no rotation of its own; couple"),
])
def test_bad_attachments_of_decks(tmp_path, text, message):
    with pytest.raises(MeshError, match=message) as caught:
        read(tmp_path, ONE + RIGID + text)
    assert "\n" not in str(caught.value)


def same(folder, text, other, count=6, **options):
    one, two = (eigenfrequencies_hz(body_of(folder, given, **options), count)
                for given in (text, other))
    assert one == pytest.approx(two, rel=1e-8)


def test_surfaces_by_elements_and_by_nodes_tie_alike(tmp_path):
    by_nodes = PAIR + "*SURFACE, TYPE=NODE, NAME=S\nB_left_N, 1.\n*TIE\nS, A_right\n"
    same(tmp_path, PAIR + TIE, by_nodes)
    same(tmp_path, PAIR + TIE, PAIR + "*TIE\nb_LEFT_n, a_Right\n")


def test_couplings_of_old_and_new_form_and_rigid_bodies_agree(tmp_path):
    new = ONE + REFERENCE + KINEMATIC
    same(tmp_path, new, f"{ONE}{REFERENCE}*KINEMATIC COUPLING, REF NODE=REF\nA_right_N, 1, 6\n")
    same(tmp_path, new, f"{ONE}{REFERENCE}*RIGID BODY, REF NODE=REF, TIE NSET=A_right_N\n")
    some = KINEMATIC.replace("1, 3", "1, 1\n3, 3")
    assert read(tmp_path, ONE + REFERENCE + some).constraints[0].axes == ((1, 0, 0), (0, 0, 1))
    same(tmp_path, ONE + REFERENCE + some,
         f"{ONE}{REFERENCE}*KINEMATIC COUPLING, REF NODE=REF\nA_right_N, 1\nA_right_N, 3\n")


def test_rigid_bodies_of_elements_and_beams_of_two_nodes(tmp_path):
    """A rigid body of a bar's elements, whose inner middles stay free, and beams to one node."""
    rigid = read(tmp_path, f"{ONE}{REFERENCE}*RIGID BODY, ELSET=EA, REF NODE=5000\n")
    body = ElasticBody(rigid)
    assert (eigenfrequencies_hz(body, 6) == 0.0).all()
    assert eigenfrequencies_hz(body, 7)[6] > 5.0 * eigenfrequencies_hz(ElasticBody(FIRST), 7)[6]
    beams = "".join(f"BEAM, {node}, {CORNER}\n" for node in (LOW, LOW + 1))
    found = read(tmp_path, f"{ONE}*MPC\n{beams}").constraints
    assert [type(one) for one in found] == [Coupling, Coupling]
    assert {one.reference for one in found} == {f"node {CORNER}"}
    same(tmp_path, f"{ONE}*NSET, NSET=P\n{LOW}, {LOW + 1}\n*MPC\nBEAM, P, {CORNER}\n",
         f"{ONE}*MPC\n{beams}")
    body = ElasticBody(read(tmp_path, f"{ONE}*MPC\n{beams}"), fixed={"A_left": "xyz"})
    found = static_solution(body, point_loads((0.1, 0.04, 0.03)))
    places = [int(body.mesh.points[f"node {node}"][0]) for node in (LOW, LOW + 1, CORNER)]
    now = body.nodes[places] + found.displacement[places]
    for first, second in ((0, 2), (1, 2), (0, 1)):  # lengths change with squares of turns alone
        before = np.linalg.norm(body.nodes[places[first]] - body.nodes[places[second]])
        assert np.linalg.norm(now[first] - now[second]) == pytest.approx(before, abs=1e-8 * before)


def test_ties_of_nodes_are_equations(tmp_path):
    equations = "".join(f"*EQUATION\n2\n{CORNER}, {dof}, 1, {LOW}, {dof}, -1\n"
                        for dof in (1, 2, 3))
    same(tmp_path, f"{ONE}*MPC\nTIE, {CORNER}, {LOW}\n", ONE + equations)
    same(tmp_path, f"{ONE}*MPC\nPIN, {CORNER}, {LOW}\n", ONE + equations)


def test_equations_of_sets_and_of_middles_of_edges(tmp_path):
    """Sets of one size go node by node, a set of one node with each of the other."""
    pair = f"*NSET, NSET=P\n{LOW}, {LOW + 1}\n*NSET, NSET=Q\n{CORNER}, {CORNER - 1}\n"
    mesh = read(tmp_path, f"{ONE}{pair}*EQUATION\n2\nP, 1, 1., Q, 1, -1.\n"
                          f"2\nP, 2, 1., {CORNER}, 2,\n-1.\n")
    assert len(mesh.constraints) == 4
    count = len(FIRST.nodes)
    middles = read(tmp_path, f"{ONE}*EQUATION\n2\n{count + 1}, 1, 1, {count + 2}, 1, -1\n")
    (equation,), body = middles.constraints, ElasticBody(middles)
    rows = body.expansion.tocsr()
    assert all(len(term.at) == 2 for term in equation.terms)
    first, second = (3 * int(body.edge_nodes(np.array([term.at]))[0, 1])
                     for term in equation.terms)
    assert (rows[[first]].toarray() == rows[[second]].toarray()).all()
    original = ElasticBody(FIRST).nodes[count : count + 2]
    assert body.nodes[[first // 3, second // 3]] == pytest.approx(original, abs=1e-15)


def test_equations_along_local_axes(tmp_path):
    """The radius about the line x = 0.1, z = 0.03 at the corner below it is -z."""
    local = (f"*NSET, NSET=L\n{LOW}\n*TRANSFORM, NSET=L, TYPE=C\n"
             "0.1, 0, 0.03, 0.1, 1, 0.03\n")
    same(tmp_path, f"{ONE}{local}*EQUATION\n2\n{LOW}, 1, 1., {CORNER}, 1, -2.\n",
         f"{ONE}*EQUATION\n2\n{LOW}, 3, 1., {CORNER}, 1, 2.\n")
    turned = f"*NSET, NSET=L\n{LOW}\n*TRANSFORM, NSET=L\n0, 1, 0, -1, 0, 0\n"
    same(tmp_path, f"{ONE}{turned}*EQUATION\n2\n{LOW}, 1, 1., {CORNER}, 1, -2.\n",
         f"{ONE}*EQUATION\n2\n{LOW}, 2, 1., {CORNER}, 1, -2.\n")


def test_a_distributing_coupling_and_equations_of_its_rotations(tmp_path):
    """The mean turn of the end about x is held by a dummy node that is held by an equation."""
    distributing = KINEMATIC.replace("KINEMATIC\n1, 3\n", "DISTRIBUTING\n")
    same(tmp_path, ONE, ONE + REFERENCE + distributing)
    mesh = read(tmp_path, f"{ONE}{REFERENCE}{distributing}*EQUATION\n1\nREF, 4, 1.\n", scale=0.5)
    body = ElasticBody(mesh, fixed={"A_left": "xyz"})
    load = point_loads("A_right", moments=(10.0, 0.0, 0.0))
    turned = static_solution(body, load)
    nodes = body.group_nodes("A_right")
    arm = body.nodes[nodes] - (0.05, 0.01, 0.0075)
    swept = arm[:, 1] * turned.displacement[nodes, 2] - arm[:, 2] * turned.displacement[nodes, 1]
    free = static_solution(ElasticBody(mesh, fixed={"A_left": "xyz"}, constraints=()), load)
    rest = arm[:, 1] * free.displacement[nodes, 2] - arm[:, 2] * free.displacement[nodes, 1]
    assert abs(swept.mean()) < 0.05 * abs(rest.mean())


INSTANCES = (f"*PART, NAME=P\n{ONE}*END PART\n*PART, NAME=POINT\n*NODE\n1, 0, 0, 0\n*END PART\n"
             "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=near, PART=P\n*END INSTANCE\n"
             "*INSTANCE, NAME=far, PART=P\n0.1, 0, 0\n*END INSTANCE\n")
TIED = "*TIE, NAME=T\nnear.A_right, far.A_left\n*END ASSEMBLY\n"


def test_tied_instances_are_one_body_or_parts(tmp_path):
    whole = read(tmp_path, INSTANCES + TIED)
    assert whole.volume == pytest.approx(2.4e-4)
    assert whole.constraints == (Tie("near.A_right", "far.A_left", name="T"),)
    other = block_mesh((6, 2, 2), (0.2, 0.04, 0.03), tetrahedra=True)
    assert eigenfrequencies_hz(ElasticBody(whole), 9)[6:] == pytest.approx(
        eigenfrequencies_hz(ElasticBody(other), 9)[6:], rel=1e-9)
    with pytest.warns(ModelWarning, match=r"^1 constraint reaches beyond the part 'near' and is "
                                          r"left out, the first is 'T'\.$"):
        near = read(tmp_path, INSTANCES + TIED, part="near")
    assert near.constraints == ()
    assert near.volume == pytest.approx(1.2e-4)
    renamed = read(tmp_path, INSTANCES + TIED, boundaries={"seam": "near.A_right"})
    assert renamed.constraints[0].dependent == "seam"


def test_reference_nodes_of_the_assembly_and_of_parts_without_elements(tmp_path):
    """Two instances apart, both rigid with one point: of a part, of the assembly, of a set."""
    apart = INSTANCES.replace("0.1, 0, 0\n*END INSTANCE", "0.3, 0, 0\n*END INSTANCE\n"
                              "*INSTANCE, NAME=hub, PART=POINT\n0.2, 0, 0\n*END INSTANCE")
    couplings = ("*COUPLING, CONSTRAINT NAME=a, REF NODE={0}, SURFACE=near.A_right\n*KINEMATIC\n"
                 "*COUPLING, CONSTRAINT NAME=b, REF NODE={0}, SURFACE=far.A_left\n*KINEMATIC\n"
                 "*END ASSEMBLY\n")
    frequencies = []
    for reference, extra in (("hub.1", ""), ("M", "*NODE\n7, 0.2, 0, 0\n*NSET, NSET=M\n7\n"),
                             ("7", "*NODE\n7, 0.2, 0, 0\n")):
        mesh = read(tmp_path, apart + extra + couplings.format(reference))
        first, second = mesh.constraints
        assert first.reference == second.reference
        assert first.place == (0.2, 0.0, 0.0)
        frequencies.append(eigenfrequencies_hz(ElasticBody(mesh), 9))
    assert (frequencies[0][:6] == 0.0).all()
    assert frequencies[0][6] > 100.0
    assert frequencies[1:] == pytest.approx(np.tile(frequencies[0], (2, 1)), rel=1e-12)


def test_coincident_nodes_stay_apart_where_constraints_join_bodies(tmp_path):
    """Halves with equal meshes at one place, of which the tie joins one face alone."""
    half = part(block_mesh((3, 2, 2), SIZE, tetrahedra=True).placed((0.1, 0.0, 0.0)), "B", 2001)
    mesh = read(tmp_path, ONE + half + TIE)
    assert mesh.pieces[0] == 2
    merged = read(tmp_path, ONE + half)
    assert merged.pieces[0] == 1
    one, two = (eigenfrequencies_hz(ElasticBody(given, fixed={"A_left": "xyz"}), 6)
                for given in (mesh, merged))
    assert one == pytest.approx(two, rel=1e-9)


def test_a_unit_of_the_file_scales_places_and_tolerances(tmp_path):
    options = {"scale": 1e-3}
    mesh = read(tmp_path, PAIR + TIE + REFERENCE + KINEMATIC, **options)
    tie, coupling = mesh.constraints
    assert tie.tolerance == pytest.approx(1e-7)
    assert coupling.place == pytest.approx((1.5e-4, 3e-5, 1e-5))
    turn = read(tmp_path, f"{ONE}{REFERENCE}{KINEMATIC}*EQUATION\n2\nREF, 6, 3., 1, 1, 1\n",
                **options).constraints[1]
    assert isinstance(turn, LinearEquation)
    assert turn.terms[0].rotation == pytest.approx((0.0, 0.0, 3e-3))


def test_plane_decks(tmp_path):
    """Two squares side by side, tied at an edge, with a rigid end."""
    square = ("*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n5,1,0\n6,2,0\n7,2,1\n8,1,1\n9,3,0.5\n"
              "*ELEMENT, TYPE=CPS4, ELSET=all\n1,1,2,3,4\n2,5,6,7,8\n"
              "*SURFACE, NAME=S\n2, S4\n*SURFACE, NAME=M\n1, S2\n*SURFACE, NAME=E\n2, S2\n")
    mesh = read(tmp_path, square + "*TIE\nS, M\n*COUPLING, REF NODE=9, SURFACE=E\n"
                                   "*KINEMATIC\n1, 2\n*EQUATION\n2\n9, 6, 1, 9, 2, -1\n")
    assert [type(one) for one in mesh.constraints] == [Tie, Coupling, LinearEquation]
    body = ElasticBody(mesh)
    assert np.count_nonzero(eigenfrequencies_hz(body, 4) == 0.0) == 2


@pytest.mark.parametrize(("text", "message"), [
    (TIE.replace("B_left", "B_lift"), r"The tie 'T' names 'B_lift', which is not a surface or node "
                                      r"set of the file; correct the name\.$"),
    (TIE.replace("A_right", "A_right_N"), r"'A_right_N', which is not a surface of element faces"),
    ("*TIE, NAME=T\n", r"The tie 'T' names no surfaces; give the dependent and the independent one "
                       r"below \*TIE\.$"),
    ("*TIE, NAME=T\nB_left\n", r"The tie 'T' has the line 'B_left'; give the dependent and"),
    ("*TIE, NAME=T, CYCLIC SYMMETRY\nB_left, A_right\n",
     r"The line \*TIE holds CYCLIC SYMMETRY, which is not read; leave it out"),
    ("*TIE, NAME=T, POSITION TOLERANCE=far\nB_left, A_right\n", r"'far' in place of a number"),
    (KINEMATIC.replace("*KINEMATIC\n1, 3\n", "*NODE\n5000, 0, 0, 0\n"),
     r"The coupling 'C1' has neither a line \*KINEMATIC nor \*DISTRIBUTING after it; add one\.$"),
    (KINEMATIC, r"The coupling 'C1' names the node or set '5000', which holds no nodes of the "),
    (KINEMATIC.replace("REF NODE=5000, ", ""), r"The coupling 'C1' has no ref node; give REF "),
    (KINEMATIC.replace("5000", "B_left_N"), r"needs one reference node, but 'B_left_N' holds \d+ "),
    (KINEMATIC.replace("5000", "1").replace("1, 3", "4, 6"), r"'C1' holds rotations alone"),
    (KINEMATIC.replace("5000", "1").replace("KINEMATIC", "DISTRIBUTING, WEIGHTING METHOD=CUBIC"),
     r"'C1' has WEIGHTING METHOD=CUBIC, which is not read; write UNIFORM\.$"),
    ("*RIGID BODY, ELSET=EA\n", r"\*RIGID BODY has no ref node; give REF NODE= on its line\.$"),
    ("*RIGID BODY, ELSET=EC, REF NODE=1\n", r"\*RIGID BODY names the set 'EC', which holds no "),
    ("*EQUATION\n2\n1, 1, 1.\n", r"An \*EQUATION that begins with '2, 1, 1, 1\.' must hold its "
                                 r"number of terms and, for each, node or set, degree of freedom"),
    ("*EQUATION\n1\n1, 9, 1.\n", r"names the degree of freedom 9; these are 1 to 3 and"),
    ("*EQUATION\n2\nA_left_N, 1, 1., A_top_N, 1, 1.\n", r"names sets of \d+ and \d+ nodes; give "),
    ("*NSET, NSET=P, UNSORTED\n2, 1\n*EQUATION\n2\nP, 1, 1., 3, 1, 1.\n",
     r"names a set that is UNSORTED, which is not read; write one line for each pair of nodes\.$"),
    ("*MPC\nBEAM, 1\n", r"The line 'BEAM, 1' below \*MPC must name a node or set, and the node or"),
    ("*TRANSFORM, NSET=A_left_N, TYPE=S\n0,0,0,1,1,1\n", r"\*TRANSFORM must give NSET=, TYPE=R "),
    ("*TRANSFORM, NSET=A_left_N\n1,0,0,2,0,0\n", r"'A_left_N' spans no local axes; give two "),
])
def test_bad_constraints_of_decks(tmp_path, text, message):
    with pytest.raises(MeshError, match=message) as caught:
        read(tmp_path, PAIR + text)
    assert str(caught.value).startswith(str(tmp_path / "a.inp"))
    assert "\n" not in str(caught.value)


def test_kinds_that_are_not_read_are_warned_of(tmp_path):
    with pytest.warns(ModelWarning, match=r"holds \*MPC SLIDER, \*SPRING with a set 'none' "
                                          r"without elements, which are not read"):
        mesh = read(tmp_path, f"{ONE}*SPRING, ELSET=none\n\n1.\n*MPC\nSLIDER, 1, 2, 3\n")
    assert mesh.constraints == ()


def test_writing_a_mesh_warns_of_its_constraints(tmp_path):
    mesh = read(tmp_path, PAIR + TIE)
    with pytest.warns(ModelWarning, match=r"b\.msh: Gmsh cannot store 1 tie; give them to"):
        write_mesh(mesh, tmp_path / "b.msh")
    mesh = read(tmp_path, ONE + RIGID + ATTACHED["all"])
    with pytest.warns(ModelWarning, match=r"1 coupling and 1 point mass, 3 springs; give them to"):
        write_mesh(mesh, tmp_path / "b.msh")
    assert (tmp_path / "b.msh").exists()
