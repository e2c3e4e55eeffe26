"""Distributed loads of Abaqus and CalculiX decks, as studies of them have them.

Displacements are those of CalculiX 2.20 for the same decks (C3D8, *STATIC, *NODE PRINT), whose
bricks have the same stiffness as trilinear ones here.
"""

import numpy as np
import pytest
from solid_blocks import block_mesh

from fecontact import MeshError, Study, read_mesh, static_solution
from fecontact.study.imported import imported

PLACES = np.array([(0.2, 0.1, 0.05), (0.1, 0.1, 0.025)])


def deck(load, scale=1.0, kind="C3D8"):
    """A block of 4 x 3 x 2 bricks, held at the left; in m, N, kg or in mm, N, t."""
    mesh = block_mesh((4, 3, 2), (0.2, 0.1, 0.05))
    text = "*NODE\n" + "".join(f"{k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(
        (mesh.nodes / scale).tolist(), start=1))
    text += f"*ELEMENT, TYPE={kind}, ELSET=EALL\n" + "".join(
        f"{k}, {', '.join(map(str, row))}\n" for k, row in enumerate(
            (mesh.cells + 1).tolist(), start=1))
    for name, numbers in (
            ("NSET, NSET=HELD", np.flatnonzero(mesh.nodes[:, 0] < 1e-9) + 1),
            ("ELSET, ELSET=UP", np.flatnonzero(mesh.nodes[mesh.cells][:, :, 2].max(axis=1)
                                               > 0.049) + 1)):
        text += f"*{name}\n" + "".join(f"{number},\n" for number in numbers)
    constants = ("2.1e11, 0.3", "7850.") if scale == 1.0 else ("2.1e5, 0.3", "7.85e-9")
    return (f"{text}*SURFACE, NAME=ROOF\nUP, S2\n*MATERIAL, NAME=STEEL\n*ELASTIC\n{constants[0]}\n"
            f"*DENSITY\n{constants[1]}\n*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n"
            f"*BOUNDARY\nHELD, 1, 3\n*STEP\n*STATIC\n{load}*END STEP\n"
            "*STEP\n*DLOAD\nEALL, GRAV, 99., 0., 0., 1.\n*END STEP\n")


# Displacements at the places [m].
CALCULIX = {
    "SIDES": [
        (2.311965e-05, -8.341398e-06, -0.000131664),
        (1.622578e-06, -2.522538e-06, -4.758102e-05)],
    "ROOF": [
        (2.145387e-05, -4.676113e-08, -0.0001310384),
        (1.221193e-07, 7.233577e-08, -4.715075e-05)],
    "GRAVITY": [
        (4.512212e-08, -2.719108e-08, -2.151024e-07),
        (8.615404e-09, -1.175749e-08, -7.761388e-08)],
    "CENTRIF": [
        (1.782248e-06, 3.273016e-05, -6.56416e-05),
        (-7.685675e-06, 1.394769e-05, -2.382579e-05)],
    "MM": [
        (2.14944e-05, -4.707765e-08, -0.0001312893),
        (1.221193e-07, 7.233577e-08, -4.72413e-05)],
}
SIDES = ("*DLOAD\nUP, P2, 2e6\n1, P1, -3e6\n3, P1, -3e6\n24, P5, 1.5e6\n24, P4, 2e6\n1, P3, 2.5e5\n"
         "24, P5, 1e6\n")


def displacement(tmp_path, load, scale=1.0):
    """Displacements (2, 3) at the places of the deck's study, and the study."""
    (tmp_path / "a.inp").write_text(deck(load, scale))
    found = imported(tmp_path / "a.inp", scale)
    assert found.notes == ()
    text = found.toml(tmp_path)
    assert "left out" not in text
    study = Study.from_toml(text, tmp_path / "a.toml").with_(
        **{"body.degree": 1, "body.bricks": "full"})
    body = study.elastic_body()
    state = static_solution(body, study.load, rotation=study.body.rotation)
    at = [int(np.linalg.norm(body.nodes - place, axis=1).argmin()) for place in PLACES]
    return state.displacement[at], study


@pytest.mark.parametrize(("load", "scale", "expected"), [
    (SIDES, 1.0, "SIDES"),
    ("*DSLOAD\nroof, P, 2e6\n", 1.0, "ROOF"),
    ("*DLOAD\nEALL, GRAV, 9.81, 3., -2., -6.\n", 1.0, "GRAVITY"),
    ("*DLOAD\nEALL, CENTRIF, 1e4, 0.1, -0.5, 0., 0., 3., 4.\n", 1.0, "CENTRIF"),
    ("*DLOAD\nUP, P2, 2.\nEALL, GRAV, 9810., 0., 0., -1.\n", 1e-3, "MM"),
], ids=["sides", "surface", "gravity", "centrifugal", "mm"])
def test_displacements_are_those_of_calculix(load, scale, expected, tmp_path):
    found, _ = displacement(tmp_path, load, scale)
    assert found == pytest.approx(np.array(CALCULIX[expected]),
                                  abs=1e-6 * np.abs(CALCULIX[expected]).max())




def test_the_basis_of_the_study_has_the_loads(tmp_path):
    load = "*DLOAD\nUP, P2, 2e6\nEALL, GRAV, 9.81, 0., 0., -1.\n"
    _, study = displacement(tmp_path, load)
    assert study.basis.loads == ("DLOAD-1", "gravity")
    assert [(one.boundary, one.pressure) for one in study.load.boundaries] == [("DLOAD-1", 2e6)]
    assert study.load.gravity == pytest.approx((0.0, 0.0, -9.81))


def test_what_is_not_taken_is_named(tmp_path):
    """Loads of parts of the body, of inner sides, of other kinds and in time; of second steps."""
    (tmp_path / "a.inp").write_text(deck(
        "*DLOAD\nUP, GRAV, 9.81, 0., 0., -1.\n2, P1, 5.\nEALL, BX, 3.\n"
        "UP, CENTRIF, 4., 0., 0., 0., 0., 0., 1.\n"
        "*DLOAD, AMPLITUDE=A\nUP, P2, 1.\n*DSLOAD\nROOF, TRVEC, 1., 0., 0., 1.\n"))
    text = imported(tmp_path / "a.inp").toml(tmp_path)
    for wanted in ("Gravity on UP is left out: it must act on all cells.",
                   "The pressure on DLOAD-1 is left out: it is no boundary of the bodies.",
                   "Centrifugal force on UP is left out", "*DLOAD BX is left out",
                   "*DSLOAD TRVEC is left out", "*DLOAD with AMPLITUDE is left out"):
        assert wanted in text, wanted
    study = Study.from_toml(text, tmp_path / "a.toml")
    assert (study.load.gravity, study.load.boundaries, study.body.rotation) == (None, (), None)


@pytest.mark.parametrize(("load", "message"), [
    ("*DLOAD\nUP, P2\n", r"\*DLOAD has the line 'UP, P2' with too few values; P2 needs 1"),
    ("*DLOAD\nEALL, GRAV, 9.81\n", r"with too few values; GRAV needs 4"),
    ("*DSLOAD\nROOF, P\n", r"\*DSLOAD has the line 'ROOF, P' with too few values; P needs 1"),
    ("*DLOAD\nnone, P1, 2.\n", r"refers to a set 'none' that it does not hold"),
    ("*DLOAD\nUP, P1, x\n", r"\*DLOAD"),
])
def test_bad_loads(load, message, tmp_path):
    (tmp_path / "a.inp").write_text(deck(load))
    with pytest.raises(MeshError, match=message):
        read_mesh(tmp_path / "a.inp")
