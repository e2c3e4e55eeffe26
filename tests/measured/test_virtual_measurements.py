"""Virtual sensors, sampling, noise and shakers beside closed forms; from a run to a fit."""

import warnings

import numpy as np
import pytest

import fecontact as fc
from fecontact.analysis import power_spectral_density, receptance
from fecontact.fitting import fit_study
from fecontact.io import read_measurement, write_uff
from fecontact.laws import Harmonic
from fecontact.measured import (
    Accelerometer,
    Acquisition,
    ForceGauge,
    Shaker,
    measure,
    with_sensors,
)
from fecontact.reduction import Spring, point_masses, with_masses

UP = np.array([[0.0], [1.0], [0.0]])
FORCED = 40.0  # Hz
M, C, K = 2.0, 4.0, 5e4


def mass(**more):
    return fc.basis_from_matrices([[M]], [[K]], {"B": UP, "C": UP, "tip": UP, **more},
                                  damping=[[C]])


def forced_run(hertz=FORCED, outputs=4001, t_end=1.0, basis=None):
    """Steady vibration: it starts from its own amplitude and phase, with a force of 3 N."""
    basis = mass() if basis is None else basis
    w = 2.0 * np.pi * hertz
    load = fc.Load(forces=[fc.PointLoad("tip", "y", signal=Harmonic(3.0, hertz))])
    system = fc.ContactSystem(basis, load=load)
    force = system.load.forces[0].signal.history([0.0])[0]
    # Complex amplitude of the force from its value and rate at t = 0.
    P = force[0] - 1j * force[1] / w
    q = P * basis.T[0, 1] / (basis.angular_frequencies**2 - w**2 + 1j * w * np.diag(basis.damping))
    state = np.concatenate([q.real, (1j * w * q).real])
    return fc.simulate(system, t_end, initial=state, outputs=outputs, rtol=1e-9), w, q[0]


def amplitude_at(time, values, w):
    """Complex amplitude of a vibration by least squares over whole periods."""
    columns = np.stack([np.cos(w * time), -np.sin(w * time)], axis=1)
    a, b = np.linalg.lstsq(columns, values, rcond=None)[0]
    return a + 1j * b


def test_an_accelerometer_without_filter_gives_the_acceleration():
    run, w, q = forced_run()
    phi = run.system.basis.T[0, 1, 0]
    found = measure(run, [Accelerometer(point="tip"), Accelerometer(point="tip", direction="-y",
                                                                    sensitivity=1.02),
                          Accelerometer(name="askew", point="tip", direction=(3.0, 4.0))],
                    Acquisition(500.0, order=0))
    exact = (-w**2 * phi * q * np.exp(1j * w * found.abscissa)).real
    assert len(found) == 501
    assert found.names == ("tip +y", "tip -y", "askew")
    assert [one.direction for one in found.channels] == ["+y", "-y", ""]
    size = np.abs(exact).max()
    for k, factor in enumerate((1.0, -1.02, 0.8)):
        assert found.values[:, k] == pytest.approx(factor * exact, abs=1e-6 * size)
    assert fc.analysis.history(run, "acceleration", "tip", "y").unit == "m/s^2"


def test_base_acceleration_is_part_of_what_is_measured():
    """A mass without spring stays where it is while its base accelerates."""
    basis = fc.basis_from_matrices([[M]], [[0.0]], {"B": UP}, translations=[[0.0], [1.0]])
    system = fc.ContactSystem(basis, load=fc.Load(base_acceleration_y=Harmonic(5.0, 10.0)))
    run = fc.simulate(system, 0.5, initial=[0.0, 0.0], outputs=501)
    found = measure(run, Accelerometer(point="B"), Acquisition(1000.0, order=0))
    assert np.abs(run.acceleration("B")[:, 1]).max() > 4.9
    assert np.abs(found.values).max() < 1e-9


@pytest.mark.parametrize("order", [1, 4, 8])
@pytest.mark.parametrize("hertz", [20.0, 100.0, 150.0])
def test_the_filter_is_that_of_butterworth(order, hertz):
    run, w, q = forced_run(hertz, outputs=20001)
    acquisition = Acquisition(500.0, 100.0, order)
    found = measure(run, Accelerometer(point="tip"), acquisition).between(0.5)
    true = -w**2 * run.system.basis.T[0, 1, 0] * q
    gain = amplitude_at(found.abscissa, found.values[:, 0], w) / true
    assert abs(gain) == pytest.approx(1.0 / np.sqrt(1.0 + (hertz / 100.0) ** (2 * order)),
                                      rel=2e-3)
    if hertz == 20.0:
        assert -np.angle(gain) / w == pytest.approx(acquisition.delay, rel=0.05)


def test_what_lies_above_half_the_rate_is_folded_with_a_warning_or_filtered():
    run, w, q = forced_run(80.0, outputs=4001)
    size = abs(w**2 * run.system.basis.T[0, 1, 0] * q)
    with pytest.warns(fc.ModelWarning, match="at 80 Hz, appears at 20 Hz. Give an anti-alias"):
        found = measure(run, Accelerometer(point="tip"), Acquisition(100.0, order=0))
    folded = amplitude_at(found.abscissa, found.values[:, 0], 2.0 * np.pi * 20.0)
    assert abs(folded) == pytest.approx(size, rel=1e-6)
    with pytest.warns(fc.ModelWarning, match="lower corner_hz"):
        found = measure(run, Accelerometer(point="tip"), Acquisition(100.0)).between(0.4)
    folded = amplitude_at(found.abscissa, found.values[:, 0], 2.0 * np.pi * 20.0)
    assert abs(folded) == pytest.approx(size * (80.0 / (100.0 / 2.56)) ** -8, rel=0.05)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        measure(run, Accelerometer(point="tip"), Acquisition(400.0))


@pytest.mark.parametrize("hertz", [100.0, 390.0, 600.0])
def test_resonance_of_a_sensor(hertz):
    run, w, q = forced_run(hertz, outputs=40001)
    sensor = Accelerometer(point="tip", resonance_hz=400.0, resonance_damping=0.05)
    found = measure(run, sensor, Acquisition(40000.0, order=0)).between(0.5)
    gain = amplitude_at(found.abscissa, found.values[:, 0], w) / (
        -w**2 * run.system.basis.T[0, 1, 0] * q)
    s, w0 = 1j * w, 2.0 * np.pi * 400.0
    assert gain == pytest.approx(w0**2 / (s**2 + 0.1 * w0 * s + w0**2), rel=2e-3)
    with pytest.raises(fc.InputError, match="resonance_hz = 400 is not resolved"):
        measure(forced_run(40.0, 501)[0], sensor, Acquisition(500.0, order=0))


@pytest.mark.slow
def test_noise_has_its_density_and_its_seed():
    system = fc.ContactSystem(mass())
    run = fc.simulate(system, 40.0, initial=[0.0, 0.0], outputs=80001)
    sensors = [Accelerometer(name="a", point="tip", noise_density=0.03),
               Accelerometer(name="b", point="tip", noise_rms=0.5)]
    found = measure(run, sensors, Acquisition(2000.0, order=0, seed=5))
    S = power_spectral_density(found.abscissa, found.values[:, 0]).values
    assert np.median(S) == pytest.approx(0.03**2, rel=0.1)
    assert found.values[:, 1].std() == pytest.approx(0.5, rel=0.02)
    assert abs(np.corrcoef(found.values.T)[0, 1]) < 0.02
    again = measure(run, sensors, Acquisition(2000.0, order=0, seed=5))
    other = measure(run, sensors, Acquisition(2000.0, order=0, seed=6))
    assert (again.values == found.values).all()
    assert abs(np.corrcoef(other.values[:, 0], found.values[:, 0])[0, 1]) < 0.02
    assert "white noise of 949 mm/s² rms in 'a', seed 5" in found.notes


def test_masses_of_sensors_are_those_of_a_model_that_has_them():
    """All modes are kept, so that the result is exact; with rigid motions, damping and gravity."""
    masses, springs = {"a": 1.0, "b": 2.0, "c": 0.5}, {("a", "b"): 1e4, ("b", "c"): 3e4}
    dashpots = {("a", "b"): 3.0, ("b", None): 2.0}
    hertz = np.linspace(1.0, 60.0, 40)
    for base in ({}, {("a", None): 5e3}):
        loaded = with_masses(point_masses(masses, springs | base, dashpots=dashpots),
                             {"c": 0.3, "a": 0.0})
        whole = point_masses(masses | {"c": 0.8}, springs | base, dashpots=dashpots)
        assert loaded.angular_frequencies == pytest.approx(whole.angular_frequencies, abs=1e-9)
        assert (loaded.angular_frequencies == 0.0).sum() == (0 if base else 1)
        H = [receptance(one, hertz, [("a", "y")], [("a", "y"), ("c", "y")]).values
             for one in (loaded, whole)]
        assert np.abs(H[0] - H[1]).max() < 1e-10 * np.abs(H[1]).max()
        assert (loaded.inertia_rows**2).sum() == pytest.approx((whole.inertia_rows**2).sum())


def test_a_heavy_accelerometer_lowers_the_frequency():
    sensor = Accelerometer(point="tip", mass=0.1)
    loaded = with_sensors(mass(), [sensor, Accelerometer(point=(0.0, 0.0))])
    assert loaded.angular_frequencies[0] == pytest.approx(np.sqrt(K / (M + 0.1)))
    with pytest.raises(fc.InputError, match="needs a named point"):
        with_sensors(mass(), [Accelerometer(point=(0.0, 0.0), mass=0.1)])
    with pytest.raises(fc.InputError, match="no point 'top'"):
        with_sensors(mass(), [Accelerometer(point="top", mass=0.1)])


SHAKERS = {
    "current": {"force_factor": 12.0},
    "voltage": {"force_factor": 12.0, "resistance": 3.0},
    "voltage, inductance": {"force_factor": 12.0, "resistance": 3.0, "inductance": 2e-2},
}


def on_shaker(more, signal=0.0):
    shaker = Shaker(0.3, suspension_stiffness=4e3, suspension_damping=6.0, stinger_stiffness=2e6,
                    stinger_damping=3.0, **more)
    links = {"stinger": shaker.stinger("beam.tip")}
    return shaker, links, fc.ContactSystem(
        bodies={"beam": mass(), "shaker": shaker.basis()}, links=links,
        load=fc.Load(forces=[shaker.drive(signal)]))


def force_of(shaker, w):
    """Force on the body per volt or ampere, and its acceleration per force."""
    H = 1.0 / (K + 1j * w * C - M * w**2)
    s, B = 1j * w, shaker.force_factor
    Z = shaker.suspension_stiffness + s * shaker.suspension_damping + shaker.armature_mass * s**2
    drive = B
    if shaker.resistance is not None:
        drive = B / (shaker.resistance + s * shaker.inductance)
        Z = Z + s * B * drive
    stinger = shaker.stinger_stiffness + s * shaker.stinger_damping
    return drive / (1.0 + Z * (H + 1.0 / stinger)), s**2 * H


@pytest.mark.parametrize("name", SHAKERS)
def test_the_force_of_a_shaker_drops_at_resonance_as_in_closed_form(name):
    shaker, _, system = on_shaker(SHAKERS[name])
    hertz = np.linspace(5.0, 80.0, 151)
    w = 2.0 * np.pi * hertz
    found = receptance(system, hertz, [("shaker.coil", "x")], [("beam.tip", "y")],
                       kind="accelerance").values[:, 0, 0]
    force, accelerance = force_of(shaker, w)
    assert found == pytest.approx(force * accelerance, rel=1e-8)
    # The drop-out: least force beside the resonance of the body.
    lowest = hertz[np.argmin(np.abs(force))]
    assert lowest == pytest.approx(np.sqrt(K / M) / (2.0 * np.pi), rel=0.02)
    assert np.abs(force).min() < 0.4 * np.median(np.abs(force))


@pytest.mark.parametrize("name", ["current", "voltage, inductance"])
def test_gauge_and_accelerometer_of_a_shaken_body(name):
    """Steady vibration beside the closed form; the mass of a gauge is part of its reading."""
    hertz = 30.0
    w = 2.0 * np.pi * hertz
    shaker, links, system = on_shaker(SHAKERS[name], Harmonic(2.0, hertz))
    run = fc.simulate(system, 4.0, outputs=16001, rtol=1e-8)
    signal = system.load.forces[0].signal.history([0.0])[0]
    P = signal[0] - 1j * signal[1] / w
    found = measure(run, [ForceGauge(link="stinger"), Accelerometer(point="beam.tip"),
                          ForceGauge(name="drive", load=0)],
                    Acquisition(1000.0), links=links).between(3.5)
    F, a, drive = (amplitude_at(found.abscissa, column, w) for column in found.values.T)
    force, accelerance = force_of(shaker, w)
    # The filter turns all channels alike.
    assert F / drive == pytest.approx(force, rel=2e-3)
    assert a / F == pytest.approx(accelerance, rel=2e-3)
    assert abs(drive) == pytest.approx(abs(P), rel=1e-3)


def test_the_mass_of_a_gauge_is_part_of_its_reading():
    shaker, links, _ = on_shaker({})
    gauge, sensor = ForceGauge(link="stinger", mass=0.25), Accelerometer(point="beam.tip")
    plain = fc.ContactSystem(bodies={"beam": mass(), "shaker": shaker.basis()}, links=links)
    system = fc.ContactSystem(
        with_sensors(plain.basis, [gauge, sensor], links),
        load=fc.Load(forces=[shaker.drive(Harmonic(50.0, 18.0))]))
    run = fc.simulate(system, 4.0, outputs=16001, rtol=1e-8)
    found = measure(run, [gauge, sensor], Acquisition(1000.0), links=links).between(3.5)
    w = 2.0 * np.pi * 18.0
    F, a = (amplitude_at(found.abscissa, column, w) for column in found.values.T)
    true = -(w**2) / (K + 1j * w * C - M * w**2)
    assert a / (F - 0.25 * a) == pytest.approx(true, rel=2e-3)
    assert abs(a / F / true - 1.0) > 0.05


@pytest.mark.parametrize(("call", "told"), [
    (lambda run: measure(run, [], Acquisition(500.0)), "sensors is empty"),
    (lambda run: measure(run, Accelerometer(point="tip"), Acquisition(3000.0)),
     "run with outputs = 12001"),
    (lambda run: measure(run, Accelerometer(point="tip"), Acquisition(2000.0)),
     "a whole multiple, 4 times at least, of the sampling"),
    (lambda run: measure(run, Accelerometer(point="tip"), Acquisition(512.3)), "up to t_end = "),
    (lambda run: measure(run, Accelerometer(point="tap"), Acquisition(500.0)), "mean 'tip'"),
    (lambda run: measure(run, Accelerometer(direction="+z"), Acquisition(500.0)), "in the plane"),
    (lambda run: measure(run, Accelerometer(direction=(1, 0, 0)), Acquisition(500.0)),
     "must have 2 components"),
    (lambda run: measure(run, ForceGauge(link="stinger"), Acquisition(500.0)),
     "no linear spring among the links"),
    (lambda run: measure(run, ForceGauge(load=1), Acquisition(500.0)), "one of the 1 forces"),
    (lambda run: measure(run, [Accelerometer()] * 2, Acquisition(500.0)), "several channels"),
    (lambda run: Accelerometer(direction="up"), "or a vector"),
    (lambda run: Accelerometer(direction=(0.0, 0.0)), "longer than zero"),
    (lambda run: Accelerometer(noise_rms=-1.0), "noise_rms"),
    (lambda run: ForceGauge(), "give link"),
    (lambda run: ForceGauge(load=0, mass=0.1), "leave out mass"),
    (lambda run: Acquisition(500.0, 250.0), "below half the sampling rate"),
    (lambda run: Acquisition(500.0, order=17), "order = 17"),
    (lambda run: Acquisition(0.0), "rate_hz"),
    (lambda run: Shaker(0.3, inductance=1e-3), "give the resistance"),
    (lambda run: Shaker(0.0), "armature_mass"),
    (lambda run: Shaker(0.3, direction=(0.0, 0.0)), "longer than zero"),
    (lambda run: with_masses(mass(), {"tip": -1.0}), "mass at 'tip'"),
])
def test_wrong_arguments(call, told):
    run, _, _ = forced_run(outputs=4001)
    with pytest.raises(fc.InputError, match=told):
        call(run)


def test_accelerations_of_set_valued_contact_are_refused():
    basis = point_masses({"a": 1.0}, components="xy", contact="a")
    system = fc.ContactSystem(basis, fc.laws.LinearContact(1e6, 10.0),
                              fc.laws.ConstantFriction(0.3), load=fc.Load(gravity=(0.0, -9.81)))
    run = fc.simulate(system, 0.1, outputs=11, solver=fc.integrate.SetValued())
    with pytest.raises(fc.InputError, match="set-valued contact are not known"):
        run.acceleration(0)


STUDY = """
geometry = { shape = "beam", length = 0.1, height = 0.02, element_size = 0.01 }
body = { material = "steel", thickness = 0.02 }
basis = { modes = 6, contact_nodes = 4, damping = 0.01 }
normal = { law = "linear", stiffness = 1e7, damping = 100.0 }
friction = { law = "jenkins", stiffness = 8e5, friction_coefficient = 0.4 }
drive = { stiffness_x = 1e6 }
simulation = { t_end = 0.15, outputs = 9601 }

[load]
normal = 8.0

[[load.forces]]
point = "B"
component = "x"
signal = { law = "pulse", kind = "half-sine", amplitude = 900.0, start = 2e-3, duration = 8e-4 }

[measurement]
rate_hz = 16000.0
seed = 3

[[measurement.sensors]]
name = "end"
point = "B"
direction = "+x"
node = 7
mass = 0.004
resonance_hz = 25000.0
noise_density = 0.005

[[measurement.sensors]]
name = "hammer"
load = 0
noise_rms = 0.2

[fit.parameters]
friction.friction_coefficient = { low = 0.05, high = 1.0 }
friction.stiffness = { low = 1e5, high = 1e7, scale = "log" }

[[fit.data]]
kind = "ring-down"
file = "results/joint-measured.uff"
channel = "end"
quantity = "acceleration"
t_start = 0.004
t_end = 0.15
window = 5.0
"""


@pytest.mark.slow
def test_from_a_run_by_a_measurement_and_a_file_to_a_fit_of_the_truth(cli, tmp_path):
    path = tmp_path / "joint.toml"
    path.write_text(STUDY)
    study = fc.Study.read(path)
    assert fc.Study.from_toml(study.to_toml(), path) == study
    bare = study.with_({"measurement.sensors.0.mass": 0.0})
    rigid = study.modal_basis().T[0, 0, :3], bare.modal_basis().T[0, 0, :3]
    # 1 / r^2 is the mass of a rigid body without rotation.
    assert 1.0 / (rigid[0] @ rigid[0]) - 1.0 / (rigid[1] @ rigid[1]) == pytest.approx(
        0.004, rel=1e-6)
    code, out, _ = cli("measure", str(path))
    assert code == 0
    assert "seed 3" in out
    file = tmp_path / "results" / "joint-measured.uff"
    code, out, _ = cli("data", str(file))
    assert code == 0
    assert "node 7 +x" in out
    stored, direct = read_measurement(file), study.measure()
    assert stored.names == direct.names == ("end", "hammer")
    assert [(one.unit, one.direction) for one in stored.channels] == [("m/s^2", "+x"), ("N", "")]
    assert stored.values == pytest.approx(direct.values, rel=1e-11)
    assert stored.abscissa == pytest.approx(direct.abscissa, rel=1e-5)
    assert read_measurement(write_uff(stored, tmp_path / "a.uff")).channels == stored.channels
    start = study.with_({"friction.friction_coefficient": 0.7, "friction.stiffness": 3e6})
    found = fit_study(start)
    for name, truth in (("friction.friction_coefficient", 0.4), ("friction.stiffness", 8e5)):
        low, high = found.intervals()[name]
        assert low < truth < high
        assert high < 2.0 * low


def test_studies_without_sensors_say_so(cli, tmp_path):
    path = tmp_path / "joint.toml"
    text = STUDY[: STUDY.index("[measurement]")]
    path.write_text(text)
    assert "has no sensors; add the section [measurement]" in cli("measure", str(path))[2]
    path.write_text(text + "[measurement]\nrate_hz = 16000.0\n[[measurement.sensors]]\n"
                    "point = 'top'\nmass = 0.1\n")
    code, _, told = cli("measure", str(path))
    assert code == 1
    assert "[measurement]: There is no point 'top'" in told


def test_springs_with_preload_are_read_by_a_gauge():
    """Two masses at rest, pressed together by a spring that pushes with 5 N."""
    spring = Spring("a.p", "b.p", stiffness=1e3, direction=(0.0, 1.0), preload=-5.0)
    bodies = {name: fc.basis_from_matrices([[1.0]], [[1e3]], {"p": UP}, damping=[[20.0]])
              for name in "ab"}
    system = fc.ContactSystem(bodies=bodies, links={"s": spring})
    run = fc.simulate(system, 2.0, initial="rest", outputs=401)
    found = measure(run, ForceGauge(link="s"), Acquisition(200.0, order=0), links={"s": spring})
    # Each gives way by x under F, 2 x shorter: F = 5 - 2 k x = 5 - 2 F.
    assert found.values[-1, 0] == pytest.approx(5.0 / 3.0)
