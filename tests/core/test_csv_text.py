"""CSV cells that a spreadsheet would compute are marked as text, and read back as they were."""

import csv
import io
import math
from types import SimpleNamespace

import numpy as np
import pytest

from fecontact.core.files.csv_text import csv_text, read_cell, safe_cell
from fecontact.sweeps.table import SweepTable, read_table

FORMULAS = ["=1+1", '=HYPERLINK("http://x")', "+cmd", "-2+3", "@SUM(A1)", "\t=1", "'=1", "''@x"]
CONTROLS = ["pad\x1b[2J\x07", "\x9b2J", r"C:\x1bfolder", r"\x5cx1b", "=\x001", "\x1b=1"]
TEXTS = ["", "x", "a=b", "'quoted'", "a,b", 'say "no"', "a\nb", "a\r\n=b", '"\n"', "-1.5", "-inf",
         "+3", "1e-3"]


@pytest.mark.parametrize("text", [*FORMULAS, *CONTROLS, *TEXTS])
def test_cells_read_back_and_none_is_a_formula(text):
    (cell, *rest), = csv.reader(io.StringIO(csv_text([[text, 1]]), newline=""))
    assert rest == ["1"]
    assert read_cell(cell) == text
    try:
        float(cell)
    except ValueError:
        assert not cell.startswith(("=", "+", "-", "@", "\t", "\r"))
    assert "\x1b" not in cell
    assert "\x9b" not in cell


def test_numbers_stay_numbers():
    assert [safe_cell(value) for value in (-1.5, -3, "-1.5", "", "nan")] == [
        -1.5, -3, "-1.5", "", "nan"]


def test_sweep_table_with_formulas_reads_back(tmp_path):
    formulas = ("=cmd|' /C calc'!A0", "@now", "-2+3")
    table = SweepTable(
        {"normal.law": ("=x", "@y", "-z")}, {"=own.py:f": np.array([1.0, -2.0, 3.0])},
        ("k0", "k1", "k2"), formulas, folder=tmp_path, warnings=formulas[::-1])
    file = table.write(tmp_path / "index.csv")
    with file.open(newline="") as lines:
        for row in csv.reader(lines):
            for cell in row:
                assert not cell.startswith(("=", "@", "-z", "-2+")), cell
    again = read_table(file)
    assert again.parameters["normal.law"] == table.parameters["normal.law"]
    assert list(again.values) == ["=own.py:f"]
    assert list(again.values["=own.py:f"]) == [1.0, -2.0, 3.0]
    assert tuple(again.reasons) == formulas
    assert tuple(again.warnings) == formulas[::-1]


def test_names_of_branches_are_no_formulas():
    from fecontact.bifurcation.continuation.point import BranchPoint
    from fecontact.cli.branch_results import branches_csv

    values = dict.fromkeys(("stable", "unstable", "observed_minimum", "observed_maximum",
                            "observed_amplitude"), 0.0)
    point = BranchPoint(np.array([0.0, 1.0]), np.zeros(2), values)
    text = branches_csv({"=1+1": SimpleNamespace(points=[point])})
    assert text.splitlines()[1].startswith("'=1+1,")
    assert math.isfinite(float(text.splitlines()[1].split(",")[2]))
