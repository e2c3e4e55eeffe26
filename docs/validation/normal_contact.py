"""One mass and the ground: times, depths and restitution of impacts."""

import numpy as np
from comparison import Comparison, comparisons
from single_masses import above, mass_above

from fecontact import Load, simulate
from fecontact.analysis import find_impacts
from fecontact.laws import LinearContact, NormalLaw, PowerContact, RoughSurface

MASS, SPEED, STIFFNESS, ROUGHNESS = 0.1, 0.05, 1e6, 1e-4
DEEPEST = (3.0 * MASS * SPEED**2 * ROUGHNESS / STIFFNESS) ** (1.0 / 3.0)
TIMES = {1.0: np.pi, 1.5: 2.9432751843, 2.0: 2.8043642107, 3.0: 2.6220575543}
LINEAR = {0.05: 0.8587581018, 0.1: 0.7440793977, 0.2: 0.5717400276}
ROUGH = {0.02: 0.9569384399, 0.05: 0.8969657584, 0.1: 0.8081864188, 0.2: 0.6653065459,
         0.5: 0.4095613395}
HUNT_CROSSLEY = {0.1: 0.9374755799, 0.5: 0.7484349316, 1.0: 0.5936242600, 2.0: 0.4107196861}


def impact(law: NormalLaw, lasting: float) -> tuple[float, float]:
    """Duration [s] and restitution of an impact that takes about ``lasting`` [s]."""
    system = mass_above(MASS, normal=law)
    run = simulate(system, 1.6 * lasting, initial=above(system, 0.2 * lasting * SPEED, -SPEED),
                   outputs=2001, rtol=1e-9)
    found = find_impacts(run)
    return float(found.duration[0]), float(found.restitution[0])


def section() -> str:
    """Tables of impacts, and of two published tests."""
    rows = []
    for power, product in TIMES.items():
        law = PowerContact(STIFFNESS * 1e-4 ** (1.0 - power), power)
        deepest = ((power + 1.0) * MASS * SPEED**2 / (2.0 * law.stiffness)) ** (1.0 / (power + 1.0))
        duration, _ = impact(law, product * deepest / SPEED)
        rows.append(Comparison(f"F = K u^{power:g}: contact time v0 / u_m", product,
                               duration * SPEED / deepest))
    for zeta, wanted in LINEAR.items():
        law = LinearContact(STIFFNESS, 2.0 * zeta * np.sqrt(STIFFNESS * MASS))
        rows.append(Comparison(f"linear spring and dashpot, zeta = {zeta:g}: restitution", wanted,
                               impact(law, np.pi * np.sqrt(MASS / STIFFNESS))[1]))
    lasting = TIMES[2.0] * DEEPEST / SPEED
    for b, wanted in ROUGH.items():
        law = RoughSurface(STIFFNESS, ROUGHNESS, b * DEEPEST / SPEED * STIFFNESS)
        rows.append(Comparison(f"uniform roughness, beta v0 / u_m = {b:g}: restitution", wanted,
                               impact(law, lasting)[1]))
    for product, wanted in HUNT_CROSSLEY.items():
        law = PowerContact(STIFFNESS * 1e-4**-0.5, 1.5, product / SPEED)
        deepest = (2.5 * MASS * SPEED**2 / (2.0 * law.stiffness)) ** 0.4
        rows.append(Comparison(f"Hunt-Crossley, chi v0 = {product:g}: restitution", wanted,
                               impact(law, 2.0 * TIMES[1.5] * deepest / SPEED)[1]))
    rows += elastic_stop() + drop_on_a_spring()
    return f"""## Impacts of one mass

{comparisons(rows)}
"""


def elastic_stop() -> list[Comparison]:
    """Code_Aster SDND101: a mass on a spring moves into an elastic stop."""
    system = mass_above(100.0, 1e4, normal=LinearContact(1e6))
    times = np.linspace(0.0, 0.4, 40001)
    run = simulate(system, 0.4, initial=above(system, 0.0, -1.0), outputs=times, rtol=1e-9)
    rate = run.velocity(0)[:, 1]
    turn = np.flatnonzero((rate[:-1] < 0.0) & (rate[1:] >= 0.0))
    found = times[turn] - rate[turn] * np.diff(times)[turn] / np.diff(rate)[turn]
    return [
        Comparison("SDND101: middle of the first impact [s]", 0.015630008, found[0]),
        Comparison("SDND101: middle of the second impact [s]", 0.361049288, found[1]),
        Comparison("SDND101: largest force of the stop [N]", 9950.371902,
                   run.normal_force.max())]


def drop_on_a_spring() -> list[Comparison]:
    """Code_Aster SDND108: a mass falls on a spring 2 m below and is thrown back."""
    system = mass_above(1.0, normal=LinearContact(100.0), load=Load(10.0), gap=2.0)
    run = simulate(system, 1.1, initial=above(system, 0.0, -1.0), rtol=1e-9, outputs=np.unique(
        np.concatenate([np.linspace(0.0, 1.1, 1101), [1.0]])))
    found, z = find_impacts(run), run.displacement(0)[:, 1]
    at = int(np.argmin(np.abs(run.time - 1.0)))
    return [
        Comparison("SDND108: touch-down [s]", 0.54031242374328, float(found.touch_down[0])),
        Comparison("SDND108: lift-off [s]", 0.88545615307643, float(found.lift_off[0])),
        Comparison("SDND108: z(1.0) [m]", -1.332162981855, z[at]),
        Comparison("SDND108: z(1.1) [m]", -0.856394405035, z[-1])]
