"""Unusual input: cases that are refused, and cases that succeed."""

import os

import numpy as np
import pytest
from systems import friction_oscillator, impact_oscillator

from fecontact import AnalysisError, Event, InputError, event
from fecontact.bifurcation import (
    Axis,
    ContinuationOptions,
    basins,
    contact_field,
    equilibrium_branch,
    poincare_scan,
)
from fecontact.cli.plot_kinds import PlotRequest, point_of
from fecontact.integrate import ContactEvents
from fecontact.output.render.movie import target
from fecontact.plot import plot_branches


def plane(t, y, p):
    return y[0] - p[0]


@pytest.mark.parametrize(("make", "names"), [
    (lambda: Event(plane, [0.0]), "kernel = .*@fecontact.event"),
    (lambda: Event(event(plane), "a"), "parameters = 'a'"),
    (lambda: Event(event(plane), [np.nan]), r"parameters = \[nan\]"),
    (lambda: event(None), "not None"),
    (lambda: ContactEvents(stop=None), "stop = None"),
    (lambda: Axis("B", "q"), "component = 'q'"),
    (lambda: Axis("B", "y", "speed"), "of = 'speed'"),
    (lambda: PlotRequest(highest_hz=-5.0), "highest_hz = -5.0"),
    (lambda: PlotRequest(highest_hz=np.nan), "highest_hz = nan"),
    (lambda: point_of("nan,0.1"), "nan,0.1"),
    (lambda: poincare_scan(impact_oscillator(), "drive.frequency_hz", "abc"),
     "values must be"),
])
def test_refused(make, names):
    with pytest.raises(InputError, match=names):
        make()


@pytest.mark.parametrize("bounds", [(1.0, 2.0, 3.0), "ab", 1.0, (2.0, 1.0)])
def test_bounds_of_branches(bounds):
    with pytest.raises(InputError, match=r"bounds = .* must be two values"):
        ContinuationOptions(bounds=bounds)


def test_no_branch_to_draw(tmp_path):
    with pytest.raises(InputError, match="nothing to draw"):
        plot_branches([], path=tmp_path / "none.png")


@pytest.mark.parametrize(("first", "names"), [
    (None, "first = None"),
    ((Axis("B", "y"), []), "list of finite values"),
    ((Axis("B", "y"), [np.nan, 0.0]), "list of finite values"),
    ((Axis("B", "x"), [0.0, 1e-3]), "each by itself"),
    ((Axis("B", "y", "velocity"), [0.0, 1e-3]), "each by itself"),
])
def test_planes_of_basins_that_no_start_lies_on(first, names):
    with pytest.raises(InputError, match=names):
        basins(impact_oscillator(modes=2), first, (Axis("B", "y", "velocity"), [0.0, 0.02]),
               transient_periods=10)


def test_branches_do_not_switch_a_drive_on():
    """Steady sliding exists without the drive alone; its amplitude is no parameter of it."""
    system = friction_oscillator(2).with_(**{"drive.amplitude_x": 0.0, "ground.speed": 0.02})
    field = contact_field(system, ["drive.amplitude_x"])
    with pytest.raises(AnalysisError, match=r"drive.amplitude_x = 0"):
        equilibrium_branch(field, parameter="drive.amplitude_x", bounds=(0.0, 1.0))


@pytest.mark.parametrize("command", [
    ("plot", "pipe.vtkhdf", "history"), ("plot", "pipe.h5", "branches"),
    ("report", "pipe.checkpoint"), ("export", "pipe.vtkhdf"), ("render", "pipe.h5"),
    ("open", "pipe.vtkhdf"), ("compare", "pipe.vtkhdf", "pipe.vtkhdf")])
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names")
def test_results_that_are_pipes(cli, tmp_path, monkeypatch, command):
    """Nobody writes into them, so that a reader would wait for ever."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo(command[1])
    code, _, err = cli(*command)
    assert code == 1
    assert err == (f"error: {command[1]} cannot be read as a file of results: it is a pipe or "
                   f"device, not a file; store its content in a file first.\n")


@pytest.mark.parametrize("name", [".mp4", ".PNG"])
def test_movies_without_a_name(tmp_path, name):
    with pytest.raises(InputError, match=f"no name before its ending; give one, such as run{name}"):
        target(tmp_path / name, 25.0, (320, 180))
