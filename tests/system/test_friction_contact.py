"""The contact element of blade dynamics: closed form of its cycle, separation, names in files."""

import numpy as np
import pytest
from systems import TURN

from fecontact import (
    ContactSystem,
    InputError,
    Load,
    PointLoad,
    Study,
    basis_from_matrices,
    simulate,
)
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
)
from fecontact.laws import (
    FrictionContact3D,
    Harmonic,
    JenkinsFriction,
    LinearContact,
)

KN, KT, MU = 2.0, 1.5, 0.4
SLOPE = 0.5  # penetration over tangential displacement
SEEN = "load.forces.0.signal.frequency_hz"


def element(preload):
    return FrictionContact3D(KN, KT, MU, preload)


def oscillator(preload, force, w=1.1, direction=None):
    """A mass on one spring whose contact node moves along the ground and, in phase, into it.

    In the plane, or in space along a direction of the ground. A constant load balances the preload.
    """
    along = np.array([1.0, 0.0] if direction is None else [*direction, 0.0])
    row = along - SLOPE * np.eye(len(along))[-1]
    rows = {"contact": [row[:, None]], "C": along[:, None]}
    basis = basis_from_matrices([[1.0]], [[1.0]], rows, damping=[[0.04]], dimension=len(along))
    return ContactSystem(basis, normal=element(preload), load=Load(forces=(
        PointLoad("C", tuple(along), signal=Harmonic(force, w / TURN)),
        PointLoad("C", tuple(along), signal=SLOPE * preload))))


def loop(low, high, preload):
    """Corners (k, 2) of displacement and friction force between two extremes of displacement.

    Friction slides on the lines +-mu (N0 + kn r x), between them it follows the spring. A contact
    that opens at x = -N0 / (kn r) has no friction, and slides as soon as it closes.
    """
    def limit(x):
        return MU * (preload + KN * SLOPE * x)

    rate = MU * KN * SLOPE
    touch = -preload / (KN * SLOPE)
    start = max(low, touch)
    down = high - 2.0 * limit(high) / (KT + rate)
    assert down > start
    corners = [(high, limit(high)), (down, -limit(down)), (start, -limit(start))]
    if start == low:
        up = low + 2.0 * limit(low) / (KT - rate)
        assert up < high
        corners.append((up, limit(up)))
    return np.array(corners)


def area(corners):
    x, R = corners.T
    return 0.5 * abs(x @ np.roll(R, -1) - R @ np.roll(x, -1))


def steady_cycle(system, w=1.1, cycles=60):
    """Displacements, friction forces (200,), normal forces and friction loss of the last cycle."""
    T = 2.0 * np.pi / w
    run = simulate(system, (cycles + 1) * T, outputs=(cycles + 1) * 200 + 1, rtol=1e-8)
    last = slice(-201, None)
    x = run.displacement("C")[last, : system.basis.dimension - 1]
    return x, run.friction_force[last, 0], run.normal_force[last, 0], np.ptp(
        run.energies.friction[last])


@pytest.mark.parametrize(("preload", "opens"), [(2.6, False), (0.5, True)])
def test_cycle_loses_the_area_of_its_loop(preload, opens):
    """In a steady cycle; friction follows the corners of the loop."""
    x, R, F, lost = steady_cycle(oscillator(preload, 1.0 + 0.5 * (preload > 1.0)))
    x = x[:, 0]
    corners = loop(x.min(), x.max(), preload)
    assert lost == pytest.approx(area(corners), rel=2e-3)
    assert (F == 0.0).any() == opens
    assert pytest.approx(np.maximum(0.0, preload + KN * SLOPE * x), abs=1e-9) == F
    sliding = (np.gradient(x) < 0.0) & (x < corners[1, 0]) & (x > corners[2, 0])
    assert sliding.any()
    assert R[sliding] == pytest.approx(-MU * F[sliding], rel=1e-6)


def test_cycle_in_two_directions_is_that_of_the_plane():
    """Along a straight line friction in two directions is that in one."""
    plane = steady_cycle(oscillator(0.5, 1.0), cycles=20)
    x, R, F, lost = steady_cycle(oscillator(0.5, 1.0, direction=(0.6, 0.8)), cycles=20)
    assert x @ [0.6, 0.8] == pytest.approx(plane[0][:, 0], abs=1e-6)
    assert pytest.approx(0.6 * plane[1], abs=1e-6) == R
    assert pytest.approx(plane[2], abs=1e-6) == F
    assert lost == pytest.approx(plane[3], rel=1e-6)


@pytest.mark.parametrize("preload", [2.6, 0.5])
def test_harmonic_balance_of_the_element_agrees_with_the_run(preload):
    system = oscillator(preload, 1.0 + 0.5 * (preload > 1.0))
    field = contact_field(system, [SEEN])
    point = frequency_response(
        field, (1.1 / TURN, 1.15 / TURN), SEEN, observe=("C", "x"), method=HarmonicBalance(
            9, 1024, stability=None), options=ContinuationOptions(points=1)).branches[0].points[0]
    x, *_ = steady_cycle(system)
    assert point.values["observed_amplitude"] == pytest.approx(np.ptp(x) / 2.0, rel=2e-3)


TEXT = """
geometry = { shape = "beam", length = 0.1, height = 0.01, element_size = 0.005 }
basis = { modes = 5, contact_nodes = 4 }
[body]
material = "steel"
thickness = 1.0
[normal]
law = "friction-contact-3d"
normal_stiffness = 2e6
tangential_stiffness = 1e6
friction_coefficient = 0.4
preload = 30.0
"""


def test_element_in_a_study_is_both_laws():
    study = Study.from_toml(TEXT)
    assert study.normal == FrictionContact3D(2e6, 1e6, 0.4, 30.0)
    assert Study.from_toml(study.to_toml()) == study
    system = study.system()
    assert system.normal == LinearContact(2e6, 0.0, 30.0)
    assert system.friction == JenkinsFriction(1e6, 0.4)
    softer = study.with_(**{"normal.tangential_stiffness": 5e5}).system()
    assert softer.friction == JenkinsFriction(5e5, 0.4)
    own = TEXT.replace("[normal]", "[interfaces.contact.normal]")
    assert Study.from_toml(own).system().friction == {
        "contact": JenkinsFriction(1e6, 0.4)}


def test_friction_beside_the_element_is_refused():
    with pytest.raises(InputError, match=r"\[normal\]: .* friction of its own"):
        Study.from_toml(TEXT + "[friction]\nlaw = 'frictionless'\n").system()
    basis = oscillator(1.0, 1.0).basis
    with pytest.raises(InputError, match="friction of its own; leave out friction = Jenkins"):
        ContactSystem(basis, normal=element(1.0), friction=JenkinsFriction(1.0, 0.3))
    with pytest.raises(InputError, match=r"interface 'contact'.* friction of its own"):
        ContactSystem(basis, normal={"contact": element(1.0)},
                      friction={"contact": JenkinsFriction(1.0, 0.3)})
    with pytest.raises(InputError, match=r"preload = .* both of the whole face or both of each"):
        FrictionContact3D((1.0, 2.0), 1.0, 0.3, 4.0)
