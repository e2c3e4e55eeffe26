"""``fecontact import``: what a mesh file holds, and the study that it suggests."""

from dataclasses import replace

import numpy as np
import pytest
from bolted_clamp import clamp_deck, clamp_mesh
from meshes_for_tests import rectangle
from solid_blocks import block_mesh

from fecontact import Material, Mesh, Study, static_solution, write_mesh
from fecontact.study.imported import imported

MATERIAL = "*MATERIAL, NAME=M\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n"


def part(name, mesh, kind="C3D8", prefix=""):
    """A part of bricks with its faces as surfaces."""
    nodes = "".join(f"{k}, {x!r}, {y!r}, {z!r}\n"
                    for k, (x, y, z) in enumerate(mesh.nodes.tolist(), start=1))
    cells = "".join(f"{k}, {', '.join(map(str, row))}\n"
                    for k, row in enumerate((mesh.cells + 1).tolist(), start=1))
    text = f"*PART, NAME={name}\n*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET={name}-ALL\n{cells}"
    sides = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (1, 2, 5, 6), (2, 3, 6, 7), (0, 3, 4, 7))
    for boundary, facets in mesh.boundaries.items():
        wanted = {frozenset(facet) for facet in facets.tolist()}
        text += f"*SURFACE, NAME={prefix}{boundary}\n" + "".join(
            f"{k}, S{number}\n" for k, row in enumerate(mesh.cells.tolist(), start=1)
            for number, side in enumerate(sides, start=1)
            if frozenset(row[at] for at in side) in wanted)
    return f"{text}*SOLID SECTION, ELSET={name}-ALL, MATERIAL=M\n*END PART\n"


def deck(*places, more="", kind="C3D8", prefixes=("", "", "")):
    """Equal parts A, B, ... in these places, of which the first is held at its left side."""
    parts = [part("ABCD"[k], block_mesh(counts, (0.1, 0.04, 0.02)).placed(place), kind,
                  prefixes[k])
             for k, (counts, place) in enumerate(places)]
    return ("".join(parts) + "*ASSEMBLY, NAME=X\n" + "".join(
        f"*INSTANCE, NAME={'ABCD'[k]}-1, PART={'ABCD'[k]}\n*END INSTANCE\n"
        for k in range(len(places))) + f"*END ASSEMBLY\n{MATERIAL}{more}")


STACK = (((3, 2, 1), (0.0, 0.0, 0.0)), ((4, 3, 1), (0.0, 0.0, 0.02)))
STEP = "*STEP\n*STATIC\n*CLOAD\nTIP, 3, 1.0\n*OUTPUT, FIELD\n*END STEP\n"


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_two_parts_on_each_other(cli, place):
    """The deck is shown, and the study that is written of it runs."""
    (place / "stack.inp").write_text(deck(*STACK, more=STEP, kind="C3D8R"))
    code, out, err = cli("import", "stack.inp", "-o", "study.toml")
    assert code == 0
    lines = [" ".join(line.split()) for line in out.splitlines()]
    for wanted in ("body A 6 hexahedra, 24 nodes, 100 mm × 40 mm × 20 mm",
                   "material of A-ALL 210 GPa, Poisson ratio 0.3, 7850 kg/m³",
                   "boundary top 6 faces", "elements C3D8R 18", "loads and supports 1 *CLOAD",
                   "interface A.top on B.contact",
                   "study.toml is written; next: fecontact mesh study.toml"):
        assert wanted in lines, wanted
    assert any(line.startswith("skipped") and "1 *OUTPUT" in line for line in lines)
    assert "18 bricks C3D8R (one point) become second-order hexahedra" in " ".join(err.split())
    study = Study.read("study.toml")
    assert set(study.bodies) == {"A", "B"}
    assert (study.interfaces["contact-1"].face, study.interfaces["contact-1"].other) == (
        "A.top", "B.contact")
    code, _, err = cli("run", "study.toml", "--set", "simulation.t_end=1e-5",
                       "--set", "bodies.A.body.degree=1", "--set", "bodies.B.body.degree=1")
    assert (code, err.count("error")) == (0, 0)


def test_supports_of_the_deck(place):
    """Supports at zero up to the end of the first step, but for those on faces in contact."""
    text = deck(*STACK, more="*BOUNDARY\nleft, 1, 2\nRIGHT, ENCASTRE\nfront, 3, 3, 0.1\ntop, 1, 3\n"
                             "*STEP\n*STATIC\n*END STEP\n*STEP\n*BOUNDARY\nback, 1\n")
    (place / "stack.inp").write_text(text)
    written = imported("stack.inp").toml(place)
    study = Study.from_toml(written, place / "study.toml")
    assert study.bodies["A"].body.fixed == {"left": "xy", "right": "xyz"}
    # The upper block is held at its own top.
    assert study.bodies["B"].body.fixed == {"left": "xy", "right": "xyz", "top": "xyz"}
    assert "The support of" not in written


def test_supports_and_loads_at_reference_nodes(cli, place):
    """A block held at one point and loaded at another by force and moment, in mm; it runs."""
    text = part("A", block_mesh((3, 2, 1), (100.0, 40.0, 20.0))).replace("2.1e11", "2.1e5")
    couplings = "".join(
        f"*COUPLING, CONSTRAINT NAME=c{node}, REF NODE={node}, SURFACE={face}\n*KINEMATIC\n"
        for node, face in ((901, "right"), ("HELD", "left")))
    nodes = "*NODE\n901, 110., 20., 10.\n*NODE, NSET=HELD\n902, 0, 0, 0\n"
    text = text.replace("*PART, NAME=A\n", "").replace("*END PART\n", nodes + couplings)
    material = MATERIAL.replace("2.1e11", "2.1e5").replace("7850.", "7.85e-9")
    (place / "a.inp").write_text(
        f"{text}{material}*BOUNDARY\nheld, 1, 4\nHELD, 6\n*STEP\n*STATIC\n*CLOAD\n901, 2, 30.\n"
        "901, 6, 500.\nnone, 1, 1.\n*END STEP\n*STEP\n*CLOAD\n901, 1, 9.\n*END STEP\n")
    assert cli("import", "a.inp", "--scale", "1e-3", "-o", "study.toml")[0] == 0
    study = Study.read("study.toml")
    assert study.body.fixed == {"HELD": "x y z phi_x phi_z"}
    assert [(one.point, one.component, one.signal.value) for one in study.load.forces] == [
        ("node 901", "y", 30.0), ("node 901", "phi_z", pytest.approx(0.5))]
    assert study.elastic_body().total_mass == pytest.approx(7850.0 * 8e-5)
    assert cli("run", "study.toml", "--set", "simulation.t_end=1e-5",
               "--set", "body.degree=1")[0] == 0


SQUARE = ("*NODE\n1, 0, 0\n2, 1, 0\n3, 1, .5\n4, 0, .5\n5, .5, 0\n6, 1, .25\n7, .5, .5\n"
          "8, 0, .25\n*ELEMENT, TYPE=CPS8, ELSET=ALL\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
          "*NSET, NSET=LEFT\n1, 4, 8\n*NSET, NSET=MIDDLE\n6\n"
          f"*SOLID SECTION, ELSET=ALL, MATERIAL=M\n.1\n{MATERIAL}"
          "*BOUNDARY\nLEFT, 1, 1\n1, 2, 2\n")


@pytest.mark.parametrize("middle", ["6", "MIDDLE"])
def test_forces_in_the_middles_of_edges(place, middle):
    """Consistent forces 1/6, 2/3, 1/6 of a traction stretch a square evenly, by F L / (E A)."""
    (place / "square.inp").write_text(
        f"{SQUARE}*STEP\n*STATIC\n*CLOAD\n2, 1, 1e3\n{middle}, 1, 4e3\n3, 1, 1e3\n*END STEP\n")
    found = imported("square.inp")
    assert not [note for note in found.notes if "left out" in note]
    (place / "square.toml").write_text(found.toml(place))
    study = Study.read("square.toml")
    body = study.elastic_body()
    moved = static_solution(body, study.load, points=study.basis.load_points).displacement
    right = body.nodes[:, 0] == 1.0
    assert moved[right, 0] == pytest.approx(6e3 / (2.1e11 * 0.05), rel=1e-9)


WEIGHT = "*STEP\n*STATIC\n*DLOAD\n{}, GRAV, 9.81, , , -1.\n*END STEP\n"


def test_names_with_the_instance_in_front(place):
    """Both parts have the sets and surfaces of equal names; gravity acts on one after the other."""
    steps = ("*CONTACT PAIR, INTERACTION=I\nB-1.contact, A-1.top\n*BOUNDARY\nA-1.LOW, 1, 3\n"
             "B-1.2, 2, 2\n*STEP\n*STATIC\n*CLOAD\nB-1.20, 3, -5.\n*DSLOAD\nA-1.left, P, 7.\n"
             "*DLOAD\nA-1.A-ALL, GRAV, 9.81, 0., 0., -1.\nB-1.B-ALL, GRAV, 9.81, 0., 0., -1.\n"
             "*END STEP\n")
    sets = "*NSET, NSET=LOW\n1, 2, 3\n*END PART"
    (place / "a.inp").write_text(deck(*STACK, more=steps).replace("*END PART", sets))
    found = imported("a.inp")
    assert found.interfaces == (("B.contact", "A.top"),)
    assert not [note for note in found.notes if "left out" in note or "interface" in note]
    study = Study.from_toml(found.toml(place), place / "study.toml")
    assert study.bodies["A"].body.fixed == {"LOW": "xyz"}
    assert study.bodies["B"].body.fixed == {"BOUNDARY 2": "y"}
    assert [(one.point, one.signal.value) for one in study.load.forces] == [("B.node 20", -5.0)]
    assert [(one.boundary, one.pressure) for one in study.load.boundaries] == [("A.left", 7.0)]
    assert study.load.gravity == pytest.approx((0.0, 0.0, -9.81))


@pytest.mark.parametrize(("weight", "gravity", "note"), [
    ("", (0.0, 0.0, -9.81), None),
    ("A-1.A-ALL", None, "Gravity is left out: it must be the same on all bodies."),
])
def test_gravity_of_the_whole_model_and_of_a_part(place, weight, gravity, note):
    (place / "a.inp").write_text(deck(*STACK, more=WEIGHT.format(weight)))
    found = imported("a.inp")
    assert [one for one in found.notes if "ravity" in one] == ([note] if note else [])
    study = Study.from_toml(found.toml(place), place / "study.toml")
    assert study.load.gravity == gravity


def test_a_body_without_points_is_observed_far_from_its_supports(cli, place):
    (place / "square.inp").write_text(SQUARE + WEIGHT.format("").replace(", , -1.", " 1., , 0."))
    assert cli("import", "square.inp", "-o", "square.toml")[0] == 0
    study = Study.read("square.toml")
    assert study.basis.B == (1.0, 0.0)
    brief = ("--set", "simulation.t_end=1e-4", "--set", "basis.modes=5")
    code, out, _ = cli("run", "square.toml", *brief)
    assert code == 0
    assert "amplitude x at B" in out


def test_exponents_of_fortran_and_words_in_place_of_numbers(cli, place):
    double = SQUARE.replace("7850.", "7.85D+03").replace("2.1e11", "2.1d11").replace(
        "2, 1, 0\n", "2, 1.0D0, 0\n")
    (place / "square.inp").write_text(double)
    mesh, = imported("square.inp").meshes.values()
    assert mesh.materials["ALL"].youngs_modulus == 2.1e11
    assert (mesh.materials["ALL"].density, mesh.nodes[1, 0]) == (7850.0, 1.0)
    (place / "square.inp").write_text(SQUARE.replace("2.1e11", "210.x"))
    code, _, err = cli("import", "square.inp")
    assert code == 1
    assert "*ELASTIC holds '210.x' in place of a number" in err


def test_an_existing_study_is_kept(cli, place):
    (place / "stack.inp").write_text(deck(*STACK))
    (place / "study.toml").write_text("mine")
    code, _, err = cli("import", "stack.inp", "-o", "study.toml")
    assert (code, (place / "study.toml").read_text()) == (1, "mine")
    assert "study.toml exists; choose another name, or replace it with --force." in err
    assert cli("import", "stack.inp", "-o", "study.toml", "--force")[0] == 0
    assert Study.read("study.toml").interfaces
    code, out, _ = cli("import", "stack.inp")
    assert code == 0
    assert "next: fecontact import stack.inp -o study.toml" in out


def test_a_part_apart_is_left_out_and_contact_pairs_come_first(place):
    """Surfaces of *CONTACT PAIR are paired although a gap of several cells parts them."""
    far = ((2, 2, 1), (0.0, 0.0, 0.5))
    (place / "a.inp").write_text(deck(*STACK, far))
    found = imported("a.inp")
    assert found.interfaces == (("A.top", "B.contact"),)
    assert "# Bodies without an interface are left out: C." in found.toml(place)
    one = block_mesh((2, 2, 1), (0.1, 0.04, 0.02))
    named = [Mesh(mesh.nodes, mesh.cells, {name: mesh.boundaries[old]}) for mesh, name, old in (
        (one, "UNDER", "top"), (one.placed((0.0, 0.0, 0.1)), "OVER", "contact"))]
    text = part("A", named[0]) + part("B", named[1]) + MATERIAL
    (place / "b.inp").write_text(text)
    assert imported("b.inp").interfaces == ()
    (place / "b.inp").write_text(text + "*CONTACT PAIR, INTERACTION=I\nover, under\n")
    assert imported("b.inp").interfaces == (("B.OVER", "A.UNDER"),)
    assert imported("b.inp").contents.contact == {"CONTACT PAIR": 1}


def test_pieces_of_one_body(place):
    """A ring of four parts that three ties join: the two faces that are free touch each other."""
    ring = [((2, 2, 1), at) for at in ((0.0, 0.0, 0.0), (0.0, 0.0, 0.02), (0.1, 0.0, 0.0),
                                       (0.1, 0.0, 0.02))]
    ties = "".join(f"*TIE, NAME=T{k}\n{one}, {other}\n" for k, (one, other) in enumerate((
        ("A-right", "C-left"), ("C-top", "D-contact"), ("D-left", "B-right"))))
    text = deck(*ring, prefixes=("A-", "B-", "C-", "D-"))
    (place / "a.inp").write_text(text.replace("*END ASSEMBLY", f"{ties}*END ASSEMBLY"))
    found = imported("a.inp")
    assert not found.has_parts
    assert found.interfaces == (("body.A-top", "body.B-contact"),)


def test_the_force_of_a_bolt(place):
    """Force on the control node of the bolt's section, which the deck names by its number."""
    (place / "a.inp").write_text(clamp_deck(clamp_mesh(), {})
                                 + "*BOUNDARY\nHELD, 1, 3\n*STEP\n*STATIC\n*CLOAD\n9001, 1, 2e4\n")
    study = Study.from_toml(imported("a.inp").toml(place), place / "study.toml")
    force, = study.load.forces
    assert (force.point, force.component, force.signal.value) == ("BOLT", "x", 2e4)
    assert (study.body.fixed, study.basis.loads) == ({"HELD": "xyz"}, ("BOLT",))


def test_next_commands_can_be_copied_with_paths_that_hold_spaces(cli, place):
    write_mesh(rectangle(0.1, 0.04, 4, 2), "a part.msh")
    for words, wanted in (
            (("init", "a study.toml"), "next: fecontact run 'a study.toml'"),
            (("import", "a part.msh"), "next: fecontact import 'a part.msh' -o study.toml"),
            (("import", "a part.msh", "-o", "b c.toml"), "next: fecontact mesh 'b c.toml'")):
        code, out, _ = cli(*words)
        assert (code, wanted in " ".join(out.split())) == (0, True), out


def test_a_single_body_and_units(cli, place):
    """A file in mm: the sizes look wrong; its study has no contact and runs."""
    mesh = rectangle(100.0, 40.0, 4, 2)
    write_mesh(mesh, "part.msh")
    code, _, err = cli("import", "part.msh")
    assert code == 0
    assert "has an extent of 100 m" in err
    assert "give a mesh in mm the scale 1e-3" in " ".join(err.split())
    _, out, _ = cli("import", "part.msh", "--scale", "1e-3")
    assert "next: fecontact import part.msh --scale 0.001 -o study.toml" in out
    assert cli("import", "part.msh", "--scale", "1e-3", "-o", "study.toml")[0] == 0
    study = Study.read("study.toml")
    assert study.mesh().extent == pytest.approx(np.hypot(0.1, 0.04))
    assert cli("run", "study.toml", "--set", "simulation.t_end=1e-5")[0] == 0


def test_notes_name_keys_as_they_are_written(place):
    """A deck in t/mm3 read in m: the density looks wrong."""
    (place / "light.inp").write_text(part("A", block_mesh((1, 1, 1), (0.1, 0.04, 0.02)))
                                     + MATERIAL.replace("7850.", "7.85e-9"))
    assert "The body has density = 7.85e-09 kg/m3, not from 1 to 25000 kg/m3; check its unit." in (
        imported("light.inp").notes)


@pytest.mark.parametrize(("name", "message"), [
    ("none.inp", "none.inp: there is no such file."),
    ("part.step", "part.step is a geometry, not a mesh; mesh it first, for example with `gmsh "),
    ("cut.inp", "cut.inp: The file ends with the line '*ELEMENT, TYPE=C3D8' without its data"),
])
def test_files_that_cannot_be_read(cli, place, name, message):
    (place / "cut.inp").write_text("*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D8\n")
    code, out, err = cli("import", name, "-o", "study.toml")
    assert (code, out) == (1, "")
    assert message in " ".join(err.split())
    assert not (place / "study.toml").exists()


def test_materials_of_the_deck_reach_the_bodies(place):
    (place / "stack.inp").write_text(deck(*STACK))
    study = Study.from_toml(imported("stack.inp").toml(place), place / "study.toml")
    # The deck says nothing of thermal expansion.
    steel = replace(Material.named("steel"), thermal_expansion=0.0)
    assert all(body.materials == (steel,) for body in study.elastic_bodies().values())
