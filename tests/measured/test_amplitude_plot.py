"""Pictures of frequency and damping over amplitude."""

import numpy as np
import pytest

import fecontact as fc
from fecontact.measured import AmplitudeCurve
from fecontact.plot import plot_amplitude_curve


def curve(**changes):
    given = {"amplitude": [2e-4, 1e-3, 4e-3], "frequency_hz": [40.0, 39.5, 38.0],
             "damping_ratio": [0.01, 0.012, 0.02], **changes}
    return AmplitudeCurve(**given)


def test_ticks_of_a_logarithmic_axis_are_in_the_unit_of_its_label():
    bars = curve(frequency_deviation_hz=[0.1, 0.1, 0.2], damping_deviation=[1e-3] * 3,
                 observed="B x")
    figure = plot_amplitude_curve([bars, curve()], names=["test", "model"])
    upper, lower = figure.axes
    figure.canvas.draw()
    assert lower.get_xlabel() == "amplitude of B x [mm]"
    ticks = {float(text.get_text()): text.get_position()[0]
             for text in lower.get_xticklabels(which="both") if text.get_text()}
    assert {0.2, 0.5, 1.0, 2.0} <= set(ticks)
    assert all(place == pytest.approx(1e-3 * shown) for shown, place in ticks.items())
    assert [text.get_text() for text in upper.get_legend().get_texts()] == ["test", "model"]
    low, high = (segment[:, 1] for segment in np.array(
        upper.containers[0][2][0].get_segments())[2][None].repeat(2, 0))
    assert high.max() - low.min() == pytest.approx(2.0 * 1.96 * 0.2)


@pytest.mark.parametrize(("call", "told"), [
    (lambda: plot_amplitude_curve([]), "there are no curves"),
    (lambda: plot_amplitude_curve([curve(), curve(unit="rad")]), "give curves in one unit"),
    (lambda: plot_amplitude_curve(curve(), names=["a", "b"]), "give one for each"),
])
def test_wrong_curves(call, told):
    with pytest.raises(fc.InputError, match=told):
        call()
