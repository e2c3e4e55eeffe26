"""A box that slides along its walls: the full rate of every solid element; a plate of NAFEMS."""

import numpy as np
import pytest
import sliding_box
from sliding_box import WAVES


def test_frequencies_are_those_of_the_tables():
    assert [wave.frequency_hz for wave in WAVES.values()] == pytest.approx(
        [9637.815, 10001.633, 18711.342], abs=5e-4)


@pytest.mark.parametrize("name", WAVES)
def test_waves_fit_into_the_box(name):
    """Displacements along the normal are zero on walls; transverse waves are free of divergence."""
    wave = WAVES[name]
    rng = np.random.default_rng(1)
    places = rng.uniform(0.1, 0.9, (20, 3)) * sliding_box.SIDES
    assert wave.shapes(places).shape == (20, 3, 2 if name.endswith("(1, 1, 1)") else 1)
    for axis, side in enumerate(sliding_box.SIDES):
        for at in (0.0, side):
            on_wall = places.copy()
            on_wall[:, axis] = at
            assert np.abs(wave.shapes(on_wall)[:, axis]).max() < 1e-14 * np.abs(
                wave.shapes(places)).max()
    h = 1e-6
    divergence = sum(wave.shapes(places + h * e)[:, i] - wave.shapes(places - h * e)[:, i]
                     for i, e in enumerate(np.eye(3))) / (2.0 * h)
    size = np.linalg.norm(wave.wave_number) * np.abs(wave.shapes(places)).max()
    assert (np.abs(divergence).max() > 0.1 * size) == wave.longitudinal
    assert wave.longitudinal or np.abs(divergence).max() < 1e-8 * size


@pytest.mark.slow
@pytest.mark.parametrize(("element", "cells", "errors", "rates"), [
    ("P1", (4, 8), (6.926e-3, 7.109e-4, 2.209e-2), (1.96, 1.99, 1.94)),
    ("Q1", (4, 8), (2.571e-3, 7.141e-4, 8.681e-3), (2.01, 2.00, 2.02)),
    ("P2", (4, 6), (2.237e-5, 5.955e-7, 2.554e-4), (3.89, 3.90, 3.78)),
    ("Q2", (2, 4), (2.277e-5, 3.251e-6, 3.197e-4), (3.96, 3.98, 3.88))])
def test_every_element_reaches_its_full_rate(element, cells, errors, rates):
    """Errors fall like h^2 and h^4; all of them are above zero."""
    found = sliding_box.errors(element, cells)
    assert [found[name][-1] for name in WAVES] == pytest.approx(errors, rel=5e-3)
    order = 2.0 if element in ("P1", "Q1") else 4.0
    reached = [sliding_box.rate(cells, found[name]) for name in WAVES]
    assert reached == pytest.approx(rates, abs=0.02)
    assert reached == pytest.approx([order] * 3, rel=0.06)


def test_plate_between_walls_has_standing_lamb_waves():
    """In three dimensions they are exact; errors fall like h^4."""
    exact = np.array([sliding_box.lamb_hz(halves) for halves in sliding_box.BENDING])
    coarse, fine = (sliding_box.bending_hz(10.0 / n, n // 4, "walls") for n in (4, 8))
    assert fine / exact - 1.0 == pytest.approx([5.28e-4, 2.384e-3, 2.311e-3, 7.136e-3], rel=5e-3)
    # With twice as fine a mesh 3.92, 3.89, 3.90 and 3.87.
    assert np.log2((coarse - exact) / (fine - exact)) == pytest.approx(
        [3.84, 3.77, 3.78, 3.67], abs=0.02)


def test_published_plate_does_not_move_along_its_edges():
    """FV52 is Mindlin's plate of such edges; held along z alone, a plate is softer in twist."""
    found = [sliding_box.mindlin_hz(halves) for halves in sliding_box.BENDING[:3]]
    assert found == pytest.approx(np.array(sliding_box.PLATE_HZ)[[0, 1, 3]], rel=6e-5)
    on = {name: sliding_box.bending_hz(1.25, 2, name) for name in sliding_box.SUPPORTS}
    softer = 1.0 - on["sides"] / on["walls"]
    assert softer[:3] == pytest.approx([0.0361, 0.0211, 0.0306], abs=5e-4)
    line = 1.0 - on["lines"] / on["sides"]
    assert line[:3] == pytest.approx([0.0154, 0.0232, 0.0374], abs=5e-4)


def test_plate_on_line_supports_is_near_its_published_frequencies_on_coarse_meshes_only():
    """NAFEMS FV52 with 4 x 4 x 1 and 8 x 8 x 2 elements; the first frequency falls on and on."""
    coarse, fine = sliding_box.plate_hz(2.5, 1), sliding_box.plate_hz(1.25, 2)
    assert coarse == pytest.approx(sliding_box.PLATE_HZ, rel=0.03)
    assert fine == pytest.approx(sliding_box.PLATE_HZ, rel=0.06)
    assert coarse[0] - fine[0] == pytest.approx(1.018, abs=0.01)
    assert fine[0] - sliding_box.plate_hz(0.625, 3)[0] == pytest.approx(0.434, abs=0.01)
