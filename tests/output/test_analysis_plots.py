"""Figures of spectra, sections, friction work and receptances show the numbers they stand for."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import basis, run

from fecontact import Drive, InputError, Load, PointLoad, simulate, write_case
from fecontact.analysis import history, receptance
from fecontact.analysis.histories import usual_component, usual_point
from fecontact.analysis.summaries import largest_displacement
from fecontact.cli import execute, plot_kinds
from fecontact.integrate import Rodas5P
from fecontact.integrate.rodas5p import driver
from fecontact.laws import Harmonic
from fecontact.output.plots import analysis
from fecontact.plot import plot_history, plot_phase


@pytest.fixture(scope="module")
def trajectory():
    return run(basis(contact_nodes=4), times=2001)


def test_window_counts_from_its_own_start(trajectory):
    part = trajectory.between(0.005, 0.015)
    assert (part.time[0], part.time[-1]) == pytest.approx((0.005, 0.015))
    np.testing.assert_array_equal(part.normal_force, trajectory.normal_force[500:1501])
    assert not part.work[0].any()
    np.testing.assert_allclose(part.friction_work[-1], trajectory.friction_work[1500]
                               - trajectory.friction_work[500], rtol=1e-9, atol=1e-18)
    assert len(trajectory.between().time) == 2001
    with pytest.raises(InputError, match="fewer than two output times"):
        trajectory.between(0.03)


def test_window_of_a_run_keeps_its_balance():
    from systems import DRIVEN, beam

    whole = simulate(beam(**DRIVEN), 0.01, outputs=401)
    part = whole.between(0.004)
    assert part.energies.imbalance < 2e-5
    np.testing.assert_allclose(part.friction_work.sum(axis=1), part.energies.friction,
                               rtol=1e-6, atol=1e-12)


def test_spectrum_shows_peaks_in_suitable_units(trajectory):
    q = trajectory.modal_coordinates.copy()
    q[:, 0] = 1e-5 * np.sin(2.0 * np.pi * 2000.0 * trajectory.time)
    q[:, 1:] = 0.0
    swinging = replace(trajectory, modal_coordinates=q)
    panel = analysis.plot_spectrum(swinging, "displacement", 1, "x").axes[0]
    assert panel.get_ylabel() == "amplitude [µm]"
    assert panel.get_title() == "displacement x of contact node 1"
    assert panel.lines[0].get_ydata().max() == pytest.approx(1e-5, rel=1e-2)
    assert [float(text.get_text()) for text in panel.texts] == pytest.approx([2000.0], rel=1e-3)
    density = analysis.plot_spectrum(trajectory, density=True)
    assert density.axes[0].get_ylabel() == "density [(m/s)²/Hz]"


def test_friction_work_per_length(trajectory):
    upper, lower = analysis.plot_friction_work(trajectory).axes
    length = trajectory.system.basis.tributary
    heights = np.array([bar.get_height() for bar in upper.patches])
    scale = {"mJ/m": 1e-3, "µJ/m": 1e-6, "J/m": 1.0}[upper.get_ylabel().split("[")[1][:-1]]
    np.testing.assert_allclose(heights * scale, trajectory.friction_work[-1] / length)
    slip = np.trapezoid(np.abs(trajectory.slip_velocity) * (trajectory.normal_force > 0.0),
                        trajectory.time, axis=0)
    ratio = np.array([bar.get_height() for bar in lower.patches]) / slip
    np.testing.assert_allclose(ratio, ratio[0])


def test_poincare_section_takes_one_point_a_period(trajectory):
    figure = analysis.plot_poincare(trajectory, "B", "x", period=0.005)
    points = figure.axes[0].lines[1]
    times = np.arange(5) * 500
    x = trajectory.displacement("B")[times, 0]
    np.testing.assert_allclose(points.get_xdata(), x, atol=1e-12)
    assert figure.axes[0].get_title() == "B, 5 points"


def test_poincare_section_of_a_short_run_is_refused_unless_it_is_an_orbit(trajectory):
    with pytest.raises(InputError, match=r"has 3 points, 0\.0071 s apart, but needs 5"):
        analysis.plot_poincare(trajectory, "B", "x", period=0.0071)
    figure = analysis.plot_poincare(trajectory, "B", "x", period=0.01)  # of two periods
    assert figure.axes[0].get_title() == "B, 3 points"


def test_response_figure_names_its_curves(trajectory):
    body = trajectory.system.basis
    f = np.linspace(10.0, 3000.0, 50)
    one = receptance(body, f, [("B", "x")])
    two = receptance(body, f, [("B", "y")], [("C", "y"), (2, "y")])
    figure = analysis.plot_receptance([one, two], ["drive", "other"])
    names = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert names == ["drive", "other, C y by B y", "other, contact node 2 y by B y"]
    np.testing.assert_allclose(figure.axes[0].lines[0].get_ydata(), np.abs(one.values[:, 0, 0]))
    assert figure.axes[0].get_ylabel() == "receptance [m/N]"
    mixed = replace(two, responses=(("C", "y"), (2, "phi")))
    panel = analysis.plot_receptance(mixed).axes[0]
    assert panel.get_ylabel() == "receptance"
    assert [text.get_text() for text in panel.get_legend().get_texts()] == [
        "C y by B y [m/N]", "contact node 2 phi by B y [rad/N]"]


def test_responses_that_are_round_off_are_left_out(trajectory):
    """A force at half the height of a straight bar stretches it and bends nothing."""
    body = trajectory.system.basis
    found = receptance(body, np.linspace(10.0, 3000.0, 50), [("B", "x")],
                       [("C", "x"), ("C", "y"), (2, "x")])
    assert np.abs(found.values[:, 1]).max() < 1e-12 * np.abs(found.values[:, 0]).max()
    figure = analysis.plot_receptance(found)
    assert [line.get_label() for line in figure.axes[0].lines] == [
        "C x by B x", "contact node 2 x by B x"]
    assert len(figure.axes[1].lines) == 2
    assert figure.get_supxlabel() == "not drawn, as zero but for round-off: C y by B x"


def test_phases_do_not_leap_about_180_degrees(trajectory):
    """Far above its resonances a body follows a force at -180 degrees, give or take round-off."""
    one = receptance(trajectory.system.basis, np.linspace(10.0, 3000.0, 50), [("B", "x")])
    beyond = replace(one, values=-np.abs(one.values) * np.exp(
        1e-6j * np.where(np.arange(50) % 2, 1.0, -1.0))[:, None, None])
    phase = analysis.plot_receptance(beyond).axes[1].lines[0].get_ydata()
    np.testing.assert_allclose(phase, -180.0, atol=1e-3)


@pytest.mark.slow
def test_every_kind_is_drawn_from_a_stored_run(trajectory, tmp_path, capsys, monkeypatch):
    """Without integrating again: the run keeps what pictures need."""
    system = trajectory.system.with_(drive=Drive(stiffness_x=1e5, amplitude_x=1e-5,
                                                 frequency_hz=200.0))
    case = write_case(tmp_path / "beam.vtkhdf", simulate(system, 0.06, outputs=2401), frames=0)

    def refused(*given, **named):
        raise AssertionError("a plot integrates")

    monkeypatch.setattr(driver, "integrate", refused)
    with pytest.raises(AssertionError, match="integrates"):
        simulate(system, 0.06, outputs=3, solver=Rodas5P())
    for kind in plot_kinds.KINDS:
        assert execute(["plot", str(case), kind, "--t-start", "0.002"]) == 0
        assert (tmp_path / f"beam-{kind}.png").read_bytes()[:4] == b"\x89PNG"
    assert execute(["plot", str(case), "history", "--point", "C", "--point", "2", "-o",
                    str(tmp_path / "two.svg")]) == 0
    assert b"contact node 2" in (tmp_path / "two.svg").read_bytes()
    capsys.readouterr()
    assert execute(["plot", str(case), "spectrun"]) == 1
    assert "no plot 'spectrun' (did you mean 'spectrum'?)" in capsys.readouterr().err
    assert execute(["plot", str(case), "phase", "--point", "D"]) == 1
    assert "There is no point 'D'" in capsys.readouterr().err


def test_a_pendulum_is_drawn_across_the_ground(tmp_path):
    """Without motion along the ground the drive's axis is the usual one, and zeros can be drawn."""
    from systems import impact_oscillator

    trajectory = simulate(impact_oscillator(w=64.32), 0.5, outputs=801)
    for kind in ("phase", "spectrum", "spectrogram", "receptance"):
        plot_kinds.redraw(trajectory, kind, path=tmp_path / f"{kind}.svg")
    assert b"velocity y" in (tmp_path / "phase.svg").read_bytes()
    for kind in ("spectrum", "spectrogram"):
        plot_kinds.redraw(trajectory, kind, plot_kinds.PlotRequest("total_friction_force"))
    with pytest.raises(InputError, match="B x does not move by a force at B x"):
        plot_kinds.redraw(trajectory, "receptance", plot_kinds.PlotRequest(component="x"))


def test_points_of_a_command_line():
    assert plot_kinds.point_of("B") == "B"
    assert plot_kinds.point_of("12") == 12
    assert plot_kinds.point_of("0.1,0.02") == (0.1, 0.02)
    with pytest.raises(InputError, match="place x,y in m"):
        plot_kinds.point_of("1,b")


def test_the_default_point_is_one_that_is_displaced(trajectory):
    body = trajectory.basis
    T = body.T.copy()
    assert usual_point(body) == "B"
    T[0, :2], T[0, 2] = 0.0, 1.0  # rotations of a clamped point need not be zero
    fixed = replace(body, T=T)
    assert usual_point(fixed) == 2
    clamped = replace(trajectory, system=replace(trajectory.system, basis=fixed))
    assert not clamped.displacement("B")[:, :2].any()
    assert history(clamped).title == "displacement x of contact node 2"
    assert plot_kinds.redraw(clamped, "phase").axes[0].get_title() == "contact node 2"
    T[4] = 0.0
    assert usual_point(replace(body, T=T)) == "C"
    blind = replace(trajectory, system=replace(
        trajectory.system, basis=replace(body, T=np.zeros_like(T))))
    for draw in (plot_phase, history, largest_displacement):
        with pytest.raises(InputError, match=r"No moving point .* points = { tip = \[x, y\] }"):
            draw(blind)
    assert plot_history(blind, [(0.2, 0.02)]).axes[0].lines


def test_a_force_alone_gives_the_default_component(trajectory):
    for signal, expected in ((Harmonic(2.0, frequency_hz=150.0), "y"), (2.0, "x")):
        load = Load(forces=[PointLoad("C", "y", signal=signal)])
        assert usual_component(replace(trajectory.system, load=load)) == expected


def test_a_spectrum_of_zeros_is_drawn_over_a_linear_axis(trajectory):
    still = replace(trajectory, modal_velocities=np.zeros_like(trajectory.modal_velocities))
    for density in (False, True):
        panel = analysis.plot_spectrum(still, density=density).axes[0]
        panel.figure.canvas.draw()
        assert panel.get_yscale() == "linear"
        assert not panel.lines[0].get_ydata().any()
