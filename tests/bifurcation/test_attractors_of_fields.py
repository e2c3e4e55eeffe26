"""Exponents, sections over parameters and basins of vector fields against known values."""

import numpy as np
import pytest
from fields_in_time import LORENZ, ROSSLER, Pendulum
from scipy.integrate import solve_ivp

import fecontact as fc
from fecontact import AnalysisError, InputError
from fecontact.bifurcation import (
    Axis,
    ContinuationOptions,
    basins,
    lyapunov_exponents,
    orbit_branch,
    periodic_motion,
    poincare_scan,
    vector_field,
)
from fecontact.integrate import Crossing, strobe


def test_exponents_of_lorenz():
    # J. C. Sprott, Chaos and Time-Series Analysis: 0.9056, 0, -14.5723.
    found = lyapunov_exponents(LORENZ, 5000.0, initial=[1.0, 1.0, 1.0], transient=50.0, count=3,
                               interval=0.5)
    assert np.abs(found.exponents - [0.9056, 0.0, -14.5723]).max() < 0.006
    assert (np.abs(found.exponents - [0.9056, 0.0, -14.5723]) < 4.0 * found.uncertainty).all()
    assert (found.uncertainty < 0.004).all()
    # The divergence is the same everywhere.
    assert found.exponents.sum() == pytest.approx(-41.0 / 3.0, abs=2e-4)


def test_exponents_of_rossler():
    # Sprott: 0.0714, 0, -5.3943.
    found = lyapunov_exponents(ROSSLER, 20000.0, initial=[1.0, 1.0, 1.0], transient=200.0, count=3)
    assert np.abs(found.exponents[:2] - [0.0714, 0.0]).max() < 0.004
    assert np.abs(found.exponents[:2] - [0.0714, 0.0]).max() < 4.0 * found.uncertainty[0]
    assert found.exponents[2] == pytest.approx(-5.3943, abs=0.03)


def duffing(t, x, p, out):
    out[0] = x[1]
    out[1] = -p[0] * x[1] + x[0] - x[0] ** 3 + p[1] * np.cos(p[2] * t)


DUFFING = vector_field(duffing, {"damping": 0.25, "force": 0.0, "w": 1.0}, ["x", "v"],
                       period=lambda p: 2.0 * np.pi / p["w"])


def test_exponents_of_the_forced_duffing_oscillator():
    # Their sum is minus the damping; that of the driven double well at force 0.3 is 0.1 ... 0.2.
    chaotic = DUFFING.with_(force=0.3)
    found = lyapunov_exponents(chaotic, 4000.0, initial=[1.0, 0.0], transient=400.0, count=2)
    assert found.exponents.sum() == pytest.approx(-0.25, abs=1e-5)
    # The largest by the separation of two runs, made close again and again (Benettin).
    period, growth = 2.0 * np.pi, []
    state, other = found.state, found.state + np.array([1e-7, 0.0])
    for _ in range(400):
        state, other = (fc.simulate(chaotic, period, initial=one, outputs=2, rtol=1e-9).states[-1]
                        for one in (state, other))
        growth.append(np.log(np.linalg.norm(other - state) / 1e-7))
        other = state + (other - state) * 1e-7 / np.linalg.norm(other - state)
    blocks = [np.mean(part) / period for part in np.array_split(growth, 10)]
    error = np.hypot(np.std(blocks, ddof=1) / np.sqrt(10.0), found.uncertainty[0])
    assert abs(np.mean(blocks) - found.exponents[0]) < 4.0 * error < 0.08
    assert found.exponents[0] > 0.08


def test_exponents_of_a_focus_and_of_a_field_of_python():
    calm = lyapunov_exponents(DUFFING, 400.0, initial=[1.1, 0.0], transient=50.0, count=2,
                              interval=0.5)
    # At x = 1 the eigenvalues are -1/8 +- i sqrt(2 - 1/64).
    assert calm.exponents == pytest.approx([-0.125, -0.125], abs=1e-3)
    swing = lyapunov_exponents(Pendulum(), 20.0, initial=[1.0, 0.0], count=2, interval=1.0)
    assert abs(swing.exponents.sum()) < 1e-6


def test_doublings_in_a_scan_are_those_of_the_branch():
    start = fc.simulate(ROSSLER.with_(c=2.5), 300.0, initial=[1.0, 1.0, 1.0], outputs=6001,
                        rtol=1e-8)
    orbits = orbit_branch(ROSSLER, start.between(280.0), "c", bounds=(2.4, 4.0),
                          options=ContinuationOptions(step=0.05, points=80))
    doubling = next(point for point in orbits.points if point.kind == "period doubling")
    values = doubling.parameter + np.array([-0.12, -0.06, 0.06, 0.12])
    scan = poincare_scan(ROSSLER, "c", values, section=Crossing("x", sense="rising"),
                         transient=1500.0, keep=8, initial=[1.0, 1.0, 1.0], rtol=1e-7)
    for each in scan.observed("y"):
        spread = np.abs(np.diff(each, axis=1)).max(axis=1)
        repeats = np.abs(each[:, 2:] - each[:, :-2]).max(axis=1)
        assert (repeats < 1e-4).all()
        assert (spread[:2] < 1e-4).all()
        assert (spread[2:] > 0.1).all()
    # Beyond a doubling the distance of the two grows with the root of the parameter.
    ratio = spread[3] / spread[2]
    assert ratio == pytest.approx(np.sqrt(2.0), rel=0.08)


def test_scans_of_forced_fields_are_strobed():
    # Linear: x'' + 0.4 x' + x = force cos(2 t), strobed at t = 0.
    def linear(t, x, p, out):
        out[0] = x[1]
        out[1] = -0.4 * x[1] - x[0] + p[0] * np.cos(2.0 * t)

    field = vector_field(linear, {"force": 1.0}, ["x", "v"], period=lambda p: np.pi)
    scan = poincare_scan(field, "force", [0.5, 1.0, 2.0], transient_periods=40, keep=3,
                         initial=[0.0, 0.0], rtol=1e-8)
    answer = 1.0 / (1.0 - 4.0 + 0.8j)
    for x, v in zip(scan.observed("x"), scan.observed("v"), strict=True):
        assert x == pytest.approx(np.outer(scan.values, np.ones(3)) * answer.real, abs=1e-6)
        assert v == pytest.approx(np.outer(scan.values, np.ones(3)) * (2j * answer).real, abs=1e-6)


def test_basins_of_the_double_well():
    places = np.linspace(-2.0, 2.0, 24)
    found = basins(DUFFING, (Axis("x"), places), (Axis("v"), places), section=Crossing("v"),
                   transient=100.0, workers=2)
    assert [one.kind for one in found.attractors] == ["equilibrium", "equilibrium"]
    ends = [one.points[0, 0] for one in found.attractors]
    assert sorted(ends) == pytest.approx([-1.0, 1.0], abs=1e-5)
    # The field is odd.
    assert (found.label == 1 - found.label[::-1, ::-1]).all()
    assert [one.share for one in found.attractors] == [0.5, 0.5]
    for i, j in ((3, 18), (12, 3), (19, 19), (7, 10), (15, 22)):
        known = solve_ivp(lambda t, x: [x[1], -0.25 * x[1] + x[0] - x[0] ** 3], (0.0, 100.0),
                          [places[i], places[j]], method="DOP853", rtol=1e-10, atol=1e-10)
        assert ends[found.label[i, j]] == pytest.approx(known.y[0, -1], abs=1e-3)
    same = basins(DUFFING, (Axis("x"), places), (Axis("v"), places), section=Crossing("v"),
                  transient=100.0, workers=1)
    assert (same.label == found.label).all()


def newton_flow(t, x, p, out):
    # z' = -(z^3 - 1) / (3 z^2), so that z^3 - 1 decays as exp(-t) along straight lines.
    a, b = x[0], x[1]
    size = 3.0 * (a * a + b * b) ** 2
    out[0] = -a / 3.0 + (a * a - b * b) / size
    out[1] = -b / 3.0 - 2.0 * a * b / size


def test_basins_of_newtons_flow_are_sectors():
    # The sign of z^3 - 1 never turns: a start leads to the cube root of one in its sector.
    field = vector_field(newton_flow, {}, ["a", "b"])
    a, b = np.linspace(-2.0, 2.0, 30), np.linspace(-1.9, 2.1, 30)
    found = basins(field, (Axis("a"), a), (Axis("b"), b), section=Crossing("a", value=5.0),
                   transient=30.0)
    assert len(found.attractors) == 3
    roots = np.array([one.points[0] @ [1.0, 1j] for one in found.attractors])
    assert np.abs(roots**3 - 1.0).max() < 1e-6
    z = a[:, None] + 1j * b[None, :]
    known = np.abs(np.angle(z[:, :, None] / roots)).argmin(axis=2)
    assert (found.label == known).all()


def test_basins_of_a_forced_field():
    # Two orbits of period one, one in each well; the shift by half a period mirrors them.
    field = DUFFING.with_(force=0.1)
    places = np.linspace(-1.5, 1.5, 12)
    found = basins(field, (Axis("x"), places), (Axis("v"), places), transient_periods=60, keep=8)
    assert {one.kind for one in found.attractors} == {"periodic"}
    low = [one for one in found.attractors if len(one.points) == 1]
    assert len(low) >= 2
    assert sorted(np.sign(one.points[0, 0]) for one in low[:2]) == [-1.0, 1.0]
    for one in low:
        state = fc.simulate(field, 2.0 * np.pi, initial=one.points[0], outputs=2, rtol=1e-9)
        assert state.states[-1] == pytest.approx(one.points[0], abs=1e-4)


def test_settled_motions_of_fields_start_branches():
    calm = periodic_motion(ROSSLER.with_(c=2.5), initial=[1.0, 1.0, 1.0], transient=300.0,
                           longest_period=20.0)
    assert calm.parameter_values == pytest.approx([0.2, 0.2, 2.5])
    orbits = orbit_branch(ROSSLER, calm, "c", bounds=(2.4, 2.6))
    assert calm.period == pytest.approx(orbits.points[0].values["period"], rel=1e-5)
    assert orbits.points[0].parameter == 2.5
    swing = periodic_motion(DUFFING.with_(force=0.1), initial=[1.0, 0.0])
    assert (swing.periods, swing.period) == (1, pytest.approx(2.0 * np.pi))
    doubled = periodic_motion(ROSSLER.with_(c=3.5), initial=[1.0, 1.0, 1.0], transient=300.0,
                              longest_period=20.0)
    assert doubled.period == pytest.approx(2.0 * calm.period, rel=0.05)
    with pytest.raises(fc.AnalysisError, match="comes to rest"):
        periodic_motion(LORENZ.with_(rho=5.0), initial=[1.0, 1.0, 1.0], transient=100.0,
                        longest_period=10.0)


def test_strobed_states_of_several_fields():
    fields = [DUFFING.with_(force=force) for force in (0.05, 0.1)]
    both = strobe(fields, transient_periods=3, keep=2, initial=np.array([[1.0, 0.0], [1.0, 0.0]]))
    alone = strobe(fields[1], transient_periods=3, keep=2, initial=[1.0, 0.0])
    assert (both.states[1] == alone.states[0]).all()
    assert fc.system.forcing_period(DUFFING) == 2.0 * np.pi


@pytest.mark.parametrize(("call", "told"), [
    (lambda: poincare_scan(DUFFING, "c", [1.0], initial=[0.0, 0.0]), "no parameter 'c'"),
    (lambda: poincare_scan(LORENZ, "rho", [1.0], initial=np.ones(3)), "no time-dependent"),
    (lambda: poincare_scan(LORENZ, "rho", [1.0], initial=np.ones(3), transient=1.0), "section"),
    (lambda: poincare_scan(LORENZ, "rho", [1.0], section=Crossing("x")), "transient = None"),
    (lambda: poincare_scan(LORENZ, "rho", [1.0], section=Crossing("x"), transient=1.0, keep=0),
     "keep = 0"),
    (lambda: lyapunov_exponents(LORENZ, 1.0), "no place at rest"),
    (lambda: lyapunov_exponents(LORENZ, 1.0, initial=np.ones(3), count=4), "from 1 to 3"),
    (lambda: basins(LORENZ, (Axis("x"), [0.0]), (Axis("x"), [0.0]), transient=1.0,
                    section=Crossing("x")), "take other axes"),
    (lambda: basins(LORENZ, (Axis("x", "x"), [0.0]), (Axis("y"), [0.0]), transient_periods=1),
     "the name of one alone"),
])
def test_errors(call, told):
    with pytest.raises(fc.InputError, match=told):
        call()


def test_exponents_at_the_start_are_those_of_the_equilibrium():
    # At the origin: (-(s + 1) +- sqrt((s - 1)^2 + 4 s rho)) / 2, and -b.
    calm = lyapunov_exponents(LORENZ.with_(rho=0.5), 200.0, initial=[1e-3, 1e-3, 1e-3], count=3,
                              transient=60.0, interval=0.1)
    root = np.sqrt(81.0 + 20.0)
    assert calm.exponents == pytest.approx(
        [(-11.0 + root) / 2.0, -8.0 / 3.0, (-11.0 - root) / 2.0], abs=2e-2)


def test_lost_exponents_are_told():
    with pytest.warns(fc.ModelWarning, match="interval = 20"):
        lyapunov_exponents(ROSSLER, 400.0, initial=[1.0, 1.0, 1.0], count=3, interval=20.0)


def growing(t, x, p, out):
    out[0], out[1] = x[1], -x[0] + p[0] * x[1]


GROWING = vector_field(growing, {"k": 0.1}, ["x", "v"])


def test_exponents_of_a_motion_that_escapes():
    """Rates grow with the motion: the usual interval is far below the memory for its instants."""
    with pytest.raises(AnalysisError, match=r"The motion escapes: at t = .* choose a start"):
        lyapunov_exponents(GROWING.with_(k=1.0), 1000.0, initial=[1.0, 1.0])
    with pytest.raises(InputError, match=r"number of intervals in duration = .* longer interval"):
        lyapunov_exponents(ROSSLER.with_(a=5.0), 1000.0, initial=[1.0, 0.0, 1.0], transient=10.0,
                           count=2)


def test_a_scan_goes_on_from_its_start_where_a_motion_escapes():
    found = poincare_scan(GROWING, "k", [-0.1, 0.1, 1.6], section=Crossing("x"), transient=100.0,
                          keep=1, initial=[1.0, 1.0], chains=1)
    assert found.up.shape == found.down.shape == (3, 1, 2)
    assert np.abs(found.up[0]).max() < 1e-3
    # x grows by exp(k t / 2); on the way down, too, it begins at the start again.
    for way in (found.up, found.down):
        assert 1.0 < np.abs(way[1]).max() < 1e7
