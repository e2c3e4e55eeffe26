"""Sweeps that keep states once per period: the published regimes, the numbers of ensembles."""

import numpy as np
import pytest
from sweep_study import Serial, files_below
from systems import impact_oscillator

from fecontact import InputError, RigidStart, Study, sweep
from fecontact.integrate import strobe
from fecontact.io import read_table
from fecontact.plot import plot_strobed
from fecontact.study.bodies_section import Reduced

STUDY = """
geometry = { shape = "pendulum" }
basis = { modes = 2, contact_nodes = 1 }
normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { law = "frictionless" }
body = { thickness = 1.0 }
simulation = { initial = { displacement = [0.0, 1e-4, 0.0] } }
[drive]
stiffness_y = 99.085
damping_y = 0.02046
amplitude_y = 0.47e-3
frequency_hz = 10.236846
[sweep]
strobe = { transient_periods = 120, keep = 48, component = "y" }
[sweep.axes]
drive.frequency_hz = [10.236846, 4.908338, 5.953986, 3.760831]
"""


@pytest.fixture
def study(tmp_path):
    """The impact oscillator of two modes, with a modal basis of numbers."""
    study = Study.from_toml(STUDY, tmp_path / "impact.toml")
    vars(study)["_reduced"] = Reduced(impact_oscillator().basis)
    return study


def test_published_regimes_and_the_numbers_of_ensembles(study, tmp_path):
    table = sweep(study, executor=Serial(), folder=tmp_path / "f")
    # one, two, higher periodic (four in the two-mode model), chaotic
    assert table.values["periods"].tolist() == [1.0, 2.0, 4.0, 0.0]
    different = [1 + int((np.diff(np.sort(row)) > 1e-7).sum()) for row in table.strobed]
    assert different[:3] == [1, 2, 4]
    assert different[3] > 40
    system = study.with_(**{"drive.frequency_hz": 4.908338}).system()
    start = RigidStart(displacement=(0.0, 1e-4, 0.0))
    alone = strobe(system, transient_periods=120, keep=48, initial=start)
    found = table.strobed[1]
    height = alone.states[0, :, :2] @ system.basis.T[0, 1]
    assert np.abs(height - found).max() < 1e-4 * np.ptp(found)
    again = read_table(tmp_path / "f/index.csv")
    assert (again.strobed == table.strobed).all()
    plot_strobed(table, "drive.frequency_hz", path=tmp_path / "s.png")
    assert (tmp_path / "s.png").stat().st_size > 5000
    one = sweep(study, {"drive.frequency_hz": [4.908338]}, Serial(), folder=tmp_path / "one")
    assert one.keys[0] == table.keys[1]
    assert (one.strobed[0] == table.strobed[1]).all()


def test_going_on_with_a_strobed_sweep(study, tmp_path):
    axes = {"drive.frequency_hz": [10.236846, 9.5, -1.0, 0.0]}
    table = sweep(study, axes, Serial(), folder=tmp_path / "f", batch=1,
                  strobe={"transient_periods": 2, "keep": 12, "component": "y"})
    assert list(table.failed) == [2, 3]
    assert "no time-dependent excitation" in table.failed[3]
    assert np.isnan(table.strobed[2:]).all()
    files = files_below(tmp_path / "f")
    next((tmp_path / "f/shards").iterdir()).unlink()
    sweep(study, axes, Serial(), folder=tmp_path / "f", batch=1, resume=True,
          strobe={"transient_periods": 2, "keep": 12, "component": "y"})
    assert files_below(tmp_path / "f") == files


def test_what_cannot_be_strobed(study, tmp_path):
    with pytest.raises(InputError, match="strobe keeps no histories"):
        sweep(study, summaries=["stick_fraction"], executor=Serial(), folder=tmp_path / "f")
    with pytest.raises(InputError, match="keep = 0 must be from 1 to"):
        sweep(study, strobe={"keep": 0}, executor=Serial(), folder=tmp_path / "f")
    few = sweep(study, {"drive.frequency_hz": [9.5]}, Serial(), folder=tmp_path / "f",
                strobe={"transient_periods": 0, "keep": 3, "component": "y"})
    assert np.isnan(few.values["periods"]).all()
    assert few.strobed[0, 0] == pytest.approx(1e-4, rel=1e-12)  # the start itself
    assert not few.failed
