"""``fecontact buckling``: load factors, picture, messages."""

import re

import numpy as np
import pytest

from fecontact import AnalysisError, Study
from fecontact.cli import execute

STRUT = """
geometry = { shape = "beam", length = 1.0, height = 0.02, element_size = 0.02 }
basis = { contact = [] }
[body]
thickness = 0.05
fixed = { left = "xy" }
[[load.boundaries]]
boundary = "right"
pressure = 1e6
"""


def test_buckling_of_a_strut(tmp_path, capsys):
    path = tmp_path / "strut.toml"
    path.write_text(STRUT)
    assert execute(["buckling", str(path), "--count", "2", "-o", str(tmp_path)]) == 0
    factor = float(re.search(r"0 +(\d+\.\d+)", capsys.readouterr().out)[1])
    assert abs(factor / (np.pi**2 * 2.1e11 * 0.02**2 / 48.0 / 1e6) - 1.0) < 2e-3
    assert (tmp_path / "strut-buckling.png").stat().st_size > 10_000


def test_a_strut_in_mm_is_warned_of(tmp_path, capsys):
    path = tmp_path / "strut.toml"
    path.write_text(STRUT.replace("length = 1.0, height = 0.02, element_size = 0.02",
                                  "length = 1000.0, height = 20.0, element_size = 20.0"))
    assert execute(["buckling", str(path), "--count", "1", "-o", str(tmp_path)]) == 0
    assert "warning: In this study the body has an extent of 1e+03 m" in capsys.readouterr().err


def test_loads_that_pull_and_bad_studies(tmp_path, capsys):
    path = tmp_path / "strut.toml"
    path.write_text(STRUT.replace("1e6", "-1e6"))
    assert execute(["buckling", str(path), "-o", str(tmp_path)]) == 0
    assert "do not make the body buckle" in capsys.readouterr().out
    assert not (tmp_path / "strut-buckling.png").exists()
    path.write_text(STRUT.replace('fixed = { left = "xy" }', ""))
    assert execute(["buckling", str(path), "-o", str(tmp_path)]) != 0
    assert "hold" in capsys.readouterr().err


def test_modes_about_the_load_of_a_study():
    """The square of the lowest frequency falls by the part of the buckling load."""
    study = Study.from_toml(STRUT.replace("basis = { contact = [] }", "basis = { contact = [], "
                                          "modes = 4, prestress = true }"))
    pressed = study.with_({"load.boundaries.0.pressure": 8e6})
    free = study.with_({"basis.prestress": False})
    first = [one.modal_basis().frequencies_hz[0] for one in (free, study, pressed)]
    euler = np.pi**2 * 2.1e11 * 0.02**2 / 48.0
    assert (first[1] / first[0]) ** 2 == pytest.approx(1.0 - 1e6 / euler, abs=5e-3)
    assert (first[2] / first[0]) ** 2 == pytest.approx(1.0 - 8e6 / euler, abs=3e-2)
    assert Study.from_toml(study.to_toml()) == study
    with pytest.raises(AnalysisError, match=r"\[basis\]: .*beyond the buckling load"):
        study.with_({"load.boundaries.0.pressure": 2e7}).modal_basis()
    with pytest.raises(AnalysisError, match=r"\[basis\]: prestress = true: There is no static"):
        study.with_({"body.fixed": {}}).modal_basis()
