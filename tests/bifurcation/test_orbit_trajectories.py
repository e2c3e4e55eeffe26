"""Orbits as trajectories by all methods: states, energies, movies; and the mode of the command."""

import csv

import imageio_ffmpeg
import numpy as np
import pytest
from oscillators import jenkins, jenkins_system, unilateral
from response_study import STUDY, study
from systems import TURN

from fecontact import Study, render, simulate
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    contact_field,
    frequency_response,
    orbit_branch,
    vector_field,
)
from fecontact.core.errors import InputError
from fecontact.io import read_mode, write_branches
from fecontact.laws import ConstantFriction
from fecontact.plot import rendering_problem

rendering = pytest.mark.skipif(rendering_problem() is not None, reason=str(rendering_problem()))
METHODS = {"harmonic": HarmonicBalance(40, 1024), "collocation": Collocation(150),
           "shooting": Shooting(2)}
FEW = ContinuationOptions(points=2)


@pytest.fixture(scope="module")
def unilateral_points():
    """One orbit of a mass that leaves a stop, by three methods."""
    field = unilateral()
    bounds = (0.9 / TURN, 0.95 / TURN)
    start = frequency_response(field.system(), bounds, observe=("B", "y"), options=FEW,
                               method=METHODS["harmonic"]).branches[0].points[0]
    motion = start.orbit(field)
    return field, {name: orbit_branch(field, motion, method=method, bounds=bounds,
                                      options=FEW).points[0] for name, method in METHODS.items()}


def test_all_methods_give_the_trajectory_of_a_run(unilateral_points):
    field, points = unilateral_points
    T = 2.0 * np.pi / 0.9
    runs = {name: point.trajectory(field, 2001) for name, point in points.items()}
    start = runs["shooting"].states[0]
    exact = simulate(runs["shooting"].system, T, initial=start, rtol=1e-9, outputs=2001)
    assert runs["shooting"].system.drive.frequency_hz == 0.9 / TURN
    spring = np.ptp(exact.energies.stored)
    for name, run in runs.items():
        within = 2e-3 if name == "harmonic" else 1e-4
        assert (np.diff(run.time) > 0.0).all()
        assert run.time[-1] - run.time[0] == pytest.approx(T)
        moved = np.interp(exact.time, run.time, run.displacement("B")[:, 1])
        assert moved == pytest.approx(exact.displacement("B")[:, 1], abs=within * 3.0)
        force = np.interp(exact.time, run.time, run.normal_force[:, 0])
        assert np.abs(force - exact.normal_force[:, 0]).max() < within * force.max() * 3.0
        assert run.energies.drive_work[-1] == pytest.approx(exact.energies.drive_work[-1],
                                                           abs=within * spring)
        assert run.energies.imbalance < within
        # An orbit comes back: what is put in is lost.
        assert np.ptp(run.energies.stored[[0, -1]]) < within * spring


def test_loss_of_a_jenkins_element_is_that_of_a_run():
    """Samples around the start of slip do not resolve the rate of its deflection."""
    system, field = jenkins_system(1.2), jenkins(1.2)
    point = frequency_response(system, (1.2 / TURN, 1.25 / TURN), options=FEW,
                               method=HarmonicBalance(25, 1000)).branches[0].points[0]
    run, T = point.trajectory(field), 2.0 * np.pi / 1.2
    settled = simulate(system, 60.0 * T, rtol=1e-9, outputs=np.array([0.0, 60.0 * T]))
    exact = simulate(system, T, initial=settled.states[-1], rtol=1e-9)
    # With a rigid - plastic element, 4 S (A - S / k) of one that slides at S.
    amplitude = np.ptp(exact.displacement("B")[:, 0]) / 2.0
    assert exact.energies.friction[-1] == pytest.approx(4.0 * (amplitude - 2.0), rel=1e-3)
    assert run.energies.friction[-1] == pytest.approx(exact.energies.friction[-1], rel=2e-5)
    assert run.friction_work[-1] == pytest.approx(exact.friction_work[-1], rel=2e-5)
    assert run.energies.drive_work[-1] == pytest.approx(exact.energies.drive_work[-1], rel=2e-5)
    assert abs(run.energies.bristle_work[-1]) < 1e-9
    assert run.energies.imbalance < 5e-4


@pytest.fixture(scope="module")
def block_branches():
    """The block with smoothed friction by three methods, over the frequency."""
    system = study().system().with_(friction=ConstantFriction(0.4, smoothing_slope=10.0))
    field = contact_field(system, ["drive.frequency_hz"])
    bounds = (50.0 / TURN, 52.0 / TURN)
    first = frequency_response(system, bounds, method=HarmonicBalance(9), options=FEW).branches[0]
    motion = first.points[0].orbit(field)
    found = {"harmonic": first}
    for name, method in (("collocation", Collocation(20)), ("shooting", Shooting(1))):
        found[name] = orbit_branch(field, motion, method=method, bounds=bounds, options=FEW)
    return system, field, found


@rendering
def test_orbits_by_all_methods_become_movies(block_branches, tmp_path):
    system, field, found = block_branches
    amplitude = found["harmonic"].points[0].values["observed_amplitude"]
    # Smoothed friction mu N v takes nearly all: the spring's force goes into it.
    w, viscous = 50.0, 0.4 * 14.0 * 10.0 * 2.0 / np.pi + 30.0
    mass = 1.0 / study().modal_basis().T[0, 0, 0] ** 2
    assert amplitude == pytest.approx(
        0.561 / abs(5610.0 - mass * w**2 + 1j * viscous * w), rel=1e-3)
    for name, branch in found.items():
        run = branch.points[0].trajectory(field, 201)
        assert np.ptp(run.displacement("B")[:, 0]) / 2.0 == pytest.approx(amplitude, rel=1e-3)
        movie = render(run, tmp_path / f"{name}.mp4", frames=6, size=(320, 180))
        assert imageio_ffmpeg.count_frames_and_secs(str(movie))[0] == 6
    assert system.basis.mode_shapes is not None


@rendering
def test_movies_of_orbits_by_the_command(block_branches, tmp_path, cli):
    system, _, found = block_branches
    file = write_branches(tmp_path / "orbits.h5", found, system=system, study=STUDY)
    for name in found:
        code, _, _ = cli("render", file, "--branch", name, "--at", 50.01 / TURN, "-o",
                         tmp_path / f"{name}.mp4", "--frames", 5, "--size", 320, 180)
        assert code == 0
        assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / f"{name}.mp4"))[0] == 5


def test_what_has_no_trajectory_says_so(block_branches, unilateral_points):
    _, field, found = block_branches
    point = found["harmonic"].points[0]
    with pytest.raises(InputError, match="outputs = 1 must be a whole number from 2"):
        point.trajectory(field, 1)

    def still(t, x, p, out):
        out[0] = p[0] - x[0]

    with pytest.raises(InputError, match="ContactField"):
        point.trajectory(vector_field(still, {"a": 1.0}, 1))


@pytest.mark.slow
def test_nonlinear_mode_by_the_command(cli, tmp_path, monkeypatch):
    """Stuck: the linear frequency; sliding far: a constant friction force of S = 5.6 N."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "block.toml").write_text(STUDY)
    code, said, _ = cli("modes", "block.toml", "--nonlinear", 1, "--amplitudes", 2e-5, 4e-3,
                        "--set", "response.samples=256")
    assert code == 0
    results = tmp_path / "results"
    mode = read_mode(results / "block-mode-1.h5")
    mass = 1.0 / Study.read(tmp_path / "block.toml").modal_basis().T[0, 0, 0] ** 2
    assert mode.angular_frequency[0] == pytest.approx(np.sqrt((5610.0 + 2e4) / mass), rel=1e-4)
    assert f"{mode.frequency_hz[0]:.6g}" in said
    A = mode.amplitude[-1]
    assert pytest.approx(4e-3, rel=1e-6) == A
    # Per period, friction 4 S (A - S / k) and the dashpot.
    motion = mode.orbit(len(mode) - 1)
    speed = motion.states[:, 2] / np.sqrt(mass)
    lost = 4.0 * 5.6 * (A - 5.6 / 2e4) + 30.0 * np.trapezoid(speed**2, motion.times)
    assert mode.loss[-1] == pytest.approx(lost, rel=1e-3)
    with (results / "block-mode-1.csv").open() as table:
        rows = list(csv.DictReader(table))
    assert [float(row["damping_ratio"]) for row in rows] == pytest.approx(mode.damping_ratio)
    for ending in ("png", "html"):
        assert (results / f"block-mode-1.{ending}").stat().st_size > 10_000
    for arguments, message in ((["--nonlinear", 1], "give --amplitudes LOW HIGH"),
                               (["--amplitudes", 1, 2], "add --nonlinear"),
                               (["--nonlinear", 7, "--amplitudes", 1e-5, 1e-3], "7"),
                               (["--nonlinear", 1, "--amplitudes", 2, 1], "2 1 must be two amp")):
        code, _, said = cli("modes", "block.toml", *arguments)
        assert code == 1
        assert message in said
    assert cli("plot", results / "block-mode-1.h5", "mode")[0] == 0
    # The negative damping of the motion gives back what is lost.
    assert cli("plot", results / "block-mode-1.h5", "energies", "--at", 1e-3)[0] == 0
