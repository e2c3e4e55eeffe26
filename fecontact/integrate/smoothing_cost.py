"""Effect of friction smoothing, or of the compliance of stops, on a run."""

from dataclasses import dataclass

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.integrate.coefficients import node_values
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.integrate.simulate import simulate
from fecontact.integrate.solvers import SET_VALUED, SetValued
from fecontact.integrate.task import Task
from fecontact.integrate.trajectory import Status
from fecontact.laws.friction_curve import largest_coefficient, static_coefficient
from fecontact.system.contact_system import ContactSystem


@dataclass(frozen=True, eq=False)
class SmoothingCost:
    """Difference between a smoothed and a set-valued run.

    Attributes
    ----------
    orbit_difference : float
        Largest difference of the displacement :attr:`component` in the second half of the run,
        relative to its amplitude there (half of its range in the set-valued run).
    component : str
        The compared displacement, that of largest amplitude of B and the contact nodes, such as
        ``x of contact node 0``.
    amplitude : float
        Its amplitude [m].
    break_away_smoothed, break_away : float
        Break-away friction force per normal force: maximum of the smoothed curve, and stick limit
        without smoothing, at the contact node where they differ most.
    sentence : str
        Summary in a sentence.
    """

    orbit_difference: float
    component: str
    amplitude: float
    break_away_smoothed: float
    break_away: float
    sentence: str


def smoothing_cost(
    system: ContactSystem,
    t_end: float,
    *,
    initial: Initial = "rest",
    outputs: int = 4001,
    rtol: float = 1e-6,
    solver: SetValued = SET_VALUED,
) -> SmoothingCost:
    """Run a system with its own laws and with set-valued ones from the same start, and compare.

    Parameters
    ----------
    system : ContactSystem
        With friction laws that have a ``smoothing_slope``.
    t_end : float
        End of both runs [s]; some periods of the motion.
    initial : 'rest', 'sliding', RigidStart, Trajectory or (2 m,) array
        Initial state of both; see :func:`fecontact.integrate.initial_state`.
    outputs : int
        Number of times at which the runs are compared, at least 20.
    rtol : float
        Relative tolerance of both.
    solver : SetValued
        Solver of the set-valued run.

    Raises
    ------
    InputError
        As :func:`fecontact.simulate`, or if one of the runs ended early.
    AnalysisError
        If there is no equilibrium to start from.
    """
    require_kind("smoothing_cost", ContactSystem, system=system)
    require_kind("smoothing_cost", SetValued, solver=solver)
    if not isinstance(outputs, int) or outputs < 20:
        raise InputError(f"smoothing_cost: outputs = {outputs!r} must be at least 20.")
    state = initial_state(system, initial, 0.0)
    smoothed = simulate(system, t_end, t_start=0.0, initial=state, outputs=outputs, rtol=rtol,
                        keep_steps=False)
    exact = solver.run(Task(system, state, smoothed.time, rtol))
    for name, run in (("smoothed", smoothed), ("set-valued", exact)):
        if run.status is not Status.FINISHED:
            raise InputError(f"smoothing_cost: the {name} run ended early at t = "
                             f"{run.time[-1]:.6g} s. {run.status.value}")
    m, d, half = system.basis.modes, system.basis.dimension, outputs // 2
    T = system.basis.T[:, :d].reshape(-1, m)
    ours, theirs = exact.states[half:, :m] @ T.T, smoothed.modal_coordinates[half:] @ T.T
    places = [f"{axis} of {point}" for point in (
        "B", "C", *(f"contact node {j}" for j in range(system.basis.contact_nodes)))
        for axis in "xyz"[:d]]
    amplitudes = 0.5 * np.ptp(ours, axis=0)[: len(places)]
    row = int(np.argmax(amplitudes))
    largest = float(np.abs(ours - theirs)[:, row].max())
    difference = largest / float(amplitudes[row]) if amplitudes[row] > 0.0 else np.inf
    before, after = _break_away(system, solver)
    what = ("a rigid stop in place of the compliant contact" if solver.restitution is not None
            else "friction without smoothing")
    sentence = (f"In the second half of {t_end:.4g} s {what} moves {places[row]} by "
                f"{100.0 * difference:.2g} % of its amplitude {amplitudes[row]:.3g} m")
    if solver.restitution is None and f"{before:.4g}" == f"{after:.4g}":
        sentence += f"; both break away at {after:.4g} F_N"
    elif solver.restitution is None:
        sentence += (f"; the smoothed contact breaks away at {before:.4g} F_N, not at "
                     f"{after:.4g} F_N")
    sentence += "."
    return SmoothingCost(difference, places[row], float(amplitudes[row]), before, after, sentence)


def _break_away(system: ContactSystem, solver: SetValued) -> tuple[float, float]:
    """Largest R/F with and without smoothing, of the node where they differ most."""
    n = system.basis.contact_nodes
    smooth, sharp = np.empty(n), np.empty(n)
    for nodes, _, law in system.law_groups("friction"):
        smooth[nodes] = largest_coefficient(law)[0]
        sharp[nodes] = static_coefficient(law, nodes.stop - nodes.start)
    static = node_values("static_coefficient", solver.static_coefficient, system.basis, -1.0)
    sharp = np.where(static >= 0.0, static, sharp)
    worst = int(np.argmax(np.abs(smooth - sharp)))
    return float(smooth[worst]), float(sharp[worst])
