"""Decks that a stranger may give: shells and beams, unknown elements, numbers given twice."""

import numpy as np
import pytest

from fecontact import ElasticBody, InputError, MeshError, ModelWarning, Study, read_mesh
from fecontact.study.imported import imported

PLACES = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
NODES = "*NODE\n" + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(PLACES, 1))
BRICK = "*ELEMENT, TYPE=C3D8, ELSET=ALL\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
STEEL = ("*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n"
         "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n")
GRID = "".join(f"GRID,{k},,{x}.,{y}.,{z}.\n" for k, (x, y, z) in enumerate(PLACES, 1))
HEXA = f"BEGIN BULK\n{GRID}GRID,9,,0.,0.,2.\nCHEXA,1,1,1,2,3,4,5,6\n+,7,8\n"


def written(folder, name, text):
    path = folder / name
    path.write_text(text)
    return path


@pytest.mark.parametrize(("kind", "nodes", "section"), [
    ("S4", "1, 2, 3, 4", "SHELL SECTION"), ("S4R", "1, 2, 3, 4", "SHELL SECTION"),
    ("S3", "1, 2, 3", "SHELL GENERAL SECTION"), ("S8", "1, 2, 3, 4, 5, 6, 7, 8", "SHELL SECTION"),
    ("B31", "1, 2", "BEAM SECTION"), ("B32", "1, 2, 3", "BEAM GENERAL SECTION"),
])
@pytest.mark.parametrize("solid", [BRICK, ""])
def test_shells_and_beams_are_refused_with_the_way_round(tmp_path, kind, nodes, section, solid):
    text = (f"{NODES}{solid}*ELEMENT, TYPE={kind}, ELSET=RIB\n2, {nodes}\n{STEEL}"
            f"*{section}, ELSET=RIB, MATERIAL=STEEL\n0.01\n")
    with pytest.raises(MeshError, match=rf"shells or beams \(\*{section} of 'RIB'\).*mesh them wi"):
        read_mesh(written(tmp_path, "a.inp", text))


@pytest.mark.parametrize(("text", "named"), [
    ("*NONSTRUCTURAL MASS, ELSET=EALL, UNITS=TOTAL MASS\n1.0\n", r"1 \*NONSTRUCTURAL MASS"),
    ("*STEP\n*STATIC\n*FOUNDATION\nEALL, F1, 0.1\n*END STEP\n", r"1 \*FOUNDATION"),
    ("*STEP\n*STATIC\n*MODEL CHANGE, REMOVE\nEALL\n*END STEP\n", r"1 \*MODEL CHANGE"),
    ("*IMPERFECTION, SYSTEM=R\n1, 0.1, 0.\n", r"1 \*IMPERFECTION"),
    ("*INITIAL CONDITIONS, TYPE=STRESS\nEALL, 1., 0., 0., 0., 0., 0.\n",
     r"1 \*INITIAL CONDITIONS of type STRESS"),
    ("*ELEMENT, TYPE=USER, ELSET=EU\n2, 1, 7\n3, 2, 7\n", r"2 \*ELEMENT of type USER"),
])
def test_keywords_that_act_on_bodies_are_named(tmp_path, text, named):
    path = written(tmp_path, "a.inp", f"{NODES}{BRICK}{STEEL}{text}")
    with pytest.warns(ModelWarning, match=f"holds {named}, which act on bodies and are not read"):
        read_mesh(path)


@pytest.mark.parametrize("held", ["ELSET=BARS", "ELSET=BARS, GENERATE"])
def test_trusses_are_refused_with_a_section_alone(tmp_path, held):
    bars = f"{NODES}{BRICK}*ELEMENT, TYPE=T3D2\n2, 1, 7\n*ELSET, {held}\n2, 2\n{STEEL}"
    assert read_mesh(written(tmp_path, "a.inp", bars)).dimension == 3
    section = "*SOLID SECTION, ELSET=BARS, MATERIAL=STEEL\n1.\n"
    with pytest.raises(MeshError, match=r"trusses \(T3D2 with \*SOLID SECTION of 'BARS'\).*SPRING"):
        read_mesh(written(tmp_path, "a.inp", f"{bars}{section}"))


def test_unknown_numbers_of_nodes_are_named_before_their_sets(tmp_path):
    text = f"{NODES}{BRICK}{STEEL}".replace("C3D8", "C3D88")
    with pytest.raises(MeshError, match="unknown type C3D88, that are not read; correct the"):
        read_mesh(written(tmp_path, "a.inp", text))


@pytest.mark.parametrize(("kind", "nodes"), [("S4", "1, 2, 3, 4"), ("CPS3", "1, 2, 3")])
def test_elements_without_a_section_name_faces(tmp_path, kind, nodes):
    """Groups as meshers write them; a triangle on a brick is no face of it, but names its nodes."""
    mesh = read_mesh(written(
        tmp_path, "a.inp", f"{NODES}{BRICK}*ELEMENT, TYPE={kind}, ELSET=SKIN\n2, {nodes}\n{STEEL}"))
    if kind == "S4":
        assert len(mesh.boundaries["SKIN"]) == 1
    else:
        assert mesh.points["SKIN"].tolist() == [0, 1, 2]


@pytest.mark.parametrize(("cards", "card"), [
    ("CBAR,2,2,5,9,0.,1.,0.\nPBAR,2,1,.1,.1,.1\n", "PBAR"),
    ("CBEAM,2,2,5,9,0.,1.,0.\nPBEAML,2,1,,ROD\n+,.1\n", "PBEAML"),
    ("CQUAD4,2,2,5,6,7,8\nPSHELL,2,1,.01,1\n", "PSHELL"),
    ("RBE1,3,9,123456,5,6,7,8\n", "RBE1"), ("CELAS2,4,1e5,1,1\n", "CELAS2"),
    ("CONM2,5,9,,1.\n", "CONM2"),
])
def test_cards_of_nastran_that_stiffen_are_refused_with_the_way_round(tmp_path, cards, card):
    path = written(tmp_path, "a.bdf", f"{HEXA}{cards}ENDDATA\n")
    with pytest.raises(MeshError, match=rf"holds {card}, which is not read.*deck of Abaqus"):
        read_mesh(path)


def test_shells_of_nastran_in_space_are_refused(tmp_path):
    grid = GRID.replace("GRID,3,,1.,1.,0.", "GRID,3,,1.,1.,1.")
    with pytest.raises(MeshError, match="surfaces only, in space"):
        read_mesh(written(tmp_path, "a.bdf", f"BEGIN BULK\n{grid}CQUAD4,1,1,1,2,3,4\nENDDATA\n"))


@pytest.mark.parametrize("kind", ["C3D8XYZ", "C3D10Q"])
def test_unknown_variants_of_elements_are_named(tmp_path, kind):
    with pytest.raises(MeshError, match=f"unknown type {kind}"):
        read_mesh(written(tmp_path, "a.inp", NODES + BRICK.replace("C3D8", kind)))


@pytest.mark.parametrize("kind", ["C3D8", "C3D8R", "C3D8I", "C3D8H", "C3D8RH", "C3D8IH", "C3D8T",
                                  "C3D8HT", "C3D8RHT"])
def test_known_variants_are_read(tmp_path, kind):
    mesh = read_mesh(written(tmp_path, "a.inp", NODES + BRICK.replace("C3D8", kind)))
    assert len(mesh.cells) == 1


def test_nodes_given_twice_are_said(tmp_path):
    text = NODES.rstrip() + "\n1, 0.0, 0.0, 0.1\n2, 1.0, 0.0, 0.0\n" + BRICK
    with pytest.warns(ModelWarning, match=r"node 1 is given a second time, at another place; the"):
        mesh = read_mesh(written(tmp_path, "a.inp", text))
    assert np.abs(mesh.nodes - [0.0, 0.0, 0.1]).sum(axis=1).min() == 0.0
    assert len(read_mesh(written(tmp_path, "a.inp", text.replace("0.1", "0.0"))).nodes) == 8


def test_elements_given_twice_are_said(tmp_path):
    text = NODES + BRICK.rstrip() + "\n" + BRICK.rstrip().splitlines()[-1] + "\n"
    with pytest.warns(ModelWarning, match="element 1 is given a second time, with its own"):
        mesh = read_mesh(written(tmp_path, "a.inp", text))
    assert len(mesh.cells) == 1


def test_materials_without_a_section_are_said(tmp_path):
    steel = "\n".join(line for line in STEEL.splitlines() if "SECTION" not in line) + "\n"
    with pytest.warns(ModelWarning, match=r"no elements, for want of a \*SOLID SECTION"):
        mesh = read_mesh(written(tmp_path, "a.inp", NODES + BRICK + steel))
    assert mesh.materials == {}


def test_sections_of_unknown_sets_and_elements_without_one_are_said(tmp_path):
    text = NODES + BRICK + STEEL
    with pytest.raises(MeshError, match=r"SOLID SECTION names the element set 'AL', which the file "
                                        r"does not hold.* 'ALL'.*; its element sets are: 'ALL'"):
        read_mesh(written(tmp_path, "a.inp", text.replace("ELSET=ALL, MAT", "ELSET=AL, MAT")))
    more = "".join(f"{k}, {x}, {y}, {z + 1}\n" for k, (x, y, z) in enumerate(PLACES[4:], 9))
    two = (NODES + more + BRICK.replace("ELSET=ALL", "ELSET=FIRST")
           + "*ELEMENT, TYPE=C3D8, ELSET=SECOND\n2, 5, 6, 7, 8, 9, 10, 11, 12\n"
           + STEEL.replace("ELSET=ALL", "ELSET=FIRST"))
    mesh = read_mesh(written(tmp_path, "b.inp", two))
    with pytest.raises(InputError, match=r"material leaves 1 of 2 cells without a material, the "
                                         r"first at \(0\.5, 0\.5, 1\.5\); give"):
        ElasticBody(mesh)
    bare = imported(written(tmp_path, "c.inp", NODES + BRICK))
    assert "The deck gives the body no material. The study takes steel: correct [body]." in (
        bare.notes)
    assert not any("section" in note or "set" in note
                   for note in imported(written(tmp_path, "d.inp", text)).notes)


def test_couplings_of_no_nodes_and_ties_of_faces_apart_are_said(tmp_path):
    points = NODES.rstrip() + "\n98, 0.5, 0.5, 2\n"
    coupling = ("*SURFACE, TYPE=NODE, NAME=A\nLONE\n"
                "*COUPLING, CONSTRAINT NAME=C, REF NODE=98, SURFACE=A\n*KINEMATIC\n")
    with pytest.raises(MeshError, match=r"Coupling 'C' needs nodes of 'A', of which the body has"):
        read_mesh(written(tmp_path, "a.inp", points + BRICK + "*NSET, NSET=LONE\n98,\n" + coupling))
    tie = "*SURFACE, NAME=L\n1, S1\n*SURFACE, NAME=U\n1, S2\n*TIE, NAME=T\nL, U\n"
    with pytest.raises(MeshError, match=r"Tie 'T': no node of 'L' lies within tolerance = .*, the "
                                        r"closest is 1 m away"):
        _ = ElasticBody(read_mesh(written(tmp_path, "b.inp", NODES + BRICK + tie))).expansion


def test_couplings_that_determine_a_node_twice_name_it(tmp_path):
    points = NODES.rstrip() + "\n98, 0.5, 0.5, 2\n99, 0.5, 0.5, -1\n"
    coupling = "*COUPLING, CONSTRAINT NAME=C{0}, REF NODE={1}, SURFACE=A\n*KINEMATIC\n"
    text = (points + BRICK + STEEL + "*SURFACE, NAME=A\n1, S1\n" + coupling.format(1, 98)
            + coupling.format(2, 99))
    mesh = read_mesh(written(tmp_path, "a.inp", text))
    with pytest.raises(InputError, match=r"'C2' and Coupling 'C1' determine .* at \(0, 0, 0\) i"):
        _ = ElasticBody(mesh).expansion
    (note,) = (one for one in imported(tmp_path / "a.inp").notes if "fit together" in one)
    assert note.startswith("The constraints and supports of the body do not fit together, so that")
    assert "determine the displacement in x of node 1 of the file at (0, 0, 0) in d" in note


def test_imports_name_nodes_that_a_support_and_a_constraint_determine(tmp_path):
    """Held at the nodes that a rigid body moves; without the support it is sound."""
    points = NODES.rstrip() + "\n98, 0.5, 0.5, 2\n"
    text = (points + BRICK + STEEL + "*SURFACE, NAME=A\n1, S2\n*NSET, NSET=HELD\n5,\n"
            "*COUPLING, CONSTRAINT NAME=C, REF NODE=98, SURFACE=A\n*KINEMATIC\n")
    held = "*BOUNDARY\nHELD, 1, 3\n"
    found = imported(written(tmp_path, "a.inp", text + held))
    (note,) = (one for one in found.notes if "fit together" in one)
    assert "a support and Coupling 'C' determine the displacement in" in note
    assert "of node 5 of the file" in note
    with pytest.raises(InputError, match="a support and Coupling 'C' determine"):
        Study.from_toml(found.toml(tmp_path), tmp_path / "a.toml").system()
    assert not any("fit together" in one for one in imported(
        written(tmp_path, "a.inp", text)).notes)


def test_imports_name_ties_without_partners(tmp_path):
    tie = "*SURFACE, NAME=L\n1, S1\n*SURFACE, NAME=U\n1, S2\n*TIE, NAME=T\nL, U\n"
    notes = imported(written(tmp_path, "a.inp", NODES + BRICK + STEEL + tie)).notes
    assert any("Tie 'T': no node of 'L' lies within tolerance" in note for note in notes)


def test_names_with_spaces(tmp_path):
    text = (NODES + BRICK.replace("ALL", '"all of it"') + STEEL.replace("ALL", '"all of it"')
            + '*NSET, NSET="some nodes"\n1, 2\n*SURFACE, NAME="the face"\n1, S1\n')
    mesh = read_mesh(written(tmp_path, "a deck.inp", text))
    assert "some nodes" in mesh.points
    assert len(mesh.boundaries["the face"]) == 1
    assert list(mesh.materials) == ["all of it"]


@pytest.mark.parametrize(("old", "new", "message"), [
    ("0.3", "0.7", "material 'STEEL' cannot be read: .* poisson_ratio = 0.7 must be above -1"),
    ("2.1e11", "steel", r"material 'STEEL' cannot be read: \*ELASTIC holds 'steel' in place"),
    ("1, 1, 2", "x, 1, 2", r"below a line \*ELEMENT, which begin with 'x, 1, .* cannot be read"),
    (", TYPE=C3D8", "", r"A line \*ELEMENT lacks TYPE=; add it"),
    ("7, 8", "7, 88", "element 1 names node 88, which the file does not hold; 1 of its elements"),
    ("1, S1", "1, S9", "has the side S9 of elements whose last one is S6"),
    ("GENERATE\n1, 8", "GENERATE\n1", r"data below a line \*NSET, which begin with '1', cannot be"),
])
def test_words_in_wrong_places_are_named_with_their_keyword(tmp_path, old, new, message):
    text = (NODES + BRICK + STEEL + "*SURFACE, NAME=A\n1, S1\n*NSET, NSET=N, GENERATE\n1, 8\n")
    assert len(read_mesh(written(tmp_path, "a.inp", text)).boundaries["A"]) == 1
    assert old in text
    with pytest.raises(MeshError, match=message):
        read_mesh(written(tmp_path, "b.inp", text.replace(old, new, 1)))


def test_files_that_are_cut_anywhere_say_so(tmp_path):
    """Within a line of data, or of bulk data wherever it is."""
    deck, bulk = (NODES + BRICK + STEEL).encode(), f"{HEXA}ENDDATA\n".encode()
    for end in range(20, len(NODES + BRICK) - 1, 7):
        if deck[end - 1 : end] != b"\n" and not deck[:end].splitlines()[-1].startswith(b"*"):
            (tmp_path / "a.inp").write_bytes(deck[:end])
            with pytest.raises(MeshError, match="may be cut off"):
                read_mesh(tmp_path / "a.inp")
    for end in range(1, len(bulk) - 8, 11):
        (tmp_path / "a.bdf").write_bytes(bulk[:end])
        with pytest.raises(MeshError, match="no line ENDDATA, so it may be cut off"):
            read_mesh(tmp_path / "a.bdf")
