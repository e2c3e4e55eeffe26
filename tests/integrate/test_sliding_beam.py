"""A beam sliding over waves: its motion and wear converge with contact nodes and modes."""


import numpy as np
import pytest
import sliding_beam as example


@pytest.fixture(scope="module")
def beam():
    return example.body(2.5e-3)


@pytest.fixture(scope="module")
def finest(beam):
    return example.run(example.system(beam, 160), 601)


@pytest.mark.slow
def test_errors_fall_with_the_square_of_the_number_of_nodes(beam, finest):
    errors = np.array([example.error(example.run(example.system(beam, nodes), 601), finest)
                       for nodes in (20, 40, 80)])
    # Against 160 nodes and not infinitely many: (1/20^2 - 1/160^2) / (1/40^2 - 1/160^2) = 4.2,
    # then 5, for errors of the second order.
    motion, wear = errors.T
    assert 3.3 < motion[0] / motion[1] < 5.2
    assert 4.2 < motion[1] / motion[2] < 6.0
    assert 3.7 < wear[0] / wear[1] < 4.7
    assert 4.2 < wear[1] / wear[2] < 6.0
    assert motion[1] < 2e-3
    assert wear[1] < 1e-3


def test_errors_fall_with_the_number_of_modes(beam):
    reference = example.run(example.system(beam, 20, 24), 601)
    errors = [example.error(example.run(example.system(beam, 20, modes), 601), reference)[0]
              for modes in (4, 6, 12, 16)]
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2] > 8.0 * errors[3]
    assert errors[2] < 5e-3
    # Residual vectors stand for the many modes that four leave out.
    completed = example.run(example.system(beam, 20, 4, reduction="residual", tolerance=0.05), 601)
    assert example.error(completed, reference)[0] < 0.1 * errors[0]


def test_energies_balance_and_friction_works_where_pressure_slips(finest):
    assert finest.energies.imbalance < 1e-6
    work = finest.friction_work[-1]
    assert work.sum() == pytest.approx(finest.energies.friction[-1], rel=1e-9)
    # Coefficient times force times slip speed, by a rule of its own over the output times.
    speed = np.abs(finest.slip_velocity)
    mu = (0.5 - 0.35) * np.exp(-2.0 * speed) + 0.35
    power = mu * finest.normal_force * speed * (2.0 / np.pi) * np.arctan(1e4 * speed)
    assert np.trapezoid(power, finest.time, axis=0) == pytest.approx(work, rel=2e-3)
    # The load is carried, and the waves pass, one in the time of the run.
    assert finest.normal_force.sum(axis=1)[50:].mean() == pytest.approx(400.0, rel=1e-3)
    density = example.wear(finest)
    middle = np.abs(finest.system.basis.contact_x - 0.1) < 0.02
    assert density[middle].mean() > 3.0 * density[:16].mean()
