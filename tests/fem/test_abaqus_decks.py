"""Abaqus decks as users have them: local systems, instances, included files, constraints."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh
from solid_blocks import block_mesh

from fecontact import ElasticBody, MeshError, ModelWarning, read_mesh

SQUARE = "*NODE\n1,0,0\n2,2,0\n3,2,1\n4,0,1\n*ELEMENT, TYPE=CPS4, ELSET=all\n1,1,2,3,4\n"
CORNERS = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
SETS = "*NSET, NSET=foot\n1,2\n*ELSET, ELSET=whole\n1\n*SURFACE, NAME=roof\nwhole, S3\n"


def shifted(by):
    return CORNERS + np.array(by)


def deck(folder, text):
    path = folder / "a.inp"
    path.write_text(text)
    return path


def rows(numbers):
    return "".join(f"{k}, {', '.join(map(str, row))}\n" for k, row in enumerate(numbers, start=1))


def solid(mesh, places, system=""):
    return (f"{system}*NODE\n{rows(places.tolist())}"
            f"*ELEMENT, TYPE=C3D8, ELSET=box\n{rows((mesh.cells + 1).tolist())}")


def frequencies(mesh):
    body = ElasticBody(mesh)
    return np.sqrt(np.abs(eigh(body.stiffness.toarray(), body.mass.toarray(), eigvals_only=True)))


def test_a_box_in_a_local_system_has_its_places_volume_and_frequencies(tmp_path):
    """Local x along global y, local y along global z, so that local z is global x."""
    box = block_mesh((2, 1, 1))
    local = "*SYSTEM\n1, 2, 3, 1, 7, 3\n1, 4, 4\n"
    read = read_mesh(deck(tmp_path, solid(box, box.nodes, local)))
    expected = box.nodes[:, [2, 0, 1]] + np.array([1.0, 2.0, 3.0])
    assert read.nodes == pytest.approx(expected, abs=1e-14)
    assert read.volume == pytest.approx(1e-3, rel=1e-12)
    assert frequencies(read)[6:] == pytest.approx(frequencies(box)[6:], rel=1e-6)


@pytest.mark.parametrize(("lines", "expected"), [
    ("", CORNERS),
    ("5, 6\n", shifted([5.0, 6.0])),
    ("5, 6,\n", shifted([5.0, 6.0])),
    # Without a second line the z axis stays and the x axis is projected on the x-y plane.
    ("5, 6, 0, 5, 9, 4\n", np.column_stack([5.0 - CORNERS[:, 1], 6.0 + CORNERS[:, 0]])),
    ("5, 6, 0, 6, 6, 0\n7, 4, 0\n", CORNERS * [1.0, -1.0] + [5.0, 6.0]),
])
def test_local_systems_of_plane_parts(tmp_path, lines, expected):
    read = read_mesh(deck(tmp_path, f"*SYSTEM\n9, 9, 0\n*SYSTEM\n{lines}{SQUARE}"))
    assert read.nodes == pytest.approx(expected, abs=1e-14)


def test_a_local_system_ends_with_the_next_one_and_with_its_part(tmp_path):
    path = deck(tmp_path, "*PART, NAME=a\n*SYSTEM\n5,0,0\n*NODE\n1,0,0\n2,2,0\n*SYSTEM\n"
                          "*NODE\n3,7,1\n4,5,1\n*SYSTEM\n5,0,0\n"
                          "*ELEMENT, TYPE=CPS4\n1,1,2,3,4\n*END PART\n"
                          f"*PART, NAME=b\n{SQUARE}*END PART\n")
    assert read_mesh(path, part="a").nodes == pytest.approx(shifted([5.0, 0.0]), abs=1e-14)
    assert (read_mesh(path, part="b").nodes == CORNERS).all()


def test_cylindrical_and_spherical_coordinates_are_in_degrees(tmp_path):
    r = math.sqrt(2.0)
    sphere = math.degrees(math.asin(1.0 / math.sqrt(3.0)))
    read = read_mesh(deck(tmp_path, f"""*SYSTEM
10, 0, 0
*NODE
1, 0, 0, 0
2, 1, 0, 0
*NODE, SYSTEM=C
3, {r!r}, 45, 0
4, 1, 90, 0
5, 0, 30, 1
6, 1, 0, 1
*NODE, SYSTEM=s
7, {math.sqrt(3.0)!r}, 45, {sphere!r}
8, {r!r}, 90, 45
*ELEMENT, TYPE=C3D8
1, 1, 2, 3, 4, 5, 6, 7, 8
"""))
    assert read.nodes == pytest.approx(np.array([
        [10, 0, 0], [11, 0, 0], [11, 1, 0], [10, 1, 0],
        [10, 0, 1], [11, 0, 1], [11, 1, 1], [10, 1, 1]]), abs=1e-14)


PARTS = (f"*PART, NAME=Pad\n{SQUARE}{SETS}*END PART\n*ASSEMBLY, NAME=A\n"
         "*INSTANCE, NAME=Left, PART=pad\n*END INSTANCE\n"
         "*INSTANCE, NAME=Right, PART=Pad\n10, 0, 0\n10, 5, 0, 10, 5, 3, 90\n*END INSTANCE\n"
         "*NSET, NSET=pin, INSTANCE=right\n3\n*NSET, NSET=pin, INSTANCE=Left\n4\n"
         "*NSET, NSET=ends\nRight.2, Left.foot\n*NSET, NSET=of-pin\npin\n*NSET, NSET=lost\n1\n"
         "*ELSET, ELSET=_side_S2, INSTANCE=Right\n1\n*SURFACE, NAME=side\n_side_S2, S2\n"
         "*SURFACE, NAME=base\nLeft.whole, S1\nRight.1, S4\n*END ASSEMBLY\n")
# Moved by 10 along x, then turned by 90 degrees about (10, 5): (x, y) -> (15 - y, 5 + x).
TURNED = np.column_stack([15.0 - CORNERS[:, 1], CORNERS[:, 0] + 5.0])


def test_instances_of_one_part_are_bodies_with_sets_of_their_own(tmp_path):
    path = deck(tmp_path, PARTS)
    with pytest.raises(MeshError, match="holds 2 parts; choose one by part: 'Left', 'Right'"):
        read_mesh(path)
    left, right = read_mesh(path, part="Left"), read_mesh(path, part="Right")
    assert left.area + right.area == pytest.approx(2 * 2.0, rel=1e-13)
    assert (left.nodes == CORNERS).all()
    assert right.nodes == pytest.approx(TURNED, abs=1e-13)
    points = {"foot": [0, 1], "pin": [3], "of-pin": [3], "ends": [0, 1]}
    assert {name: nodes.tolist() for name, nodes in left.points.items()} == points
    points |= {"pin": [2], "of-pin": [2], "ends": [1]}
    assert {name: nodes.tolist() for name, nodes in right.points.items()} == points
    sides = {"foot": [[0, 1]], "roof": [[2, 3]], "base": [[0, 1]], "ends": [[0, 1]]}
    assert {name: edges.tolist() for name, edges in left.boundaries.items()} == sides
    sides |= {"base": [[3, 0]], "side": [[1, 2]]}
    del sides["ends"]
    assert {name: edges.tolist() for name, edges in right.boundaries.items()} == sides


@pytest.mark.parametrize("placement", ["", "0, 0, 0\n", "0., 0., 0.\n0, 0, 0, 0, 0, 1, 360.\n"])
def test_undisplaced_instances_of_one_part_each_have_the_names_of_parts(tmp_path, placement):
    path = deck(tmp_path, f"*PART, NAME=a\n{SQUARE}*END PART\n*PART, NAME=b\n{SQUARE}*END PART\n"
                          f"*ASSEMBLY\n*INSTANCE, NAME=b-1, PART=b\n{placement}*END INSTANCE\n"
                          f"*INSTANCE, NAME=a-1, PART=a\n{placement}*END INSTANCE\n*END ASSEMBLY\n")
    with pytest.raises(MeshError, match="choose one by part: 'a', 'b'"):
        read_mesh(path)
    assert (read_mesh(path, part="b").nodes == CORNERS).all()


def test_a_displaced_solid_is_turned_about_its_axis(tmp_path):
    """The solid turns by 120 degrees about the diagonal of space: (x, y, z) -> (z, x, y)."""
    box = block_mesh((2, 1, 1))
    path = deck(tmp_path, f"*PART, NAME=P\n{solid(box, box.nodes)}*END PART\n*ASSEMBLY\n"
                          "*INSTANCE, NAME=I, PART=P\n1, 2, 3\n0, 0, 0, 5, 5, 5, 120\n"
                          "*END INSTANCE\n*END ASSEMBLY\n")
    for part in (None, "I"):
        expected = (box.nodes + np.array([1.0, 2.0, 3.0]))[:, [2, 0, 1]]
        assert read_mesh(path, part=part).nodes == pytest.approx(expected, abs=1e-13)


def test_a_mesh_within_an_instance_is_placed_with_it(tmp_path):
    """Independent instances of Abaqus/CAE: the part is empty, the instance holds the mesh."""
    path = deck(tmp_path, "*PART, NAME=P\n*END PART\n*ASSEMBLY\n*INSTANCE, NAME=One, PART=P\n"
                          f"3, 0, 0\n{SQUARE}{SETS}*END INSTANCE\n"
                          f"*INSTANCE, NAME=Two\n*SYSTEM\n0, 1, 0\n{SQUARE}*END INSTANCE\n"
                          "*NODE\n1, 50, 50\n*NSET, NSET=pin, INSTANCE=One\n2\n*END ASSEMBLY\n")
    one, two = read_mesh(path, part="One"), read_mesh(path, part="Two")
    assert one.nodes == pytest.approx(shifted([3.0, 0.0]), abs=1e-14)
    assert two.nodes == pytest.approx(shifted([0.0, 1.0]), abs=1e-14)
    assert sorted(one.boundaries) == ["foot", "roof"]
    assert one.points["pin"].tolist() == [1]
    assert not two.boundaries


def test_equally_named_sets_of_part_and_assembly_stay_apart(tmp_path):
    path = deck(tmp_path, f"*PART, NAME=P\n{SQUARE}*NSET, NSET=Set-1\n1,2,3,4\n*END PART\n"
                          "*ASSEMBLY\n*INSTANCE, NAME=P-1, PART=P\n*END INSTANCE\n"
                          "*NSET, NSET=Set-1, INSTANCE=P-1\n3,4\n*NSET, NSET=both\n"
                          "Set-1, P-1.Set-1\n*ELSET, ELSET=all\n1\n*END ASSEMBLY\n")
    read = read_mesh(path)
    assert {name: nodes.tolist() for name, nodes in read.points.items()} == {
        "Set-1": [2, 3], "P-1.Set-1": [0, 1, 2, 3], "both": [0, 1, 2, 3]}
    # Elements of the assembly itself, such as reference points, make no set of the instance.
    assert len(read_mesh(path, part="all").cells) == 1


def test_included_files_are_found_from_the_file_that_names_them(tmp_path):
    (tmp_path / "my parts").mkdir()
    (tmp_path / "my parts" / "square, fine.inp").write_text(
        "** all of it\n*NODE\n*INCLUDE, INPUT=places.txt\n*Include,\n input = cells.inp\n")
    (tmp_path / "my parts" / "places.txt").write_text("1,0,0\n2,2,0\n3,2,1\n4,0,1\n")
    (tmp_path / "my parts" / "cells.inp").write_text(
        "*ELEMENT, TYPE=CPS4, INPUT=numbers.txt\n*NSET, NSET=foot\n1,2\n")
    (tmp_path / "my parts" / "numbers.txt").write_text("1,1,2,3,4\n")
    path = deck(tmp_path, '*PART, NAME=P\n*INCLUDE, INPUT="my parts/square, fine.inp"\n*END PART\n')
    read = read_mesh(path)
    assert (read.nodes == CORNERS).all()
    assert read.boundary("foot").tolist() == [[0, 1]]
    path.write_text("*INCLUDE, INPUT=my parts\\square, fine.inp\n")
    with pytest.raises(MeshError, match=r"a\.inp includes the file 'my parts\\\\square', but there "
                                        r"is no file .*square; put it there, or correct INPUT="):
        read_mesh(path)


@pytest.mark.parametrize(("others", "message"), [
    ({"b.inp": "*INCLUDE, INPUT=sub/c.inp\n", "sub/c.inp": "*INCLUDE, INPUT=../b.inp\n"},
     r"a\.inp: The file includes itself, a\.inp -> b\.inp -> c\.inp -> b\.inp; remove one"),
    ({"b.inp": "*INCLUDE, INPUT=a.inp\n"}, r"includes itself, a\.inp -> b\.inp -> a\.inp; remove"),
    ({"b.inp": "*INCLUDE, INPUT=c.inp\n"}, r"b\.inp includes the file 'c\.inp', but there is no"),
    ({"b.inp": "*INCLUDE\n"}, r"line '\*INCLUDE' names no file; write \*INCLUDE, INPUT=file\."),
    ({"b.inp": f"{SQUARE}*NSET, NSET=N\n1, 2"},
     r"last line of the included file b\.inp, '1, 2', has no line break, so the file may be cut"),
    ({"b.inp": f"*PART, NAME=P\n{SQUARE}"}, r"\*PART without a line \*END PART, so it may be cut"),
    ({"b.inp": f"{SQUARE}*NSET, NSET=N\n"}, r"ends with the line '\*NSET, NSET=N' without its"),
])
def test_included_files_that_are_missing_cut_off_or_circular(tmp_path, others, message):
    path = deck(tmp_path, "*INCLUDE, INPUT=b.inp\n")
    (tmp_path / "sub").mkdir()
    for name, text in others.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(MeshError, match=message) as caught:
        read_mesh(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("keyword", ["EMBEDDED ELEMENT", "SHELL TO SOLID COUPLING", "FASTENER"])
def test_joints_that_are_not_read_stop_the_reading(tmp_path, keyword):
    path = deck(tmp_path, f"{SQUARE}*{keyword}\nA, B\n")
    with pytest.raises(MeshError, match=rf"a\.inp: The file holds 1 \*{keyword}, which join or "
                                        r"stiffen bodies and are not read; delete them"):
        read_mesh(path)


def test_elements_lost_at_the_end_of_an_included_file_are_warned_of(tmp_path):
    (tmp_path / "b.inp").write_text("*NODE\n5,0,9\n" + SQUARE)
    path = deck(tmp_path, "*INCLUDE, INPUT=b.inp\n*NSET, NSET=foot\n1,2\n")
    with pytest.warns(ModelWarning, match=r"a\.inp: the file b\.inp ends with \*ELEMENT data, and "
                                          r"1 of 5 nodes belong to no element"):
        read_mesh(path)


def test_springs_and_masses_without_elements_are_named(tmp_path):
    path = deck(tmp_path, f"{SQUARE}*MASS, ELSET=m\n1.\n*Spring, elset=s\n1, 1\n"
                          "*Mass, elset=n\n2.\n*BOUNDARY\n1, 1\n")
    with pytest.warns(ModelWarning) as caught:
        assert read_mesh(path).area == 2.0
    message, = caught
    assert ("a.inp: the file holds *MASS with a set 'm' without elements, *SPRING with a set 's' "
            "without elements, *MASS with a set 'n' without elements, which are not read") in str(
        message.message)


def test_rows_of_nodes_of_any_form_are_read_alike(tmp_path):
    elements = SQUARE[SQUARE.index("*ELEMENT"):]
    for nodes in ("1, 0., 0.\n2, 2e0, 0.\n3, 2., 1.\n4, 0., 1.\n", "1\n2,2\n3,2,1,\n4,,1\n",
                  "1,0,0,0,0,0,1\n2,2,0,0,0,0,1\n3,2,1,0,0,0,1\n4,0,1,0,0,0,1\n",
                  "1,0,0\n1,0,0\n2,2,0\n3,2,1\n4,0,1\n"):
        read = read_mesh(deck(tmp_path, f"*NODE\n{nodes}{elements}"))
        assert (read.nodes == CORNERS).all()


def test_sections_of_parts_with_sets_of_one_name_have_their_own_materials(tmp_path):
    """Programs write equal names of sets into every part."""
    parts = "".join(
        f"*PART, NAME={name}\n*NODE\n{rows(block_mesh((1, 1, 1), size).nodes.tolist())}"
        f"*ELEMENT, TYPE=C3D8, ELSET=All\n{rows((block_mesh((1, 1, 1), size).cells + 1).tolist())}"
        f"*SOLID SECTION, ELSET=ALL, MATERIAL={name}\n*END PART\n"
        for name, size in (("BASE", (2.0, 1.0, 1.0)), ("PAD", (1.0, 1.0, 1.0))))
    materials = "".join(f"*MATERIAL, NAME={name}\n*ELASTIC\n{modulus}, 0.3\n*DENSITY\n{density}\n"
                        for name, modulus, density in (("BASE", 2.1e11, 7850.0),
                                                       ("PAD", 7e10, 2700.0)))
    path = deck(tmp_path, parts + "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=LOW, PART=BASE\n"
                "*END INSTANCE\n*INSTANCE, NAME=HIGH, PART=PAD\n0, 0, 1\n*END INSTANCE\n"
                "*END ASSEMBLY\n" + materials)
    for name, modulus, mass in (("LOW", 2.1e11, 2.0 * 7850.0), ("HIGH", 7e10, 2700.0)):
        body = ElasticBody(read_mesh(path, part=name))
        material, = body.mesh.materials.values()
        assert material.youngs_modulus == modulus
        along = np.tile([1.0, 0.0, 0.0], body.mass.shape[0] // 3)
        assert along @ body.mass @ along == pytest.approx(mass, rel=1e-9)
