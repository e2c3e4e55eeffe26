"""Nonlinear modes of reduced bodies against those of whole bodies, by harmonic balance of both."""

import numpy as np
import pytest
from whole_body_modes import WholeBody

from fecontact import (
    ContactSystem,
    ElasticBody,
    Material,
    Mesh,
    ModelWarning,
    modal_basis,
)
from fecontact.bifurcation import HarmonicBalance, nonlinear_mode
from fecontact.fem.points import place_rows
from fecontact.reduction import LargeDeflections, eigenfrequencies_hz

STEEL = Material(2e11, 0.3, 7800.0)


def frame(upright, thin):
    """A beam of 400 x 4 mm, clamped at the left, with an upright leg at its end.

    Height and thickness of the leg are parts of those of the beam.
    """
    length, h, n = 0.4, 0.004, 8
    x = np.append(np.linspace(0.0, length, n + 1), length + thin * h)
    y = np.append([0.0], h + np.linspace(0.0, upright * length, round(n * upright) + 1))
    grid = Mesh.grid(x, y)
    centre = grid.nodes[grid.cells].mean(axis=1)
    cells = grid.cells[(centre[:, 0] > length) | (centre[:, 1] < h)]
    used = np.unique(cells)
    number = np.full(len(grid.nodes), -1)
    number[used] = np.arange(len(used))
    nodes = grid.nodes[used]
    left = grid.boundaries["left"]
    left = left[(grid.nodes[left, 1] < h + 1e-9).all(axis=1)]
    corner = int(np.argmin(np.linalg.norm(nodes - [x[-1], 0.0], axis=1)))
    mesh = Mesh(nodes, number[cells], {"left": number[left]}, {"corner": corner})
    return ElasticBody(mesh, STEEL, thickness=0.01, fixed={"left": "xy"})


def first_mode(body, place, axis, size, modes, fitted, harmonics=4):
    """The basis, its first nonlinear mode up to a size, and the whole body."""
    basis = modal_basis(body, 3, contact=(), points={"seen": place},
                        large_deflections=LargeDeflections(fitted, modes))
    mode = nonlinear_mode(ContactSystem(basis), (0.02 * size, 1.15 * size),
                          observe=("seen", "xyz"[axis]),
                          method=HarmonicBalance(harmonics, stability=None))
    row = place_rows(body, place, "seen").matrix[[axis]].T.toarray()
    return basis, mode, WholeBody(body, row)


@pytest.mark.long
def test_clamped_plate():
    """The backbone of a square plate: a per cent with one mode, 1e-4 with three, up to h.

    The frequency ratio at an amplitude of h is that of thin plates, 1.17 to 1.19 by theory.
    """
    a, h = 1.0, 0.016
    x = 0.5 * a * np.linspace(0.0, 1.0, 4) ** 1.8  # a quarter, finer at the clamped edges
    body = ElasticBody(Mesh.grid(x, x, [0.0, h]), STEEL, fixed={
        "left": "xyz", "front": "xyz", "right": "x", "back": "y"})
    for modes, error in ((1, 0.012), ((0, 1, 2), 5e-4)):
        basis, mode, whole = first_mode(body, (0.5 * a, 0.5 * a, 0.5 * h), 2, h, modes, 1.3 * h)
        exact, found = whole.frequency_near(basis, mode, h)
        assert exact / basis.frequencies_hz[0] == pytest.approx(1.17, abs=0.02)
        assert found == pytest.approx(exact, rel=error)


def test_frame_in_internal_resonance():
    """Frequencies 1:2.003. The second mode vibrates at its own frequency, as no static map could.

    With both modes among those with large deflections its amplitude and the frequency are those of
    the whole body. Left out, it is a linear coordinate that resonates too, right for small motions.
    A static map would have its amplitude 300 times too small.
    """
    body = frame(0.658, 0.5)
    low, high = eigenfrequencies_hz(body, 2)
    assert high / low == pytest.approx(2.003, abs=1e-3)
    size = 1.2e-3
    for modes, error in (((0, 1), 0.01), (1, 0.04)):
        if modes == 1:
            with pytest.warns(ModelWarning, match=r"mode 1, 23.83 Hz, .* with 2 x mode 0"):
                basis, mode, whole = first_mode(body, "corner", 1, size, modes, 6.6e-3)
        else:
            basis, mode, whole = first_mode(body, "corner", 1, size, modes, 6.6e-3)
        exact, found = whole.frequency_near(basis, mode, size)
        assert found - low == pytest.approx(exact - low, rel=error)
        inertia = whole.mass @ (body.expansion.T @ basis.mode_shapes.shapes.reshape(
            -1, basis.modes)[:, :2])
        first, second = np.abs(whole.harmonics[[1, 2]] @ inertia)[[0, 1], [0, 1]]
        assert second > 0.06 * first
        ratio = np.interp(size, np.abs(mode.harmonic()), np.abs(
            mode.coordinates(2)[:, 1] / mode.coordinates(1)[:, 0]))
        assert ratio == pytest.approx(second / first, rel=2.0 * error)


def parts(whole, basis, mode, size, number):
    """Coordinates of two modes in a harmonic, of the whole body and of the reduced one."""
    shapes = basis.mode_shapes.shapes.reshape(-1, basis.modes)[:, :2]
    inertia = whole.mass @ (whole.model.body.expansion.T @ shapes)
    found = [np.interp(size, np.abs(mode.harmonic()), along)
             for along in np.abs(mode.coordinates(number)[:, :2]).T]
    return np.abs(whole.harmonics[number] @ inertia), np.array(found)


def twins():
    """Clamped beams of 400 x 4 and 400 x 4.04 mm, joined near their left ends; 1:1.013."""
    x, y = np.linspace(0.0, 0.4, 17), np.array([0.0, 4.0, 10.0, 16.0, 20.04]) * 1e-3
    grid = Mesh.grid(x, y)
    centre = grid.nodes[grid.cells].mean(axis=1)
    beams = (centre[:, 1] < y[1]) | (centre[:, 1] > y[3])
    cells = grid.cells[beams | (np.abs(centre[:, 0] - 0.5 * (x[1] + x[2])) < 1e-9)]
    used = np.unique(cells)
    number = np.full(len(grid.nodes), -1)
    number[used] = np.arange(len(used))
    ends = {name: grid.boundaries[name][[0, 3]] for name in ("left", "right")}
    middle = int(np.argmin(np.linalg.norm(grid.nodes - [0.2, 0.0], axis=1)))
    mesh = Mesh(grid.nodes[used], number[cells], {name: number[one] for name, one in ends.items()},
                {"middle": int(number[middle])})
    return ElasticBody(mesh, STEEL, thickness=0.01, fixed={"left": "xy", "right": "xy"})


def test_two_beams_of_nearly_one_frequency():
    """1:1: with the amplitude the vibration retires to one beam, as in the whole body.

    With both modes the change of frequency is right to 1.3 %. With one, the other beam stays
    linear, and it is off by a fourth; a warning says so.
    """
    body, size = twins(), 1e-3
    low, high = eigenfrequencies_hz(body, 2)
    assert high / low == pytest.approx(1.013, abs=1e-3)
    basis, mode, whole = first_mode(body, "middle", 1, size, (0, 1), 2.6e-3)
    exact, found = whole.frequency_near(basis, mode, size)
    assert exact - low > 0.01 * low
    assert found - low == pytest.approx(exact - low, rel=0.02)
    own, reduced = parts(whole, basis, mode, size, 1)
    assert 0.25 < own[1] / own[0] < 0.35
    assert reduced[1] / reduced[0] == pytest.approx(own[1] / own[0], rel=0.03)
    with pytest.warns(ModelWarning, match="mode 1, .* in internal resonance with 3 x mode 0"):
        basis, mode, whole = first_mode(body, "middle", 1, size, 1, 2.6e-3)
    lone = np.interp(size, mode.amplitude, mode.frequency_hz)
    assert abs(lone - exact) > 0.1 * (exact - low)


def test_frame_near_one_to_three():
    """1:2.96: the second mode moves with three times the frequency, as in the whole body."""
    body, size = frame(1.0, 0.25), 0.01
    low, high = eigenfrequencies_hz(body, 2)
    assert high / low == pytest.approx(2.961, abs=2e-3)
    tip = tuple(body.nodes[np.argmax(body.nodes[:, 1] - 1e-3 * body.nodes[:, 0])].tolist())
    basis, mode, whole = first_mode(body, tip, 0, size, (0, 1), 1.3 * size, harmonics=6)
    exact, found = whole.frequency_near(basis, mode, size)
    assert found - low == pytest.approx(exact - low, rel=0.01)
    own, reduced = parts(whole, basis, mode, size, 3)
    assert own[1] > 1.5e-3 * np.abs(mode.coordinates(1)).max(initial=0.0) / 1.15
    assert reduced[1] == pytest.approx(own[1], rel=0.02)


def test_resonances_of_modes_left_out_are_told():
    """1:3 through the cubic displacement; none for a mode that nothing couples."""
    body = frame(1.0, 0.25)
    low, high = eigenfrequencies_hz(body, 2)
    assert high / low == pytest.approx(3.0, abs=0.1)
    with pytest.warns(ModelWarning, match="with 3 x mode 0 and moves by"):
        modal_basis(body, 2, contact=(), large_deflections=LargeDeflections(0.03))
    modal_basis(body, 2, contact=(), large_deflections=LargeDeflections(0.03, 2))
