"""Running the compiled integrator: tolerances, pieces of a run, interrupts, checkpoints."""

import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.contact_energy import POWERS
from fecontact.integrate import stepping
from fecontact.integrate.scipy_solvers import longest_step
from fecontact.laws.contract import ground_profile
from fecontact.system import ContactSystem

Array = NDArray[np.float64]

FRICTION_PART = 0.01
# Slip velocities, in widths of the smoothing, at which slip is about to turn into stick.
_SLOW = 20.0


@ground_profile
def _flat(xi, p):  # type: ignore[no-untyped-def]
    return 0.0, 0.0, 0.0


@dataclass(frozen=True, eq=False)
class Run:
    """A run of the compiled integrator that can be left and taken up again.

    Attributes
    ----------
    status : int
        ``stepping.RUNNING`` while output times are left, ``FINISHED``, ``MINIMUM_STEP`` or
        ``NOT_FINITE``.
    states, work : arrays (N, 2 m + n s), (N, 8 + n)
        At the output times; rows from ``outputs`` on are not filled yet. Work of the powers
        :data:`fecontact.contact_energy.POWERS`, then friction work of each node [J].
    progress : Progress
        All that is needed to go on.
    """

    arrays: Any
    shapes: Array
    times: Array
    control: stepping.Control
    progress: stepping.Progress
    room: stepping.Room
    states: Array
    work: Array

    @property
    def outputs(self) -> int:
        """Number of output times passed."""
        return int(self.progress.counts[stepping.OUTPUTS])

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.progress.numbers[stepping.TIME])

    @property
    def statistics(self) -> dict[str, int]:
        """Counts of steps, rejected steps, right-hand sides and Jacobians."""
        counts = self.progress.counts
        return {"steps": int(counts[stepping.STEPS]),
                "rejected": int(counts[stepping.REJECTIONS]),
                "right_hand_sides": int(counts[stepping.RATES]),
                "jacobians": int(counts[stepping.STEPS]) + 1}

    def advance(self, steps: int) -> int:
        """At most so many steps more; returns the status."""
        return int(stepping.advance(self.arrays, self.shapes, self.times, self.control,
                                    self.progress, self.room, steps, self.states, self.work))


def start(
    system: ContactSystem,
    state: Array,
    times: Array,
    *,
    rtol: float,
    work: bool = True,
    breaks: Array | None = None,
    friction_part: float = FRICTION_PART,
) -> Run:
    """A run from ``times[0]``, before its first step.

    Parameters
    ----------
    system : ContactSystem
    state : (2 m + n s,) array
        y = [q, q', z] at the start.
    times : (N,) array
        Output times, ascending [s].
    rtol : float
        Error of one step: of each modal displacement relative to its largest value so far, or to
        the penetration scale of the normal laws where that is more; of modal velocities relative
        to the largest so far; of internal variables relative to their scale. At nodes with
        friction without memory slip velocities are resolved to a hundredth of their distance
        from rest, or of the width of the smoothing.
    work : bool
        Whether to integrate the powers.
    breaks : (k,) array, optional
        Times at which what is given in time has jumps or kinks; steps end there.
    """
    arrays, basis = system.arrays, system.basis
    if system.ground.shortest_wavelength is None:
        arrays = arrays._replace(profile=_flat.address)
    m, n, states = basis.modes, basis.contact_nodes, system.memory
    largest = np.abs(basis.T[:, :2]).max(axis=(0, 1))
    largest = np.where(largest > 0.0, largest, 1.0)
    slip_scale = np.empty(n)
    for nodes, _, law in system.law_groups("friction"):
        slip_scale[nodes] = law.velocity_scale
    depth = np.empty(n)
    for nodes, _, law in system.law_groups("normal"):
        depth[nodes] = law.penetration_scale
    longest = 5.0 * longest_step(system, times)
    velocity_scale = system.velocity_scale
    acceleration = np.abs(system.rhs(float(times[0]), state)[m : 2 * m]) * largest
    first = 0.1 * velocity_scale / max(float(acceleration.max()), 1e-300)
    control = stepping.Control(
        displacement_scale=system.penetration_scale / largest,
        memory_scale=system.memory_scales, slip_scale=slip_scale, depth=depth, slow=_SLOW * slip_scale,
        largest=largest, breaks=np.array([] if breaks is None else breaks, dtype=float), rtol=float(rtol),
        friction_part=friction_part, longest=longest, velocity_scale=velocity_scale,
        work=int(work))
    numbers = np.zeros(stepping.NUMBERS)
    numbers[stepping.TIME] = times[0]
    numbers[stepping.STEP] = min(first, 1e-2 * longest)
    progress = stepping.Progress(
        numbers, np.zeros(stepping.COUNTS, dtype=np.int64), np.array(state, dtype=float),
        np.zeros(len(state)), np.zeros(m), np.zeros(len(POWERS) + n), np.zeros(len(POWERS) + n),
        np.zeros((n, 3, 4)), np.zeros((n, 3 + states)), np.zeros((n, states, 3 + states)))
    return Run(arrays, np.vstack([arrays.Tx, arrays.Ty]).T.copy(), np.array(times, dtype=float),
               control, progress, stepping.room_for(m, n, states),
               np.zeros((len(times), len(state))),
               np.zeros((len(times), len(POWERS) + n)))


def finish(run: Run, progress: Callable[[float], None] | None = None, seconds: float = 0.2) -> int:
    """Go on to the end, a failure or Ctrl-C, reporting about every ``seconds``; the status."""
    steps = 1000
    while True:
        begin = clock.perf_counter()
        status = run.advance(steps)
        if progress is not None:
            progress(run.time)
        if status != stepping.RUNNING:
            return status
        passed = clock.perf_counter() - begin
        steps = int(min(max(steps * seconds / max(passed, 1e-9), 100), 10 * steps))
