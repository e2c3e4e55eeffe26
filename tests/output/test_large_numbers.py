"""Runs whose numbers are finite, but whose squares are not: plots, spectra, stresses, files."""

import dataclasses

import numpy as np
import pytest
from tiny_study import TINY

from fecontact import Study, render, write_case
from fecontact.analysis import power_spectral_density
from fecontact.analysis.sampling import fastest_period
from fecontact.analysis.spectra import mean_frequency
from fecontact.cli import execute
from fecontact.cli.plot_kinds import KINDS
from fecontact.core.errors import InputError
from fecontact.core.magnitude import magnitude
from fecontact.io import report
from fecontact.output.files.frames import cell_stress, displacement, von_mises

HUGE = 2.0**520  # 3e156, whose square overflows


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run of a small body, and its place."""
    study = Study.from_toml(TINY).with_(**{"simulation.outputs": 401})
    return study.run()


def vibrating(run, size):
    """The run with a vibration of 20 periods in each coordinate in place of its motion."""
    turn = 40.0 * np.pi * np.linspace(0.0, 1.0, len(run.time))[:, None]
    rate = 40.0 * np.pi / float(run.time[-1] - run.time[0])
    sizes = size * np.arange(1.0, 1.0 + run.modal_coordinates.shape[1])
    return dataclasses.replace(run, modal_coordinates=sizes * np.sin(turn),
                               modal_velocities=rate * sizes * np.cos(turn))


def test_magnitudes_are_powers_of_two():
    assert magnitude([3.0, -5.0]) == 4.0
    assert magnitude([0.25]) == 0.25
    assert magnitude([1.7e308]) == 2.0**1023
    assert magnitude([0.0]) == magnitude([]) == magnitude([np.inf, 1.0]) == magnitude(np.nan) == 1.0


def test_frequencies_do_not_depend_on_the_size(run):
    small, large = vibrating(run, 1.0), vibrating(run, HUGE)
    assert fastest_period(large) == pytest.approx(fastest_period(small), rel=1e-12)
    x = small.modal_coordinates[:, 0]
    assert mean_frequency(run.time, HUGE * x) == pytest.approx(mean_frequency(run.time, x),
                                                               rel=1e-12)


def test_a_density_is_right_or_refused(run):
    x = vibrating(run, 1.0).modal_coordinates[:, 0]
    small, large = (power_spectral_density(run.time, factor * x) for factor in (1.0, 2.0**500))
    np.testing.assert_allclose(large.values, 2.0**1000 * small.values, rtol=1e-9)
    with pytest.raises(InputError, match="beyond the largest number; take an amplitude spectrum"):
        power_spectral_density(run.time, HUGE * x)


def test_fields_are_linear_in_the_coordinates(run):
    field, q = run.system.basis.mode_shapes, vibrating(run, 1.0).modal_coordinates[3:5]
    for values in (displacement, von_mises, cell_stress):
        once = values(field, q)
        np.testing.assert_allclose(values(field, HUGE * q), HUGE * once, rtol=1e-9,
                                   atol=1e-9 * HUGE * np.abs(once).max())


@pytest.mark.parametrize("size", [
    pytest.param(HUGE, marks=pytest.mark.slow), 2.0**980])
@pytest.mark.long
def test_every_plot_and_file_is_made_or_refused_in_a_sentence(
    size, run, tmp_path, monkeypatch, capsys
):
    """No warning of NumPy or matplotlib, which are errors here."""
    monkeypatch.chdir(tmp_path)
    write_case("run.vtkhdf", vibrating(run, size))
    for line in (*(f"plot run.vtkhdf {kind} -o a.png" for kind in KINDS),
                 "export run.vtkhdf --format csv -o a.csv", "export run.vtkhdf -o a",
                 "report run.vtkhdf -o a.html", "render run.vtkhdf --frames 2 -o a.mp4"):
        code = execute(line.split())
        said = capsys.readouterr().err.splitlines()
        assert all(one.startswith(("warning: In this run ", "error: ")) for one in said), said
        assert code == any(one.startswith("error: ") for one in said), line
        assert "should not happen" not in said[-1]
        assert code == 0 or line.split()[0] in ("report", "render") or "density" in line, said


@pytest.mark.filterwarnings("ignore::fecontact.core.errors.ModelWarning")
def test_pictures_and_pages_of_numbers_beyond_drawing_are_refused(run, tmp_path):
    large = vibrating(run, HUGE)
    with pytest.raises(InputError, match=r"cannot be drawn at t = .* beyond 1e\+100; draw an"):
        render(large, tmp_path / "a.mp4", frames=2)
    with pytest.raises(InputError, match=r"no motion to report: .* beyond 1e\+100; check loads"):
        report(large, tmp_path / "a.html")
    assert list(tmp_path.iterdir()) == []
