"""Frequency responses against closed forms, inverted dynamic stiffness, and runs in time."""

import numpy as np
import pytest
from meshes_for_tests import rectangle

from fecontact import (
    AnalysisError,
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    InputError,
    Load,
    Material,
    PointLoad,
    basis_from_matrices,
    equilibrium,
    modal_basis,
    simulate,
)
from fecontact.analysis import receptance
from fecontact.cli.plot_kinds import PlotRequest, redraw
from fecontact.laws import ExponentialFriction, Harmonic, LinearContact, RoughSurface
from fecontact.plot import plot_receptance

MASS = 2.0
SURFACE = RoughSurface(0.3e6, 5.2e-6, 6.0)


def mass(**parts):
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    basis = basis_from_matrices(MASS * np.eye(2), np.zeros((2, 2)),
                                {"contact": rows[None], "B": rows, "C": rows})
    return ContactSystem(basis, **{"friction": ExponentialFriction(0.8, 0.55, 1e3),
                                   "normal": SURFACE, **parts})


F = np.array([0.3, 1.0, 4.0, 4.5, 5.0, 20.0, 300.0])
W = 2.0 * np.pi * F


def test_mass_on_the_spring_of_the_drive():
    system = mass(drive=Drive(stiffness_x=1500.0, damping_x=6.0))
    expected = 1.0 / (1500.0 - MASS * W**2 + 6j * W)
    for kind, power in (("receptance", 0), ("mobility", 1), ("accelerance", 2)):
        found = receptance(system, F, [("B", "x")], kind=kind)
        assert found.values[:, 0, 0] == pytest.approx((1j * W) ** power * expected, rel=1e-10)
    free = receptance(system.basis, F, [("B", "x")], [(0, "x"), (0, "y")])
    assert free.values[:, 0, 0] == pytest.approx(-1.0 / (MASS * W**2), rel=1e-10)
    assert free.values[:, 1, 0] == pytest.approx(np.zeros(len(F)), abs=1e-12)
    assert (found.unit(), free.unit()) == ("m/s^2/N", "m/N")


def test_contact_pressed_by_its_load():
    """Above its roughness height the law is linear: c_N0 with the dashpot beta c_N0."""
    system = mass(normal=RoughSurface(1e6, 1e-6, 200.0), load=Load(50.0),
                  drive=Drive(stiffness_x=1500.0))
    found = receptance(system, F, [("C", "y")], linearised_at="rest")
    expected = 1.0 / (1e6 - MASS * W**2 + 200j * W)
    assert found.values[:, 0, 0] == pytest.approx(expected, rel=1e-9)
    # Half way up the roughness: stiffness c s, damping beta c s with s^2 = 2 F / (c R_Z).
    shallow = system.with_(**{"normal.roughness_height": 1e-3})
    s = np.sqrt(2.0 * 50.0 / (1e6 * 1e-3))
    found = receptance(shallow, F, [("C", "y")], linearised_at="rest")
    expected = 1.0 / (1e6 * s - MASS * W**2 + 200j * s * W)
    assert found.values[:, 0, 0] == pytest.approx(expected, rel=1e-9)


def test_falling_friction_takes_damping_away():
    """Steady sliding: the dashpot and the slope of the friction law, here without smoothing."""
    speed, load = 0.01, 50.0
    friction = ExponentialFriction(0.6, 0.4, 100.0, 1e9)
    system = mass(normal=LinearContact(1e6, 200.0), friction=friction, load=Load(load),
                  ground=Ground(speed=speed), drive=Drive(stiffness_x=1500.0, damping_x=500.0))
    slope = -0.2 * 100.0 * np.exp(-100.0 * speed)
    damping = 500.0 + load * slope
    assert damping < 140.0
    found = receptance(system, F, [("B", "x"), ("B", "y")], linearised_at="sliding")
    expected = 1.0 / (1500.0 - MASS * W**2 + 1j * damping * W)
    assert found.values[:, 0, 0] == pytest.approx(expected, rel=1e-4)
    # Pressing changes friction, which pushes along the ground: mu times the change of F.
    mu = 0.4 + 0.2 * np.exp(-100.0 * speed)
    normal = (1e6 + 200j * W) / (1e6 + 200j * W - MASS * W**2)
    assert found.values[:, 0, 1] == pytest.approx(-mu * normal * expected, rel=1e-4)


@pytest.mark.parametrize("damping", [40.0, 30.0])
def test_response_tells_that_steady_sliding_is_unstable(damping, tmp_path):
    """Falling friction takes more than the dashpot gives: m x'' + d x' + c x = 0, d < 0."""
    speed, load = 0.01, 50.0
    slope = -0.2 * 100.0 * np.exp(-100.0 * speed) * load
    system = mass(normal=LinearContact(1e6, 2000.0), load=Load(load), ground=Ground(speed=speed),
                  friction=ExponentialFriction(0.6, 0.4, 100.0, 1e9),
                  drive=Drive(stiffness_x=1500.0, damping_x=damping - slope - 35.0))
    found = receptance(system, F, [("B", "x")], linearised_at="sliding")
    left = damping - 35.0
    assert found.stable == (left > 0.0)
    assert receptance(system, F, [("B", "x")]).stable
    if not found.stable:
        expected = np.roots([MASS, left, 1500.0])
        assert found.growing == pytest.approx(expected[expected.imag > 0.0], rel=1e-3)
        assert found.growth_in_words == "vibrations at 4.35 Hz grow by 1.25 1/s"
    run = simulate(system, 0.1, initial="sliding")
    redraw(run, "receptance", PlotRequest(component="x"), path=tmp_path / "receptance.svg")
    text = (tmp_path / "receptance.svg").read_text()
    assert ("UNSTABLE" in text) == (left < 0.0)
    figure = plot_receptance([receptance(system, F, [("B", "x")]), found], ["a", "b"])
    assert [line.is_dashed() for line in figure.axes[0].lines] == [False, left < 0.0]


def test_run_in_time_moves_as_the_response_says():
    speed, f, force = 0.01, 3.0, 0.05
    system = mass(normal=LinearContact(1e4, 50.0), ground=Ground(speed=speed),
                  friction=ExponentialFriction(0.6, 0.4, 10.0, 1e5),
                  drive=Drive(stiffness_x=1500.0, damping_x=120.0))
    pushed = ContactSystem(
        system.basis, normal=system.normal, friction=system.friction, ground=system.ground,
        drive=system.drive, load=Load(50.0, (PointLoad("C", "y", signal=Harmonic(
            force, f)),)))
    response = receptance(pushed, f, [("C", "y")], [(0, "x"), ("B", "y")],
                          linearised_at="sliding").values[0, :, 0]
    times = np.concatenate([[0.0], np.linspace(20.0, 21.0, 601) / f])
    run = simulate(pushed, times[-1], initial="sliding", outputs=times, rtol=1e-9)
    turn = np.exp(-2j * np.pi * f * run.time[1:-1])
    moved = np.column_stack([run.displacement(0)[1:-1, 0], run.displacement("B")[1:-1, 1]])
    found = 2j * (turn[:, None] * (moved - moved.mean(axis=0))).mean(axis=0) / force
    assert found == pytest.approx(response, rel=2e-3)


LENGTH, HEIGHT, THICKNESS = 1.0, 0.005, 0.02


def cantilever():
    return ElasticBody(rectangle(LENGTH, HEIGHT, 80, 1),
                       Material(2.1e11, 0.0, 7850.0), THICKNESS, fixed={"left": "xy"})


def test_tip_of_a_cantilever():
    """Euler-Bernoulli between the first resonances at 4.18, 26.2 and 73.3 Hz, and above them."""
    basis = modal_basis(cantilever(), 25, contact="bottom", contact_nodes=1, B=(LENGTH, HEIGHT))
    f = np.array([0.5, 2.0, 3.5, 5.0, 10.0, 20.0, 30.0, 50.0, 80.0])
    found = receptance(basis, f, [("B", "y")]).values[:, 0, 0]
    EI = 2.1e11 * THICKNESS * HEIGHT**3 / 12.0
    beta = (7850.0 * THICKNESS * HEIGHT * (2.0 * np.pi * f) ** 2 / EI) ** 0.25
    x = beta * LENGTH
    expected = (np.sin(x) * np.cosh(x) - np.cos(x) * np.sinh(x)) / (
        EI * beta**3 * (1.0 + np.cos(x) * np.cosh(x)))
    assert expected[0] == pytest.approx(LENGTH**3 / (3.0 * EI), rel=0.02)
    assert found.real == pytest.approx(expected, rel=1e-3)


def test_inverse_of_the_dynamic_stiffness_of_all_degrees_of_freedom():
    mesh = rectangle(0.3, 0.05, 6, 2)
    body = ElasticBody(mesh, Material(), 0.02)
    d = body.mass.shape[0]
    dofs = {"contact": [(0, 1), (4, 5)], "B": [(d - 2, d - 1)]}
    rows = {"contact": np.zeros((2, 3, d)), "B": np.zeros((3, d))}
    for node, pair in enumerate(dofs["contact"]):
        rows["contact"][node, [0, 1], pair] = 1.0
    rows["B"][[0, 1], dofs["B"][0]] = 1.0
    M, K = body.mass.toarray(), body.stiffness.toarray()
    C = 3.0 * M + 2e-6 * K
    basis = basis_from_matrices(M, K, rows, damping=C)
    system = ContactSystem(basis, SURFACE,
                           drive=Drive(stiffness_x=1e7, stiffness_y=3e6, damping_x=400.0),
                           friction=ExponentialFriction(0.8, 0.55, 1e3))
    K[d - 2, d - 2] += 1e7
    K[d - 1, d - 1] += 3e6
    C[d - 2, d - 2] += 400.0
    f = np.array([20.0, 300.0, 1100.0, 6000.0, 2e4])
    places = [("B", "x"), ("B", "y"), (0, "x"), (1, "y")]
    chosen = [d - 2, d - 1, 0, 5]
    found = receptance(system, f, places)
    for w, values in zip(2.0 * np.pi * f, found.values, strict=True):
        inverse = np.linalg.inv(K + 1j * w * C - w**2 * M)[np.ix_(chosen, chosen)]
        assert np.abs(values - inverse).max() < 1e-6 * np.abs(inverse).max()
        assert np.abs(values - values.T).max() < 1e-12 * np.abs(values).max()


def test_beam_on_its_contact_against_jacobian_of_the_statics():
    """At low frequency the response is the change of the equilibrium under a small force."""
    body = ElasticBody(rectangle(0.2, 0.02, 12, 2), Material(), 0.01)
    basis = modal_basis(body, 8, contact="bottom", contact_nodes=5, C=(0.1, 0.02),
                        B=(0.0, 0.01), points={"side": (0.05, 0.02)}, damping=0.01)

    def system(force=0.0):
        return ContactSystem(basis, normal=RoughSurface(1e8, 1e-5, 1e3),
                             friction=ExponentialFriction(0.0, 0.0, 1000.0),
                             load=Load(500.0 + force),
                             drive=Drive(stiffness_x=1e5))

    step = 1.0
    more, less = (equilibrium(system(by)).modal_coordinates for by in (step, -step))
    change = (more - less) / (2.0 * step)
    response = receptance(
        system(), 0.0, [("C", "y")], [("C", "y"), (2, "y"), ("side", "phi")],
        linearised_at="rest").values[0, :, 0]
    expected = [-basis.T[1, 1] @ change, -basis.contact_T[2, 1] @ change,
                -basis.T[basis.point_index("side"), 2] @ change]
    assert response.real == pytest.approx(expected, rel=1e-4)


def test_what_has_no_response():
    system = mass(drive=Drive(stiffness_x=1500.0))
    with pytest.raises(AnalysisError, match="nothing holds the body"):
        receptance(system.basis, [0.0, 1.0], [("B", "x")])
    with pytest.raises(InputError, match=r"kind = 'mobilty' must.*mean 'mobility'"):
        receptance(system, 1.0, [("B", "x")], kind="mobilty")
    with pytest.raises(InputError, match="There is no point 'D'"):
        receptance(system, 1.0, [("D", "x")])
    with pytest.raises(InputError, match="component 'z' at 'B'"):
        receptance(system, 1.0, [("B", "z")])
    with pytest.raises(InputError, match="zero or above"):
        receptance(system, -1.0, [("B", "x")])
    with pytest.raises(InputError, match="give a ContactSystem"):
        receptance(system.basis, 1.0, [("B", "x")], linearised_at="rest")
    with pytest.raises(InputError, match="pair of a point and a component"):
        receptance(system, 1.0, ["B"])
    with pytest.raises(InputError, match="at least one"):
        receptance(system, 1.0, [])
