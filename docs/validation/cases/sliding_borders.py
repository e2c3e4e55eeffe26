"""Sliding bifurcations: the end of stick-slip, and the birth and loss of stick phases.

A mass on a belt (m = k = 1, F_N = 1) with static friction 1 and kinetic friction 1/2: stick ends at
x = 1 - c V with the speed V, slip is a damped vibration about x = 1/2, and where its next crest
just reaches the speed of the belt, stick-slip ends by grazing-sliding. The border over speed and
dashpot is compared with the roots of that closed form.

A mass on a belt with one coefficient of friction, driven by a harmonic force, passes three borders
as the belt becomes faster: from slip to both sides without stick, by crossing-sliding to stick, by
switching-sliding to slip to one side, by grazing-sliding to slip that never ends. There the
greatest speed of the linear response is that of the belt.

Usage: python sliding_borders.py [--quick]
"""

import sys

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

import fecontact as fc
from fecontact.bifurcation import (
    Branch,
    ContactField,
    ContinuationOptions,
    Shooting,
    codim2_curve,
    contact_field,
    orbit_branch,
    periodic_motion,
)
from fecontact.integrate import SetValued
from fecontact.laws import ConstantFriction, PrescribedForce

ROWS = [[[1.0], [0.0], [0.0]]]
STATIC = SetValued(static_coefficient=1.0)
DASHPOT = 0.1  # of the first mass, and of the second one


def closed_form(dashpot: float) -> float:
    """Speed of the belt at which the next crest of the slip velocity just reaches it."""
    rates = np.array([[0.0, 1.0], [-1.0, -dashpot]])

    def misses(speed: float) -> float:
        start = np.array([0.5 - dashpot * speed, speed])

        def slope(t: float) -> float:
            return float((rates @ expm(rates * t) @ start)[1])

        times = np.linspace(0.0, 2.2 * np.pi, 100)
        slopes = np.array([slope(t) for t in times])
        last = int(np.flatnonzero((slopes[:-1] > 0.0) & (slopes[1:] <= 0.0))[0])
        crest = brentq(slope, times[last], times[last + 1], xtol=1e-15)
        return float((expm(rates * crest) @ start)[1] - speed)

    return float(brentq(misses, 0.12, 1.5, xtol=1e-13))


def on_belt(dashpot: float, speed: float) -> fc.ContactSystem:
    """Static friction 1, kinetic friction 1/2."""
    basis = fc.basis_from_matrices([[1.0]], [[1.0]], {"contact": ROWS, "B": ROWS[0]},
                                   damping=[[dashpot]])
    return fc.ContactSystem(basis, normal=PrescribedForce(1.0), friction=ConstantFriction(0.5),
                            ground=fc.Ground(speed=speed))


def end_of_stick_slip(quick: bool) -> tuple[Branch, Branch]:
    """The branch over the speed up to its end, and that end over speed and dashpot."""
    field = contact_field(on_belt(DASHPOT, 0.5), {
        "ground.speed": None,
        "dashpot": (DASHPOT, lambda system, c: system.with_(basis=on_belt(c, 1.0).basis))})
    motion = periodic_motion(field.system(), initial=[0.9, 0.5], transient=40.0,
                             longest_period=20.0, solver=STATIC)
    branch = orbit_branch(field, motion, "ground.speed", method=Shooting(1, solver=STATIC),
                          bounds=(0.4 if quick else 0.1, 1.0), both=True)
    curve = codim2_curve(
        field, branch.points[-1], "dashpot",
        bounds={"ground.speed": (0.4, 0.8) if quick else (0.15, 1.4), "dashpot": (0.02, 0.5)},
        options=ContinuationOptions(largest_step=0.1))
    return branch, curve


def driven(quick: bool) -> tuple[ContactField, Branch]:
    """One coefficient of friction, 0.4, a force cos 1.5 t, and damping 0.05, over the speed."""
    basis = fc.basis_from_matrices([[1.0]], [[0.5]], {"contact": ROWS, "B": ROWS[0]},
                                   damping=[[DASHPOT]])
    system = fc.ContactSystem(
        basis, normal=PrescribedForce(1.0), friction=ConstantFriction(0.4),
        ground=fc.Ground(speed=0.8),
        drive=fc.Drive(stiffness_x=0.5, amplitude_x=2.0, frequency_hz=1.5 / (2.0 * np.pi)))
    field = contact_field(system, ["ground.speed"])
    motion = periodic_motion(system, solver=SetValued())
    return field, orbit_branch(field, motion, method=Shooting(1, solver=SetValued()),
                               bounds=(0.7 if quick else 0.1, 1.4), both=True)


def main(quick: bool = False) -> None:
    """Print the borders beside their closed forms."""
    branch, curve = end_of_stick_slip(quick)
    end = branch.points[-1]
    print(f"stick-slip ends at V = {end.parameter:.7f}, by {end.kind} "
          f"(closed form {closed_form(DASHPOT):.7f})")
    differences = [abs(point.parameter - closed_form(point.values["dashpot"]))
                   for point in curve.points]
    print(f"over speed and dashpot: {len(differences)} points, largest difference "
          f"{max(differences):.1e}")
    _, forced = driven(quick)
    for point in forced.special:
        print(f"{point.kind} at V = {point.parameter:.6f}")
    response = 1.5 / abs(1.0 - 1.5**2 + 1.5j * DASHPOT)
    print(f"greatest speed of the linear response: {response:.6f}")


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
