"""One mass and dry friction: decay, forced vibration, stick-slip on a belt, stability."""

import numpy as np
from comparison import Comparison, comparisons
from scipy.optimize import brentq
from single_masses import in_plane, mass_in_plane

from fecontact import ContactSystem, Drive, Ground, Load, equilibrium, simulate
from fecontact.integrate import Rodas5P, SetValued
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    HyperbolicFriction,
    LinearContact,
    RoughSurface,
)

GENTLE = RoughSurface(1e5, 1e-4, 0.0)
DEN_HARTOG = {(0.8, 0.2): 2.7114152554, (0.8, 0.4): 2.5017878810, (0.9, 0.4): 4.6203419164,
              (1.25, 0.4): 1.4800496969, (1.5, 0.2): 0.7659416862, (1.5, 0.6): 0.4,
              (2.0, 0.4): 4.0 / 15.0}
LEINE = {None: (12.0010312948, 1.1339446764), 1e4: (11.80799363, 1.1158705968),
         1e3: (11.29815066, 1.0670795093), 1e2: (9.70968083, 0.91023681)}


def section() -> str:
    """One table."""
    rows = coulomb_decay() + den_hartog() + leine() + unexcited() + hopf() + flutter()
    return f"""## Friction of one mass

"Set-valued" is friction without smoothing (`solver=SetValued()`); other rows give the smoothing
slope k_s. Smoothing with k_s = 1e3 s/m changes the period of the belt oscillator by 6 %. This is a
property of the model: the reference is the period of the smoothed law.

{comparisons(rows)}
"""


def coulomb_decay() -> list[Comparison]:
    """Code_Aster SDND100: turning points of a mass released on a rough table."""
    times = np.pi / 100.0 * np.arange(6)
    exact = 1e-3 * np.array([0.85, -0.65, 0.45, -0.25, 0.05, 0.05])
    rows = []
    for name, slope, solver, rtol in (("set-valued", 1e6, SetValued(), 1e-10),
                                      ("k_s = 1e6 s/m", 1e6, Rodas5P(), 1e-8)):
        system = mass_in_plane(stiffness=np.diag([1e4, 0.0]), normal=GENTLE, load=Load(2.0),
                               friction=ConstantFriction(0.5, smoothing_slope=slope))
        x = simulate(system, times[-1], initial=in_plane(system, 0.85e-3), outputs=times,
                     solver=solver, rtol=rtol).displacement(0)[:, 0]
        rows += [Comparison(f"SDND100, {name}: turning point {k} [mm]", 1e3 * exact[k], 1e3 * x[k])
                 for k in (1, 4)]
    return rows


def den_hartog() -> list[Comparison]:
    """Amplitudes of a mass under P cos(w t) with Coulomb friction beta P."""
    rows = []
    for (ratio, beta), wanted in DEN_HARTOG.items():
        system = mass_in_plane(
            stiffness=np.diag([0.5, 0.0]), normal=GENTLE, load=Load(1.0),
            friction=ConstantFriction(beta),
            drive=Drive(stiffness_x=0.5, amplitude_x=2.0, frequency_hz=ratio / (2.0 * np.pi)))
        periods = 150
        times = np.concatenate([[0.0], np.linspace(periods - 1, periods, 401)])
        times *= 2.0 * np.pi / ratio
        x = simulate(system, times[-1], initial=in_plane(system, 0.0), outputs=times,
                     solver=SetValued(), rtol=1e-9).displacement(0)[1:, 0]
        rows.append(Comparison(f"Den Hartog, r = {ratio:g}, beta = {beta:g}, set-valued: X k / P",
                               wanted, 0.5 * np.ptp(x)))
    return rows


def leine() -> list[Comparison]:
    """A mass on a belt with friction F_s / (1 + 3 |v|)."""
    rows = []
    for slope, (period, largest) in LEINE.items():
        system = mass_in_plane(
            stiffness=np.diag([1.0, 0.0]), normal=GENTLE, load=Load(1.0), ground=Ground(speed=0.2),
            friction=HyperbolicFriction(1.0, 0.0, 1.0 / 3.0, smoothing_slope=slope or 1e6))
        run = simulate(system, 60.0, initial=in_plane(system, 0.5, 0.2), outputs=60001,
                       solver=Rodas5P() if slope else SetValued(), rtol=1e-9)
        x = run.displacement(0)[:, 0]
        name = f"k_s = {slope:g}" if slope else "set-valued"
        rows += [Comparison(f"belt (Leine), {name}: period", period,
                            mean_period(run.time, x, 0.5)),
                 Comparison(f"belt (Leine), {name}: largest x", largest,
                            x[run.time > 20.0].max())]
    return rows


def oscillator(speed: float, slope: float) -> ContactSystem:
    """The friction oscillator of section 4.3, its base at rest."""
    return mass_in_plane(
        5.632, normal=RoughSurface(10e6, 10e-6, 40.0), load=Load(14.0), ground=Ground(speed=speed),
        friction=ExponentialFriction(0.8, 0.55, 1000.0, slope),
        drive=Drive(stiffness_x=5610.0, damping_x=0.768))


def unexcited() -> list[Comparison]:
    """Periods of stick-slip of the friction oscillator of section 4.3 without excitation."""
    rows = []
    for name, slope, solver, wanted in (("set-valued", 1e6, SetValued(), 1.361213293),
                                        ("k_s = 1e6 s/m", 1e6, Rodas5P(), 1.264348)):
        system = oscillator(1e-3, slope)
        run = simulate(system, 12.0, initial=in_plane(system, 0.0), outputs=48001, solver=solver,
                       rtol=1e-9)
        rows.append(Comparison(f"section 4.3 without excitation, {name}: period [s]", wanted,
                               mean_period(run.time, run.displacement(0)[:, 0], 1.5e-3)))
    return rows


def hopf() -> list[Comparison]:
    """Belt speed above which the friction oscillator slides steadily."""

    def growth(speed: float, slope: float) -> float:
        system = oscillator(speed, slope)
        q = equilibrium(system, "sliding").modal_coordinates
        values = np.linalg.eigvals(system.jacobian(0.0, np.concatenate([q, np.zeros(2)])))
        # The pair of the motion along the ground; that of the contact lies near 970 rad/s.
        return float(values[np.abs(values.imag) < 100.0].real.max())

    return [Comparison(f"section 4.3: speed where steady sliding becomes stable, {name} [mm/s]",
                       wanted, 1e3 * brentq(growth, 7e-3, 10e-3, (slope,), xtol=1e-13))
            for name, slope, wanted in (("k_s = 1e6 s/m", 1e6, 8.336533),
                                        ("k_s = 1e12 s/m", 1e12, 8.424483793))]


def flutter() -> list[Comparison]:
    """Mode coupling of Hoffmann et al. (2002): a linear contact of stiffness 4/3."""

    def frequencies(coefficient: float) -> np.ndarray:
        # The belt runs to -x, so that friction takes 4 mu / 3 from the coupling of x to y.
        system = mass_in_plane(stiffness=np.array([[2.0, 1.0], [1.0, 2.0 - 4.0 / 3.0]]),
                               normal=LinearContact(4.0 / 3.0), ground=Ground(speed=-1.0),
                               friction=ConstantFriction(coefficient), load=Load(1.0))
        q = equilibrium(system, "sliding").modal_coordinates
        values = np.linalg.eigvals(system.jacobian(0.0, np.concatenate([q, np.zeros(2)])))
        return np.sort_complex(-values**2)[[0, -1]]

    # The two squares of frequencies meet where the square of their difference is zero.
    critical = brentq(lambda mu: float(np.diff(frequencies(mu))[0].real ** 2
                                       - np.diff(frequencies(mu))[0].imag ** 2), 0.5, 0.9,
                      xtol=1e-13)
    return [Comparison("mode coupling (Hoffmann): friction coefficient of flutter", 0.75, critical),
            Comparison("mode coupling (Hoffmann): frequency there", np.sqrt(2.0),
                       float(np.sqrt(frequencies(critical).real.mean())))]


def mean_period(time: np.ndarray, x: np.ndarray, place: float) -> float:
    """Mean time between upward passages of a place, transients left out."""
    passing = np.flatnonzero((x[:-1] < place) & (x[1:] >= place))
    at = time[passing] + (place - x[passing]) / (x[passing + 1] - x[passing]) * np.diff(
        time)[passing]
    at = at[at > 0.3 * time[-1]]
    return float((at[-1] - at[0]) / (len(at) - 1))
