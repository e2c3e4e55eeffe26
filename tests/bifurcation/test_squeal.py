"""The example of a beam that squeals: its border of flutter."""

import runpy

import numpy as np
import pytest
from scripts_for_tests import ROOT

from fecontact.bifurcation import contact_field, find_equilibrium


@pytest.mark.slow
def test_points_of_the_border_have_a_mode_without_damping(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = runpy.run_path(str(ROOT / "examples" / "squeal.py"))
    hopf, border = found["hopf"], found["border"]
    assert hopf.parameter == pytest.approx(0.3108, abs=1e-4)
    assert hopf.frequency_hz == pytest.approx(646.0, abs=0.1)
    for point in border.points[:: len(border) // 4]:
        system = found["system"].with_({name: point.values[name] for name in (
            "load.normal", "friction.friction_coefficient")})
        modes = find_equilibrium(contact_field(system, [])).modes
        worst = np.argmin(np.abs(modes.damping_ratios))
        assert modes.damping_ratios[worst] == pytest.approx(0.0, abs=1e-9)
        assert modes.frequencies_hz[worst] == pytest.approx(point.values["frequency_hz"], rel=1e-7)
    loads = border.column("load.normal")
    assert (loads.min(), loads.max()) == pytest.approx((2.0, 30.0), rel=1e-9)
