"""Fits of mechanical models: loops, decays, modes, responses, histories, against known truths."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

import fecontact as fc
from fecontact.bifurcation import ContinuationOptions, HarmonicBalance
from fecontact.fitting import (
    BackboneData,
    DecayData,
    FrequencyData,
    HistoryData,
    LoopData,
    ReceptanceData,
    ResponseData,
)
from fecontact.laws import (
    BoucWenFriction,
    ConstantFriction,
    IwanFriction,
    JenkinsFriction,
    LuGreFriction,
    PrescribedForce,
)
from fecontact.measured import AmplitudeCurve, ring_down
from fecontact.study import FitParameter

ROW = np.array([[1.0], [0.0], [0.0]])


def mass(spring=5e4, damping=0.0, **parts):
    """A mass of 2 kg on a spring, with a contact node along x."""
    body = fc.basis_from_matrices([[2.0]], [[spring]], {"contact": ROW[None], "B": ROW, "C": ROW},
                                  damping=[[damping]])
    return fc.ContactSystem(body, **{"normal": PrescribedForce(50.0),
                                     "friction": ConstantFriction(0.0), **parts})


def state(system, displacement):
    y = np.zeros(system.size)
    y[0] = displacement * np.sqrt(2.0)
    return y


# Hysteresis loops --------------------------------------------------------------------------------

PULL = 1e-3 * np.concatenate([np.linspace(0.0, 1.0, 20), np.linspace(1.0, -1.0, 40)[1:],
                              np.linspace(-1.0, 1.0, 40)[1:]])
IWAN = {"friction.stiffness": FitParameter(1e5, 1e7, scale="log"),
        "friction.friction_coefficient": FitParameter(0.05, 2.0, scale="log")}


def iwan(stiffness=1e6, coefficient=0.4, drive=1e6):
    return mass(1e4, friction=IwanFriction(stiffness=stiffness, friction_coefficient=coefficient),
                drive=fc.Drive(stiffness_x=drive))


def noisy_loops(trials, noise):
    """Fits of a loop with noise, in parts of the largest force; counts of covered truths."""
    truth = iwan()
    force = LoopData(PULL, np.zeros(len(PULL)), 1.0).predicted(truth)
    deviation = noise * np.abs(force).max()
    rng = np.random.default_rng(7)
    covered = np.zeros(2)
    for _ in range(trials):
        data = LoopData(PULL, force + deviation * rng.standard_normal(len(force)), deviation)
        found = fc.fit(iwan(5e5, 0.3), IWAN, data)
        for k, (name, low_high) in enumerate(found.intervals().items()):
            covered[k] += low_high[0] <= truth.parameter(name) <= low_high[1]
    return covered


def test_jenkins_loop_is_found_without_noise():
    """Force of the drive over its displacement: closed form of springs in series."""
    system = mass(1e4, friction=JenkinsFriction(stiffness=4e5, friction_coefficient=0.4),
                  drive=fc.Drive(stiffness_x=1e6))
    x = np.concatenate([np.linspace(0.0, 4e-4, 30), np.linspace(4e-4, -4e-4, 30)[1:]])
    force, z = [], 0.0
    for at in x:
        # Stuck: k (q - z) + 1e4 q = 1e6 (x - q); else the slider follows at its limit of 20 N.
        q = (1e6 * at + 4e5 * z) / (1e6 + 1e4 + 4e5)
        if abs(4e5 * (q - z)) > 20.0:
            limit = np.copysign(20.0, q - z)
            q = (1e6 * at - limit) / (1e6 + 1e4)
            z = q - limit / 4e5
        force.append(1e6 * (at - q))
    found = fc.fit(system.with_({"friction.stiffness": 1e6,
                                 "friction.friction_coefficient": 0.2}), IWAN,
                   LoopData(x, np.array(force), 0.1))
    assert found.estimates == pytest.approx([4e5, 0.4], rel=1e-4)
    assert found.chi_square < 1e-2


def test_intervals_of_loops_cover_the_truth_in_a_few_trials():
    assert (noisy_loops(8, 0.03) >= 5).all()


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.01, 0.03, 0.1])
def test_intervals_of_loops_cover_the_truth(noise):
    covered = noisy_loops(100, noise)
    assert (binom.ppf(5e-4, 100, 0.95) <= covered).all()
    assert (covered <= binom.ppf(1.0 - 5e-4, 100, 0.95)).all()


def test_normal_load_and_coefficient_are_found_as_their_product_alone():
    force = LoopData(PULL, np.zeros(len(PULL)), 1.0).predicted(iwan())
    data = LoopData(PULL, force, 0.5)
    found = fc.fit(iwan(5e5, 0.3), {**IWAN, "normal.force": FitParameter(5.0, 500.0, scale="log")},
                   data)
    assert len(found.not_found) == 1
    assert "friction.friction_coefficient" in found.not_found[0]
    assert "normal.force" in found.not_found[0]
    assert "stiffness" not in found.not_found[0]
    assert found["friction.stiffness"] == pytest.approx(1e6, rel=1e-3)
    assert found["friction.friction_coefficient"] * found["normal.force"] == pytest.approx(
        20.0, rel=1e-4)
    assert np.isfinite(found.deviations["friction.stiffness"])


# Motions -----------------------------------------------------------------------------------------

def test_dry_friction_of_a_decay():
    """Den Hartog: each half period the middle of the swing is mu N / k to the other side."""
    mu, w, start = 0.02, np.sqrt(5e4 / 2.0), 6e-3
    off, times = mu * 50.0 / 5e4, np.linspace(0.0, 2.0, 20001)
    half = np.floor(times * w / np.pi)
    sign = 1.0 - 2.0 * (half % 2)
    x = sign * ((start - (2.0 * half + 1.0) * off) * np.cos(times * w - np.pi * half) + off)
    options = {"window": 6.0, "frequency_hz": w / (2.0 * np.pi)}
    first = mass(friction=ConstantFriction(0.015, smoothing_slope=1e4))
    found = fc.fit(first, {"friction.friction_coefficient": (5e-3, 0.025)}, DecayData(
        ring_down(times, x, **options), state(first, start), 2.0, options=options))
    assert found.estimates == pytest.approx([mu], rel=1e-3)


def test_amplitudes_beyond_a_run_go_on_linearly():
    """A linear decay has one frequency and one damping ratio at all amplitudes."""
    data = DecayData(AmplitudeCurve([1e-9, 1e-4, 1.0], [25.0] * 3, [0.01] * 3),
                     lambda system: state(system, 1e-3), 0.6)
    linear = mass(damping=4.0 * np.sqrt(5e4 / 2.0) * 0.012)
    w = np.sqrt(5e4 / 2.0)
    assert data.predicted(linear) == pytest.approx(
        np.repeat([w / (2.0 * np.pi), 0.012], 3), rel=1e-4)


@pytest.mark.slow
def test_den_hartogs_friction_from_a_decay():
    """Exact decay by 4 F / k a cycle: half cycles about +-F / k, with noise of 1 %."""
    spring, force = 5e4, 1.0
    w, shift = np.sqrt(spring / 2.0), force / spring
    time = np.arange(0.0, 1.0, 2e-4)
    half = np.floor(time * w / np.pi)
    amplitude = 2e-3 - shift * (2.0 * half + 1.0)
    x = np.where(half % 2 == 0, 1.0, -1.0) * (
        shift + amplitude * np.cos(w * time - np.pi * half))
    x = x + 2e-5 * np.random.default_rng(4).standard_normal(len(time))
    curve = ring_down(time, x, t_end=0.85, window=5.0)
    assert np.polyfit(curve.time, curve.amplitude, 1)[0] == pytest.approx(
        -4.0 * force / spring * w / (2.0 * np.pi), rel=0.02)
    model = mass(friction=ConstantFriction(0.05, 1e5))
    # With much friction the run stops early and the data say nothing: several starts.
    found = fc.fit(model, {"friction.friction_coefficient": FitParameter(
        0.005, 0.2, scale="log")}, DecayData(
        curve, lambda system: state(system, 2e-3), 0.85, options={"window": 5.0}), starts=3)
    # 1 N of a normal force of 50 N.
    low, high = found.intervals(0.999)["friction.friction_coefficient"]
    assert low < 0.02 < high
    assert found["friction.friction_coefficient"] == pytest.approx(0.02, rel=0.02)
    assert high / low < 1.1


def lugre(stiffness=2e4, kinetic=0.3):
    return mass(damping=10.0, friction=LuGreFriction(0.5, kinetic, 1e-2, 2.0, stiffness, 10.0))


def test_derivatives_of_a_history_are_exact():
    system = lugre()
    data = HistoryData(np.linspace(0.0, 0.1, 21), np.zeros(21), 1.0, initial=state(system, 3e-3))
    for name, value in (("friction.bristle_stiffness", 2e4), ("friction.kinetic_coefficient", 0.3)):
        exact = data.derivative(system, name)
        step = 1e-4 * value
        difference = (data.predicted(system.with_({name: value + step}))
                      - data.predicted(system.with_({name: value - step}))) / (2.0 * step)
        assert exact == pytest.approx(difference, abs=2e-3 * np.abs(difference).max())
        assert np.abs(difference).max() > 0.0
    assert data.derivative(system, "friction.nothing") is None


@pytest.mark.slow
def test_lugre_from_a_noisy_history():
    truth = lugre()
    time = np.linspace(0.0, 0.12, 61)
    initial = state(truth, 3e-3)
    x = HistoryData(time, np.zeros(61), 1.0, initial=initial).predicted(truth)
    data = HistoryData(time, x + 3e-5 * np.random.default_rng(8).standard_normal(61), 3e-5,
                       initial=initial)
    found = fc.fit(lugre(1e4, 0.4), {
        "friction.bristle_stiffness": FitParameter(2e3, 2e5, 1e4, "log"),
        "friction.kinetic_coefficient": (0.1, 0.5)}, data)
    assert set(found.derivatives.values()) == {"exact"}
    assert found["friction.kinetic_coefficient"] == pytest.approx(0.3, abs=4.0 * found.deviations[
        "friction.kinetic_coefficient"])
    assert found["friction.bristle_stiffness"] == pytest.approx(2e4, abs=4.0 * found.deviations[
        "friction.bristle_stiffness"])
    assert found.deviations["friction.kinetic_coefficient"] < 0.01
    assert 30.0 < found.chi_square < 100.0


@pytest.mark.slow
def test_bouc_wen_from_a_ring_down():
    def model(coefficient=0.3, deflection=4e-4):
        return mass(damping=6.0, friction=BoucWenFriction(coefficient, deflection, 0.6, 1.2))

    truth = model()
    time = np.linspace(0.0, 0.8, 4001)

    def initial(system):
        return state(system, 3e-3)

    run = fc.simulate(truth, 0.8, initial=initial(truth), outputs=time)
    x = run.displacement("B")[:, 0] + 3e-5 * np.random.default_rng(6).standard_normal(len(time))
    curve = ring_down(time, x, window=6.0)
    assert np.ptp(curve.frequency_hz) > 2.0
    found = fc.fit(model(0.15, 1e-3), {
        "friction.friction_coefficient": (0.05, 1.0),
        "friction.yield_displacement": FitParameter(5e-5, 5e-3, scale="log")},
        DecayData(curve, initial, 0.8, options={"window": 6.0}))
    assert found["friction.friction_coefficient"] == pytest.approx(0.3, rel=0.02)
    assert found["friction.yield_displacement"] == pytest.approx(4e-4, rel=0.05)


# Frequencies and responses -----------------------------------------------------------------------

def two_masses():
    rows = np.zeros((3, 2))
    rows[0, 0] = 1.0
    body = fc.basis_from_matrices(np.diag([2.0, 1.0]), [[3e5, -1e5], [-1e5, 1e5]],
                                  {"B": rows, "C": rows}, damping=[[8.0, -2.0], [-2.0, 2.0]])
    return fc.ContactSystem(body, drive=fc.Drive(stiffness_x=1.0))


def test_natural_frequencies_find_a_stiffness():
    """Two masses, with a third spring of 5e4 N/m at the first one."""
    K = np.array([[3.5e5, -1e5], [-1e5, 1e5]])
    root = np.diag([2.0**-0.5, 1.0])
    hertz = np.sqrt(np.linalg.eigvalsh(root @ K @ root)) / (2.0 * np.pi)
    found = fc.fit(two_masses(), {"drive.stiffness_x": (0.0, 2e5)}, FrequencyData(hertz, 0.01))
    assert found["drive.stiffness_x"] == pytest.approx(5e4, rel=5e-4)
    assert found.freedom == 1


def test_a_receptance_finds_spring_and_dashpot():
    hertz = np.linspace(30.0, 90.0, 121)
    w = 2.0 * np.pi * hertz
    K, C = np.array([[3.5e5, -1e5], [-1e5, 1e5]]), np.array([[20.0, -2.0], [-2.0, 2.0]])
    H = np.array([np.linalg.inv(K + 1j * one * C - one**2 * np.diag([2.0, 1.0]))[0, 0]
                  for one in w])
    rng = np.random.default_rng(2)
    noise = 0.01 * np.abs(H).max()
    y = H + noise * (rng.standard_normal(121) + 1j * rng.standard_normal(121))
    found = fc.fit(two_masses(), {"drive.stiffness_x": (0.0, 2e5), "drive.damping_x": (0.0, 50.0)},
                   ReceptanceData(hertz, y, deviation=noise))
    for name, truth in (("drive.stiffness_x", 5e4), ("drive.damping_x", 12.0)):
        assert abs(found[name] - truth) < 4.0 * found.deviations[name]
        assert found.deviations[name] < 0.05 * truth
    assert 170.0 < found.chi_square < 320.0


def jenkins(limit=1.0, stiffness=0.5):
    """m 1, k 1, c .02, spring and slider, force cos w t through the drive."""
    body = fc.basis_from_matrices([[1.0]], [[0.9]], {"contact": ROW[None], "B": ROW, "C": ROW},
                                  damping=[[0.02]])
    return fc.ContactSystem(
        body, normal=PrescribedForce(1.0),
        friction=JenkinsFriction(stiffness=stiffness, friction_coefficient=limit),
        drive=fc.Drive(stiffness_x=0.1, amplitude_x=5.0, frequency_hz=0.16))


RANGES = {"friction.friction_coefficient": (0.3, 2.0), "friction.stiffness": (0.2, 1.0)}


def closed_backbone():
    """First harmonics of a Jenkins element in closed form, with deviations of 0.1 % and 2 %."""
    A = np.geomspace(2.2, 20.0, 14)
    limit = 2.0  # deflection at which the slider moves
    theta = np.arccos(1.0 - 2.0 * limit / A)
    stiff = 0.5 / np.pi * (theta - 0.5 * np.sin(2.0 * theta))
    loss = 4.0 * limit * 0.5 * (A - limit)
    w = np.sqrt(1.0 + stiff)
    ratio = loss / (2.0 * np.pi * w**2 * A**2) + 0.01 / w
    curve = AmplitudeCurve(A, w / (2.0 * np.pi), ratio, 1e-3 * w, 0.02 * ratio)
    return BackboneData(curve, method=HarmonicBalance(1, 128, stability=None),
                        options=ContinuationOptions(points=200, step=0.1, largest_step=0.3))


def test_the_backbone_of_the_model_is_the_closed_form():
    data = closed_backbone()
    off = (data.predicted(jenkins()) - data.measured) / data.deviations
    assert np.abs(off).max() < 1.0


@pytest.mark.slow
def test_a_backbone_finds_spring_and_slider():
    found = fc.fit(jenkins(0.6, 0.8), RANGES, closed_backbone())
    assert found.estimates == pytest.approx([1.0, 0.5], rel=5e-3)
    assert found.chi_square < 1.0


def test_the_response_of_a_linear_model_is_its_receptance():
    linear = jenkins(1e-6)
    hertz = np.linspace(0.85, 1.15, 9) / (2.0 * np.pi)
    w = 2.0 * np.pi * hertz
    A = 0.5 / np.abs(1.0 - w**2 + 0.02j * w)
    data = ResponseData(hertz, A, 0.01, method=HarmonicBalance(1, 64, stability=None))
    assert data.predicted(linear) == pytest.approx(A, rel=2e-3)


@pytest.mark.slow
def test_a_response_finds_spring_and_slider():
    hertz = np.linspace(0.9, 1.3, 25) / (2.0 * np.pi)
    method = HarmonicBalance([1, 3], 64, stability=None)
    options = ContinuationOptions(points=200, largest_step=0.2)
    data = [ResponseData(hertz, np.ones(25), 1.0, changes={"drive.amplitude_x": level},
                         method=method, options=options, name=f"{level:g}") for level in (3.0, 8.0)]
    rng = np.random.default_rng(9)
    noisy = []
    for one in data:
        A = one.predicted(jenkins().with_(one.changes))
        noisy.append(ResponseData(hertz, A * (1.0 + 0.01 * rng.standard_normal(25)), 0.01 * A,
                                  changes=one.changes, method=method,
                                  options=options, name=one.name))
    found = fc.fit(jenkins(0.6, 0.7), RANGES, noisy)
    for name, truth in (("friction.friction_coefficient", 1.0), ("friction.stiffness", 0.5)):
        assert abs(found[name] - truth) < 4.0 * found.deviations[name]
        assert found.deviations[name] < 0.05 * truth


def test_several_kinds_of_data_together():
    """A loop determines the slider, natural frequencies of the stuck model the spring."""
    truth = iwan()
    force = LoopData(PULL, np.zeros(len(PULL)), 1.0).predicted(truth)
    path = fc.LoadPath(motion_x=(0.0, 1e-9), steps=1)
    stuck = FrequencyData(np.ones(1), about=path).predicted(truth)
    # Body, drive and all elements of the contact hold the mass.
    assert stuck == pytest.approx(np.sqrt((1e4 + 1e6 + 1e6) / 2.0) / (2.0 * np.pi), rel=1e-3)
    found = fc.fit(iwan(5e5, 0.3), IWAN, [
        LoopData(PULL, force, 1.0), FrequencyData(stuck, 0.1, about=path)])
    assert found.estimates == pytest.approx([1e6, 0.4], rel=1e-4)
    alone = fc.fit(iwan(5e5, 0.3), IWAN, LoopData(PULL, force, 1.0))
    assert found.deviations["friction.stiffness"] < 0.2 * alone.deviations["friction.stiffness"]


def test_several_assemblies_at_once():
    """Two normal loads, and another body with the same joint, have one coefficient of friction."""
    force = LoopData(PULL, np.zeros(len(PULL)), 1.0)
    heavy = iwan().with_({"normal.force": 80.0})
    rng = np.random.default_rng(4)
    data = [replace(force, name=name, changes=changes, model=model, deviation=0.3, force=(
        force.predicted((model or iwan()).with_(changes)) + 0.3 * rng.standard_normal(len(PULL))))
        for name, changes, model in (("a", {}, None), ("b", {"normal.force": 100.0}, None),
                                     ("c", {}, heavy))]
    found = fc.fit(iwan(5e5, 0.3), IWAN, data)
    for name, truth in (("friction.stiffness", 1e6), ("friction.friction_coefficient", 0.4)):
        assert abs(found[name] - truth) < 4.0 * found.deviations[name]
    assert found.chi_square / found.freedom == pytest.approx(1.0, abs=0.3)
    # Each limit of friction grows with its normal load, by which it weighs.
    alone = [fc.fit(iwan(5e5, 0.3), IWAN, one) for one in data]
    assert found.place_covariance == pytest.approx(np.linalg.inv(sum(
        np.linalg.inv(one.place_covariance) for one in alone)), rel=0.1)
    with pytest.raises(fc.InputError, match=r"'b' changes 'normal\.force', which is fitted"):
        fc.fit(iwan(), {"normal.force": (10.0, 200.0)}, data)
    with pytest.raises(fc.InputError, match="model must be"):
        fc.fit(iwan(), IWAN, replace(force, model=3))


@pytest.mark.parametrize(("call", "told"), [
    (lambda: HistoryData([0.0], [1.0]), "give two at least"),
    (lambda: HistoryData([0.0, 1.0], [1.0]), "give as many values in each"),
    (lambda: LoopData([0.0, 1.0], [1.0, 2.0], along="motion"), "or give a path"),
    (lambda: LoopData([0.0, 1.0], [1.0, 2.0], path=fc.LoadPath(travel=(0.0, 1.0), steps=5)),
     "has 6 points for 2 forces"),
    (lambda: DecayData(3, None, 1.0), "curve must be"),
    (lambda: DecayData(AmplitudeCurve([1.0], [1.0], [1.0]), None, 0.0), "a time above zero"),
    (lambda: FrequencyData([1.0, 2.0], modes=[1]), "modes must be 2 whole numbers"),
    (lambda: BackboneData(None), "curve must be"),
    (lambda: ReceptanceData([1.0, 2.0], [1.0]), "give as many values in each"),
    (lambda: ResponseData([1.0], [1.0]), "two frequencies or more"),
])
def test_wrong_data_are_told_in_one_sentence(call, told):
    with pytest.raises(fc.InputError, match=told):
        call()


def test_models_that_lack_what_was_measured_fail_in_words():
    with pytest.raises(fc.AnalysisError, match=r"has 2 vibrating modes, fewer than the mode 3"):
        fc.fit(two_masses(), {"drive.stiffness_x": (0.0, 2e5)}, FrequencyData([1.0], 0.1, [3]))
    with pytest.raises(fc.AnalysisError, match="without an equilibrium"):
        fc.fit(mass(0.0, friction=JenkinsFriction(1e5, 0.1)), {
            "friction.friction_coefficient": (0.05, 0.2)}, LoopData(
                [0.0, 1.0], [0.0, 1.0], 1.0, along="C.x", path=fc.LoadPath(
                    forces={"C.x": (0.0, 50.0)}, steps=1)))
