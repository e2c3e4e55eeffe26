"""Frequency responses at several levels: closed forms, starts, files and pictures."""

from dataclasses import replace

import numpy as np
import pytest
from oscillators import duffing, jenkins_amplitude, jenkins_system, unilateral
from systems import TURN, impact_oscillator

from fecontact import (
    Beam,
    ContactSystem,
    Drive,
    ElasticBody,
    Load,
    PointLoad,
    basis_from_matrices,
    generate,
    io,
    modal_basis,
    plot,
    simulate,
)
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    codim2_curve,
    contact_field,
    controlled_response,
    frequency_response,
    orbit_branch,
)
from fecontact.core.errors import AnalysisError, InputError
from fecontact.laws import (
    ConstantFriction,
    Frictionless,
    Harmonic,
    JenkinsFriction,
    LinearContact,
    ParallelSliders,
    PrescribedForce,
)
from fecontact.system.model_limits import unresisted_motion


@pytest.fixture(scope="module")
def response():
    return frequency_response(duffing(), (0.6, 1.8), "W", levels={"P": [0.02, 0.1, 0.18]})


@pytest.mark.parametrize("method", [Collocation(intervals=10), Shooting(1)])
def test_a_response_over_an_amplitude_goes_through_zero(method):
    """A linear oscillator: amplitudes are those at one newton times the force."""
    system = ContactSystem(
        basis_from_matrices([[1.0]], [[1.0]], {"contact": [[[1.0], [0.0], [0.0]]],
                                               "B": [[1.0], [0.0], [0.0]]}, damping=[[0.2]]),
        normal=PrescribedForce(1.0), friction=Frictionless(),
        load=Load(forces=(PointLoad("B", "x", signal=Harmonic(1.0, 2.0 / TURN)),)))
    name = "load.forces.0.signal.amplitude"
    for low in (0.0, -1.0):
        response = frequency_response(system, (low, 1.0), name, method=method)
        branch, = response.branches
        assert branch.status is BranchStatus.BOUND
        ends = branch.parameter[[0, -1]]
        assert sorted(ends) == pytest.approx([low, 1.0], abs=0.0)
        assert response.amplitude() == pytest.approx(
            np.abs(branch.parameter) / abs(1.0 - 4.0 + 0.4j), rel=2e-5, abs=1e-12)
    found = contact_field(system, name)
    motion = branch.points[-1].orbit(found)
    zero = orbit_branch(found, motion, method=method, bounds=(0.0, 1.0), direction=-1.0).points[-1]
    assert orbit_branch(found, zero, bounds=(-1.0, 0.0), direction=1.0).parameter[-1] == -1.0


def test_orbits_by_shooting_end_where_an_element_no_longer_slides():
    """It keeps any deflection there: the branch had gone along these at one frequency."""
    system = ContactSystem(
        basis_from_matrices([[1.0]], [[0.0]], {"contact": [[[1.0], [0.0], [0.0]]],
                                               "B": [[1.0], [0.0], [0.0]]}),
        normal=PrescribedForce(1.0), friction=ParallelSliders(0.5, 1.0, (1.0, 2.0), (3.0, 1.0)),
        drive=Drive(stiffness_x=1.0, damping_x=0.02, amplitude_x=1.0, frequency_hz=0.188))
    branch, = frequency_response(system, (0.188, 0.2), method=Shooting(1)).branches
    assert branch.status is BranchStatus.STALLED
    assert branch.parameter[-1] == pytest.approx(0.18897, abs=1e-5)
    assert "never slides" in branch.message


def test_levels_of_the_duffing_oscillator(response):
    assert response.levels == pytest.approx([0.02, 0.1, 0.18])
    assert [[point.kind for point in branch.special] for branch in response.branches] == [
        [], ["fold", "fold"], ["fold", "fold"]]
    lower = response.branches[2].of_kind("fold")[1]
    assert lower.parameter == pytest.approx(1.11570025, abs=1e-8)
    assert response.peak(2).parameter == pytest.approx(1.2696, abs=2e-3)
    for branch, level in zip(response.branches, response.levels, strict=True):
        assert branch.points[0].parameter == 0.6
        assert branch.points[-1].parameter == 1.8
        p = branch.attributes["parameter_values"]
        assert p[1] == level


@pytest.mark.slow
def test_one_harmonic_meets_the_cubic_equation_of_its_amplitude():
    """[(1 - W^2) A + 3/4 .1 A^3]^2 + (.05 W A)^2 = P^2 along the whole branch, phase included."""
    found = frequency_response(duffing(), (0.6, 1.8), "W", method=HarmonicBalance(1))
    W, A = found.branches[0].parameter, np.abs(found.harmonic(1))
    elastic, damped = (1.0 - W**2) * A + 0.075 * A**3, 0.05 * W * A
    assert np.hypot(elastic, damped) == pytest.approx(0.18, rel=1e-5)
    # The force is a cosine, a quarter of a period ahead of a sine.
    lag = np.angle(found.harmonic(1))
    assert np.cos(lag) == pytest.approx(elastic / 0.18, abs=1e-5)
    assert np.sin(lag) == pytest.approx(-damped / 0.18, abs=1e-5)
    assert found.phase()[0] == pytest.approx(np.pi / 2.0, abs=0.1)
    assert found.phase()[-1] == pytest.approx(-np.pi / 2.0, abs=0.1)
    assert (np.diff(found.phase()) < 1e-6).all()


@pytest.mark.slow
def test_one_harmonic_of_a_jenkins_element_over_frequency_and_force():
    system = jenkins_system()
    method, coarse = HarmonicBalance(1, samples=256), ContinuationOptions(largest_step=0.2)
    found = frequency_response(system, (1.1 / TURN, 1.3 / TURN), method=method, options=coarse,
                               levels={"drive.amplitude_x": [1.0, 1.5]})
    for level, force in enumerate((1.0, 1.5)):
        branch = found.branches[level]
        exact = [jenkins_amplitude(w, force) for w in TURN * branch.parameter]
        assert np.abs(found.harmonic(1, level)) == pytest.approx(exact, rel=1e-3)
        assert branch.column("stable").all()
    over = frequency_response(system.with_(**{"drive.frequency_hz": 1.1 / TURN}), (0.7, 2.0),
                              "drive.amplitude_x", method=method, options=coarse)
    exact = [jenkins_amplitude(1.1, force) for force in over.branches[0].parameter]
    assert np.abs(over.harmonic(1)) == pytest.approx(exact, rel=1e-3)


def test_small_forces_give_the_linear_response():
    """At an amplitude at which nothing slides: 1 / (1.5 - w^2 + .02 i w) times the force."""
    system = jenkins_system(amplitude=1e-3)
    found = frequency_response(system, (0.5 / TURN, 1.0 / TURN), method=HarmonicBalance(3, 256),
                               options=ContinuationOptions(largest_step=0.2))
    w = TURN * found.branches[0].parameter
    linear = 1e-3 / (1.5 - w**2 + 0.02j * w)
    assert 1j * found.harmonic(1) == pytest.approx(linear, rel=1e-5)


def test_unilateral_response_agrees_with_collocation_and_a_run():
    field = unilateral()
    system = field.system()
    found = frequency_response(system, (0.85 / TURN, 0.95 / TURN), observe=("B", "y"),
                               method=HarmonicBalance(30, 512),
                               options=ContinuationOptions(largest_step=0.2))
    branch = found.branches[0]
    here = branch.at(field, 0.9 / TURN)
    other = orbit_branch(
        field, here.orbit(field), method=Collocation(150), bounds=(0.9 / TURN, 0.91 / TURN),
        options=ContinuationOptions(points=1)).points[0]
    assert here.values["minimum"] == pytest.approx(other.values["minimum"], rel=5e-4)
    assert here.values["maximum"] == pytest.approx(other.values["maximum"], rel=5e-4)
    assert here.values["stable"]
    T = 2.0 * np.pi / 0.9
    moved = system.with_(**{"drive.frequency_hz": 0.9 / TURN})
    # A multiplier of -0.93 makes runs settle slowly: start on the orbit.
    start = here.orbit().states[0]
    run = simulate(moved, T, initial=start, rtol=1e-9, outputs=2001).states
    assert run[-1] == pytest.approx(start, abs=2e-3)
    assert here.values["maximum"][0] == pytest.approx(run[:, 0].max(), rel=1e-3)
    assert here.values["minimum"][0] == pytest.approx(run[:, 0].min(), rel=1e-3)


def test_files_give_back_what_was_written(response, tmp_path):
    again = io.read_response(io.write_response(tmp_path / "response.h5", response))
    assert again.level_name == "P"
    assert again.levels == pytest.approx(response.levels)
    assert again.observed == response.observed
    for level in range(3):
        assert again.amplitude(level) == pytest.approx(response.amplitude(level), rel=1e-15)
        assert again.harmonic(3, level) == pytest.approx(response.harmonic(3, level), rel=1e-15)
    assert repr(again) == repr(response)
    io.write_branch(tmp_path / "branch.h5", response.branches[0])
    with pytest.raises(InputError):
        io.read_response(tmp_path / "branch.h5")


def test_picture_has_stable_and_unstable_parts_of_each_level(response, tmp_path):
    figure = plot.plot_response(response, path=tmp_path / "response.png")
    upper, lower = figure.axes
    styles = {line.get_linestyle() for line in upper.lines}
    assert {"-", "--"} <= styles
    assert len({line.get_color() for line in lower.lines}) == 3
    assert (tmp_path / "response.png").stat().st_size > 10_000


def test_picture_of_a_phase_that_changes_little_has_ticks(response):
    """Far below the resonance, where no multiples of 45 degrees lie within the axis."""
    level = replace(response.branches[0], points=response.branches[0].points[:3])
    lower = plot.plot_response(replace(response, branches=(level,), levels=(0.02,))).axes[1]
    low, high = lower.get_ylim()
    assert high - low < 45.0
    assert ((lower.get_yticks() >= low) & (lower.get_yticks() <= high)).sum() > 1


@pytest.mark.parametrize(("changes", "told"), [
    ({"levels": {"P": [1.0], "W": [1.0]}}, "levels has 2 names"),
    ({"levels": {"Q": [1.0]}}, "Q"),
    ({"observe": [1.0]}, "observe must hold 2 numbers"),
    ({"parameter": "X"}, "X"),
    ({"levels": {"W": [1.0]}}, "levels are those of 'W', over which the response runs"),
    ({"method": HarmonicBalance([0, 2])}, r"\[0, 2\] leave out all harmonics .*, \[1\]; add"),
    ({"start": 5.0}, "outside the bounds")])
def test_bad_arguments(changes, told):
    given = {"parameter": "W", **changes}
    with pytest.raises(InputError, match=told):
        frequency_response(duffing(), (0.6, 1.8), **given)


def test_a_fold_by_harmonic_balance_starts_no_curve_by_itself(response):
    fold = response.branches[2].of_kind("fold")[0]
    with pytest.raises(InputError, match=r"follow a branch from it by orbit_branch\(field, point"):
        codim2_curve(duffing(), fold, "P", bounds={"W": (0.6, 1.8), "P": (0.1, 0.3)})


@pytest.mark.parametrize(("bounds", "told"), [
    (None, "bounds = None must be two finite values of 'drive.frequency_hz'"),
    ((-0.1, 0.2), "bounds: drive.frequency_hz = -0.1 must be a finite number, zero or above")])
def test_bad_bounds(bounds, told):
    with pytest.raises(InputError, match=told):
        frequency_response(jenkins_system(), bounds)


@pytest.mark.parametrize("method", [HarmonicBalance(3), Collocation(12), Shooting()])
def test_a_load_of_another_frequency_has_no_common_period(method):
    """At 0.17 Hz the load of 0.11 Hz has one with the drive, but nowhere beside it."""
    load = Load(forces=(PointLoad("B", "x", signal=Harmonic(0.1, 0.11)),))
    system = jenkins_system().with_(friction=ConstantFriction(0.1, 10.0), load=load)
    with pytest.raises(AnalysisError, match=r"9\.09091 s.* have no common multiple; choose"):
        frequency_response(system, (0.17, 0.2), method=method)


def test_levels_and_harmonics_that_a_response_lacks(response):
    """Levels are those of three branches, of nine harmonics."""
    for call in (response.peak, response.amplitude, response.peak_reached, response.phase):
        with pytest.raises(InputError, match="level = 3 must be the number of one of its 3 levels"):
            call(3)
    for k in (10, -1):
        with pytest.raises(InputError, match=f"k = {k} must be a whole number from 0 to 9"):
            response.harmonic(k)


def test_system_without_excitation_is_refused():
    system = impact_oscillator().with_(**{"drive.amplitude_y": 0.0})
    for method in (HarmonicBalance(), Shooting()):
        with pytest.raises(InputError, match="frequency response needs a harmonic drive or load"):
            frequency_response(system, (10.0, 11.0), observe=("B", "y"), method=method)
    assert contact_field(impact_oscillator(), ["drive.frequency_hz"]).dimension == 4


@pytest.mark.parametrize("changes", [{"drive.amplitude_y": 0.0}, {"drive.stiffness_y": 0.0}])
def test_frequency_of_a_drive_that_moves_nothing_is_refused(changes):
    pushed = Load(forces=(PointLoad("B", "y", signal=Harmonic(1.0, 12.0)),))
    system = impact_oscillator().with_({"load": pushed, **changes})
    force = "load.forces.0.signal.frequency_hz"
    with pytest.raises(InputError, match=force.replace(".", r"\.")):
        frequency_response(system, (10.0, 11.0), observe=("B", "y"))
    with pytest.raises(InputError, match=force.replace(".", r"\.")):
        controlled_response(system, (10.0, 11.0), 1e-5, "load.forces.0.signal.amplitude",
                            observe=("B", "y"))


def test_a_rigid_motion_that_nothing_resists_is_named(monkeypatch):
    """A spring at one point lets a beam turn, unless its contact presses back."""
    body = ElasticBody(generate(Beam(length=0.2, height=0.01)), thickness=0.02)
    system = ContactSystem(
        modal_basis(body, 4, contact_nodes=3), normal=PrescribedForce(100.0),
        friction=JenkinsFriction(stiffness=2e5, friction_coefficient=0.3),
        drive=Drive(stiffness_x=1e5, stiffness_y=1e7, amplitude_x=1e-3, frequency_hz=60.0))
    assert unresisted_motion(system) == ("Nothing but friction resists a rotation of the body; "
                                         "give it a support, a spring or a damper.")
    assert unresisted_motion(replace(system, normal=LinearContact(1e8))) is None

    def no_orbit(*given):
        raise AnalysisError("Newton's method does not converge.")

    for name in ("_from_rest", "_raised", "_from_run"):
        monkeypatch.setattr(f"fecontact.bifurcation.harmonic.forced_starts.{name}", no_orbit)
    with pytest.raises(AnalysisError, match="Nothing but friction resists a rotation"):
        frequency_response(system, (40.0, 160.0))
