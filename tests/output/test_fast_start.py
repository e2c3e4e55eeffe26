"""Stored runs are read and drawn without their laws, and without what compiles these."""

import os
import subprocess
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
from systems import friction_oscillator, impact_oscillator

import fecontact as fc
from fecontact.analysis.resolved import resolved
from fecontact.cli import execute
from fecontact.integrate import SetValued
from fecontact.integrate.trajectory import StoredSystem
from fecontact.output.files.case import stored_case

# Plots that need nothing but the motion and recorded forces.
PLOTS = ("history", "contact_map", "spectrum", "density", "spectrogram")


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A run whose outputs are far apart, and its file."""
    run = fc.simulate(friction_oscillator(), 20.0, outputs=41)
    return run, fc.write_case(tmp_path_factory.mktemp("runs") / "run.vtkhdf", run)


@pytest.mark.parametrize("kind", PLOTS)
def test_plots_of_stored_runs_import_no_compiler(stored, kind):
    _, file = stored
    # An entry None is a module that must not be imported.
    code = (f"import sys; sys.modules['numba'] = None; from fecontact.cli import execute; "
            f"sys.exit(execute(['plot', {str(file)!r}, {kind!r}]))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          check=False, env={**os.environ, "PYTHONWARNINGS": "default"})
    assert done.returncode == 0, done.stdout + done.stderr
    assert file.with_name(f"run-{kind}.png").stat().st_size > 10_000


def test_curves_are_those_of_the_run_and_need_no_system(stored):
    run, file = stored
    read = stored_case(file).trajectory
    assert len(read.kept.time) > 5 * len(read.time)
    drawn, known = resolved(read).trajectory, resolved(run).trajectory
    assert len(drawn.time) > 2 * len(run.time)
    for name in ("normal_force", "friction_force"):
        known_forces = getattr(known, name)
        assert getattr(drawn, name) == pytest.approx(
            known_forces, abs=1e-6 * np.abs(known_forces).max())
    assert np.array_equal(drawn.contact_state, known.contact_state)
    part = read.between(5.0, 15.0)
    assert np.array_equal(part.friction_force, run.between(5.0, 15.0).friction_force)
    for one in (read, drawn, part):
        assert isinstance(vars(one)["system"], StoredSystem)
    # Asked for, it is that of the run.
    assert read.system.parameters() == run.system.parameters()
    assert drawn.penetration == pytest.approx(known.penetration, rel=1e-12, abs=1e-18)


def test_messages_of_limits_are_those_of_the_run(tmp_path):
    """A mass that is pressed in too deep; the file says so without its laws."""
    system = friction_oscillator()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = fc.simulate(system, 0.01, initial=np.array([0.0, -0.01, 0.0, 0.0]), outputs=3)
    assert run.limits_exceeded
    read = stored_case(fc.write_case(tmp_path / "far.vtkhdf", run)).trajectory
    assert read.limits_exceeded == run.limits_exceeded
    assert isinstance(vars(read)["system"], StoredSystem)


def test_a_file_whose_laws_are_damaged_is_drawn_and_refused_by_read_case(stored, tmp_path):
    import h5py

    _, file = stored
    broken = tmp_path / "broken.vtkhdf"
    broken.write_bytes(file.read_bytes())
    with h5py.File(broken, "r+") as content:
        text = content["system"].attrs["json"]
        content["system"].attrs["json"] = text.replace("static_coefficient", "no_such_key")
        assert content["system"].attrs["json"] != text
    assert fc.plot.plot_history(stored_case(broken).trajectory).axes
    with pytest.raises(fc.InputError, match="no_such_key"):
        fc.read_case(broken)


def test_runs_without_a_recorded_quantity_or_with_gaps_are_drawn(stored, tmp_path, capsys):
    """Files changed by other programs: forces follow from the laws, gaps are told."""
    import h5py

    run, file = stored
    changed = tmp_path / "changed.vtkhdf"
    changed.write_bytes(file.read_bytes())
    with h5py.File(changed, "r+") as content:
        del content["trajectory/normal_force"]
    drawn = [fc.plot.plot_history(one).axes for one in (stored_case(changed).trajectory, run)]
    for panels in zip(*drawn, strict=True):
        for lines in zip(*(axis.lines for axis in panels), strict=True):
            one, other = (line.get_ydata() for line in lines)
            np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-6 * np.abs(other).max())
    with h5py.File(changed, "r+") as content:
        content["trajectory/modal_coordinates"][2] = np.nan
    assert execute(["plot", str(changed), "phase", "-o", str(tmp_path / "phase.png")]) == 0
    assert "not finite at 1 of" in capsys.readouterr().err


def test_forces_of_set_valued_contact_keep_all_digits(tmp_path):
    run = fc.simulate(impact_oscillator(), 0.5, outputs=5, solver=SetValued())
    read = fc.read_case(fc.write_case(tmp_path / "run.vtkhdf", run)).trajectory
    assert np.array_equal(read.kept.normal_force, run.kept.normal_force)
    without = replace(run, kept=None)
    assert fc.read_case(fc.write_case(tmp_path / "none.vtkhdf", without)).trajectory.kept is None
