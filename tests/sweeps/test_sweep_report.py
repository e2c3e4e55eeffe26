"""The page of a sweep: all cases with what is known of them."""

import numpy as np
import pytest
from report_reading import Shown

from fecontact import InputError
from fecontact.cli import execute
from fecontact.io import report_sweep
from fecontact.sweeps import SweepTable

EVIL = "</script><img src=x onerror=alert(1)>"


def a_table():
    speeds, laws = [1e-3, 1e-2, 1e-1], ["exponential", "constant"]
    pairs = [(speed, law) for speed in speeds for law in laws]
    return SweepTable(
        {"ground.speed": tuple(speed for speed, _ in pairs),
         "friction.law": tuple(law for _, law in pairs)},
        {"amplitude_x": np.array([1e-5, 2e-5, 3e-5, np.nan, 5e-5, 6e-5]),
         "stick_fraction": np.linspace(0.0, 1.0, 6)},
        [f"k{number}" for number in range(6)], ["", "", "", EVIL, "", None],
        shape=(3, 2), warnings=["", "far", "", "", "", ""])


def test_cases_are_those_of_the_table(tmp_path):
    shown = Shown(report_sweep(a_table(), tmp_path / "sweep.html", title="speeds")).header
    speed, law, amplitude, stick = shown["columns"]
    assert speed["title"] == "log10 of ground speed [m/s]"
    np.testing.assert_allclose(speed["values"], [-3, -3, -2, -2, -1, -1], rtol=1e-12)
    assert law["values"] == [0, 1, 0, 1, 0, 1]
    assert "0 exponential, 1 constant" in shown["remarks"]
    assert amplitude["title"] == "amplitude x [µm]"
    np.testing.assert_allclose([amplitude["values"][k] for k in (0, 1, 2, 4)], [10, 20, 30, 50])
    assert amplitude["values"][3] is None
    np.testing.assert_allclose(stick["values"], np.linspace(0.0, 1.0, 6))
    assert (shown["cases"], shown["start"], shown["good"]) == (6, [0, 1, 2], False)
    cases = [dict(zip(shown["headings"], row, strict=True)) for row in shown["rows"]]
    assert cases[1]["warning"] == "far"
    assert cases[2] == {"case": "2", "ground.speed": "0.01", "friction.law": "exponential",
                        "amplitude_x": "30 µm", "stick_fraction": "0.4", "failed because": "",
                        "warning": "", "run it alone": ""}
    assert cases[3]["failed because"] == EVIL
    assert cases[5]["failed because"] == "not computed"


def test_texts_stay_texts_and_the_name_is_that_of_a_page(tmp_path):
    path = report_sweep(a_table(), tmp_path / "sweep.html", title=EVIL)
    assert "<img" not in path.read_text(encoding="utf-8")
    with pytest.raises(InputError, match=r"must end in \.html"):
        report_sweep(a_table(), tmp_path / "sweep.csv")


@pytest.mark.slow
def test_the_command_writes_it(tmp_path):
    study = tmp_path / "s.toml"
    study.write_text("""
geometry = { shape = "block", element_size = 0.03 }
body = { thickness = 0.1 }
basis = { modes = 4, contact_nodes = 3, damping = 0.01 }
normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
load = { normal = 14.0 }
simulation = { t_end = 0.01, outputs = 11 }
[sweep]
summaries = ["mean_normal_force"]
[sweep.axes]
ground.speed = [1e-3, 2e-3]
""")
    assert execute(["sweep", str(study), "--workers", "1"]) == 0
    shown = Shown(tmp_path / "results" / "s-sweep" / "index.html").header
    assert shown["cases"] == 2
    assert shown["columns"][1]["title"] == "mean normal force [N]"
    # The block rests on the ground under its load.
    np.testing.assert_allclose(shown["columns"][1]["values"], 14.0, rtol=0.05)
