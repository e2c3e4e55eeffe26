"""Wear follows the loss in slip, and wears the face until its loads are even."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from systems import TURN, friction_oscillator

from fecontact import (
    AnalysisError,
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    InputError,
    Load,
    Material,
    ModelWarning,
    PointLoad,
    basis_from_matrices,
    modal_basis,
    simulate,
)
from fecontact.integrate import wear_history
from fecontact.io import read_wear, write_wear
from fecontact.laws import (
    ArchardWear,
    ConstantFriction,
    EnergyWear,
    ExponentialFriction,
    Harmonic,
    JenkinsFriction,
    LinearContact,
    PrescribedForce,
    RoughSurface,
)
from fecontact.plot import plot_wear

MU, V, N, THICKNESS = 0.3, 0.5, 60.0, 0.02
STIFFNESS = 2e6


def slider(gap=0.0, nodes=5, **parts):
    """A stiff punch 0.1 m long that cannot tilt, held by a spring on a belt."""
    rows = np.zeros((nodes, 3, 2))
    rows[:, 0, 0] = rows[:, 1, 1] = 1.0
    basis = basis_from_matrices(2.0 * np.eye(2), np.zeros((2, 2)),
                                {"contact": rows, "B": rows[0], "C": rows[0]},
                                contact_x=0.02 * np.arange(nodes), tributary=np.full(nodes, 0.02))
    return ContactSystem(basis, gap=gap, **{
        "normal": LinearContact(STIFFNESS, 2e3),
        "friction": ConstantFriction(MU, smoothing_slope=1e6),
        "ground": Ground(speed=V), "drive": Drive(stiffness_x=1e5, damping_x=500.0),
        "load": Load(N), **parts})


# Laws --------------------------------------------------------------------------------------------

def test_depth_of_steady_sliding():
    """Archard: k N V t / area; energy: k_w mu N V t / area."""
    system = friction_oscillator(2, **{
        "drive.amplitude_x": 0.0, "drive.damping_x": 500.0, "ground.speed": 0.05})
    run = simulate(system, 2.0, initial="sliding")
    mu = abs(float(run.friction_force[-1, 0] / run.normal_force[-1, 0]))
    distance = 14.0 * 0.05 * 2.0 / (1.0 * 0.02)
    # Depths are so small that approx's own absolute tolerance would let anything pass.
    assert run.wear_depth(EnergyWear(1e-13), 0.02)[-1, 0] == pytest.approx(
        1e-13 * mu * distance, rel=1e-6, abs=0.0)
    assert run.wear_depth(ArchardWear(1e-14), 0.02)[-1, 0] == pytest.approx(
        1e-14 * distance, rel=1e-6, abs=0.0)
    with pytest.raises(InputError, match=r"thickness = 0"):
        run.wear_depth(EnergyWear(1e-13), 0)
    with pytest.raises(InputError, match=r"wear_depth"):
        run.wear_depth(1e-13, 1.0)
    for law in (EnergyWear, ArchardWear):
        with pytest.raises(InputError, match=rf"{law.__name__}: coefficient = -1"):
            law(-1.0)


def test_archard_counts_pressed_distance_where_friction_falls_with_speed():
    """Stick-slip at few output times, against normal force times slip at very many."""
    system = friction_oscillator(2, **{"drive.amplitude_x": 0.0, "friction.smoothing_slope": 1e5})
    fine = simulate(system, 4.0, outputs=40001, rtol=1e-7)
    slips = fine.contact_state[:, 0] == 2
    power = np.where(slips, fine.normal_force[:, 0] * np.abs(fine.slip_velocity[:, 0]), 0.0)
    expected = 1e-14 * np.trapezoid(power, fine.time) / 0.02
    assert fine.wear_depth(ArchardWear(1e-14), 0.02)[-1, 0] == pytest.approx(
        expected, rel=2e-3, abs=0.0)
    coarse = simulate(system, 4.0, outputs=21, rtol=1e-7)
    depth = coarse.wear_depth(ArchardWear(1e-14), 0.02)[:, 0]
    assert depth[-1] == pytest.approx(expected, rel=5e-3, abs=0.0)
    assert (np.diff(depth) >= 0.0).all()
    # It wears only in slip, though it creeps in stick.
    assert coarse.creep_work[-1, 0] > 0.0
    assert coarse.slip_work[-1, 0] == pytest.approx(
        coarse.friction_work[-1, 0] - coarse.creep_work[-1, 0], rel=1e-9)


def test_elastic_and_creeping_contacts_wear_nothing():
    """A Jenkins element below its limit; a smoothed contact held at half its limit."""
    x = [[1.0], [0.0], [0.0]]
    point = basis_from_matrices([[1.0]], [[0.0]], {"contact": [x], "C": x})
    for friction in (JenkinsFriction(1e5, 0.4), ExponentialFriction(0.4, 0.4, 0.0, 1e4)):
        push = Load(forces=(PointLoad("C", "x", signal=Harmonic(4.0, 5.0 / TURN)),))
        run = simulate(ContactSystem(point, normal=PrescribedForce(20.0), friction=friction,
                                     load=push), 2.0)
        for law in (EnergyWear(1e-9), ArchardWear(1e-9)):
            # To 1e-6 of what the same motion would wear in slip.
            slid = 1e-9 * 20.0 * np.abs(run.velocity("C")[:, 0]).max() * 2.0 / 0.01
            assert run.wear_depth(law, 0.01).max() < 1e-6 * slid


# Worn gaps ---------------------------------------------------------------------------------------

def test_flat_punch_sinks_by_the_closed_form():
    """One block is as good as many: k_w mu N V T x acceleration over the area."""
    law, period = EnergyWear(2e-13), 0.05
    for blocks, acceleration in ((1, 4e3), (4, 1e3)):
        history = wear_history(slider(), law, THICKNESS, acceleration=acceleration, blocks=blocks,
                               period=period, initial="sliding")
        mu = MU * (2.0 / np.pi) * np.arctan(1e6 * V)
        depth = 2e-13 * mu * N * V * period * 4e3 / (0.1 * THICKNESS)
        assert history.depth[-1] == pytest.approx(np.full(5, depth), rel=1e-6, abs=0.0)
        assert history.cycles[-1] == 4e3
        assert history.time == pytest.approx(period * np.arange(blocks + 1))
        # The body sinks with it: the loads stay, and nothing is shaken.
        assert history.normal_force == pytest.approx(np.full((blocks, 5), N / 5), rel=1e-6)
        system = history.worn(slider())
        assert system.gap == pytest.approx(tuple([depth] * 5), rel=1e-6)
        state = system.contact_history(np.array([history.time[-1]]), history.state[None])
        assert state[0, :, 0] == pytest.approx(np.full(5, N / 5), rel=1e-6)


GAP = (2e-5, 4e-6, 0.0, 7e-6, 1.2e-5)


def evened(acceleration, blocks, law=None):
    law = EnergyWear(1e-13) if law is None else law
    return wear_history(slider(GAP), law, THICKNESS, acceleration=acceleration, blocks=blocks,
                        period=0.01, initial="sliding", outputs=11)


def test_loads_even_out_by_the_closed_form():
    """Deviations from the mean load fall by 1 - rate per block; exp(-rate t) in the limit."""
    mu = MU * (2.0 / np.pi) * np.arctan(1e6 * V)
    # g' = k_w mu V F / area, F = c (u - g): the depth of a cycle over the gap that causes it.
    per_cycle = 1e-13 * mu * V * 0.01 * (STIFFNESS / 5) / (0.02 * THICKNESS)
    total = 2.0 / per_cycle
    first = (STIFFNESS / 5) * (np.mean(GAP) - np.array(GAP))
    assert (first + N / 5 > 0.0).all()
    ends = []
    for blocks in (20, 40):
        history = evened(total / blocks, blocks)
        away = history.normal_force - N / 5
        expected = first * (1.0 - 2.0 / blocks) ** np.arange(blocks)[:, None]
        assert away == pytest.approx(expected, abs=2e-4 * np.abs(first).max())
        # The worn volume follows from the slip work.
        assert np.diff(history.volume) == pytest.approx(
            1e-13 * history.acceleration * history.slip_work.sum(axis=1), rel=1e-12, abs=0.0)
        ends.append(history.depth[-1])
    limit = (1.0 - np.exp(-2.0)) * first / (STIFFNESS / 5)
    off = [np.abs(depth - depth.mean() - limit).max() / np.abs(limit).max() for depth in ends]
    assert off[0] < 0.02
    # The error is of the first order in the acceleration.
    assert off[0] / off[1] == pytest.approx(2.0, rel=0.1)
    archard = evened(total / 20, 20, ArchardWear(1e-13 * mu))
    assert archard.depth[-1] == pytest.approx(evened(total / 20, 20).depth[-1], rel=1e-6, abs=0.0)


def test_too_large_an_acceleration_is_warned_of():
    with pytest.warns(ModelWarning, match=r"Block 1 wears .* choose a smaller acceleration"):
        evened(1e7, 1)


@pytest.fixture(scope="module")
def beam():
    """A beam pressed in its middle, driven to and fro on the ground."""
    body = ElasticBody(rectangle(0.1, 0.01, 12, 2), Material(), THICKNESS)
    basis = modal_basis(body, 6, contact="bottom", contact_nodes=10, B=(0.0, 0.005),
                        C=(0.05, 0.01), damping=0.05)
    return ContactSystem(
        basis, normal=RoughSurface(5e7, 1e-5, 2e3), friction=ConstantFriction(MU, 1e4),
        drive=Drive(stiffness_x=2e6, damping_x=200.0, amplitude_x=2e-4,
                    frequency_hz=20.0), load=Load(400.0))


def test_pressure_below_a_loaded_beam_evens_out(beam, tmp_path):
    """With equal slip along the face, steady wear needs equal pressure."""
    coarse, fine = (wear_history(beam, EnergyWear(8e-12), THICKNESS, acceleration=a, blocks=blocks,
                                 settling=1, outputs=201) for a, blocks in ((1e4, 8), (5e3, 16)))
    uneven = np.ptp(fine.line_load, axis=1) / fine.line_load.mean(axis=1)
    assert uneven[0] > 0.3
    assert uneven[-1] < 0.15 * uneven[0]
    assert (np.diff(uneven) < 0.02 * uneven[0]).all()
    assert fine.normal_force.sum(axis=1) == pytest.approx(np.full(16, 400.0), rel=1e-2)
    # Most is worn off below the load, where it pressed most.
    assert np.argmax(fine.depth[-1]) in (4, 5)
    # Half the acceleration changes the depth by 0.3 %.
    change = np.abs(coarse.depth[-1] - fine.depth[-1]).max() / fine.depth[-1].max()
    assert change < 0.005
    assert coarse.volume[-1] == pytest.approx(
        8e-12 * 1e4 * coarse.slip_work.sum(), rel=1e-12, abs=0.0)
    # Stored and drawn.
    again = read_wear(write_wear(tmp_path / "wear.h5", fine))
    for name in ("x", "tributary", "gap", "cycles", "time", "depth", "normal_force", "state"):
        assert (getattr(again, name) == getattr(fine, name)).all()
    assert (again.law, again.acceleration, again.status) == (fine.law, 5e3, fine.status)
    figure = plot_wear(fine, path=tmp_path / "wear.png")
    profile, load, _ = figure.axes
    drawn = profile.patches[-1].get_data()
    assert drawn.values * 1e-6 == pytest.approx(-fine.depth[-1], rel=1e-9) or (
        drawn.values * 1e-9 == pytest.approx(-fine.depth[-1], rel=1e-9))
    assert drawn.edges[[0, -1]] == pytest.approx([0.0, 100.0])
    assert "largest" in figure.axes[2].get_legend_handles_labels()[1]
    assert len(load.patches) == len(profile.patches) == 6


def test_an_impacting_mass_wears_without_an_equilibrium():
    """Nothing presses it on the ground: the gap opens under it, and the run goes on."""
    oscillator = slider(gap=1e-4, load=Load(0.0), drive=Drive(
        stiffness_y=2e4, damping_y=5.0, stiffness_x=1e5, damping_x=100.0, amplitude_y=4e-4,
        frequency_hz=60.0 / TURN), ground=Ground(speed=V))
    history = wear_history(oscillator, EnergyWear(1e-13), THICKNESS, acceleration=10.0, blocks=2,
                           periods=2)
    assert history.depth[-1].min() > 0.0
    assert history.cycles[-1] == 40.0


@pytest.mark.parametrize(("options", "message"), [
    ({"acceleration": 0.0}, "acceleration = 0"), ({"blocks": 0}, "blocks = 0 must be a whole"),
    ({"periods": 1.5}, r"periods = 1\.5"), ({"settling": -1}, "settling = -1"),
    ({"period": -1.0}, r"period = -1"), ({"thickness": 0.0}, "thickness = 0"),
    ({"law": 1e-13}, "wear_history"),
])
def test_options_are_checked(options, message):
    given = {"law": EnergyWear(1e-13), "thickness": THICKNESS, "acceleration": 10.0, "blocks": 2,
             "period": 0.01, **options}
    with pytest.raises(InputError, match=message):
        wear_history(slider(), **given)


def test_a_cycle_must_be_known():
    with pytest.raises((InputError, AnalysisError), match="period"):
        wear_history(slider(), EnergyWear(1e-13), THICKNESS, acceleration=10.0, blocks=1)
