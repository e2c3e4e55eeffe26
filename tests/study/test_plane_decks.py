"""State and thickness of plane bodies in the studies that imports write."""

import pytest
from ansys_archives import archive

from fecontact import Mesh, MeshError, Study, read_mesh, write_mesh
from fecontact.study.imported import imported

NODES = [(0.1 * i, 0.05 * j, 0.0) for j in range(2) for i in range(4)]
CELLS = [(i, i + 1, i + 5, i + 4) for i in (1, 2, 3)]
DENSITY = 7850.0


def study(path, scale=1.0):
    """Notes of the import, and the study that it writes."""
    found = imported(path, scale)
    return found.notes, Study.from_toml(found.toml(path.parent), path.with_suffix(".toml"))


def abaqus(path, kinds, thicknesses):
    """A strip of three elements, in mm, N and t, each with a section of its own."""
    text = "*NODE\n" + "".join(f"{k}, {1e3 * x}, {1e3 * y}\n"
                               for k, (x, y, _) in enumerate(NODES, 1))
    for k, (kind, cell) in enumerate(zip(kinds, CELLS, strict=True), 1):
        text += (f"*ELEMENT, TYPE={kind}, ELSET=E{k}\n{k}, {', '.join(map(str, cell))}\n")
    text += f"*MATERIAL, NAME=M\n*ELASTIC\n2.1e5, 0.3\n*DENSITY\n{1e-12 * DENSITY}\n"
    for k, size in enumerate(thicknesses, 1):
        text += f"*SOLID SECTION, ELSET=E{k}, MATERIAL=M\n{size}\n".replace("\n\n", "\n")
    path.write_text(text)
    return path


@pytest.mark.parametrize(("kinds", "thicknesses", "plane", "thickness"), [
    (["CPS4"] * 3, ["5."] * 3, "stress", 5e-3),
    (["CPS4R", "CPS4", "CPS4I"], ["", "", ""], "stress", 1e-3),
    (["CPE4"] * 3, ["20., "] * 3, "strain", 20e-3),
])
def test_decks_say_the_state_and_the_thickness(tmp_path, kinds, thicknesses, plane, thickness):
    notes, found = study(abaqus(tmp_path / "a.inp", kinds, thicknesses), 1e-3)
    body = found.elastic_body()
    assert (body.plane, body.thickness) == (plane, pytest.approx(thickness))
    mass = DENSITY * 0.3 * 0.05 * thickness
    assert body.total_mass == pytest.approx(mass, rel=1e-12)
    assert not any("plane" in note or "thickness" in note for note in notes)


def test_states_and_thicknesses_that_differ_are_named(tmp_path):
    notes, found = study(abaqus(tmp_path / "a.inp", ["CPE4", "CPS4", "CPS4"], ["5", "6", "5"]),
                         1e-3)
    assert (found.body.plane, found.body.thickness) == ("stress", pytest.approx(5e-3))
    assert any("plane stress for all" in note for note in notes)
    assert any("the thicknesses 5, 6" in note for note in notes)


def test_files_without_a_state_are_named(tmp_path):
    write_mesh(Mesh.grid([0.0, 0.1, 0.2, 0.3], [0.0, 0.05]), tmp_path / "a.msh")
    notes, found = study(tmp_path / "a.msh")
    assert found.body.plane == "strain"
    assert any("does not tell plane stress" in note for note in notes)


def test_shells_of_nastran_are_in_plane_stress(tmp_path):
    path = tmp_path / "a.bdf"
    path.write_text("BEGIN BULK\n" + "".join(
        f"GRID,{k},,{x},{y},0.\n" for k, (x, y, _) in enumerate(NODES, 1)) + "".join(
        f"CQUAD4,{k},1,{','.join(map(str, cell))}\n" for k, cell in enumerate(CELLS, 1))
        + "PSHELL,1,2,.007\nMAT1,2,2.1e11,,.3,7850.\nENDDATA\n")
    _, found = study(path)
    assert (found.body.plane, found.body.thickness) == ("stress", 0.007)


@pytest.mark.parametrize(("card", "plane"), [("CPLSTS4", "stress"), ("CPLSTN4", "strain")])
def test_plane_elements_of_nastran_have_their_state_and_thickness(tmp_path, card, plane):
    path = tmp_path / "a.bdf"
    path.write_text("BEGIN BULK\n" + "".join(
        f"GRID,{k},,{x},{y},0.\n" for k, (x, y, _) in enumerate(NODES, 1)) + "".join(
        f"{card},{k},1,{','.join(map(str, cell))}\n" for k, cell in enumerate(CELLS, 1))
        + "PPLANE,1,2,.003\nMAT1,2,2.1e11,,.3,7850.\nENDDATA\n")
    _, found = study(path)
    assert (found.body.plane, found.body.thickness) == (plane, 0.003)


@pytest.mark.parametrize(("kind", "option", "plane"), [
    (182, None, "stress"), (182, 0, "stress"), (183, 3, "stress"), (182, 2, "strain"),
    (42, 2, "strain")])
def test_plane_elements_of_ansys_say_it_by_an_option(tmp_path, kind, option, plane):
    pytest.importorskip("mapdl_archive")
    path = archive(tmp_path / "a.cdb", kind, NODES, CELLS)
    if option is not None:
        path.write_text(path.read_text().replace(
            "NBLOCK", f"KEYOP,        1, 3,        {option}\nNBLOCK", 1))
    notes, found = study(path)
    assert found.body.plane == plane
    assert any("no thickness" in note for note in notes)


@pytest.mark.parametrize("constants", [
    "R,       1,  5.0E-003    ,\n", "R,2,9.\nRLBLOCK,       2,       2,       1,       7\n"
    "(2i8,6g16.9)\n(7g16.9)\n       1       1 5.000000000E-03\n       2       1 8.00000000     \n"])
def test_real_constants_of_ansys_are_thicknesses(tmp_path, constants):
    """Of elements in plane stress with a thickness; others have none."""
    pytest.importorskip("mapdl_archive")
    path = archive(tmp_path / "a.cdb", 182, NODES, CELLS)
    path.write_text(path.read_text().replace("NBLOCK", f"{constants}KEYOP,1,3,3\nNBLOCK", 1))
    notes, found = study(path)
    assert (found.body.plane, found.body.thickness) == ("stress", 0.005)
    assert not any("thickness" in note for note in notes)
    path.write_text(path.read_text().replace("KEYOP,1,3,3", "KEYOP,1,3,0"))
    assert study(path)[1].body.thickness == 1.0


def test_axisymmetric_elements_of_ansys_are_refused(tmp_path):
    pytest.importorskip("mapdl_archive")
    path = archive(tmp_path / "a.cdb", 182, NODES, CELLS)
    path.write_text(path.read_text().replace("NBLOCK", "KEYOP,1,3,1\nNBLOCK", 1))
    with pytest.raises(MeshError, match="axisymmetric elements"):
        read_mesh(path)
