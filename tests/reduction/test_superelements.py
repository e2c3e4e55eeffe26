"""Reduced models of other programs: DMIG of Nastran and substructures of Abaqus, as text."""

import numpy as np
import pytest

from fecontact import InputError, basis_from_matrices
from fecontact.io import read_matrix
from fecontact.reduction import rows_from_dofs

# A chain of three masses between walls: w^2 = (2 - sqrt(2), 2, 2 + sqrt(2)) k / m.
K, M = 1e4, 2.0
STIFFNESS = K * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
MASS = M * np.eye(3)
EXACT = np.sqrt(np.array([2.0 - np.sqrt(2.0), 2.0, 2.0 + np.sqrt(2.0)]) * K / M) / (2.0 * np.pi)
POINTS = ((101, 2), (7, 2), (30, 2))  # of the three masses, and their directions


def dmig(name, matrix, form=6, wide=True):
    """A punch file: large fields with D exponents, or small ones."""
    lines = [f"DMIG    {name:8}{0:8}{form:8}{2 if wide else 1:8}{0:8}{'':16}{3:8}"]
    for column, (point, way) in enumerate(POINTS):
        rows = [row for row in range(3) if matrix[row, column] and (form != 6 or row >= column)]
        if wide:
            lines.append(f"DMIG*   {name:16}{point:16}{way:16}{'':16}")
            for row in rows:
                value = f"{matrix[row, column]:.9E}".replace("E", "D")
                lines.append(f"*       {POINTS[row][0]:16}{POINTS[row][1]:16}{value:>16}")
        else:
            card = [f"DMIG    {name:8}{point:8}{way:8}{'':8}"]
            for k, row in enumerate(rows):
                entry = f"{POINTS[row][0]:8}{POINTS[row][1]:8}{matrix[row, column]:8.1f}{'':8}"
                if k % 2:
                    card.append(f"+       {entry}")
                else:
                    card[-1] += entry
            lines += card
    return "$ punched\n" + "\n".join(lines) + "\n"


def substructure(stiffness, mass, nodes=POINTS):
    """Nodes with one direction each; upper triangles by columns, four numbers a line."""

    def block(title, matrix):
        text = f"*MATRIX, TYPE={title}\n"
        for column in range(len(matrix)):
            values = [f"{value:.15E}" for value in matrix[: column + 1, column]]
            text += "".join(", ".join(values[k : k + 4]) + ",\n" for k in range(0, len(values), 4))
        return text

    names = ", ".join(str(node) for node, _ in nodes)
    return (f"** Substructure Z1\n*USER ELEMENT, NODES={len(nodes)}, LINEAR\n** ELEMENT NODES\n"
            f"** {names}\n {nodes[0][1]}\n{block('STIFFNESS', stiffness)}{block('MASS', mass)}")


def frequencies(stiffness, mass):
    """With the second mass of the chain as contact node, and the first as B."""
    first, second = stiffness.dof(101, 2), stiffness.dof(7, 2)
    rows = rows_from_dofs(3, [(None, second)], B=(None, first))
    basis = basis_from_matrices(mass, stiffness, rows)
    assert basis.contact_nodes == 1
    assert (np.abs(basis.T[:, 1]).max(axis=1) > 0.0).tolist() == [True, False, True]
    return basis.frequencies_hz


@pytest.mark.parametrize(("form", "wide"), [(6, True), (1, True), (6, False), (1, False)])
def test_a_chain_from_a_punch_file(tmp_path, form, wide):
    path = tmp_path / "chain.pch"
    path.write_text(dmig("KAAX", STIFFNESS, form, wide) + dmig("MAAX", MASS, form, wide))
    stiffness, mass = (read_matrix(path, name) for name in ("KAAX", "maax"))
    assert stiffness.labels.tolist() == [[7, 2], [30, 2], [101, 2]]
    order = [stiffness.dof(*point) for point in POINTS]
    assert stiffness.matrix.toarray()[np.ix_(order, order)] == pytest.approx(STIFFNESS)
    assert frequencies(stiffness, mass) == pytest.approx(EXACT, rel=1e-9)


def test_free_fields_and_exponents_without_a_letter(tmp_path):
    path = tmp_path / "one.dmig"
    path.write_text("DMIG,K,0,6,1,,,,2\nDMIG,K,5,1,,5,1,1.5+3,,\n+,6,0,-2.-1\nDMIG,K,6,0,,6,0,4.\n"
                    "ENDDATA\n")
    found = read_matrix(path)
    assert found.labels.tolist() == [[5, 1], [6, 0]]
    assert found.matrix.toarray() == pytest.approx(np.array([[1500.0, -0.2], [-0.2, 4.0]]))


def test_a_chain_from_a_substructure(tmp_path):
    path = tmp_path / "chain.mtx"
    path.write_text(substructure(STIFFNESS, MASS))
    stiffness, mass = (read_matrix(path, name) for name in ("STIFFNESS", "MASS"))
    assert stiffness.labels.tolist() == [list(point) for point in POINTS]
    assert stiffness.matrix == pytest.approx(STIFFNESS)
    assert frequencies(stiffness, mass) == pytest.approx(EXACT, rel=1e-12)


def test_degrees_of_freedom_that_change_and_generalised_coordinates(tmp_path):
    """Two directions at the first node, one at the others, of which node 0 are coordinates."""
    path = tmp_path / "a.mtx"
    text = substructure(np.diag([1.0, 2.0, 3.0, 4.0]), np.eye(4), ((8, 1), (9, 3), (0, 1)))
    path.write_text(text.replace("\n 1\n", "\n 1, 2\n 2, 3\n 3, 1\n"))
    found = read_matrix(path, "stiffness")
    assert found.labels.tolist() == [[8, 1], [8, 2], [9, 3], [0, 1]]
    assert np.diag(found.matrix) == pytest.approx([1.0, 2.0, 3.0, 4.0])
    assert found.dof(9, 3) == 2


BOTH = dmig("KAAX", STIFFNESS) + dmig("MAAX", MASS)
PART = substructure(STIFFNESS, MASS)


@pytest.mark.parametrize(("name", "text", "message"), [
    ("a.pch", "GRID,1\n", r"The file holds no DMIG; write the matrices with EXTSEOUT"),
    ("a.pch", BOTH, r"Say which matrix to read by its name; the file holds: 'KAAX', 'MAAX'\.$"),
    ("a.pch", dmig("K", STIFFNESS, 9), r"'K' is of the form '9'; real square \(1\) and symmetric"),
    ("a.pch", dmig("K", STIFFNESS).replace("       6       2", "       6       4"), r"is complex"),
    ("a.pch", dmig("K", STIFFNESS).replace("2.000000000D+04", "2.0000000X0D+04", 1),
     r"Card of line 3: '2\.0000000X0D\+04' is not a number\."),
    ("a.pch", "DMIG,K,0,6,1,,,,2\nDMIG,K,x,1,,5,1,1.\n", r"Card of line 2: 'x' is no number of"),
    ("a.pch", "DMIG,K,0,6,1,,,,2\n", r"The matrix 'K' has no columns"),
    ("a.pch", "DMIG,K,0,1,1,,,,2\nDMIG,K,5,1,,5,1,1.,,\n+,5,1,2.\n", r"gives an entry a second"),
    ("a.mtx", PART, r"Say which matrix to read by its name; the file holds: 'MASS', 'STIFFNESS'"),
    ("a.mtx", PART.partition("*MATRIX")[0], r"The file of a substructure holds no \*MATRIX; add"),
    ("a.mtx", PART.replace("** ELEMENT NODES\n", ""), r"does not name its nodes \(\*\* ELEMENT "),
])
def test_bad_files(tmp_path, name, text, message):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_matrix(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(("name", "text", "wanted", "message"), [
    ("a.pch", BOTH, "KAAY", r"There is no matrix 'KAAY' \(did you mean 'KAAX'\?\); the"),
    ("a.mtx", PART, "MASSE", r"There is no matrix 'MASSE' \(did you mean 'MASS'\?\)"),
    ("a.mtx", PART[:-30], "MASS", r"must have 6 numbers, its upper triangle, not \d; the file "),
    ("a.mtx", PART.replace("E+00", "F+00"), "MASS", r"holds something else than numbers: could n"),
])
def test_bad_matrices_by_name(tmp_path, name, text, wanted, message):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_matrix(path, wanted)
    assert "\n" not in str(caught.value)
