"""Rigid stops without a law of compliance: a ball that bounces, files, studies, messages."""

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact import InputError
from fecontact.bifurcation import Shooting, contact_field, orbit_branch, periodic_motion
from fecontact.integrate import ContactEvents, SetValued
from fecontact.laws import LinearContact, RigidStop

G, HEIGHT, E = 9.81, 0.1, 0.8
RIGID = SetValued(restitution=E)


def ball(normal=None):
    y = [[0.0], [1.0], [0.0]]
    return fc.ContactSystem(fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": [y], "C": y}),
                            normal=normal or RigidStop(), load=fc.Load(G))


def bounced(system):
    return fc.simulate(system, 1.2, initial=[HEIGHT, 0.0], outputs=121, rtol=1e-10, solver=RIGID,
                       events=ContactEvents())


def test_bounces_are_those_of_a_point_mass():
    run = bounced(ball())
    fall = np.sqrt(2.0 * HEIGHT / G)
    touches = run.events.time[[kind == "touch-down" for kind in run.events.kind]][:6]
    assert touches[0] == pytest.approx(fall, rel=1e-9)
    assert np.diff(touches) == pytest.approx(2.0 * fall * E ** np.arange(1, 6), rel=1e-8)
    assert np.isfinite(run.normal_force).all()
    assert run.penetration.max() < 1e-12


def test_the_law_that_is_left_out_makes_no_difference():
    run, other = bounced(ball()), bounced(ball(LinearContact(1e6)))
    assert np.array_equal(run.states, other.states)
    assert np.array_equal(run.normal_force, other.normal_force)


def test_files_hold_it(tmp_path):
    run = bounced(ball())
    fc.write_case(tmp_path / "ball.vtkhdf", run)
    again = fc.read_case(tmp_path / "ball.vtkhdf").trajectory
    assert again.system.normal == RigidStop()
    assert np.array_equal(again.normal_force, run.normal_force)


def test_periodic_impacts_are_followed():
    """A mass on a spring strikes a stop once a period T with the velocity V after the impact.

    x'' + x = sin(w t):
    (V (1 + 1/e) / (2 tan(T/2)))^2 + (V (1 - 1/e) / (2 w))^2 = 1 / (1 - w^2)^2.
    """
    y = [[0.0], [1.0], [0.0]]
    system = fc.ContactSystem(
        fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": [y], "B": y}), normal=RigidStop(),
        drive=fc.Drive(stiffness_y=1.0, amplitude_y=1.0, frequency_hz=2.3 / TURN))
    motion = periodic_motion(system, initial=[0.1, 0.0], transient=200.0 * np.pi, solver=RIGID)
    branch = orbit_branch(contact_field(system, ["drive.frequency_hz"]), motion,
                          "drive.frequency_hz", method=Shooting(1, solver=RIGID),
                          bounds=(2.2 / TURN, 2.5 / TURN))
    assert len(branch) > 3
    for point in branch.points[:: len(branch) // 3]:
        w = TURN * point.parameter
        run = fc.simulate(system.with_({"drive.frequency_hz": point.parameter}), TURN / w,
                          initial=point.u[:2], events=ContactEvents(), solver=RIGID, rtol=1e-10)
        V = run.events.states[0, 1]
        size = np.hypot(V * (1.0 + 1.0 / E) / (2.0 * np.tan(np.pi / w)),
                        V * (1.0 - 1.0 / E) / (2.0 * w))
        assert size == pytest.approx(abs(1.0 / (1.0 - w**2)), rel=1e-6)


@pytest.mark.parametrize("use", [
    lambda: fc.simulate(ball(), 1.0, initial=[HEIGHT, 0.0]),
    lambda: fc.simulate(ball(), 1.0, initial=[HEIGHT, 0.0], solver=SetValued()),
    lambda: fc.equilibrium(ball()),
    lambda: fc.ensemble(ball(), [0.0, 1.0], initial=np.zeros((2, 2))),
    lambda: fc.load_history(ball(), fc.LoadPath(forces={"C.y": (0.0, 1.0)})),
], ids=["run", "set-valued", "equilibrium", "ensemble", "loading"])
def test_what_needs_a_force_of_the_penetration_says_so(use):
    with pytest.raises(InputError, match="RigidStop has no force of the penetration; give"):
        use()
