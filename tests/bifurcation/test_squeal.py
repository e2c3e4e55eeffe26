"""The example of a beam that squeals: border of flutter, pictures."""


import numpy as np
import pytest
import squeal

from fecontact.bifurcation import contact_field, find_equilibrium


def test_border_of_flutter(tmp_path, capsys):
    branch, border = squeal.main(tmp_path)
    hopf, = branch.of_kind("Hopf")
    assert hopf.parameter == pytest.approx(0.3108, abs=1e-4)
    assert hopf.frequency_hz == pytest.approx(646.0, abs=0.1)
    for name in ("squeal_modes.png", "squeal_map.png"):
        assert (tmp_path / name).stat().st_size > 10_000
    assert "flutter from a friction coefficient of" in capsys.readouterr().out
    # Points of the border, in systems made anew, have a mode without damping.
    for point in border.points[:: len(border) // 4]:
        load, friction = point.values["load.normal"], point.values[squeal.FRICTION]
        found = find_equilibrium(contact_field(squeal.system(friction, load), []))
        worst = np.argmin(np.abs(found.modes.damping_ratios))
        assert found.modes.damping_ratios[worst] == pytest.approx(0.0, abs=1e-9)
        assert found.modes.frequencies_hz[worst] == pytest.approx(point.values["frequency_hz"],
                                                                  rel=1e-7)
    loads = border.column("load.normal")
    assert (loads.min(), loads.max()) == pytest.approx((2.0, 30.0), rel=1e-9)
