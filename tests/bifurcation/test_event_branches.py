"""Set-valued orbits that are followed from event to event, and ends of their branches."""

import numpy as np
import pytest
from systems import TURN
from test_sliding_bifurcations import (
    DAMPING,
    FILIPPOV,
    STOPS,
    events_of,
    forced,
    gain,
    impacting,
)

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    Shooting,
    amplitude,
    codim2_curve,
    contact_field,
    orbit_branch,
    periodic_motion,
    with_normal_form,
)
from fecontact.bifurcation.continuation.follow import regular
from fecontact.integrate import SetValued, TimeStepping
from fecontact.laws import ConstantFriction, LinearContact, PrescribedForce

GRAZING = 4.0 / gain(0.8)


def skew(drive):
    """A stop with friction whose motions along and across the ground are coupled."""
    rows = [[1.0, 0.5], [0.0, 1.0], [0.0, 0.0]]
    basis = fc.basis_from_matrices(np.eye(2), np.diag([2.0, 0.5]),
                                   {"contact": [rows], "B": rows, "C": rows},
                                   damping=0.1 * np.eye(2))
    return fc.ContactSystem(
        basis, normal=LinearContact(1e6), friction=ConstantFriction(0.3),
        ground=fc.Ground(speed=0.3), load=fc.Load(1.0),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=drive, frequency_hz=2.0 / TURN))


@pytest.mark.parametrize("law", ["newton", "poisson"])
def test_orbits_of_either_impact_law_are_those_of_runs(law):
    """One impact a period, in which the laws differ; multipliers are differences of runs."""
    solver = SetValued(restitution=0.5, impact_law=law)
    system = skew(8.0)
    field = contact_field(system, "drive.amplitude_y")
    motion = periodic_motion(system, solver=solver, initial=[0.0, 0.5, 0.0, 0.0], rtol=1e-9)
    branch = orbit_branch(field, motion, method=Shooting(3, solver=solver), bounds=(7.2, 8.8),
                          options=ContinuationOptions(points=2, step=0.05))
    assert branch.method.segments == (1 if law == "newton" else 3)
    point = branch.points[-1]
    there, period = field.system(np.array([point.parameter])), point.values["period"]
    start = point.u[:4]

    def ends(state):
        return fc.simulate(there, period, initial=state, solver=solver, rtol=1e-12,
                           outputs=2).states[-1]

    assert ends(start) == pytest.approx(start, abs=1e-8)
    known = np.linalg.eigvals(np.array([(ends(start + away) - ends(start - away)) / 2e-6
                                        for away in 1e-6 * np.eye(4)]).T)
    assert np.sort(np.abs(point.values["multipliers"])) == pytest.approx(np.sort(np.abs(known)),
                                                                         abs=1e-5)


def test_points_between_those_of_a_branch_go_from_event_to_event():
    """Den Hartog's (1931) amplitude of an undamped oscillator with Coulomb friction."""
    along, share = np.array([[1.0], [0.0], [0.0]]), 0.3
    system = fc.ContactSystem(
        fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": along[None], "B": along}),
        normal=PrescribedForce(1.0), friction=ConstantFriction(share),
        drive=fc.Drive(stiffness_x=1.0, amplitude_x=1.0, frequency_hz=0.7 / TURN))
    field = contact_field(system, "drive.frequency_hz")
    motion = periodic_motion(system, initial=[0.0, 0.0], solver=SetValued(), transient=400.0)
    branch = orbit_branch(field, motion, method=Shooting(1, solver=SetValued()),
                          bounds=(0.7 / TURN, 0.9 / TURN))
    for ratio in (0.75, 0.85):
        static = 1.0 / (1.0 - ratio**2)
        lag = np.sin(np.pi / ratio) / (ratio * (1.0 + np.cos(np.pi / ratio)))
        at = branch.at(field, ratio / TURN)
        assert at.values["maximum"][0] == pytest.approx(
            np.sqrt(static**2 - (share * lag) ** 2), rel=1e-10)


def test_time_stepping_is_differenced():
    """Above the largest speed of the mass it slips all the time: a linear oscillator."""
    solver = TimeStepping()
    system = forced(speed=3.0)
    motion = periodic_motion(system, solver=solver, rtol=1e-8)
    branch = orbit_branch(
        contact_field(system, "ground.speed"), motion,
        method=Shooting(2, solver=solver, rtol=1e-8), bounds=(2.9, 3.1),
        options=ContinuationOptions(points=1))
    assert branch.method.segments == 2
    assert branch.message == ""
    matrix = np.array([[0.0, 1.0], [-1.0, -2.0 * DAMPING]])
    known = np.exp(np.linalg.eigvals(matrix) * branch.points[0].values["period"])
    found = branch.points[0].values["multipliers"]
    assert found[np.argsort(found.imag)] == pytest.approx(known[np.argsort(known.imag)], abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("nodes", "instead"), [
    (1, r"EventDriven\(\)"), (2, r"smoothing_slope and Auto\(\)")])
def test_time_stepping_of_stick_slip_names_what_to_take(nodes, instead):
    """Time stepping has transitions of first order: Newton's method finds no orbit."""
    system = forced(speed=0.45)
    motion = periodic_motion(system, solver=FILIPPOV, rtol=1e-8)
    if nodes > 1:  # with slip velocities that depend on each other
        rows = np.array([[[1.0], [0.0], [0.0]], [[1.01], [0.0], [0.0]]])
        basis = fc.basis_from_matrices([[1.0]], [[0.5]], {
            "contact": rows, "B": rows[0], "C": rows[0]}, damping=[[2.0 * DAMPING]])
        system = system.with_(basis=basis)
    solver = TimeStepping()
    with pytest.raises(fc.AnalysisError, match=f"runs by time stepping .* take .*{instead}"):
        orbit_branch(contact_field(system, "ground.speed"), motion,
                     method=Shooting(1, solver=solver), bounds=(0.4, 0.5))


def test_static_friction_above_the_kinetic_one():
    """Stick that begins where it just lets go grows from nothing; stick that lasts jumps in."""
    solver = SetValued(static_coefficient=0.5)
    branch = orbit_branch(
        contact_field(forced(speed=1.0), "ground.speed"),
        periodic_motion(forced(speed=1.0), solver=solver, rtol=1e-9), bounds=(0.75, 1.5),
        method=Shooting(1, solver=solver), both=True, options=ContinuationOptions(step=0.02))
    crossing, switching = branch.special
    assert (crossing.kind, crossing.persists) == ("crossing-sliding", True)
    assert (switching.kind, switching.persists) == ("switching-sliding", False)
    at, end = crossing.parameter, switching.parameter
    short = [sum(events_of(forced(speed=at + off), solver)) for off in (-1e-3, 1e-3, 2e-3)]
    assert short[0] == 0.0
    assert short[2] / short[1] == pytest.approx(2.0, abs=0.01)
    lasting = [sum(events_of(forced(speed=end + off), solver))
               for off in (-2e-3, -1e-3, 1e-3, 2e-3)]
    steps = np.abs(np.diff(lasting))
    assert steps[1] > 20.0 * max(steps[0], steps[2])


def test_messages_say_why_runs_are_differenced():
    """Before it rests, the stop is struck ever more quickly."""
    solver = SetValued(restitution=0.5)
    system = skew(2.4)
    motion = periodic_motion(system, solver=solver, initial=[0.0, 0.5, 0.0, 0.0], rtol=1e-9)
    branch = orbit_branch(contact_field(system, "drive.amplitude_y"), motion,
                          method=Shooting(1, solver=solver), bounds=(2.2, 2.6),
                          options=ContinuationOptions(points=1))
    assert branch.message.startswith("The runs of the orbit were differenced: ")


@pytest.fixture(scope="module")
def stop():
    """The oscillator over a stop that it does not touch, and its orbit."""
    system = impacting()
    field = contact_field(system, ["drive.amplitude_y", "drive.frequency_hz"])
    return field, periodic_motion(system, solver=STOPS, initial=[2.0, 0.0], rtol=1e-9)


def over_amplitude(stop, **options):
    both, bounds = options.pop("both", False), options.pop("bounds")
    return orbit_branch(*stop, "drive.amplitude_y", method=Shooting(1, solver=STOPS),
                        bounds=bounds, both=both,
                        options=ContinuationOptions(tolerance=1e-10, **options))


@pytest.mark.parametrize("beyond", [1e-7, 1e-5, 1e-4])
def test_a_bound_just_behind_a_border(stop, beyond):
    branch = over_amplitude(stop, bounds=(1.0, GRAZING + beyond), step=0.02)
    assert branch.status is BranchStatus.BOUND
    assert branch.parameter.max() <= GRAZING + beyond
    assert branch.of_kind("grazing")[0].parameter == pytest.approx(GRAZING, rel=1e-10)


def test_as_many_points_to_both_sides_as_asked_for(stop):
    told = []
    branch = over_amplitude(stop, bounds=(0.2, 3.0), step=0.02, largest_step=0.05, points=16,
                            both=True, progress=told.append)
    assert branch.status is BranchStatus.POINTS
    assert regular(branch.points) == 16
    alone = []
    long = over_amplitude(stop, bounds=(1.0, 3.0), step=0.05, points=14, progress=alone.append)
    assert len(long.of_kind("grazing")) == 1
    assert regular(long.points) == 14
    assert (np.diff(alone) >= 0).all()


def test_a_failure_beyond_a_border_keeps_the_branch(stop, monkeypatch):
    from fecontact.bifurcation.events import branches

    go, calls = branches.continue_branch, []

    def failing(*given, **how):
        calls.append(given)
        if len(calls) > 1:
            raise fc.AnalysisError("No orbit.")
        return go(*given, **how)

    monkeypatch.setattr(branches, "continue_branch", failing)
    branch = over_amplitude(stop, bounds=(1.0, 3.0), step=0.02)
    assert (branch.status, branch.message) == (BranchStatus.STALLED, "No orbit.")
    assert branch.points[-1].kind == "grazing"
    calls.clear()
    branch = over_amplitude(stop, bounds=(1.0, 1.3), step=0.02, both=True)
    assert branch.status is BranchStatus.BOUND
    assert branch.message == "Nothing was found to the other side: No orbit."
    assert branch.parameter[0] == pytest.approx(1.2)


def test_what_borders_take(stop):
    field, _ = stop
    grazing, = over_amplitude(stop, bounds=(1.0, GRAZING + 1e-5), step=0.02).of_kind("grazing")
    over = "drive.frequency_hz"
    box = {"drive.amplitude_y": (0.1, 8.0), over: (0.7 / TURN, 1.2 / TURN)}
    brief = ContinuationOptions(points=2)
    curve = codim2_curve(field, grazing, over, bounds=box, scales=[3.0, 7.0], options=brief)
    assert curve.attributes["scales"][:2].tolist() == [3.0, 7.0]
    with pytest.raises(fc.InputError, match=r"scales = .* must hold 2 numbers above zero"):
        codim2_curve(field, grazing, over, bounds=box, scales=[1.0, -1.0])
    with pytest.raises(fc.InputError, match="is a border of set-valued orbits, which keep="):
        codim2_curve(field, grazing, over, bounds=box, keep="period")
    with pytest.raises(fc.InputError, match="leave one of them out"):
        codim2_curve(field, grazing, over, bounds=box, keep="period", to="fold")
    with pytest.raises(fc.InputError, match="stores no orbit, only its extremes"):
        amplitude([1.0, 0.0])(curve.points[0])


def test_set_valued_orbits_have_no_smooth_normal_form():
    system = impacting(amplitude=2.2)
    field = contact_field(system, ["drive.amplitude_y"])
    motion = periodic_motion(system, solver=STOPS, initial=[2.0, 0.0], rtol=1e-9)
    doubling = orbit_branch(
        field, motion, method=Shooting(1, solver=STOPS), bounds=(2.0, 2.3), direction=-1.0,
        options=ContinuationOptions(step=0.02, stop_at="period doubling")).points[-1]
    with pytest.raises(fc.InputError, match="set-valued system, which has no smooth normal form"):
        with_normal_form(field, doubling)


def test_a_system_at_one_value_alone_has_no_branch():
    def only(system, value):
        if value != 0.1:
            raise fc.InputError("There is no such belt.")
        return system

    system = forced(speed=0.1)
    field = contact_field(system, {"belt": (0.1, only)})
    with pytest.raises(fc.AnalysisError, match="exists at this value of the parameter alone"):
        orbit_branch(field, periodic_motion(system, solver=FILIPPOV, rtol=1e-9),
                     method=Shooting(1, solver=FILIPPOV), bounds=(0.05, 0.2))
