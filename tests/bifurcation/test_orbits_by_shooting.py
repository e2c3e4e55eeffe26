"""Branches by shooting: switches onto them, driven systems, and settled motions as starts."""

from dataclasses import replace

import impact_orbits
import numpy as np
import pytest
from systems import (
    TURN,
    belt,
    lorenz_field,
    two_mass_field,
    two_mass_system,
    with_force,
)

from fecontact import (
    AnalysisError,
    ContactSystem,
    Drive,
    InputError,
    Load,
    PointLoad,
    basis_from_matrices,
    simulate,
)
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    contact_field,
    equilibrium_branch,
    frequency_response,
    observe,
    orbit_branch,
    periodic_motion,
)
from fecontact.bifurcation.orbits.restored import restored_shooting
from fecontact.integrate import strobe
from fecontact.laws import (
    Frictionless,
    Harmonic,
    JenkinsFriction,
    LinearContact,
    PrescribedForce,
)

FEW = ContinuationOptions(step=5e-3, largest_step=0.05, points=60)


@pytest.fixture(scope="module")
def two_masses():
    field = two_mass_field()
    sliding = equilibrium_branch(field, parameter="B", bounds=(0.3, 8.3))
    orbits = orbit_branch(field, sliding.of_kind("Hopf")[0], method=Collocation(intervals=100),
                          bounds=(0.3, 8.3))
    return field, sliding, orbits


@pytest.mark.parametrize("segments", [1, 4])
def test_extremes_of_a_linear_response_are_those_of_the_closed_form(segments):
    along = np.array([[1.0], [0.0], [0.0]])
    system = ContactSystem(
        basis_from_matrices([[1.0]], [[0.0]], {"contact": along[None], "B": along}),
        normal=PrescribedForce(1.0), friction=Frictionless(),
        drive=Drive(stiffness_x=1.0, damping_x=0.1, amplitude_x=1.0, frequency_hz=0.1))
    branch = orbit_branch(contact_field(system, "drive.frequency_hz"),
                          periodic_motion(system, initial=[0.0, 0.0]), method=Shooting(segments),
                          bounds=(0.1, 0.2))
    for point in branch.points:
        w = TURN * point.parameter
        size = 1.0 / abs(1.0 - w**2 + 0.1j * w)
        assert point.values["maximum"] == pytest.approx([size, w * size], rel=5e-7)
        assert point.values["minimum"] == pytest.approx([-size, -w * size], rel=5e-7)
    # Those of a run from the same start, by many outputs: slopes wrong by 1 % would give 2e-7.
    first = branch.points[0]
    fine = simulate(system, first.values["period"], initial=first.u[:2], outputs=40001,
                    rtol=1e-12).states
    assert first.values["maximum"] == pytest.approx(fine.max(axis=0), rel=3e-8)
    assert first.values["minimum"] == pytest.approx(fine.min(axis=0), rel=3e-8)


def test_an_element_that_slides_at_the_end_of_the_period_keeps_its_deflection():
    """The derivative to the period is that of runs, and steps are as long as elsewhere."""
    along = np.array([[1.0], [0.0], [0.0]])
    basis = basis_from_matrices([[1.0]], [[0.0]], {"contact": along[None], "B": along})

    def system(frequency):
        return ContactSystem(
            basis, normal=PrescribedForce(1.0), friction=JenkinsFriction(2.0, 0.3),
            drive=Drive(stiffness_x=1.0, damping_x=0.02, amplitude_x=1.0, frequency_hz=frequency))

    field = contact_field(system(0.16), "drive.frequency_hz")
    start = periodic_motion(system(0.16), initial=[0.0, 0.0, 0.0], transient=3000.0)
    branch = orbit_branch(field, start, method=Shooting(1), bounds=(0.16, 0.2))
    assert branch.status is BranchStatus.BOUND
    assert len(branch) < 100
    point = branch.points[0]
    assert point.u[2] == pytest.approx(-0.15, abs=1e-12)
    problem, u, _ = restored_shooting(field, point)
    ends = [simulate(system(0.16 + step), 1.0 / (0.16 + step), initial=u[:3], outputs=2,
                     rtol=1e-11).states[-1] for step in (1e-5, -1e-5)]
    assert problem.linearise(u).factors.local[0, :, -1] == pytest.approx(
        (ends[0] - ends[1]) / 2e-5, rel=1e-5, abs=1e-5)


def test_doubled_orbits_agree_with_collocation(two_masses):
    field, _, orbits = two_masses
    doubling, = orbits.of_kind("period doubling")
    near = max((at for at in orbits.points if at.parameter < 8.08), key=lambda at: at.parameter)
    motion = near.orbit(field, 2000)
    shot = orbit_branch(field, motion, "B", method=Shooting(), bounds=(7.5, 8.11), options=FEW)
    found, = shot.of_kind("period doubling")
    assert found.parameter == pytest.approx(doubling.parameter, rel=1e-7)
    twice = orbit_branch(field, found, options=FEW, bounds=(8.05, 8.12))
    wanted = orbit_branch(field, doubling, options=FEW, bounds=(8.05, 8.12))
    for branch in (twice, wanted):
        assert branch.points[-1].parameter == pytest.approx(8.12, rel=1e-12)
    one, other = twice.points[-1].values, wanted.points[-1].values
    assert one["period"] == pytest.approx(other["period"], rel=1e-7)
    assert one["period"] == pytest.approx(2.0 * near.values["period"], rel=0.1)
    assert one["stable"]
    assert other["stable"]
    low, high = (branch.points[-1].values for branch in (
        observe(field, twice, 1), observe(field, wanted, 1)))
    for name in ("observed_minimum", "observed_maximum"):
        assert low[name] == pytest.approx(high[name], rel=1e-4)


def test_events_agree_with_collocation(two_masses):
    """Events at a given period agree between two discretisations with steps of their own."""
    field, _, orbits = two_masses
    near = max((at for at in orbits.points if at.parameter < 7.6), key=lambda at: at.parameter)
    beyond = min((at for at in orbits.points if at.parameter > 7.7), key=lambda at: at.parameter)
    wanted = (near.values["period"] + beyond.values["period"]) / 2.0
    options = ContinuationOptions(step=0.02, points=10, stop_at=["period"],
                                  events={"period": lambda values: values["period"] - wanted})
    places = [orbit_branch(field, near.orbit(field, 2000), "B", method=method, bounds=(7.0, 8.3),
                           options=options).of_kind("period")[0].parameter
              for method in (Shooting(), Collocation(intervals=100))]
    assert near.parameter < places[0] < beyond.parameter
    assert places[0] == pytest.approx(places[1], rel=1e-8)


def test_orbits_of_a_hopf_point_agree_with_collocation(two_masses):
    field, sliding, _ = two_masses
    hopf = sliding.of_kind("Hopf")[0]
    # The branch leaves to smaller B.
    shot = orbit_branch(field, hopf, method=Shooting(segments=3), options=FEW, bounds=(1.1, 8.3))
    assert shot.points[-1].parameter == pytest.approx(1.1, rel=1e-12)
    assert not shot.points[-1].values["stable"]
    beside = orbit_branch(field, hopf, options=FEW, bounds=(1.1, 8.3))
    assert shot.points[-1].values["period"] == pytest.approx(
        beside.points[-1].values["period"], rel=1e-7)


def test_the_drives_frequency_moves_the_ends_of_the_segments():
    """At the end of the range the orbit is the motion of a run that knows nothing of it."""
    branch = impact_orbits.orbits(64.32 / TURN, (64.3 / TURN, 64.5 / TURN), points=25)
    field = impact_orbits.field_at(64.32 / TURN)
    end = observe(field, branch, "B", "y").points[-1]
    assert end.parameter == pytest.approx(64.5 / TURN, rel=1e-9)
    run = strobe(impact_orbits.oscillator(64.5 / TURN), transient_periods=150, keep=2,
                 initial=np.zeros(4), rtol=1e-9)
    row = field.displacement_row("B", "y")
    assert end.values["observed_section"] == pytest.approx(run.states[0, -1:] @ row, rel=1e-5)
    assert np.abs(end.values["multipliers"])[:2] == pytest.approx([0.545, 0.545], abs=0.01)


FOLD = 0.890686833041  # of the two masses over B, by collocation with fine meshes


def island():
    """Orbits from their fold to B = 0.99, twice over: p = -1 to 1 and back is a closed branch."""
    return contact_field(two_mass_system(), {"p": (0.0, lambda system, p: with_force(
        system, FOLD + 0.1 * (1.0 - p * p)))})


def on_island(two_masses, options, segments=4):
    _, _, orbits = two_masses
    near = min((at for at in orbits.points if at.values["stable"]),
               key=lambda at: abs(at.parameter - 0.95))
    motion = replace(near.orbit(samples=2000),
                     parameter_values=[np.sqrt(1.0 - (near.parameter - FOLD) / 0.1)])
    return orbit_branch(island(), motion, method=Shooting(segments), bounds=(-1.5, 1.5),
                        options=options)


@pytest.mark.parametrize("segments", [1, 4])
def test_an_island_of_orbits_is_gone_round_once(two_masses, segments):
    """The branch comes back in another phase; the folds are those over B, at p = -1 and 1."""
    branch = on_island(two_masses, segments=segments,
                       options=ContinuationOptions(largest_step=0.1, points=150))
    assert branch.status is BranchStatus.CLOSED
    assert [point.kind for point in branch.special] == ["fold", "fold"]
    assert [point.parameter for point in branch.special] == pytest.approx([1.0, -1.0], abs=1e-8)
    assert (branch.points[-1].u == branch.points[0].u).all()
    # It had come back: what it closes with is the next step from the point before.
    before, start = branch.points[-2], branch.points[0]
    assert abs(start.values["period"] - before.values["period"]) < 0.1
    assert len(branch) < 70


def test_orbits_in_another_phase_are_met_again(two_masses):
    """A quarter of a period later, off the ends of the segments, it is the same orbit; beside it
    it is not."""
    branch = on_island(two_masses, options=ContinuationOptions(points=2))
    problem, u, _ = restored_shooting(island(), branch.points[0])
    tangent = branch.points[0].tangent
    later = np.concatenate([problem.at_phases(u, problem.mesh[:-1] + 0.217).reshape(-1), u[-2:]])
    assert np.abs(later - u)[:-2].max() > 0.1
    moved = replace(problem, reference=problem.starts(later)[0].copy())
    again = moved.met_again(problem, u, tangent, later, tangent, np.inf)
    assert np.abs(again - later).max() < 1e-6 * np.abs(later).max()
    assert moved.met_again(problem, u, tangent, later, -tangent, np.inf) is None
    other, v, _ = restored_shooting(island(), branch.points[1])
    beside = other.met_again(problem, u, tangent, v, tangent, np.inf)
    assert np.sqrt(other.weights() @ (beside - v) ** 2) == pytest.approx(
        np.sqrt(other.weights() @ (u - v) ** 2), rel=1e-3)


def test_driven_orbits_a_period_of_the_drive_later_are_the_same():
    motion = periodic_motion(impact_orbits.oscillator(30.9 / TURN), initial=np.zeros(4),
                             longest_period=8 * 2.0 * np.pi / 30.9)
    assert motion.periods == 2
    field = impact_orbits.field_at(30.9 / TURN)
    branch = orbit_branch(field, motion, method=Shooting(segments=3),
                          bounds=(30.0 / TURN, 32.0 / TURN), options=ContinuationOptions(points=1))
    problem, u, _ = restored_shooting(field, branch.points[0])
    tangent = branch.points[0].tangent
    later = np.append(problem.at_phases(u, problem.mesh[:-1] + 0.5).reshape(-1), u[-1])
    sizes = np.ptp(motion.states, axis=0)
    assert (np.abs(later - u)[:-1].reshape(3, 4) / sizes).max() > 1e-3
    again = problem.met_again(problem, u, tangent, later, tangent, np.inf)
    assert (np.abs(again - later)[:-1].reshape(3, 4) / sizes).max() < 1e-9


def test_periodic_motions():
    motion = periodic_motion(belt(speed=1e-3), initial=np.zeros(2), transient=6.0,
                             longest_period=2.0)
    # Known from an independent calculation.
    assert motion.period == pytest.approx(1.264348, abs=2e-5)
    driven = periodic_motion(impact_orbits.oscillator(30.9 / TURN), initial=np.zeros(4),
                             longest_period=8 * 2.0 * np.pi / 30.9)
    assert driven.periods == 2
    assert driven.period == pytest.approx(4.0 * np.pi / 30.9, rel=1e-12)
    assert np.abs(driven.states[-1] - driven.states[0]).max() < 1e-3 * np.ptp(driven.states)
    with pytest.raises(AnalysisError, match=r"(does not repeat|has not settled) within 4 periods"):
        periodic_motion(impact_orbits.oscillator(23.63 / TURN), initial=np.zeros(4),
                        transient=10.0, longest_period=4 * 2.0 * np.pi / 23.63)
    with pytest.raises(InputError, match="give transient"):
        periodic_motion(belt(speed=1e-3))


def test_motions_of_both_kinds_are_those_of_runs(two_masses):
    field, _, orbits = two_masses
    point = next(at for at in orbits.points if at.values["stable"] and at.kind is None)
    motion = point.orbit(field, 50)
    run = simulate(field.system(motion.parameter_values), motion.period, initial=motion.states[0],
                   outputs=motion.times, rtol=1e-9)
    assert np.abs(run.states - motion.states).max() < 1e-4 * np.abs(motion.states).max()


def test_kind_errors(two_masses):
    field, sliding, orbits = two_masses
    doubling, = orbits.of_kind("period doubling")
    with pytest.raises(InputError, match="both = True goes with motions, resonances, regular"):
        orbit_branch(field, doubling, both=True)
    with pytest.raises(InputError, match="follow the equilibrium over that one first"):
        orbit_branch(field, sliding.of_kind("Hopf")[0], "ground.speed")
    with pytest.raises(InputError, match="has no orbits to follow"):
        orbit_branch(field, sliding.points[0], method=Shooting())
    with pytest.raises(InputError, match="is no periodic orbit"):
        sliding.points[0].orbit(field)
    with pytest.raises(InputError, match="is no periodic orbit by shooting"):
        restored_shooting(lorenz_field(), sliding.points[0])
    with pytest.raises(InputError, match="start must be two arrays"):
        orbit_branch(field, (1.0, 2.0, 3.0), "B")
    with pytest.raises(InputError, match="segments = 0 must be"):
        Shooting(segments=0)
    assert contact_field(belt(), {}).dimension == 2


def test_two_masses_with_a_unilateral_spring():
    """Published largest displacements (NLvib, example 3), on branches of grown amplitude.

    Masses 1, springs 1 between them and from the second to the base, dashpots 0.03, force 0.1 cos
    on the second mass, spring 100 behind a gap of 1 on the first.
    """
    rows, points = np.zeros((1, 3, 2)), np.zeros((2, 3, 2))
    rows[0, 1, 0] = -1.0
    points[0, 0, 0] = points[1, 0, 1] = 1.0
    K = np.array([[1.0, -1.0], [-1.0, 2.0]])
    basis = basis_from_matrices(np.eye(2), K, {"contact": rows, "one": points[0],
                                               "two": points[1]}, damping=0.03 * K)
    system = ContactSystem(basis, normal=LinearContact(100.0), gap=1.0, load=Load(
        forces=(PointLoad("two", "x", signal=Harmonic(0.1, 0.8 / TURN)),)))
    name, seen = "load.forces.0.signal.frequency_hz", basis.point_row("one", "x")
    response = frequency_response(
        system, (0.5 / TURN, 0.8 / TURN), name, observe=("one", "x"), start=0.8 / TURN,
        method=HarmonicBalance(21, 512, stability=None)).branches[0]
    field = contact_field(system, [name])
    for w, which, largest in ((0.64, 0, 1.0262143), (0.7, -1, 1.0521133)):
        f = w / TURN
        orbit = orbit_branch(
            field, response.at(field, f, which).orbit(field), method=Shooting(),
            bounds=(f, f + 0.01 / TURN), options=ContinuationOptions(points=1)).points[0]
        assert (orbit.orbit(field, 8001).states[:, :2] @ seen).max() == pytest.approx(
            largest, rel=3e-7)
    # Scales grow with the motion: those of the first orbit would take some thousand points.
    shot = orbit_branch(field, response.points[0].orbit(field), method=Shooting(1, rtol=1e-6),
                        bounds=(0.5 / TURN, 0.8 / TURN), direction=-1.0,
                        options=ContinuationOptions(points=500, locate=False))
    assert shot.parameter[-1] == 0.5 / TURN


def test_extremes_between_samples(two_masses):
    """Velocities turn within a stage of stick of a thousandth of a period."""
    field, _, orbits = two_masses
    start = orbits.at(field, 7.5, which=-1)
    one = ContinuationOptions(points=1)
    fine, shot = (orbit_branch(field, start, method=method, options=one, bounds=(0.3, 8.3)
                               ).points[0].values
                  for method in (Collocation(intervals=240), Shooting()))
    size = fine["maximum"] - fine["minimum"]
    for name in ("minimum", "maximum"):
        assert (np.abs(shot[name] - fine[name]) < 2e-6 * size).all()
