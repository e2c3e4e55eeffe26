"""The example of a disc between two pads as solids: statics, complex modes, growth, squeal."""

import disc_brake as example
import numpy as np
import pytest
from scipy.linalg import eig

import fecontact as fc
from fecontact.analysis import complex_modes
from fecontact.integrate import initial_state


@pytest.fixture(scope="module")
def brake():
    return example.brake()


@pytest.fixture(scope="module")
def modes(brake):
    return complex_modes(brake, "sliding")


def test_calliper_holds_what_friction_carries_along(brake):
    """Friction of a pad against the springs at its back, forces and moments about its middle."""
    state = initial_state(brake, "sliding", 0.0)
    contact = brake.contact_history(np.zeros(1), state[None])[0]
    basis, stiffness = brake.basis, np.array(example.HELD)
    for name, outward, (nodes, _, _) in zip(example.PADS, (1.0, -1.0), brake.law_groups("normal"),
                                            strict=True):
        normal, sliding = contact[nodes, 0], contact[nodes][:, [1, 6]]
        force = normal[:, None] * basis.normals[nodes] - np.einsum(
            "nk,nkd->nd", sliding, basis.tangents[nodes])
        # Friction of all nodes is mu F along the disc's motion, about the axis.
        places = basis.contact_places[nodes]
        ahead = np.column_stack([-places[:, 1], places[:, 0]])
        ahead /= np.linalg.norm(ahead, axis=1)[:, None]
        assert force[:, :2] == pytest.approx(0.3 * normal[:, None] * ahead, abs=1e-9 * normal.max())
        back = basis.point_index(f"{name}.back")
        motion = basis.T[back] @ state[: basis.modes]
        held = -stiffness * motion
        held[2] -= outward * example.PRESS
        assert force.sum(axis=0) + held[:3] == pytest.approx(0.0, abs=1e-8 * example.PRESS)
        moment = np.cross(places - basis.positions[back], force).sum(axis=0)
        assert moment + held[3:] == pytest.approx(0.0, abs=1e-8 * example.PRESS * example.RADIUS)
        assert normal.sum() == pytest.approx(example.PRESS, rel=5e-3)


def test_modes_are_those_of_differences_of_the_right_hand_side(brake, modes):
    y = initial_state(brake, "sliding", 0.0)
    m = brake.basis.modes
    steps = np.repeat([1e-9, 1e-6], m)
    A = np.stack([(brake.rhs(0.0, y + h * e) - brake.rhs(0.0, y - h * e)) / (2.0 * h)
                  for h, e in zip(steps, np.eye(2 * m), strict=True)], axis=1)
    found = eig(A)[0]
    for value in modes.eigenvalues:
        assert np.abs(found - value).min() < 1e-5 * abs(value)
    assert modes.grows.sum() == 1


def test_without_friction_nothing_grows_and_with_it_one_mode(modes):
    largest = [complex_modes(example.brake(friction), "sliding").eigenvalues.real.max()
               for friction in (0.0, 0.1, 0.2)]
    assert max(largest) < 0.0
    assert modes.growing() == pytest.approx([8277.82], rel=1e-3)


def test_a_disc_that_turns_backwards_squeals_alike(modes):
    """The brake is symmetric about y = 0, and so are its modes."""
    back = example.brake().with_(**{f"interfaces.{name}.sliding.speed": -example.SPEED
                                    for name in example.PADS})
    found = complex_modes(back, "sliding")
    assert found.eigenvalues == pytest.approx(modes.eigenvalues, rel=1e-6)


@pytest.mark.parametrize("friction", [0.3, 0.5])
def test_a_run_grows_as_its_mode(friction):
    system = example.brake(friction)
    modes = complex_modes(system, "sliding")
    mode = example.flutter_mode(modes)
    rate, frequency = example.growth(system)
    assert rate == pytest.approx(modes.eigenvalues[mode].real, rel=1e-6)
    assert frequency == pytest.approx(modes.frequencies_hz[mode], rel=1e-8)


def test_pads_lift_off_and_the_squeal_keeps_its_size(brake, modes):
    run, frequency = example.squeal(brake, 0.012)
    assert abs(run.energies.imbalance) < 1e-5
    # Contacts that open are softer: below the frequency of the mode.
    assert 0.95 * modes.growing()[0] < frequency < 0.98 * modes.growing()[0]
    sizes = [np.ptp(run.between(start, start + 2e-3).displacement("pad1.back")[:, 1])
             for start in (0.0, 0.006, 0.008, 0.01)]
    assert sizes[2] == pytest.approx(sizes[3], rel=0.25)
    # Linear growth of the mode would give a factor of more than four.
    assert sizes[3] < 0.75 * sizes[0] * np.exp(modes.eigenvalues.real.max() * 0.01)
    states = run.between(0.008).contact_state
    assert 0.02 < (states == fc.ContactState.OPEN).mean() < 0.2
