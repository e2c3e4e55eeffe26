"""Initial states given at points: rotations, solids, in Python and in study files."""

import numpy as np
import pytest

import fecontact as fc
from fecontact.core.errors import InputError
from fecontact.core.tables import from_table, to_table
from fecontact.integrate import PointStart, initial_state
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.study.sections import SimulationSettings

MASS, SIDES = 2.0, np.array([0.2, 0.3, 0.1])
INERTIA = MASS / 12.0 * ((SIDES**2).sum() - SIDES**2)
CORNERS = np.array([(x, y, -0.05) for x in (-0.1, 0.1) for y in (-0.15, 0.15)])
TOP = np.array([0.04, -0.03, 0.05])


def rigid_rows(places):
    rows = np.tile(np.eye(6), (len(places), 1, 1))
    for row, (x, y, z) in zip(rows, places, strict=True):
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return rows


def block():
    """A free rigid block above the ground."""
    basis = fc.basis_from_matrices(
        np.diag([MASS] * 3 + [*INERTIA]), np.zeros((6, 6)),
        {"contact": rigid_rows(CORNERS), "B": rigid_rows([TOP])[0]}, dimension=3,
        contact_places=CORNERS, tributary=np.full(4, 0.015), damping=0.0)
    return fc.ContactSystem(basis, LinearContact(1e6), ConstantFriction(0.3), gap=1.0)


def rod():
    """A free rigid rod of the plane, with B at its end."""
    mass = np.diag([3.0, 3.0, 0.02])
    row = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.25], [0.0, 0.0, 1.0]])
    basis = fc.basis_from_matrices(mass, np.zeros((3, 3)), {"contact": np.eye(3)[None], "B": row})
    return fc.ContactSystem(basis, LinearContact(1e6), ConstantFriction(0.3), gap=1.0)


def test_six_components_of_a_point_are_a_rigid_motion():
    v, w = np.array([0.1, -0.2, 0.3]), np.array([2.0, -1.0, 0.5])
    system = block()
    state = initial_state(system, PointStart(velocities={"B": (*v, *w)}), 0.0)
    rates = system.basis.contact_T @ state[6:12]
    assert rates[:, :3] == pytest.approx(v + np.cross(w, CORNERS - TOP), rel=1e-12)
    assert rates[:, 3:] == pytest.approx(np.tile(w, (4, 1)), rel=1e-12)
    assert not state[:6].any()


def test_point_pushed_along_z_moves_as_by_an_impulse():
    """Least mass: the motion after an impulse at the point, of a mass 1 / (1/m + r x n ...)."""
    system, n, v = block(), np.array([0.0, 0.0, 1.0]), 0.4
    arm = np.cross(TOP, n)
    impulse = v / (1.0 / MASS + arm @ (arm / INERTIA))
    for given in ((None, None, v), {"z": v}, (None, None, v, None, None, None)):
        state = initial_state(system, PointStart(velocities={"B": given}), 0.0)
        assert 0.5 * state[6:12] @ state[6:12] == pytest.approx(0.5 * impulse * v, rel=1e-12)


def test_rotation_of_a_point_in_the_plane():
    """A given rotation of a free rod is one about its centre; with the end held, about the end."""
    system = rod()
    free = initial_state(system, PointStart({"B": {"phi": 0.01}}), 0.0)
    assert system.basis.contact_T[0] @ free[:3] == pytest.approx([0.0, 0.0, 0.01], abs=1e-15)
    held = initial_state(system, PointStart({"B": (0.0, 0.0, 0.01)}), 0.0)
    assert system.basis.contact_T[0] @ held[:3] == pytest.approx([0.0, -0.0025, 0.01], abs=1e-15)
    run = fc.simulate(system, 0.1, initial=PointStart(velocities={0: (0.0, None, 2.0)}), outputs=2)
    assert system.basis.contact_T[0] @ run.states[-1, :3] == pytest.approx([0.0, 0.0, 0.2],
                                                                           abs=1e-12)


def test_study_files_take_motions_of_points():
    table = {"initial": {"displacements": {"B": {"y": 1e-3, "phi": 0.1}, "0": [0.0, 2e-3]},
                         "velocities": {"B": [0.1, 0.0, 2.0]}}}
    start = from_table(SimulationSettings, table, "[simulation]").initial
    assert start == PointStart({"B": {"y": 1e-3, "phi": 0.1}, 0: (0.0, 2e-3)},
                               {"B": (0.1, 0.0, 2.0)})
    assert to_table(SimulationSettings(initial=start), defaults=False) == table
    # None has no place in a file.
    given = SimulationSettings(initial=PointStart({"B": (None, 1e-3)}))
    assert to_table(given, defaults=False) == {
        "initial": {"displacements": {"B": {"y": 1e-3}}}}
    with pytest.raises(InputError, match=r"table such as \{x = 1e-3\}"):
        SimulationSettings(initial=PointStart({"B": (None, None, 1e-3)}))


def test_wrong_motions_of_points_are_refused():
    for given, message in (((1.0,), "two, three or six finite numbers"),
                           ((1.0, np.inf), "two, three or six finite numbers"),
                           ({"q": 1.0}, "the component 'q' must be one of"),
                           ({"x": "far"}, "two, three or six finite numbers"),
                           ({"x": True}, "two, three or six finite numbers")):
        with pytest.raises(InputError, match=message):
            PointStart({"B": given})
    for system, given, message in (
            (rod(), (0.0,) * 6, "must be two or three numbers, x, y, phi"),
            (block(), (0.0, 1.0), "must be three or six numbers, x, y, z"),
            (rod(), {"z": 1.0}, "the component 'z' must be one of 'phi', 'x', 'y'"),
            (block(), {"phi": 1.0}, "the component 'phi' must be one of 'phi_x'")):
        with pytest.raises(InputError, match=message):
            initial_state(system, PointStart({"B": given}), 0.0)
