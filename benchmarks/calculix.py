"""Decks of our own, read by this package and solved by CalculiX: displacements and frequencies.

Each deck is solved twice by ``ccx`` (Debian: calculix-ccx) in a temporary folder, a static step and
frequencies; ``read_mesh`` reads it too. Elements have the points of quadrature of the deck, C3D8R
the hourglass stiffness of CalculiX. Frequencies are compared with the exact mass of bodies, and
with the mass at the points of the stiffness, of tetrahedra at four points, as CalculiX has it; it
gives bricks C3D8I another mass.

Public decks, which are no part of this package, follow if their files are given: the blade of
NASA's rotor 37 (one part of fifteen-node wedges, free, beside CalculiX), and the Brake-Reuss beam,
whose parts CalculiX does not read (beside the frequencies that its author gives).

Usage: python benchmarks/calculix.py [--quick] [DECK ...]
"""

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh
from usage import explain

import fecontact as fc
from fecontact.fem import SolidBlock
from fecontact.fem.assembly import assembled
from fecontact.fem.elements.cell_kinds import TETRAHEDRON
from fecontact.fem.elements.quadrature import rule
from fecontact.reduction import eigenfrequencies_hz

# Nodes of the sides S1, S2, ... of tetrahedra, wedges and hexahedra, and their edges with middles.
SIDES = {4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
         6: ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
         8: ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (1, 2, 5, 6), (2, 3, 6, 7), (0, 3, 4, 7))}
EDGES = {4: ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
         6: ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
         8: ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6),
             (3, 7))}
# Corners of elements, and whether their edges have middles.
ELEMENTS_OF = {"C3D10": (4, True), "C3D8": (8, False), "C3D8I": (8, False), "C3D8R": (8, False),
               "C3D20": (8, True), "C3D20R": (8, True), "C3D6": (6, False), "C3D15": (6, True)}
HOURGLASS = 0.001 * 1.3  # of CalculiX, over the shear modulus
# Set of all elements of the blade, and frequencies that the author of the beam's deck gives [Hz].
ELEMENTS, BEAM = "Eall", (70.323, 151.26, 609.25)
MATERIAL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n"
HUB = "*NODE, NSET=HUB\n90001, 0.15, 0.03, 0.01\n*NODE, NSET=TURN\n90002, 0.15, 0.03, 0.01\n"
RIGID = f"{HUB}*RIGID BODY, NSET=A_right_N, REF NODE=90001, ROT NODE=90002\n"


@dataclass(frozen=True)
class Case:
    """A deck, its forces and moments at the node set whose displacement is compared.

    ``force`` are pairs of the node's component and the value; those of rotations act on TURN.
    """

    name: str
    deck: str
    point: str
    force: tuple[tuple[str, float], ...]
    degree: int = 2


def part(name: str, at: float, size: float, element: str, first: int) -> str:
    """A block of 0.1 x 0.04 x 0.03 m from x = ``at`` on, with its sides as surfaces and sets."""
    corners, second_order = ELEMENTS_OF[element]
    mesh = fc.generate(SolidBlock(0.1, 0.04, 0.03, element_size=size, element=(
        "tetrahedron" if corners == 4 else "hexahedron"))).placed((at, 0.0, 0.0))
    cells, places = mesh.cells, mesh.nodes
    if corners == 6:
        cells = np.concatenate([cells[:, [0, 1, 2, 4, 5, 6]], cells[:, [0, 2, 3, 4, 6, 7]]])
    sides = cells
    if second_order:
        ends = np.sort(cells[:, np.array(EDGES[corners])], axis=2)
        pairs, number = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
        cells = np.concatenate([cells, len(places) + number.reshape(len(cells), -1)], axis=1)
        places = np.concatenate([places, places[pairs].mean(axis=1)])
    text = f"*NODE, NSET={name}\n" + "".join(
        f"{first + k}, {', '.join(map(repr, place))}\n" for k, place in enumerate(places.tolist()))
    # Data of an element have at most 16 numbers a line.
    text += f"*ELEMENT, TYPE={element}, ELSET=E{name}\n" + "".join(
        f"{first + k}, {', '.join(map(str, row[:15]))}" + (
            f",\n{', '.join(map(str, row[15:]))}\n" if row[15:] else "\n")
        for k, row in enumerate((cells + first).tolist()))
    for boundary, end in (("left", at), ("right", at + 0.1)):
        wanted = {frozenset(facet) for facet in mesh.boundaries[boundary].tolist()}
        text += f"*SURFACE, NAME={name}_{boundary}\n" + "".join(
            f"{first + k}, S{side}\n" for k, row in enumerate(sides)
            for side, of in enumerate(SIDES[corners], start=1)
            if frozenset(row[list(of)].tolist()) in wanted)
        nodes = first + np.flatnonzero(np.abs(places[:, 0] - end) < 1e-9)
        text += f"*NSET, NSET={name}_{boundary}_N\n" + "".join(f"{node},\n" for node in nodes)
    tip = first + int(np.linalg.norm(places - [at + 0.1, 0.04, 0.03], axis=1).argmin())
    return (f"{text}*NSET, NSET={name}_tip\n{tip},\n*SOLID SECTION, ELSET=E{name}, "
            "MATERIAL=STEEL\n")


def cases(size: float) -> Iterator[Case]:
    """Decks of blocks with cells of a size [m]."""
    force = (("x", 300.0), ("y", 100.0), ("z", -200.0))
    for element in ELEMENTS_OF:
        yield Case(f"block of {element}", part("A", 0.0, size, element, 1), "A_tip", force,
                   1 if element.startswith(("C3D6", "C3D8")) else 2)
    one = part("A", 0.0, size, "C3D10", 1)
    pair = one + part("B", 0.1, 0.8 * size, "C3D10", 30001)
    yield Case("tied blocks", f"{pair}*TIE, NAME=T, POSITION TOLERANCE=1e-4\nB_left, A_right\n",
               "B_tip", force)
    turned = (*force, ("phi_x", 4.0), ("phi_y", -3.0), ("phi_z", 2.0))
    yield Case("rigid end, moments", one + RIGID, "HUB", turned)
    yield Case("mass at the end", f"{one}{RIGID}*ELEMENT, TYPE=MASS, ELSET=M\n99001, 90001\n"
               "*MASS, ELSET=M\n2.5\n", "HUB", turned)
    yield Case("spring at the end", f"{one}{RIGID}*ELEMENT, TYPE=SPRING1, ELSET=S\n99002, 90001\n"
               "*SPRING, ELSET=S\n2\n3.e6\n", "HUB", turned)


def calculix(folder: Path, text: str) -> str:
    """Results of ccx in its .dat file; RuntimeError if it finds none."""
    (folder / "deck.inp").write_text(text)
    done = subprocess.run(["ccx", "-i", "deck"], cwd=folder, capture_output=True, text=True,
                          check=False)
    found = (folder / "deck.dat").read_text() if (folder / "deck.dat").is_file() else ""
    if "ERROR" in done.stdout or not found.strip():
        raise RuntimeError(f"ccx does not solve the deck: {done.stdout[-500:]}")
    return found


def frequencies_with_its_mass(body: fc.ElasticBody, count: int) -> np.ndarray:
    """The lowest frequencies (count,) [Hz] with mass at the points of CalculiX.

    Mass at the points of reduced rules is singular.
    """
    blocks = [replace(block, mass_rule=(rule(3, 4, 2) if block.kind == TETRAHEDRON else (
        block.local, block.weights))) for block in body.blocks]
    _, lateral, shear = body.elasticity.T
    M = sp.kron(assembled(blocks, lateral, shear, body.densities)[1], sp.eye_array(3))
    M = sp.csc_array(M + body.mass - sp.kron(body.component_mass, sp.eye_array(3)))
    E = body.expansion
    squares = eigsh((E.T @ body.stiffness @ E).tocsc(), count, M=(E.T @ M @ E).tocsc(),
                    sigma=-1e6, return_eigenvectors=False)
    return np.sqrt(np.maximum(np.sort(squares), 0.0)) / (2.0 * np.pi)


def compared(case: Case, folder: Path) -> tuple[float, float, float]:
    """Largest relative differences of displacement and of three frequencies, with either mass."""
    whole = f"{case.deck}{MATERIAL}*BOUNDARY\nA_left_N, 1, 3\n*STEP\n"
    loads = "".join(
        f"{'TURN' if len(way) > 1 else case.point}, {'xyz'.index(way[-1]) + 1}, {value}\n"
        for way, value in case.force)
    sets = [case.point, *(["TURN"] if len(case.force) > 3 else [])]
    printed = "".join(f"*NODE PRINT, NSET={name}\nU\n" for name in sets)
    rows = re.findall(r"^ +\d+((?: +\S+){3})$", calculix(
        folder, f"{whole}*STATIC\n*CLOAD\n{loads}{printed}*END STEP\n"), re.MULTILINE)
    expected = np.array([float(word) for row in rows for word in row.split()])
    modes = re.findall(r"^ +\d+((?: +\S+){4})$", calculix(
        folder, f"{whole}*FREQUENCY\n3\n*END STEP\n"), re.MULTILINE)
    frequencies = np.array([float(row.split()[2]) for row in modes[:3]])
    (folder / "deck.inp").write_text(case.deck + MATERIAL)
    body = fc.ElasticBody(fc.read_mesh(folder / "deck.inp"), degree=case.degree,
                          fixed={"A_left_N": "xyz"}, hourglass=HOURGLASS)
    moved = fc.static_solution(body, fc.Load(forces=tuple(
        fc.PointLoad(case.point, way, signal=value) for way, value in case.force)))
    own = (body.motion_rows(case.point) @ moved.displacement.ravel())[: len(expected)]
    return (float(np.abs(own / expected - 1.0).max()),
            *(float(np.abs(found / frequencies - 1.0).max()) for found in (
                eigenfrequencies_hz(body, 3), frequencies_with_its_mass(body, 3))))


def of_blade(deck: Path, folder: Path) -> list[float]:
    """Largest relative differences of six elastic frequencies of a free deck in mm."""
    titanium = (f"*MATERIAL, NAME=TITANIUM\n*ELASTIC\n115000., 0.3\n*DENSITY\n4.43e-9\n"
                f"*SOLID SECTION, ELSET={ELEMENTS}, MATERIAL=TITANIUM\n")
    modes = re.findall(r"^ +\d+((?: +\S+){4})$", calculix(
        folder, f"{deck.read_text()}\n{titanium}*STEP\n*FREQUENCY\n12\n*END STEP\n"), re.MULTILINE)
    expected = np.array([float(row.split()[2]) for row in modes[6:12]])
    body = fc.ElasticBody(fc.read_mesh(deck, scale=1e-3), fc.Material(115e9, 0.3, 4430.0))
    return [float(np.abs(found[6:] / expected - 1.0).max()) for found in (
        eigenfrequencies_hz(body, 12), frequencies_with_its_mass(body, 12))]


def of_beam(deck: Path) -> list[float]:
    """Largest relative difference of three elastic frequencies of the Brake-Reuss beam."""
    body = fc.ElasticBody(fc.read_mesh(deck), degree=1)
    return [float(np.abs(eigenfrequencies_hz(body, 10)[7:] / BEAM - 1.0).max())]


def main(quick: bool, public: list[Path]) -> None:
    """Prints a table."""
    if shutil.which("ccx") is None:
        print("CalculiX is not installed: there is no program ccx to compare with.")
        return
    print(f"{'deck':24} {'displacement':>12} {'frequencies':>12} {'its mass':>12}")
    with tempfile.TemporaryDirectory() as folder:
        for case in cases(0.02 if quick else 0.01):
            print(f"{case.name:24}", *(f"{found:12.1e}" for found in compared(case, Path(folder))),
                  flush=True)
        for deck in public:
            blade = "*SYSTEM" not in deck.read_text().upper()
            off = of_blade(deck, Path(folder)) if blade else of_beam(deck)
            print(f"{deck.stem:24} {'':12}", *(f"{found:12.1e}" for found in off),
                  "" if blade else "(published)", flush=True)


if __name__ == "__main__":
    explain(__doc__)
    main("--quick" in sys.argv, [Path(word) for word in sys.argv[1:] if word != "--quick"])
