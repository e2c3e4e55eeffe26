"""Pictures of runs are those of the motion, however far apart the outputs are."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import run as made_by_hand
from systems import friction_oscillator, impact_oscillator

import fecontact as fc
from fecontact import read_case, write_case
from fecontact.analysis.resolved import resolved
from fecontact.cli import execute
from fecontact.integrate import SetValued
from fecontact.laws import ExponentialFriction, LinearContact, RoughSurface
from fecontact.output.diagrams.diagram import thinned
from fecontact.plot import plot_contact_map, plot_friction_work, plot_history, plot_phase

MASS, STIFFNESS, SPEED = 2.0, 1e6, 0.3


def point_mass(axis, **parts):
    """One mass, free to move along x or y."""
    rows = np.zeros((3, 1))
    rows["xy".index(axis)] = 1.0
    basis = fc.basis_from_matrices(
        [[MASS]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows})
    return fc.ContactSystem(basis, **{"friction": ExponentialFriction(0.8, 0.55, 1e3),
                                      "normal": RoughSurface(0.3e6, 5.2e-6, 6.0), **parts})


def hit(outputs, t_end=0.05, height=1e-3, **options):
    """A mass flies on a spring: a half sine of 4.4 ms, of v_0 sqrt(k m) at its height."""
    start = np.sqrt(MASS) * np.array([height, -SPEED])
    return fc.simulate(point_mass("y", normal=LinearContact(STIFFNESS)), t_end, initial=start,
                       outputs=outputs, **options)


def drawn(axis, line=0):
    return np.column_stack(axis.lines[line].get_data())


# At 7 outputs the impact lies between two of them; at 2 there are none but its ends.
@pytest.mark.parametrize("outputs", [2, 7, 12])
def test_impacts_have_their_height(outputs):
    run = hit(outputs)
    highest = SPEED * np.sqrt(STIFFNESS * MASS)
    assert run.normal_force.max() < 0.95 * highest
    axes = plot_history(run, ["B"]).axes
    t, force = drawn(axes[2]).T
    assert force.max() == pytest.approx(highest, rel=0.01)
    assert np.trapezoid(force, t) == pytest.approx(2.0 * MASS * SPEED, rel=0.01)
    # So deep is it there, and so fast again.
    assert drawn(axes[0])[:, 1].min() == pytest.approx(
        -SPEED * np.sqrt(MASS / STIFFNESS), rel=0.01)
    assert drawn(axes[1])[:, 1].max() == pytest.approx(SPEED, rel=0.01)
    load = np.asarray(plot_contact_map(run).axes[0].collections[0].get_array())
    assert load.max() == pytest.approx(highest, rel=0.01)


def test_free_oscillation_at_seven_outputs_a_period_is_an_ellipse():
    w, size = 20.0, 1e-3
    system = point_mass("x", drive=fc.Drive(stiffness_x=MASS * w**2))
    periods = 5
    run = fc.simulate(system, periods * 2.0 * np.pi / w, outputs=7 * periods + 1, rtol=1e-8,
                      initial=np.sqrt(MASS) * np.array([size, 0.0]))
    curve = drawn(plot_phase(run).axes[0]) / [size, size * w]
    # Of the line, not of its corners alone.
    between = curve[:-1, None] + np.linspace(0.0, 1.0, 9)[:, None] * np.diff(curve, axis=0)[:, None]
    assert np.abs(np.linalg.norm(between, axis=2) - 1.0).max() < 0.01
    turned = np.unwrap(np.arctan2(curve[:, 1], curve[:, 0]))
    assert abs(turned[-1] - turned[0]) == pytest.approx(2.0 * np.pi * periods, rel=1e-6)


@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_outputs_once_a_period_do_not_look_like_rest(phase):
    w = 20.0
    system = point_mass("x", drive=fc.Drive(stiffness_x=MASS * w**2))
    run = fc.simulate(system, 20.0 * 2.0 * np.pi / w, outputs=21, rtol=1e-8,
                      initial=1e-3 * np.array([np.sin(phase), w * np.cos(phase)]))
    assert np.ptp(run.displacement("B")[:, 0]) < 1e-6
    size = 1e-3 / np.sqrt(MASS)
    assert np.ptp(resolved(run).trajectory.displacement("B")[:, 0]) == pytest.approx(2.0 * size,
                                                                                     rel=0.01)


def test_outputs_stay_and_energies_balance():
    run = fc.simulate(impact_oscillator(2), 1.0, outputs=41, initial=np.zeros(4))
    found = resolved(run)
    fine = found.trajectory
    assert not found.note
    at = np.searchsorted(fine.time, run.time)
    np.testing.assert_array_equal(fine.time[at], run.time)
    np.testing.assert_array_equal(fine.states[at], run.states)
    np.testing.assert_array_equal(fine.work[at], run.work)
    assert fine.energies.imbalance < 1e-4
    assert (np.diff(fine.work[:, 4:], axis=0) > -1e-4 * fine.work.max()).all()
    # Outputs that are fine enough give the same motion, and are left alone.
    dense = fc.simulate(impact_oscillator(2), 1.0, outputs=40_001, initial=np.zeros(4))
    assert resolved(dense).trajectory is dense
    assert fine.normal_force.max() == pytest.approx(dense.normal_force.max(), rel=5e-3)
    height = np.interp(fine.time, dense.time, dense.displacement("B")[:, 1])
    assert np.abs(fine.displacement("B")[:, 1] - height).max() < 1e-3 * np.ptp(height)


def test_slip_is_measured_along_the_motion():
    """Slips bring the mass back by the way that the belt has carried it forth."""
    system = friction_oscillator(2)
    run = fc.simulate(system, 8.0 * 2.0 * np.pi / 13.8, outputs=33)
    fine = resolved(run).trajectory
    creep = np.trapezoid(fine.slip_velocity[:, 0], fine.time)
    moved = run.displacement(0)[-1, 0] - run.displacement(0)[0, 0] - 1e-3 * run.time[-1]
    assert creep == pytest.approx(moved, rel=5e-3)
    heights = [bar.get_height() for bar in plot_friction_work(run).axes[1].patches]
    assert 1e-3 * heights[0] == pytest.approx(np.trapezoid(np.abs(fine.slip_velocity[:, 0]),
                                                           fine.time))


def test_rebounds_shorter_than_the_outputs_are_drawn():
    """A ball on a rigid stop: rebounds of e, e^2 ... that are shorter than the times between."""
    system = point_mass("y", load=fc.Load(9.81 * MASS))
    run = fc.simulate(system, 0.55, initial=np.sqrt(MASS) * np.array([0.1, 0.0]), outputs=12,
                      solver=SetValued(restitution=0.5))
    found = resolved(run)
    assert not found.note
    fine, rate = found.trajectory, found.trajectory.velocity("B")[:, 1]
    fastest = np.sqrt(2.0 * 9.81 * 0.1)
    assert rate.min() == pytest.approx(-fastest, rel=5e-3)
    assert rate.max() == pytest.approx(0.5 * fastest, rel=5e-3)
    second = fine.displacement("B")[fine.time > np.sqrt(2.0 * 0.1 / 9.81), 1]
    assert second.max() == pytest.approx(0.25 * 0.1, rel=5e-3)
    assert fine.normal_force[-1, 0] == pytest.approx(9.81 * MASS)


def test_files_read_back_are_drawn_alike(tmp_path, capsys):
    run = hit(7)
    case = write_case(tmp_path / "hit.vtkhdf", run)
    again = read_case(case).trajectory
    # The file holds forces between the outputs to 7 digits.
    highest = resolved(run).trajectory.normal_force.max()
    assert resolved(again).trajectory.normal_force == pytest.approx(
        resolved(run).trajectory.normal_force, abs=1e-7 * highest)
    assert execute(["plot", str(case), "history", "-o", str(tmp_path / "history.svg")]) == 0
    assert b"straight lines" not in (tmp_path / "history.svg").read_bytes()
    assert execute(["plot", str(case), "phase", "--component", "y", "--t-start", "0.01"]) == 0


def test_pictures_say_where_they_are_too_coarse(tmp_path):
    by_hand = made_by_hand(times=11)
    found = resolved(by_hand)
    assert found.trajectory is by_hand
    assert "has kept nothing" in found.note
    figure = plot_phase(by_hand, 2)
    assert [" ".join(text.get_text().split()) for text in figure.texts] == [found.note]
    wide = plot_history(by_hand, ["B"])
    wide.savefig(tmp_path / "wide.png")
    assert " ".join(wide.texts[0].get_text().split()) == found.note
    assert not plot_phase(hit(7), component="y").texts
    assert "has kept nothing" in resolved(hit(7, keep_steps=False)).note
    # Stand-in for a run that was too long: two of the kept rows are left.
    run = hit(7)
    sparse = replace(run, kept=run.kept.part(slice(None, None, len(run.kept.time) // 2)))
    assert "too long to keep more" in resolved(sparse).note


def test_rounding_of_a_run_at_rest_is_no_motion():
    """Velocities of 1e-17 m/s about a static displacement of 1e-3 m have no peaks to cut."""
    by_hand = made_by_hand(times=11)
    noise = np.random.default_rng(0).standard_normal((11, by_hand.basis.modes))
    rest = replace(by_hand, modal_coordinates=1e-3 * (1.0 + 1e-16 * noise),
                   modal_velocities=1e-17 * noise)
    assert not resolved(rest).note
    assert resolved(replace(rest, modal_velocities=1e-3 * noise)).note


def test_thinned_lines_keep_single_peaks_at_uneven_times():
    t = np.sort(np.random.default_rng(0).uniform(0.0, 1.0, 60_000)) ** 3
    y = np.sin(7.0 * t)
    y[[123, 45_678]] = [5.0, -4.0]
    x, shown = thinned(t, y)
    assert len(x) <= 8000
    assert (shown.max(), shown.min()) == (5.0, -4.0)
    assert (x[0], x[-1]) == (t[0], t[-1])
    assert (np.diff(x) > 0.0).all()
    rest = np.abs(shown) < 2.0
    assert np.abs(np.interp(np.linspace(0.01, 0.99, 500), x[rest], shown[rest])
                  - np.sin(7.0 * np.linspace(0.01, 0.99, 500))).max() < 0.01
