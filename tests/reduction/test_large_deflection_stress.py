"""Stress of large deflections of reduced bodies, against the whole body, in files and on pages."""

from functools import cache

import numpy as np
import pytest
import test_large_deflections as beams
from report_reading import Shown

from fecontact import (
    BoundaryLoad,
    ContactSystem,
    Load,
    ModelWarning,
    equilibrium,
    modal_basis,
    simulate,
)
from fecontact.analysis import DeflectionSteps, deflection_path
from fecontact.io import report
from fecontact.output.files.frames import cell_stress, von_mises
from fecontact.output.files.hdf5 import read_basis, write_basis
from fecontact.reduction import LargeDeflections, Weld, assembled_basis
from fecontact.reduction.mode_shapes import NonlinearStress

H = beams.H
PRESSED = Load(boundaries=(BoundaryLoad("top", pressure=9e3),))


@cache
def exact():
    """Fields of the whole beam at 1.5 thicknesses."""
    path = deflection_path(beams.beam("clamped"), PRESSED, steps=DeflectionSteps(first=0.5))
    return path.fields()


def two_modes(**options):
    return beams.bent("clamped", 2.5 * H, (0, 2), 9, reduction="residual", loads=("top",),
                      **options)


def test_stress_is_a_sum_of_products_of_coordinates():
    """One node and component, by hand: 2 q_0 + 5 q_0^2 - 3 q_0 (4 q_1)^2."""
    terms = NonlinearStress(np.diag([1.0, 4.0]), np.array([[2, 0], [1, 2]]),
                            np.array([[[5.0, -3.0]]]))
    assert terms.products(np.array([[0.5, 0.2]])) == pytest.approx(
        np.array([[0.25, 0.5 * 0.64]]), rel=1e-14)
    basis = two_modes()
    q = 1e-3 * np.random.default_rng(2).normal(size=(1, basis.modes))
    shapes = basis.mode_shapes
    expected = shapes.stress @ q[0] + shapes.nonlinear_stress.stress @ (
        shapes.nonlinear_stress.products(q)[0])
    assert basis.fields(q[0]).stress == pytest.approx(expected, rel=1e-12)


def test_stress_of_a_clamped_beam_under_pressure():
    """Everywhere within a few per cent of the largest one; without stretching half of it is off."""
    basis = two_modes()
    rest = equilibrium(ContactSystem(basis, load=PRESSED))
    found = basis.fields(rest.modal_coordinates)
    scale = np.abs(exact().stress).max()
    assert np.abs(found.stress - exact().stress).max() < 0.03 * scale
    assert np.abs(found.cauchy_stress - exact().cauchy_stress).max() < 0.03 * scale
    linear = basis.mode_shapes.stress @ rest.modal_coordinates
    assert np.abs(linear - exact().stress).max() > 0.3 * scale
    forces = basis.large_deflections[0]
    assert forces.stress_error < 0.01
    assert forces.largest_strain == pytest.approx(1e-3, rel=0.5)


@pytest.mark.slow
def test_files_and_pages_show_it(tmp_path):
    basis = two_modes(damping=0.05)
    write_basis(tmp_path / "basis.h5", basis)
    again = read_basis(tmp_path / "basis.h5")
    start = np.zeros(2 * basis.modes)
    start[0] = 0.6 * basis.large_deflections[0].ranges[0, 1]
    run = simulate(ContactSystem(again), 0.2 / basis.frequencies_hz[0], initial=start, outputs=11)
    expected = np.array([basis.fields(q).von_mises for q in run.modal_coordinates])
    linear = np.array([basis.mode_shapes.stress @ q for q in run.modal_coordinates])
    assert np.abs(linear[0, :, 0]).max() < 0.8 * expected.max()
    assert von_mises(again.mode_shapes, run.modal_coordinates) == pytest.approx(
        expected, rel=1e-9, abs=1e-9 * expected.max())
    shapes = again.mode_shapes
    fields = basis.fields(run.modal_coordinates[-1])
    assert cell_stress(shapes, run.modal_coordinates)[-1] == pytest.approx(
        fields.stress[shapes.cells].mean(axis=1), abs=1e-9 * expected.max())
    shown = Shown(report(run, tmp_path / "run.html"))
    assert shown.stress == pytest.approx(expected, abs=1e-3 * expected.max())
    assert shown.header["bodies"]["largest"]["peak"] == pytest.approx(expected.max(), rel=1e-3)
    moved = np.array([basis.fields(q).displacement for q in run.modal_coordinates])
    assert shown.displacement == pytest.approx(moved, abs=1e-3 * np.abs(moved).max())


def test_bodies_side_by_side_and_linked():
    """Each body has its own stress, with the coordinates of a welded pair too."""
    one, other = two_modes(), beams.bent("hinged", 0.6 * H)
    both = assembled_basis({"one": one, "other": other}, {})
    q = np.concatenate([1e-3 * np.arange(1.0, 1.0 + one.modes), 1e-2 * np.arange(
        1.0, 1.0 + other.modes)])
    for name, basis, part in (("one", one, q[: one.modes]), ("other", other, q[one.modes :])):
        expected = basis.fields(part).stress
        assert both.fields(q, name).stress == pytest.approx(
            expected, abs=1e-9 * np.abs(expected).max())
    assert both.select(range(both.modes)).fields(q).stress == pytest.approx(
        both.fields(q).stress, rel=1e-12)
    joined = assembled_basis({"one": one, "other": other}, {},
                             [Weld("one.middle", "other.middle")])
    r = np.linspace(1e-3, 2e-3, joined.modes)
    parts = [joined.mode_shapes.shapes[: len(one.mode_shapes.nodes)] @ r]
    inertia = beams.beam("clamped").mass @ one.mode_shapes.shapes.reshape(-1, one.modes)
    own = inertia.T @ parts[0].ravel()
    expected = one.fields(own).stress
    assert joined.fields(r, "one").stress == pytest.approx(
        expected, abs=1e-6 * np.abs(expected).max())


def test_large_strain_is_told():
    """A thick beam: the strain is 28 a h / (2 L^2) at its ends, and some of shear."""
    thick = beams.ElasticBody(beams.rectangle(1.0, 0.1, 12, 1), beams.STEEL,
                              fixed={"left": "xy", "right": "xy"})
    basis = modal_basis(thick, 1, contact=(), large_deflections=LargeDeflections(0.1))
    start = np.zeros(2 * basis.modes)
    start[0] = 0.9 * basis.large_deflections[0].ranges[0, 1]
    with pytest.warns(ModelWarning, match=r"strains the body by up to 0\.1"):
        simulate(ContactSystem(basis), 1e-4, initial=start, outputs=2)
