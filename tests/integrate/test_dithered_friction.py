"""Mean friction under dither across and along the motion, beside closed forms."""

import dithered_friction as df
import numpy as np
import pytest
from scipy.integrate import quad


def test_closed_form_is_that_of_the_tables():
    assert df.closed_form([0.1, 1.0], "across") == pytest.approx([0.2344157, 0.8346268], abs=5e-8)
    for ratio in (0.03, 0.4, 3.0):
        mean = quad(lambda s, v=ratio: v / np.hypot(v, np.cos(s)), 0.0, 0.5 * np.pi)[0]
        assert df.closed_form(ratio, "across") == pytest.approx(2.0 / np.pi * mean, rel=1e-10)
    turned = np.sign(0.3 + np.sin(2.0 * np.pi * (np.arange(100_000) + 0.5) / 1e5)).mean()
    assert df.closed_form(0.3, "along") == pytest.approx(turned, abs=2e-5)


@pytest.mark.parametrize("ratio", [0.02, 0.1, 0.4, 1.0, 2.0])
def test_dither_across_turns_friction_away(ratio):
    """To 1e-5 with k_s = 1e6 s/m."""
    found = df.mean_friction(df.dithered(ratio, "across"))
    assert found == pytest.approx(float(df.closed_form(ratio, "across")), rel=1e-5)


@pytest.mark.parametrize(("ratio", "tolerance"), [(0.1, 5e-5), (0.5, 5e-5), (1.0, 1e-3),
                                                  (1.5, 1e-6)])
def test_dither_along_turns_friction_round(ratio, tolerance):
    """To the steps of the output, and the smoothing where it stops turning round."""
    found = df.mean_friction(df.dithered(ratio, "along"))
    assert found == pytest.approx(float(df.closed_form(ratio, "along")), abs=tolerance)


def test_error_of_smoothing_falls_with_its_slope():
    """The arctan lacks 2 / (pi k_s |v|) of the force: 2 / (pi k_s) times the mean of v / |v|^2."""
    exact = float(df.closed_form(0.1, "across"))
    errors = [df.mean_friction(df.dithered(0.1, "across", slope)) - exact for slope in (1e3, 1e4)]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.02)
    lacking = quad(lambda s: 0.1 / (0.01 + np.cos(s) ** 2), 0.0, np.pi)[0] / np.pi
    assert errors[1] == pytest.approx(-2.0 / (np.pi * 1e4) * lacking, rel=1e-3)
