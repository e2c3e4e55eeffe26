"""Modes and responses of a test beside those of a model."""

import numpy as np
import pytest

import fecontact as fc
from fecontact.analysis import receptance
from fecontact.io import read_uff
from fecontact.measured import (
    modal_assurance,
    pair_modes,
    response_assurance,
    scale_question,
)
from fecontact.plot import plot_modal_assurance


def test_assurance_of_known_shapes():
    x = np.array([[1.0, 1.0], [1.0, -1.0], [0.0, 0.0]])
    y = np.array([[1.0, 0.0, 1e200], [0.0, 0.0, 1e200], [0.0, 1.0, 0.0]])
    assert modal_assurance(x, y) == pytest.approx(np.array([[0.5, 0.0, 1.0], [0.5, 0.0, 0.0]]))
    # A complex factor does not matter, a phase within the shape does.
    assert modal_assurance(x[:, 0], (0.3 - 2.0j) * x[:, 0]) == pytest.approx(np.ones((1, 1)))
    assert modal_assurance([1.0, 1.0], [1.0, 1.0j]) == pytest.approx(np.full((1, 1), 0.5))


def beam(length):
    mesh = fc.generate(fc.Beam(length=length, height=0.02, element_size=0.01))
    return fc.ElasticBody(mesh, fc.Material(), 0.02, fixed={"left": "xy"})


def test_modes_of_a_test_are_paired_with_those_of_a_model():
    """Modes of a clamped beam at eight points, noisy, turned around and in another order."""
    places = [(0.4 * k / 8.0, 0.0) for k in range(1, 9)]
    points = {f"p{k}": place for k, place in enumerate(places)}
    basis = fc.modal_basis(beam(0.4), modes=5, points=points)
    shapes = np.array([basis.point_row(f"p{k}", "y") for k in range(8)])
    order = np.array([2, 0, 3, 1])
    rng = np.random.default_rng(2)
    test = -3.0 * shapes[:, order]
    test = test + 0.05 * np.abs(test).max(axis=0) * rng.standard_normal(test.shape)
    hertz = 1.02 * basis.frequencies_hz[order]
    found = pair_modes(test, shapes, hertz, basis.frequencies_hz)
    assert found.tested.tolist() == [0, 1, 2, 3]
    assert found.computed.tolist() == order.tolist()
    assert found.errors == pytest.approx(np.full(4, 1.0 / 1.02 - 1.0))
    assert (found.assurance[found.tested, found.computed] > 0.95).all()
    assert found.rows()[1][:2] == ("2", "1")
    assert found.rows()[1][4] == "-1.96 %"
    figure = plot_modal_assurance(found)
    assert figure.axes[0].get_ylabel() == "test [Hz]"
    assert len(figure.axes[0].lines) == 4
    # Noise alone is no pair.
    noise = pair_modes(rng.standard_normal((8, 1)), shapes[:, :1], [1.0], [1.0], least=0.99)
    assert len(noise) == 0
    assert "0 of 1" in repr(noise)


def test_shapes_of_a_universal_file_agree_with_the_body_they_come_from():
    from pathlib import Path

    modes = read_uff(Path(__file__).parents[1] / "data" / "block.uff")
    shapes = modes.shapes.reshape(-1, len(modes.frequencies_hz))
    table = modal_assurance(shapes, shapes)
    assert np.diag(table) == pytest.approx(np.ones(len(table)))


def test_responses():
    basis = fc.modal_basis(beam(0.3), modes=4, B=(0.3, 0.0), damping=0.01)
    hertz = np.linspace(50.0, 2000.0, 400)
    H = receptance(basis, hertz, [("B", "y")]).values[:, 0, 0]
    assert response_assurance(H, (2.0 + 1.0j) * H) == pytest.approx([1.0])
    # Resonances that are shifted beyond their width have nothing in common but the rest.
    other = receptance(basis, 1.1 * hertz, [("B", "y")]).values[:, 0, 0]
    assert response_assurance(H, other)[0] < 0.2
    assert scale_question(H, 1.3 * H) == ""
    assert "'tip' are 1.1e+03 times those of the model" in scale_question(1100.0 * H, H, ["tip"])
    assert "1e-06 times the SI unit" in scale_question(1e-6 * H, H)


@pytest.mark.parametrize(("call", "told"), [
    (lambda x: modal_assurance(x, x[:2]), "at the same places and directions"),
    (lambda x: modal_assurance(x, 0.0 * x), "shape 0 of second is zero"),
    (lambda x: modal_assurance(x, np.nan * x), "must be finite shapes"),
    (lambda x: modal_assurance("a", x), "must be real numbers"),
    (lambda x: pair_modes(x, x, [1.0], [1.0, 2.0]), "give one for each"),
    (lambda x: pair_modes(x, x, [1.0, 2.0], [1.0, 2.0], least=2.0), "must be from 0 to 1"),
    (lambda x: response_assurance(x, x[:2]), "at the same frequencies"),
    (lambda x: response_assurance(x, 0.0 * x), "must be finite and not zero"),
    (lambda x: response_assurance("a", x), "must be real numbers"),
])
def test_wrong_input_is_told_in_one_sentence(call, told):
    with pytest.raises(fc.InputError, match=told):
        call(np.eye(3)[:, :2] + 0.1)
