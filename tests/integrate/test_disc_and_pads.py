"""The example of a pad on a disc: statics, complex modes, growth and limit cycle."""

import disc_and_pads as example
import numpy as np
import pytest
from scipy.linalg import eig

from fecontact import equilibrium
from fecontact.analysis import complex_modes
from fecontact.integrate import initial_state


@pytest.fixture(scope="module")
def brake():
    return example.brake()


@pytest.fixture(scope="module")
def modes(brake):
    return complex_modes(brake, "sliding")


def forces(system):
    """Normal and friction forces of the nodes in steady sliding, by the laws."""
    q = equilibrium(system, "sliding").modal_coordinates
    penetration = -(system.arrays.rows[:, 1] @ q) - np.asarray(system.gap)
    law = system.normal["pad1"]
    depth = penetration / law.roughness_height
    share = system.basis.tributary / system.basis.tributary.sum()
    f = np.where(depth > 1.0, depth - 0.5, 0.5 * np.maximum(depth, 0.0) ** 2)
    return q, depth, share * law.stiffness * law.roughness_height * f, share


def test_pad_is_in_equilibrium_in_steady_sliding(brake):
    q, _, F, _ = forces(brake)
    basis = brake.basis
    n, places = basis.normals, basis.positions[2 : 2 + basis.contact_nodes]
    t = np.stack([n[:, 1], -n[:, 0]], axis=1)
    v = -0.4 * (t[:, 1] * places[:, 0] - t[:, 0] * places[:, 1])
    R = 0.4 * F * 2.0 / np.pi * np.arctan(1e5 * v)
    acting = [(F[:, None] * n - R[:, None] * t, places)]
    for point, d, c, preload in (("start", (0, 1), 1e5, 1000.0), ("end", (0, 1), 1e5, 1000.0),
                                 ("back", (1, 0), 5e7, 0.0)):
        index = basis.point_index(f"pad1.{point}")
        d = np.array(d, dtype=float)
        pull = preload + c * d @ (basis.T[index, :2] @ q)
        acting.append((-pull * d[None], basis.positions[index][None]))
    force = sum(f.sum(axis=0) for f, _ in acting)
    moment = sum((p[:, 0] * f[:, 1] - p[:, 1] * f[:, 0]).sum() for f, p in acting)
    assert np.abs(force).max() < 1e-6 * 2000.0
    # The faces are polygons: their nodes lie within the smooth face by up to 0.15 mm.
    assert abs(moment) < 1e-3 * 2000.0 * example.RIM
    assert R.sum() == pytest.approx(0.4 * F.sum(), rel=2e-4)
    assert F.sum() == pytest.approx(2000.0, rel=0.03)


def test_modes_are_those_of_differences_of_the_right_hand_side(brake, modes):
    y = initial_state(brake, "sliding", 0.0)
    m = brake.basis.modes
    steps = np.repeat([1e-9, 1e-6], m)
    A = np.stack([(brake.rhs(0.0, y + h * e) - brake.rhs(0.0, y - h * e)) / (2.0 * h)
                  for h, e in zip(steps, np.eye(2 * m), strict=True)], axis=1)
    found = eig(A)[0]
    found = found[found.imag > 0.0]
    for value in modes.eigenvalues:
        assert np.abs(found - value).min() < 1e-5 * abs(value)
    assert len(found) == len(modes.eigenvalues)
    assert modes.grows.sum() == 1


def test_without_friction_modes_are_those_of_a_symmetric_system(brake):
    system = example.with_friction(brake, 0.0)
    q, depth, _, share = forces(system)
    Ty, basis, law = system.arrays.rows[:, 1], system.basis, system.normal["pad1"]
    bearing = np.clip(depth, 0.0, 1.0) * share
    K = np.diag(basis.angular_frequencies**2) + law.stiffness * (Ty.T * bearing) @ Ty
    D = basis.damping + law.damping * (Ty.T * bearing) @ Ty
    m = len(q)
    values = eig(np.block([[np.zeros((m, m)), np.eye(m)], [-K, -D]]))[0]
    values = np.sort_complex(values[values.imag > 0.0] * -1j)
    found = complex_modes(system, "sliding")
    assert found.frequencies_hz == pytest.approx(values.real / (2.0 * np.pi), rel=1e-9)
    assert found.damping_ratios == pytest.approx(values.imag / np.abs(values), rel=1e-6)
    assert (found.damping_ratios > 0.0).all()


def test_the_arrangement_may_stand_anywhere():
    """With all residual vectors; which of them a tolerance keeps depends on the axes x and y."""
    first, turned = (complex_modes(example.brake(turned=angle, tolerance=0.0), "sliding")
                     for angle in (0.0, 37.0))
    assert turned.eigenvalues == pytest.approx(first.eigenvalues, rel=1e-8)


def test_two_opposite_pads_make_pairs_of_modes(modes):
    """Half a turn maps the brake on itself: the growing modes are even or odd."""
    system = example.brake(angles=(90.0, 270.0))
    found = complex_modes(system, "sliding")
    assert found.grows.sum() == 2
    backs = [found.right[: system.basis.modes, found.grows].T @ system.basis.T[
        system.basis.point_index(f"pad{k}.back"), :2].T for k in (1, 2)]
    ratios = (backs[0] / backs[1])[:, 0]
    assert np.sort(ratios.real) == pytest.approx([-1.0, 1.0], abs=1e-5)
    assert found.growing() == pytest.approx(modes.growing()[0], rel=0.02)


def test_a_run_grows_as_its_mode(brake, modes):
    mode = example.flutter_mode(modes)
    rate, frequency = example.growth(brake)
    assert rate == pytest.approx(modes.eigenvalues[mode].real, rel=1e-3)
    assert frequency == pytest.approx(modes.frequencies_hz[mode], rel=1e-5)


def test_limit_cycle(brake, modes):
    run, frequency = example.squeal(brake, 0.012)
    assert 0.9 * modes.growing()[0] < frequency < modes.growing()[0]
    assert abs(run.energies.imbalance) < 1e-4
    sizes = [np.sqrt((run.between(start, start + 2e-3).velocity("pad1.back")[:, 0] ** 2).mean())
             for start in (0.004, 0.008, 0.010)]
    # An eighth of the growth of the linear mode is left, and friction and lift-off hold it.
    assert sizes[2] == pytest.approx(sizes[1], rel=0.1)
    assert np.log(sizes[2] / sizes[1]) < 0.15 * 2e-3 * modes.eigenvalues.real.max()
    stuck = run.between(0.010).contact_state
    assert (stuck == 0).any()
    assert (stuck == 1).any()
