"""RBE2, RBE3, MPC and supports of Nastran's bulk data, beside decks of Abaqus that say the same."""

import numpy as np
import pytest

import fecontact as fc
from fecontact import MeshError, read_mesh
from fecontact.reduction import eigenfrequencies_hz

STEEL = fc.Material(2.1e11, 0.3, 7850.0)
MESH = fc.Mesh.grid(np.linspace(0.0, 0.3, 4), [0.0, 0.05, 0.1], [0.0, 0.08])
# One facet of the end, so that shares of area are equal weights.
END = [k + 1 for k, place in enumerate(MESH.nodes) if place[0] > 0.29 and place[1] < 0.06]
FOOT = [k + 1 for k, place in enumerate(MESH.nodes) if place[0] < 0.01]
HUB = (0.4, 0.05, 0.04)


def bulk(more, hub=True):
    """Bulk data in fields of commas."""
    places = [*MESH.nodes.tolist(), *([HUB] if hub else [])]
    text = "BEGIN BULK\n" + "".join(
        f"GRID,{k},,{x:.6f},{y:.6f},{z:.6f}\n" for k, (x, y, z) in enumerate(places, 1))
    for k, row in enumerate((MESH.cells + 1).tolist(), 1):
        text += f"CHEXA,{k},1,{','.join(map(str, row[:6]))}\n+,{row[6]},{row[7]}\n"
    return f"{text}{more}ENDDATA\n"


def deck(more):
    """The deck of Abaqus."""
    text = "*NODE\n" + "".join(
        f"{k}, {x}, {y}, {z}\n"
        for k, (x, y, z) in enumerate([*MESH.nodes.tolist(), HUB], 1))
    text += "*ELEMENT, TYPE=C3D8, ELSET=ALL\n" + "".join(
        f"{k}, {', '.join(map(str, row))}\n" for k, row in enumerate((MESH.cells + 1).tolist(), 1))
    hub = len(MESH.nodes) + 1
    return (f"{text}*NSET, NSET=HUB\n{hub}\n*NSET, NSET=END\n"
            + "".join(f"{node},\n" for node in END) + more)


HUB_AT = len(MESH.nodes) + 1
FOLLOW = ",".join(map(str, END))
COUPLED = "*SURFACE, TYPE=NODE, NAME=E\nEND\n*COUPLING, REF NODE=HUB, SURFACE=E\n"
# The end turns about x and moves along it in proportion.
GEARED = (f"MPC,5,{HUB_AT},4,0.1,{HUB_AT},1,-1.0\n",
          f"*EQUATION\n2\n{HUB_AT}, 4, 0.1, {HUB_AT}, 1, -1.0\n")
CASES = {
    "rigid": (f"RBE2,77,{HUB_AT},123456,{FOLLOW}\n", f"{COUPLED}*KINEMATIC\n"),
    "rigid along x": (f"RBE2,77,{HUB_AT},1,{FOLLOW}\n", f"{COUPLED}*KINEMATIC\n1\n"),
    "mean": (f"RBE3,78,,{HUB_AT},123456,1.0,123,{END[0]},{END[1]}\n+,"
             f"{','.join(map(str, END[2:]))}\n{GEARED[0]}",
             f"{COUPLED}*DISTRIBUTING\n{GEARED[1]}"),
    "equation": (f"MPC,5,{END[0]},3,1.0,{FOOT[0]},3,-2.0,\n+,,{FOOT[1]},1,0.5\n",
                 f"*EQUATION\n3\n{END[0]}, 3, 1.0, {FOOT[0]}, 3, -2.0, {FOOT[1]}, 1, 0.5\n"),
}


def frequencies(path):
    return eigenfrequencies_hz(fc.ElasticBody(read_mesh(path), STEEL, degree=1), 12)


@pytest.mark.parametrize("case", CASES)
def test_constraints_are_those_of_a_deck_of_abaqus(tmp_path, case):
    for name, text in zip(("a.bdf", "a.inp"), CASES[case], strict=True):
        (tmp_path / name).write_text(bulk(text) if name == "a.bdf" else deck(text))
    (tmp_path / "free.bdf").write_text(bulk("", hub=False))
    found, wanted, free = (frequencies(tmp_path / name) for name in ("a.bdf", "a.inp", "free.bdf"))
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-3)
    # The constraint counts: the free body has other frequencies.
    assert np.abs(found[8:] / free[8:] - 1.0).max() > 1e-3


def test_weights_of_a_mean_are_those_of_the_card(tmp_path):
    """The point has the rigid motion that fits the weighted nodes best, by least squares."""
    given = {END[0]: 1.0, END[1]: 2.5, END[2]: 2.5, END[3]: 4.0}
    (tmp_path / "a.bdf").write_text(bulk(
        f"RBE3,78,,{HUB_AT},123456,4.0,123,{END[3]},2.5\n+,123,{END[2]},{END[1]},1.0,123,{END[0]}\n"))
    mesh = read_mesh(tmp_path / "a.bdf")
    one, = mesh.constraints
    assert dict(zip(mesh.points["RBE3 78"] + 1, one.weights, strict=True)) == given
    for degree in (1, 2):
        body = fc.ElasticBody(mesh, STEEL, degree=degree)
        u = np.random.default_rng(3).standard_normal((len(body.nodes), 3))
        nodes, weights = np.array(list(given)) - 1, np.array(list(given.values()))
        arm = body.nodes[nodes] - HUB
        # Displacements of the nodes under unit displacements and turns of the point.
        rigid = np.concatenate([np.broadcast_to(np.eye(3), (4, 3, 3)),
                                -np.cross(arm[:, None], np.eye(3)[None])], axis=1)
        rigid = np.swapaxes(rigid, 1, 2).reshape(12, 6)
        root = np.sqrt(np.repeat(weights, 3))
        expected = np.linalg.lstsq(root[:, None] * rigid, root * u[nodes].ravel(), rcond=None)[0]
        assert body.motion_rows(one.reference) @ u.ravel() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("cards", [
    "SPC1,9,123," + ",".join(map(str, FOOT[:4])) + "\n+," + ",".join(map(str, FOOT[4:])) + "\n",
    "".join(f"SPC,9,{one},123,0.0,{other},123,0.0\n"
            for one, other in zip(FOOT[::2], FOOT[1::2], strict=True))])
def test_nodes_of_supports_are_a_group(tmp_path, cards):
    (tmp_path / "a.bdf").write_text(bulk(cards, hub=False))
    mesh = read_mesh(tmp_path / "a.bdf")
    assert sorted(mesh.points["SPC 9"] + 1) == FOOT
    body = fc.ElasticBody(mesh, STEEL, fixed={"SPC 9": "xyz"}, degree=1)
    assert eigenfrequencies_hz(body, 1)[0] > 100.0


@pytest.mark.parametrize(("cards", "message"), [
    (f"RBE2,77,{HUB_AT},123,999\n", "RBE2 77 of line .* names the point 999, which the file does"),
    (f"RBE2,77,{HUB_AT},456,1\n", "holds the components '456', no displacements"),
    (f"RBE2,77,{HUB_AT},123\n", "RBE2 77 of line .* names no points"),
    (f"RBE3,78,,{HUB_AT},123,-1.0,123,1,2\n+,2.0,123,3\n", "weights = .* above zero, one for"),
    (f"RBE3,78,,{HUB_AT},123,1.0,123,1,2\n+,UM,1,1\n", "RBE3 78 .* no weight or a list UM"),
    (f"RBE3,78,,{HUB_AT},123,1.0,1,1,2\n", "weights of other components"),
    ("MPC,5,1,1,1.0,2,1,-1.0\nMPC,6,3,1,1.0,2,1,-1.0\n", "sets '5', '6' of MPC"),
    ("MPC,5,1,9,1.0,2,1,-1.0\n", "component 9, which must be 1 to 6"),
    ("MPC,5,1,1,x,2,1,-1.0\n", "'x' is not a number"),
])
def test_bad_cards(tmp_path, cards, message):
    (tmp_path / "a.bdf").write_text(bulk(cards))
    with pytest.raises((MeshError, fc.InputError), match=message):
        read_mesh(tmp_path / "a.bdf")


def test_the_case_control_chooses_the_set_of_equations(tmp_path):
    sets = "".join(f"MPC,{number},{END[0]},3,1.0,{FOOT[0]},3,-{number}.0\n" for number in (9, 10))
    (tmp_path / "a.bdf").write_text("MPC = 9\n" + bulk(sets))
    (one,) = read_mesh(tmp_path / "a.bdf").constraints
    assert [term.displacement for term in one.terms] == [(0.0, 0.0, 1.0), (0.0, 0.0, -9.0)]
    (tmp_path / "a.bdf").write_text("MPC = 8\n" + bulk(sets))
    with pytest.raises(MeshError, match="set 8 of MPC, but the file has the sets '10', '9'"):
        read_mesh(tmp_path / "a.bdf")


def test_a_node_of_two_couplings_is_named_by_its_number(tmp_path):
    """Both couplings are named too; those of Abaqus without names of their own as another one."""
    twice = (f"RBE2,77,{HUB_AT},123456,{FOLLOW}\nRBE2,78,{FOOT[0]},123,{END[0]}\n",
             f"{COUPLED}*KINEMATIC\n*SURFACE, TYPE=NODE, NAME=T\n{END[0]}\n"
             f"*NSET, NSET=FOOT\n{FOOT[0]}\n*COUPLING, REF NODE=FOOT, SURFACE=T\n*KINEMATIC\n")
    for name, text in zip(("a.bdf", "a.inp"), twice, strict=True):
        (tmp_path / name).write_text(bulk(text) if name == "a.bdf" else deck(text))
        with pytest.raises(fc.InputError, match=(
                r"Coupling .* and (Coupling|another one) .* determine the displacement in x "
                rf"of node {END[0]} of the file at \(0\.3, ")):
            frequencies(tmp_path / name)
