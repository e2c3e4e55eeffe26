"""Bifurcations of small equations and of mode coupling, as published or in closed form."""

import numpy as np
from comparison import Comparison, comparisons
from scipy.integrate import solve_ivp
from single_masses import mass_in_plane

from fecontact import Ground, Load
from fecontact.bifurcation import (
    Branch,
    Collocation,
    ContinuationOptions,
    contact_field,
    equilibrium_branch,
    find_equilibrium,
    orbit_branch,
    vector_field,
)
from fecontact.laws import ConstantFriction, LinearContact

CASCADE = (("asymmetric orbit", 229.407, 0.480867), ("doubled orbit", 218.210, 0.987949),
           ("twice doubled orbit", 215.966, 1.98675))


def section() -> str:
    """One table."""
    rows = stuart_landau() + lorenz() + reactor() + predator() + mode_coupling()
    return f"""## Continuation

Equilibria and periodic orbits are followed by `equilibrium_branch` and `orbit_branch`. The
Stuart-Landau orbit, the Hopf point of the Lorenz equations and mode coupling have closed forms.
Other references are known to the digits shown; those of AUTO's demos are as AUTO-07p prints them.

{comparisons(rows)}
"""


def stuart_landau() -> list[Comparison]:
    """Solutions of z' = (r + 2 i) z - z |z|^2 from its Hopf point to r = 1."""

    def landau(t, x, p, out):
        square = x[0] * x[0] + x[1] * x[1]
        out[0] = (p[0] - square) * x[0] - 2.0 * x[1]
        out[1] = (p[0] - square) * x[1] + 2.0 * x[0]

    field = vector_field(landau, {"r": -0.5}, 2)
    still = equilibrium_branch(field, parameter="r", bounds=(-0.5, 1.0))
    hopf, = still.of_kind("Hopf")
    end = orbit_branch(field, hopf, bounds=(-0.5, 1.0)).points[-1]
    period, smallest = end.values["period"], np.abs(end.values["multipliers"]).min()
    return [Comparison("Stuart-Landau: r of the Hopf point", 0.0, hopf.parameter),
            Comparison("Stuart-Landau, r = 1: radius", 1.0, end.values["maximum"][0]),
            Comparison("Stuart-Landau, r = 1, w = 2: period", np.pi, period),
            Comparison("Stuart-Landau, r = 1: Floquet exponent", -2.0, np.log(smallest) / period)]


def lorenz() -> list[Comparison]:
    """Hopf point, and three doublings of the asymmetric orbit; sigma = 10, b = 8 / 3."""

    def flow(t, x, p, out):
        out[0] = 10.0 * (x[1] - x[0])
        out[1] = x[0] * (p[0] - x[2]) - x[1]
        out[2] = x[0] * x[1] - 8.0 / 3.0 * x[2]

    field = vector_field(flow, {"rho": 280.0}, 3)
    root = np.sqrt(8.0 / 3.0 * 19.0)
    still = find_equilibrium(field, {"rho": 20.0}, start=[root, root, 19.0])
    hopf, = equilibrium_branch(field, still, "rho", bounds=(20.0, 30.0)).of_kind("Hopf")
    rows = [Comparison("Lorenz: rho of the Hopf point", 470.0 / 19.0, hopf.parameter),
            Comparison("Lorenz: period there", 0.65283, hopf.period)]
    times = np.linspace(39.0, 40.0, 4000)
    states = solve_ivp(lambda t, x: field.rates(np.zeros(1), x[None], field.values)[0],
                       (0.0, 40.0), [1.0, 2.0, 250.0], method="LSODA", t_eval=times, rtol=1e-8,
                       atol=1e-10).y.T
    branch = orbit_branch(field, (times, states), "rho", method=Collocation(intervals=60),
                          bounds=(225.0, 330.0), direction=-1.0)
    rows.append(Comparison("Lorenz, rho = 280: period of the asymmetric orbit", 0.434522,
                           branch.points[0].values["period"]))
    for number, (name, rho, period) in enumerate(CASCADE):
        doubling = branch.of_kind("period doubling")[0]
        rows += [Comparison(f"Lorenz, {name}: rho of its doubling", rho, doubling.parameter),
                 Comparison(f"Lorenz, {name}: period there", period, doubling.values["period"])]
        if number < 2:
            branch = orbit_branch(field, doubling, bounds=(215.0, 230.0),
                                  options=ContinuationOptions(step=0.01,
                                                              stop_at=("period doubling",)))
    return rows


def reactor() -> list[Comparison]:
    """Demo ab, p3 = 3."""

    def reaction(t, x, p, out):
        rate = p[0] * (1.0 - x[0]) * np.exp(x[1])
        out[0] = -x[0] + rate
        out[1] = -x[1] + p[1] * rate - 3.0 * x[1]

    rows = []
    for p2, kind, wanted in ((14.0, "Hopf", (0.165042, 0.336550)),
                             (17.0, "Hopf", (0.120866, 0.217081)),
                             (17.0, "fold", (0.121901, 0.117015))):
        field = vector_field(reaction, {"p1": 0.0, "p2": p2}, 2)
        branch = equilibrium_branch(field, parameter="p1", bounds=(0.0, 0.5))
        rows += [Comparison(f"AUTO's ab, p2 = {p2:g}: p1 of {kind} point {k + 1}", value,
                            point.parameter)
                 for k, (value, point) in enumerate(zip(wanted, branch.of_kind(kind),
                                                        strict=True))]
    return rows


def predator() -> list[Comparison]:
    """Demo pp2, p2 = p4 = 3, p3 = 5: from branch to branch."""

    def species(t, x, p, out):
        out[0] = (3.0 * x[0] * (1.0 - x[0]) - x[0] * x[1]
                  - p[0] * (1.0 - np.exp(-5.0 * x[0])))
        out[1] = -x[1] + 3.0 * x[0] * x[1]

    field = vector_field(species, {"p1": 0.0}, 2)
    empty = equilibrium_branch(field, parameter="p1", bounds=(0.0, 1.0))
    first, = empty.of_kind("branch point")
    prey = equilibrium_branch(field, first, bounds=(0.01, 1.0))
    fold, = prey.of_kind("fold")
    second = largest(prey, "branch point")
    hopf, = equilibrium_branch(field, second, bounds=(0.01, 1.0)).of_kind("Hopf")
    return [Comparison("AUTO's pp2: branch point of u = v = 0", 0.6, first.parameter),
            Comparison("AUTO's pp2: branch point of v = 0", 0.821904, second.parameter),
            Comparison("AUTO's pp2: fold of v = 0", 0.832929, fold.parameter),
            Comparison("AUTO's pp2: u there", 0.411162, fold.u[0]),
            Comparison("AUTO's pp2: Hopf point of u = 1/3", 0.671594, hopf.parameter),
            Comparison("AUTO's pp2: v there", 0.365762, hopf.u[1])]


def largest(branch: Branch, kind: str):
    """The special point of a kind with the largest parameter."""
    return max(branch.of_kind(kind), key=lambda point: point.parameter)


def mode_coupling() -> list[Comparison]:
    """Hoffmann's oscillator with dashpots c = 0.1: flutter at mu = 3 / 4 (1 + 2 c^2)."""
    c = 0.1
    system = mass_in_plane(
        stiffness=np.array([[2.0, 1.0], [1.0, 2.0 - 4.0 / 3.0]]), damping=c * np.eye(2),
        normal=LinearContact(4.0 / 3.0), ground=Ground(speed=-100.0), load=Load(1.0),
        friction=ConstantFriction(0.1, smoothing_slope=1e9))
    name = "friction.friction_coefficient"
    hopf, = equilibrium_branch(contact_field(system, [name]), parameter=name,
                               bounds=(0.0, 1.0)).special
    return [Comparison("mode coupling (Hoffmann), dashpots 0.1: friction coefficient of flutter",
                       0.75 * (1.0 + 2.0 * c * c), hopf.parameter),
            Comparison("mode coupling (Hoffmann), dashpots 0.1: angular frequency there",
                       np.sqrt(2.0), hopf.angular_frequency)]
