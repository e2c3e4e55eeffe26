"""Summaries of runs whose numbers are known in closed form."""

import inspect
import os
from dataclasses import replace

import numpy as np
import pytest
import synthetic
from joined_bodies import stack_run
from systems import impact_oscillator

from fecontact import (
    ContactSystem,
    Ground,
    InputError,
    ModelWarning,
    RigidStart,
    Study,
    Trajectory,
    simulate,
)
from fecontact.cli.templates import template
from fecontact.laws import ConstantFriction, EnergyWear, RoughSurface
from fecontact.sweeps.summaries import SUMMARIES, functions_for, summarise, unit_of
from fecontact.system.columns import POWERS
from fecontact.system.powers import FRICTION

V, STIFFNESS, DEPTH, MU, THICKNESS = 0.02, 3e5, 4e-5, 0.3, 0.05
TURNS = 8  # of the oscillation in the run of 0.02 s


@pytest.fixture(scope="module")
def run():
    """Sliding forth and back by 0.1 mm at 400 Hz on a belt, pressed in for the first half."""
    system = ContactSystem(
        replace(synthetic.basis(contact_nodes=4), thickness=THICKNESS),
        normal=RoughSurface(STIFFNESS, 1e-9, 0.0),
        friction=ConstantFriction(MU, smoothing_slope=1e9), ground=Ground(speed=V))
    t = np.linspace(0.0, 0.02, 8001)
    w = 2.0 * np.pi * TURNS / 0.02
    q, rate = np.zeros((len(t), 5)), np.zeros((len(t), 5))
    q[:, 0], rate[:, 0] = 1e-4 * np.sin(w * t), 1e-4 * w * np.cos(w * t)
    q[:, 1] = np.where(t <= 0.01, -DEPTH, 3e-5)
    work = np.outer(t, np.arange(float(len(POWERS))))
    work[:, FRICTION] = 5.0 * t
    return Trajectory(system, t, q, rate, work,
                      node_friction_work=np.outer(t, [1.0, 2.0, 4.0, 3.0]))


def values(run, *names, t_start=None, **known):
    return summarise(run, functions_for(names, **known), t_start)


def test_displacements_and_velocities(run):
    found = values(run, "largest_displacement", "amplitude_x", "amplitude_x@3", "amplitude_y@B",
                   "rms_velocity", "dominant_frequency")
    # x and y together, at the highest x of the first half
    assert found["largest_displacement"] == pytest.approx(np.hypot(1e-4, DEPTH), rel=1e-6)
    assert found["amplitude_x"] == pytest.approx(1e-4, rel=1e-6)
    assert found["amplitude_x@3"] == pytest.approx(1e-4, rel=1e-6)
    assert found["amplitude_y@B"] == pytest.approx(0.5 * (DEPTH + 3e-5), rel=1e-9)
    assert found["rms_velocity"] == pytest.approx(1e-4 * 2.0 * np.pi * 400.0 / 2.0**0.5, rel=1e-4)
    assert found["dominant_frequency"] == pytest.approx(400.0, rel=1e-3)


@pytest.mark.parametrize("outputs", [11, 40, 4001])
def test_numbers_of_a_run_do_not_depend_on_its_outputs(outputs):
    """A pendulum that strikes a stop; few outputs miss its impacts."""
    system = impact_oscillator()
    names = ("amplitude_y", "largest_displacement", "peak_normal_force", "mean_normal_force",
             "rms_velocity", "open_fraction")
    found = values(simulate(system, 0.5, outputs=outputs, rtol=1e-8), *names, t_start=0.1)
    fine = values(simulate(system, 0.5, outputs=100001, rtol=1e-8), *names, t_start=0.1)
    for name in names:
        assert found[name] == pytest.approx(fine[name], rel=1e-2), name


def test_numbers_of_outputs_alone_come_with_a_warning():
    run = simulate(impact_oscillator(), 0.5, outputs=11, keep_steps=False)
    with pytest.warns(ModelWarning, match="which may cut peaks.*give it more outputs"):
        values(run, "amplitude_y")


def test_contact(run):
    found = values(run, "open_fraction", "slip_fraction", "stick_fraction", "mean_normal_force",
                   "peak_normal_force", "peak_line_load", "peak_pressure", "peak_friction_force",
                   "mean_friction_force")
    force = STIFFNESS * DEPTH  # all nodes together
    assert found["open_fraction"] == pytest.approx(0.5, abs=2e-4)
    assert found["slip_fraction"] + found["stick_fraction"] == pytest.approx(0.5, abs=2e-4)
    assert found["stick_fraction"] < 1e-3
    assert found["peak_normal_force"] == pytest.approx(force, rel=1e-4)
    assert found["mean_normal_force"] == pytest.approx(0.5 * force, rel=2e-4)
    assert found["peak_line_load"] == pytest.approx(force / 0.2, rel=1e-4)
    assert found["peak_pressure"] == pytest.approx(force / (0.2 * THICKNESS), rel=1e-4)
    assert (unit_of("peak_line_load"), unit_of("peak_pressure")) == ("N/m", "Pa")
    assert found["peak_friction_force"] == pytest.approx(MU * force, rel=1e-4)
    # faster than the belt for arccos(V / amplitude) / pi of each turn
    forward = np.arccos(V / (1e-4 * 2.0 * np.pi * 400.0)) / np.pi
    assert found["mean_friction_force"] == pytest.approx(
        0.5 * MU * force * (2.0 * forward - 1.0), abs=0.5 * MU * force * 2e-3)


def test_forces_of_one_of_several_interfaces():
    """Forces of both interfaces add up to the force of the whole system."""
    stack = stack_run(times=801)
    found = values(stack, *(f"{kind}_{force}_force{at}" for kind in ("mean", "peak")
                            for force in ("normal", "friction") for at in ("", "@shoe", "@foot")))
    for force in ("normal", "friction"):
        mean = f"mean_{force}_force"
        assert found[mean] == pytest.approx(found[f"{mean}@shoe"] + found[f"{mean}@foot"], rel=1e-9)
        peaks = [found[f"peak_{force}_force@{name}"] for name in ("shoe", "foot")]
        assert max(peaks) > 0.0
        assert found[f"peak_{force}_force"] <= sum(peaks) * (1.0 + 1e-9)
    # The first eight contact nodes are those of the shoe.
    shoe = stack.normal_force[:, :8].sum(axis=1)
    assert found["peak_normal_force@shoe"] == pytest.approx(shoe.max())
    assert unit_of("peak_normal_force@shoe") == "N"
    with pytest.raises(InputError, match="There is no interface 'sole'; choose from 'foot'"):
        values(stack, "peak_normal_force@sole")


def test_friction_of_solids_is_that_of_both_directions():
    """A pad that slides at 45 degrees: mu F in all, mu F / sqrt(2) along each direction."""
    system = replace(Study.from_toml(template("solid")).system(), ground=Ground(),
                     friction=ConstantFriction(MU, smoothing_slope=1e9))
    basis = system.basis
    rows = basis.contact_T[:, :3, :6].reshape(-1, 6)

    def rigid(*vector):
        return np.linalg.lstsq(rows, np.tile(vector, basis.contact_nodes), rcond=None)[0]

    t = np.linspace(0.0, 1e-3, 11)
    q, rate = np.zeros((2, len(t), basis.modes))
    rate[:, :6] = rigid(0.1, 0.1, 0.0)
    q[:, :6] = t[:, None] * rigid(0.1, 0.1, 0.0) + rigid(0.0, 0.0, -1e-5)
    motion = Trajectory(system, t, q, rate, np.zeros((len(t), len(POWERS))))
    found = values(motion, "peak_friction_force", "mean_friction_force", "peak_normal_force")
    assert found["peak_normal_force"] > 0.0
    limit = MU * found["peak_normal_force"]
    assert found["peak_friction_force"] == pytest.approx(limit, rel=1e-4)
    assert abs(found["mean_friction_force"]) == pytest.approx(limit / np.sqrt(2.0), rel=1e-4)


def test_power_and_wear(run):
    names = ("friction_power", "wear_depth", "wear_rate")
    known = {"wear": EnergyWear(1e-13), "thickness": 0.03}
    found = values(run, *names, **known)
    assert found["friction_power"] == pytest.approx(5.0)
    depth = 1e-13 * 4.0 * 0.02 / (0.05 * 0.03)  # the third node has worked most
    assert found["wear_depth"] == pytest.approx(depth)
    assert found["wear_rate"] == pytest.approx(depth / 0.02)
    late = values(run, *names, t_start=0.015, **known)
    assert late["friction_power"] == pytest.approx(5.0)
    assert late["wear_depth"] == pytest.approx(depth / 4.0)
    assert late["wear_rate"] == pytest.approx(depth / 0.02)


def test_the_late_part_counts_from_its_first_time(run):
    late = run.between(0.01)
    assert late.time[0] == pytest.approx(0.01)
    assert len(late.states) == len(late.time) == len(late.friction_work) == 4001
    assert (late.work[0] == 0.0).all()
    assert values(run, "open_fraction", t_start=0.0101) == {"open_fraction": 1.0}
    with pytest.raises(InputError, match=r"fewer than two output times from t_start = 0\.03 s"):
        run.between(0.03)


def test_every_summary_has_a_sentence_a_unit_and_a_finite_value(run):
    # The last one is of solids.
    others = ("periods", "lyapunov_exponent", "amplitude_z")
    names = tuple(name for name in SUMMARIES if name not in others)
    with np.errstate(all="raise"):
        found = values(run, *names, wear=EnergyWear(1e-13), thickness=0.1)
    assert all(np.isfinite(value) for value in found.values())
    for name, summary in SUMMARIES.items():
        assert summary.text.endswith((".", ").")), name
        assert next(iter(inspect.signature(summary.function).parameters)) == "trajectory"
    assert unit_of("amplitude_x@B") == "m"
    assert unit_of("own.py:f") == ""


def test_number_of_periods(run):
    """A motion with half the frequency of the drive in it, and one that drifts."""
    t = np.linspace(0.0, 60.0, 60 * 16 + 1)
    q, rate = np.zeros((len(t), 5)), np.zeros((len(t), 5))
    for k, size in ((1.0, 1.0), (0.5, 0.3)):
        w = 2.0 * np.pi * k
        q[:, 0] += 1e-4 * size * np.sin(w * t)
        rate[:, 0] += 1e-4 * size * w * np.cos(w * t)
    system = run.system.with_(**{"drive.frequency_hz": 1.0})
    motion = Trajectory(system, t, q, rate, np.zeros((len(t), len(POWERS))))
    assert values(motion, "periods") == {"periods": 2.0}
    assert values(replace(motion, modal_coordinates=q + 1e-5 * t[:, None]), "periods") == {
        "periods": 0.0}
    with pytest.raises(InputError, match="periods: count_periods: 9 points cannot show 16"):
        values(motion, "periods", t_start=52.0)


def test_lyapunov_exponents_of_the_impact_oscillator():
    """About +6 1/s in the chaotic regime, below zero where the motion repeats."""
    found = []
    for w in (23.63, 64.32):
        system = impact_oscillator(w=w)
        period = 2.0 * np.pi / w
        motion = simulate(system, 250 * period, outputs=251,
                          initial=RigidStart(displacement=(0.0, 1e-4, 0.0)))
        found.append(values(motion, "lyapunov_exponent", t_start=50 * period)["lyapunov_exponent"])
    assert found[0] == pytest.approx(6.0, abs=1.0)
    assert found[1] < -0.05


def test_functions_of_the_user_are_those_of_the_file_now(run, tmp_path):
    (tmp_path / "own.py").write_text("def f(run):\n    return run.time[-1]\n")
    assert summarise(run, functions_for(["own.py:f"], tmp_path)) == {"own.py:f": run.time[-1]}
    (tmp_path / "own.py").write_text("def f(run):\n    return 2.0\n")
    os.utime(tmp_path / "own.py", ns=(1, 1))
    assert summarise(run, functions_for(["own.py:f"], tmp_path)) == {"own.py:f": 2.0}
    with pytest.raises(InputError, match=r"there is no file .*none\.py"):
        functions_for(["none.py:f"], tmp_path)
    (tmp_path / "bad.py").write_text("1 / 0")
    with pytest.raises(InputError, match=r"bad\.py cannot be loaded \(ZeroDivisionError"):
        functions_for(["bad.py:f"], tmp_path)


def test_summaries_that_cannot_be(run):
    with pytest.raises(InputError, match="'stick_fraction' is not one of a point; leave out '@B'"):
        functions_for(["stick_fraction@B"])
    with pytest.raises(InputError, match=r"amplitude_x@D: There is no point 'D'"):
        values(run, "amplitude_x@D")
    uneven = replace(run, time=run.time**2)
    with pytest.raises(InputError, match="dominant_frequency: the frequency needs equally spaced"):
        values(uneven, "dominant_frequency")
