"""Labels of parameters, with the units that the annotations of their classes name."""

import re
from types import SimpleNamespace
from typing import get_type_hints

import numpy as np
import pytest
from systems import mass_in_y

from fecontact import Load, PointLoad, Study
from fecontact.bifurcation import Branch, contact_field, equilibrium_branch, observe
from fecontact.core.docstrings import documented
from fecontact.io import read_branches, write_branches
from fecontact.laws import Constant, Harmonic
from fecontact.output.diagrams.branches import level_texts
from fecontact.output.diagrams.labels import branch_label
from fecontact.output.plots.drawing import name_axis
from fecontact.output.plots.figure import new_figure
from fecontact.plot import plot_branches, plot_eigenvalues, plot_sweep
from fecontact.sweeps import SweepTable
from fecontact.system.parameter_labels import _classes, _units_of, parameter_label


@pytest.mark.parametrize(("name", "label"), [
    ("ground.speed", "ground speed [m/s]"),
    ("ground.profile.amplitude", "ground profile amplitude [m]"),
    ("drive.frequency_hz", "drive frequency [Hz]"),
    ("interfaces.SOLE.friction.smoothing_slope", "SOLE friction smoothing slope [s/m]"),
    ("normal.roughness_height", "normal roughness height [m]"),
    ("load.normal", "load normal [N]"),
    ("gap", "gap [m]"),
    # The laws do not agree: N/m of rough surfaces, N/m^n of powers.
    ("normal.stiffness", "normal stiffness"),
    ("friction.friction_coefficient", "friction coefficient"),
    ("B", "B"),
])
def test_labels(name, label):
    assert parameter_label(name) == label


def test_forces_are_named_by_their_place_and_direction():
    forces = (PointLoad("B", "x", signal=Harmonic(3.0, 10.0)),
              PointLoad("C", "phi", signal=Harmonic(3.0, 10.0)),
              PointLoad(3, "y", signal=Harmonic(3.0, 10.0)))
    system = SimpleNamespace(load=Load(forces=forces))
    name = "load.forces.0.signal"
    assert parameter_label(f"{name}.amplitude", system=system) == "force at B x [N]"
    assert parameter_label(f"{name}.frequency_hz", system=system) == (
        "frequency of the force at B x [Hz]")
    assert parameter_label("load.forces.1.signal.amplitude", system=system) == (
        "moment at C phi [N m]")
    assert parameter_label(f"{name}.amplitude") == "amplitude of force 0"
    assert parameter_label("load.forces.2.signal.amplitude", system=system) == (
        "force at contact node 3 y [N]")
    response = SimpleNamespace(
        level_name=f"{name}.amplitude", levels=np.array([0.5, 2e3]),
        branches=[Branch(f"{name}.frequency_hz", (), attributes={
            "level_label": "force at B x [N]"})])
    assert level_texts(response) == ("force at B x", ["0.0005 kN", "2 kN"])


def test_branches_know_the_labels_of_what_they_show(tmp_path):
    """The place of a force, what was observed, the second parameter; also those of files."""
    forces = (PointLoad("C", "y", signal=Constant(-20.0)),)
    name = "load.forces.0.signal.value"
    system = mass_in_y(spring=1e4, load=Load(forces=forces))
    field = contact_field(system, [name])
    branch = observe(field, equilibrium_branch(field, parameter=name, bounds=(-30.0, -10.0)),
                     "C", "y")
    stored = read_branches(write_branches(tmp_path / "one.h5", {"rest": branch}))["rest"]
    for one in (branch, stored):
        axis = plot_branches(one, "observed_amplitude").axes[0]
        assert axis.get_xlabel() == "force at C y [N]"
        assert axis.get_ylabel() == "amplitude of displacement y of C [m]"
        assert plot_eigenvalues(one).axes[1].get_xlabel() == "force at C y [N]"
        assert branch_label(one, "period") == "period [s]"
        assert branch_label(one, "state_error") == "state error"
    plain = Branch("a", (), attributes={"parameters": ("ground.speed", "load.normal")})
    assert branch_label(plain) == "ground speed [m/s]"
    assert branch_label(plain, "load.normal") == "load normal [N]"


def test_sweeps_know_the_places_of_forces():
    table = SweepTable({"load.forces.0.signal.amplitude": (1.0, 2.0)}, {"amplitude_x": np.ones(2)},
                       ["0", "1"], ["", ""], shape=(2,),
                       labels={"load.forces.0.signal.amplitude": "force at B x [N]"})
    assert plot_sweep(table, "amplitude_x").axes[0].get_xlabel() == "force at B x [N]"
    assert table.label("ground.speed") == "ground speed [m/s]"


def test_ticks_are_in_a_unit_that_suits_the_values():
    with new_figure(4.0, 3.0) as figure:
        axes = figure.subplots()
        axes.plot([0.0, 4e-3], [0.0, 3e4])
        name_axis(axes, "x", "ground speed [m/s]", np.array([0.0, 4e-3, np.nan]))
        name_axis(axes, "y", "decay [s/m]", np.array([0.0, 3e4]))
        figure.draw_without_rendering()
    assert axes.get_xlabel() == "ground speed [mm/s]"
    assert axes.get_ylabel() == "decay [s/m]"
    ticks = {label.get_text(): label.get_position()[0] for label in axes.get_xticklabels()}
    assert ticks["3"] == pytest.approx(3e-3)  # data stay in SI units
    assert axes.xaxis.get_major_formatter()(-2e-3) == "\N{MINUS SIGN}2"


def _documented_units():
    for cls in {cls for hint in get_type_hints(Study).values() for _, cls in _classes(hint, "")}:
        units = _units_of(cls)
        for names, meaning in documented(cls):
            named = re.findall(r"\[([^\]]+)\]", meaning)
            for name in names:
                yield cls.__name__, name, named, units[name]


def test_docstrings_and_annotations_name_the_same_units():
    """For people one, for labels the other."""
    compared = 0
    for owner, name, named, unit in _documented_units():
        if unit or (len(named) == 1 and named[0] in KNOWN):
            # Tables and laws within a parameter say their own units.
            assert unit in named, (owner, name)
            compared += 1
    assert compared > 100


KNOWN = {"m", "m/s", "s", "1/s", "1/m", "s/m", "N", "N/m", "N s/m", "Pa", "Hz", "rad", "rad/s"}
