"""Frequency responses: convergence in the harmonics, and four ways to the same motion."""

from pathlib import Path
from typing import Any

import blade_pair
import frequency_response as example
import friction_damper
import numpy as np
from comparison import Comparison, comparisons, table
from pictures import save

from fecontact import ContactSystem, Drive, basis_from_matrices, simulate
from fecontact.bifurcation import (
    Collocation,
    ContactField,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    contact_field,
    frequency_response,
    orbit_branch,
    vector_field,
)
from fecontact.laws import JenkinsFriction, LinearContact
from fecontact.plot import plot_response

TURN = 2.0 * np.pi
FREQUENCY = "drive.frequency_hz"
HARMONICS = (1, 3, 5, 9, 15, 25)
FEW = ContinuationOptions(points=2)


def section(images: Path) -> str:
    """Tables, and a picture of the responses of the Duffing oscillator."""
    response = frequency_response(duffing(), (0.6, 1.6), "W", levels={"P": [0.05, 0.1, 0.18]})
    save(plot_response(response), images / "duffing-responses.png")
    return TEXT.format(published=comparisons(published()), convergence=convergence(),
                       methods=methods(), bodies=bodies())


def duffing() -> Any:
    """The oscillator x'' + .05 x' + x + .1 x^3 = P cos W t."""
    return vector_field(example.hardening, {"W": 0.8, "P": 0.18}, ["x", "v"],
                        period=lambda p: TURN / p["W"])


def jenkins() -> ContactSystem:
    """A mass with a Jenkins element, driven through its spring."""
    system = example.damped_mass()
    return system.with_(friction=JenkinsFriction(0.5, 1.0))


def unilateral() -> ContactSystem:
    """A mass on a spring, above a stop that it leaves."""
    rows = np.array([[0.0], [1.0], [0.0]])
    basis = basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows})
    return ContactSystem(basis, normal=LinearContact(3.0, 0.0), drive=Drive(
        stiffness_y=1.0, damping_y=0.1, amplitude_y=1.0, frequency_hz=0.9 / TURN))


def published() -> list[Comparison]:
    """Numbers that are known to the digits shown, or from closed forms."""
    field = duffing()
    found = frequency_response(field, (0.8, 1.6), "W")
    rows = [Comparison(f"Duffing, W = {w:g}: amplitude of the first harmonic", amplitude,
                       first(found.branches[0].at(field, w)))
            for w, amplitude in ((0.8, 0.4748720), (1.0, 1.3053455))]
    rows.append(Comparison("Duffing: W of the lower fold", 1.11570025,
                           found.branches[0].of_kind("fold")[1].parameter))
    low = frequency_response(vector_field(example.hardening, {"W": 0.6, "P": 0.01}, ["x", "v"],
                                          period=lambda p: TURN / p["W"]), (0.6, 0.61), "W",
                             options=FEW)
    third = 0.1 * abs(low.harmonic(1)[0]) ** 3 / 4.0 / abs(1.0 - 9.0 * 0.36 + 0.15j * 0.6)
    rows.append(Comparison("Duffing, P = 0.01, W = 0.6: third harmonic (to leading order)",
                           float(third), float(abs(low.harmonic(3)[0]))))
    for w, amplitude in ((1.1, 5.70250434), (1.2, 3.88731412)):
        one = frequency_response(jenkins(), (w / TURN, 1.3 / TURN),
                                 method=HarmonicBalance(1, 128), options=FEW)
        rows.append(Comparison(f"Jenkins element, one harmonic, w = {w:g}: amplitude", amplitude,
                               float(abs(one.harmonic(1)[0]))))
    return [*rows, *mathieu()]


def mathieu() -> list[Comparison]:
    """Traces of the monodromy of x'' + (a - 2 q cos 2 t) x = 0 at q = 1, which are 2 or -2."""
    from fecontact.bifurcation.harmonic.stability import koopman_hill

    t = np.pi * np.arange(64) / 64
    rows = []
    for a, name, trace in ((-0.4551386041, "a_0", 2.0), (-0.1102488170, "b_1", -2.0),
                           (1.8591080725, "a_1", -2.0)):
        J = np.zeros((64, 2, 2))
        J[:, 0, 1], J[:, 1, 0] = 1.0, -(a - 2.0 * np.cos(2.0 * t))
        rows.append(Comparison(f"Mathieu, characteristic value {name} at q = 1: trace over a "
                               f"period by Hill's matrix", trace,
                               float(np.trace(koopman_hill(J, np.pi, 24)).real)))
    return rows


def first(point: Any) -> float:
    """Amplitude of the first harmonic of the first state of an orbit of a vector field."""
    X = point.u[:6].reshape(3, 2)
    return float(np.hypot(X[1, 0], X[2, 0]))


def convergence() -> str:
    """Errors of the orbit over the number of harmonics, relative to its size."""
    strong = vector_field(example.hardening, {"W": 1.0, "P": 2.0}, ["x", "v"],
                          period=lambda p: TURN / p["W"])
    rows = []
    for name, field, parameter, value, seen in (
            ("Duffing, P = 2, W = 1", strong, "W", 1.0, None),
            ("Duffing, P = 0.18, W = 1", duffing(), "W", 1.0, None),
            ("mass that leaves a stop, w = 0.9", _field(unilateral()), FREQUENCY, 0.9 / TURN, "y"),
            ("mass with a Jenkins element, w = 1.2", _field(jenkins()), FREQUENCY, 1.2 / TURN,
             "x")):
        samples = 512 if seen is None else 2048
        exact = motion(field, parameter, value, HarmonicBalance(61, samples), seen)
        errors = [apart(motion(field, parameter, value, HarmonicBalance(H, samples), seen), exact)
                  for H in HARMONICS]
        rows.append((name, *(f"{error:.1e}" for error in errors)))
    return table(("", *(f"H = {H}" for H in HARMONICS)), rows)


def _field(system: ContactSystem) -> ContactField:
    return contact_field(system, [FREQUENCY])


def motion(
    field: Any, parameter: str, value: float, method: HarmonicBalance, seen: str | None
) -> np.ndarray:
    """Displacement (501,) of the orbit from rest at a value of the parameter."""
    row = np.eye(field.dimension)[0] if seen is None else field.displacement_row("B", seen)
    found = frequency_response(field, (value, 1.05 * value), parameter, method=method, options=FEW,
                               observe=row if seen is None else ("B", seen))
    return np.asarray(found.branches[0].points[0].orbit(samples=501).states @ row)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest distance of two motions relative to half the range."""
    return float(np.abs(one - other).max() / (np.ptp(other) / 2.0))


def methods() -> str:
    """Half the range of the displacement by harmonic balance, collocation, shooting and a run."""
    rows = []
    for name, system, hz, component in (
            ("mass that leaves a stop, w = 0.9", unilateral(), 0.9 / TURN, "y"),
            ("mass with a Jenkins element, w = 1.2", jenkins(), 1.2 / TURN, "x")):
        field = _field(system)
        start = frequency_response(
            system, (hz, 1.05 * hz), observe=("B", component), options=FEW,
            method=HarmonicBalance(40, 2048)).branches[0].points[0]
        given, row = start.orbit(field), field.displacement_row("B", component)
        found = [half_range(given.states @ row)]
        for method in (Collocation(200), Shooting(2)):
            # Collocation does not serve elastic Coulomb elements.
            if isinstance(method, Collocation) and component == "x":
                found.append(np.nan)
                continue
            other = orbit_branch(field, given, method=method, bounds=(hz, 1.05 * hz),
                                 options=FEW)
            found.append(half_range(other.points[0].orbit(field, 4001).states @ row))
        found.append(half_range(settled(field.system(start.parameter_values(field)), 1.0 / hz,
                                        given.states[0], 200) @ row))
        rows.append((name, *("" if np.isnan(one) else f"{one:.7f}" for one in found)))
    return table(("", "harmonic balance", "collocation", "shooting", "run in time"), rows)


def settled(system: ContactSystem, period: float, state: np.ndarray, count: int) -> np.ndarray:
    """States (2001, d) of the last of some periods of a run."""
    ends = simulate(system, count * period, initial=state, rtol=1e-9,
                    outputs=np.array([0.0, count * period])).states[-1]
    return simulate(system, period, initial=ends, rtol=1e-9, outputs=2001).states


def half_range(values: np.ndarray) -> float:
    """(max - min) / 2, with a parabola through the samples about each extreme."""
    def crest(y: np.ndarray) -> float:
        k = int(np.argmax(y[1:-1])) + 1
        a, b, c = y[k - 1], y[k], y[k + 1]
        bend = a - 2.0 * b + c
        return float(b - (c - a) ** 2 / (8.0 * bend)) if bend else float(b)

    return (crest(values) + crest(-values)) / 2.0


def bodies() -> str:
    """Amplitudes of elastic bodies with friction dampers beside runs."""
    name = "load.forces.0.signal.frequency_hz"
    beam = friction_damper.damped_beam(friction_damper.BEST, 101.0).with_(
        **{"interfaces.damper.friction.smoothing_slope": 200.0})
    pair = contact_field(blade_pair.blade_pair(5.236), {blade_pair.FREQUENCY: (
        357.0, blade_pair.excited_at)})
    rows = []
    for what, field, parameter, seen, hz, kinds, periods in (
            ("beam with a friction damper, 101 Hz", contact_field(beam, [name]), name,
             ("beam.end", "y"), 101.0, ((1, 128), (5, 256), (15, 512)), 60),
            ("two blades with a damper, 357 Hz", pair, blade_pair.FREQUENCY,
             ("first.end", "y"), 357.0, ((1, 1024), (3, 1024), (25, 1024)), 300)):
        amplitudes, row = [], field.displacement_row(*seen)
        for H, samples in kinds:
            point = frequency_response(
                field, (hz, 1.02 * hz), parameter, observe=seen,
                method=HarmonicBalance(H, samples, stability=None),
                options=ContinuationOptions(points=1)).branches[0].points[0]
            amplitudes.append((H, float(point.values["observed_amplitude"])))
        run = half_range(settled(field.system(point.parameter_values(field)), 1.0 / hz,
                                 point.orbit(field).states[0], periods) @ row)
        rows.append((what, f"{1e6 * run:.4f}", *(
            f"{1e6 * one:.4f} ({one / run - 1.0:+.1e}), H = {H}" for H, one in amplitudes)))
    return table(("amplitude [um]", "run in time", "harmonic balance", "", ""), rows)


TEXT = """## Frequency responses

Responses are computed by harmonic balance (`frequency_response`). The references are published
numbers to the digits shown, the describing function of a Jenkins element (one harmonic, 128
samples), a perturbation solution of the third harmonic at small vibration, and Mathieu's
characteristic values for Hill's method.

{published}

![Responses of the Duffing oscillator](images/validation/duffing-responses.png)

Error of the displacement over a period with H harmonics, relative to half its range; the reference
has 61 harmonics. Responses converge exponentially for smooth forces, and about as H^-3 for forces
with kinks:

{convergence}

Half the range of the displacement by four methods: harmonic balance with 40 harmonics and 2048
samples, collocation on 200 intervals, shooting with two segments, and a run of 200 periods:

{methods}

Elastic bodies with friction dampers at resonance are compared with steady runs:
`friction_damper.py` with a smoothing slope of 200 s/m, `blade_pair.py` with the normal load of the
smallest peak. With one harmonic the amplitude of the blades agrees by chance:

{bodies}
"""
