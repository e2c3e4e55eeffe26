"""Motions in phase space as plots and movies, and runs of vector fields in files."""

import subprocess

import h5py
import matplotlib.image
import numpy as np
import pytest
from fields_in_time import LORENZ, Pendulum
from systems import friction_oscillator, impact_oscillator

import fecontact as fc
from fecontact.bifurcation import (
    Collocation,
    PeriodicMotion,
    contact_field,
    orbit_branch,
    periodic_motion,
    poincare_scan,
    vector_field,
)
from fecontact.integrate import ContactEvents, Crossing, Rodas5P, SetValued
from fecontact.io import read_run, write_run
from fecontact.plot import plot_branches, plot_phase_space, render_phase_space


def damped(t, x, p, out):
    out[0] = x[1]
    out[1] = -0.4 * x[1] - x[0] + p[0] * np.cos(2.0 * t)


DAMPED = vector_field(damped, {"force": 1.0}, ["x", "v"], period=lambda p: np.pi)
RUN = fc.simulate(LORENZ, 10.0, initial=[1.0, 1.0, 1.0], events=Crossing("z", value=27.0))
SWING = fc.simulate(Pendulum(), 10.0, initial=[2.0, 0.0])


def test_curves_hold_the_states_of_runs():
    plane = plot_phase_space([SWING, PeriodicMotion(SWING.time, 0.5 * SWING.states)],
                             labels=["angle [rad]", "speed [rad/s]"]).axes[0]
    assert plane.lines[0].get_xydata() == pytest.approx(SWING.states)
    assert plane.lines[2].get_xydata() == pytest.approx(0.5 * SWING.states)
    assert plane.get_xlabel() == "angle [rad]"
    space = plot_phase_space(RUN, ["x", "y", "z"]).axes[0]
    assert np.transpose(space.lines[0].get_data_3d()) == pytest.approx(RUN.states)
    assert np.transpose(space.lines[2].get_data_3d()) == pytest.approx(RUN.events.states)
    assert space.get_zlabel() == "z"
    # States by number have their names too.
    assert plot_phase_space(RUN, [2, 0]).axes[0].get_xlabel() == "z"


def test_quantities_of_contact_systems_come_by_rows():
    system = impact_oscillator(2)
    run = fc.simulate(system, 0.2, initial=np.zeros(4))
    row = np.append(system.basis.point_row("B", "y"), np.zeros(2))
    drawn = plot_phase_space(run, [row, np.roll(row, 2)]).axes[0].lines[0].get_xydata()
    assert drawn[:, 0] == pytest.approx(run.displacement("B")[:, 1])
    assert drawn[:, 1] == pytest.approx(run.velocity("B")[:, 1])


def test_frames_show_dots_that_move_and_their_trails(tmp_path):
    first = render_phase_space(SWING, tmp_path / "swing.png", frames=3, size=(640, 360), trail=0.2,
                               title="pendulum")
    assert first == tmp_path / "swing_0000.png"
    assert len(list(tmp_path.glob("swing_*.png"))) == 3
    frames = [matplotlib.image.imread(tmp_path / f"swing_{k:04d}.png")[..., :3] for k in range(3)]
    assert frames[0].shape == (360, 640, 3)
    # Pixels of the dot's colour: their middle is where the pendulum is.
    blue = [np.argwhere(np.abs(frame - [0.0, 0.447, 0.698]).max(axis=2) < 0.1) for frame in frames]
    assert len(blue[1]) > 1.3 * len(blue[0])  # no trail at the start
    axis = plot_phase_space(SWING).axes[0]
    where = [np.interp(time, SWING.time, SWING.state("angle")) for time in (0.0, 10.0)]
    assert (where[0] - where[1]) * (blue[0].mean(axis=0) - blue[2].mean(axis=0))[1] > 0.0
    assert axis.lines


def test_movies_in_space(tmp_path):
    path = render_phase_space([RUN.between(0.0, 4.0), RUN.between(5.0, 9.0)],
                              tmp_path / "lorenz.mp4", ["x", "y", "z"], frames=6, turn=30.0,
                              size=(320, 180))
    import imageio_ffmpeg

    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert count == 6
    assert seconds == pytest.approx(6 / 25, rel=0.01)
    assert subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(path), "-f",
                           "null", "-"], check=True, stdin=subprocess.DEVNULL).returncode == 0


@pytest.mark.parametrize(("call", "told"), [
    (lambda path: plot_phase_space(RUN, ["x", "w"]), "no state 'w'"),
    (lambda path: plot_phase_space(RUN, [0, 3]), "no state 3"),
    (lambda path: plot_phase_space(RUN, ["x"]), "two or three"),
    (lambda path: plot_phase_space(RUN, "xy"), "two or three"),
    (lambda path: plot_phase_space(RUN, [[1.0], [2.0]]), "must have 3 numbers"),
    (lambda path: plot_phase_space([]), "must be a FieldRun"),
    (lambda path: plot_phase_space(RUN, labels=["x"]), "2 texts"),
    (lambda path: render_phase_space(RUN, path, frames=1), "frames = 1"),
    (lambda path: render_phase_space(RUN, path, trail=2.0), "trail = 2.0"),
    (lambda path: render_phase_space(RUN, path, turn=np.nan), "turn = nan"),
    (lambda path: render_phase_space(RUN, path, size=(3, 4)), "size"),
])
def test_errors(call, told, tmp_path):
    with pytest.raises(fc.InputError, match=told):
        call(tmp_path / "a.png")


def test_orbits_know_the_names_of_their_states():
    def circle(t, x, p, out):
        square = x[0] * x[0] + x[1] * x[1]
        out[0] = p[0] * x[0] - x[1] - square * x[0]
        out[1] = x[0] + p[0] * x[1] - square * x[1]

    field = vector_field(circle, {"mu": 0.25}, ["left", "up"])
    motion = periodic_motion(field, initial=[0.5, 0.0], transient=50.0, longest_period=10.0)
    branch = orbit_branch(field, motion, "mu", bounds=(0.2, 0.3), method=Collocation(intervals=10))
    for one in (motion, branch.points[0].orbit(field)):
        axis = plot_phase_space(one, ["up", "left"]).axes[0]
        assert (axis.get_xlabel(), axis.get_ylabel()) == ("up", "left")
        assert np.hypot(*axis.lines[0].get_data()) == pytest.approx(0.5, abs=1e-5)
        with pytest.raises(fc.InputError, match=r"no state 'u' .*mean 'up'"):
            plot_phase_space(one, ["u", "left"])
    with pytest.raises(fc.InputError, match="There is no state 'up'"):
        plot_phase_space(branch.points[0].orbit(), ["up", "left"])


@pytest.mark.parametrize("run", [RUN, SWING])
def test_runs_come_back_from_files(run, tmp_path):
    read = read_run(write_run(tmp_path / "run.h5", run))
    assert (read.states == run.states).all()
    assert (read.time == run.time).all()
    assert read.parameters == run.parameters
    assert (read.state_names, read.status, read.statistics) == (
        run.state_names, run.status, run.statistics)
    if run.events is None:
        assert read.events is None
    else:
        assert (read.events.states == run.events.states).all()
        assert read.events.kind == run.events.kind
    again = fc.simulate(LORENZ, 11.0, initial=read_run(write_run(tmp_path / "b.h5", RUN)))
    assert (again.states[0] == RUN.states[-1]).all()


@pytest.mark.parametrize("solver", [
    Rodas5P(), SetValued(), SetValued(static_coefficient=[0.85])])
def test_runs_of_contact_fields_come_back(solver, tmp_path):
    field = contact_field(friction_oscillator(), {"drive.frequency_hz": None})
    run = fc.simulate(field, 1.0, initial="rest", solver=solver, events=ContactEvents())
    read = read_run(write_run(tmp_path / "run.h5", run))
    assert len(run.events) > 0
    assert (run.events.node == 0).all()
    assert (read.events.node == run.events.node).all()
    assert read.events.kind == run.events.kind
    wanted = {name: value for name, value in run.statistics.items() if value is not None}
    assert read.statistics.keys() == wanted.keys()
    for name, value in wanted.items():
        assert np.all(read.statistics[name] == np.array(value).tolist()), name


def test_runs_of_fields_beneath_branches():
    scan = poincare_scan(DAMPED, "force", [0.5, 1.0, 2.0], transient_periods=20, keep=2,
                         initial=[0.0, 0.0], down=False)
    run = fc.simulate(DAMPED, 60.0, initial=[0.0, 0.0], outputs=3001)
    branch = orbit_branch(DAMPED, run, "force", bounds=(0.4, 2.5), both=True)
    drawn = plot_branches(branch, lambda point: point.u[0], beneath=scan, observe="x").axes[0]
    dots = drawn.lines[0].get_xydata()
    assert dots[:, 0] == pytest.approx(np.repeat([0.5, 1.0, 2.0], 2))
    assert dots[:, 1] == pytest.approx(scan.up[..., 0].ravel())
    # The nodes of an orbit begin at t = 0, where the runs are strobed.
    on_branch = np.interp(dots[:, 0], branch.parameter, [point.u[0] for point in branch.points])
    assert dots[:, 1] == pytest.approx(on_branch, abs=1e-3)


def test_damaged_files_of_runs(tmp_path):
    path = write_run(tmp_path / "run.h5", RUN)
    with h5py.File(path, "r+") as file:
        del file["run/states"]
        file["run/states"] = np.zeros((3, 2))
    with pytest.raises(fc.InputError, match="damaged"):
        read_run(path)
    with h5py.File(tmp_path / "empty.h5", "w"):
        pass
    with pytest.raises(fc.InputError, match="no group 'run'"):
        read_run(tmp_path / "empty.h5")
