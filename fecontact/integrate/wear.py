"""Wear that changes the gap: blocks of runs between which the worn depth is taken off the body."""

import warnings
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from fecontact.core.checks import as_count, require_kind
from fecontact.core.errors import (
    AnalysisError,
    InputError,
    ModelWarning,
    require_finite,
    require_positive,
)
from fecontact.core.progress import progress_bar, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised, quantity
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.integrate.simulate import simulate
from fecontact.integrate.solvers import AUTO, Solver
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.laws.wear import WearLaw
from fecontact.system.contact_system import ContactSystem
from fecontact.system.forcing_period import forcing_period
from fecontact.system.statics.equilibrium import equilibrium_coordinates

# Difference of depth along the face in one block, relative to the penetration, that is warned of.
_UNEVEN = 0.5


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class WearHistory(Summarised):
    """Wear of a contact face over B blocks of cycles.

    Attributes
    ----------
    law : WearLaw
    thickness : float
        Out-of-plane thickness of the face [m]; one for solids.
    acceleration : float
        Cycles that each computed period stands for.
    x, tributary : (n,) arrays
        Places and lengths of the contact nodes [m].
    gap : (n,) array
        Initial gap [m].
    cycles, time : (B + 1,) arrays
        Cycles endured, and computed time [s], at the start and after each block.
    depth : (B + 1, n) array
        Depth worn off [m].
    normal_force, slip_work : (B, n) arrays
        Mean normal force [N] and energy lost in slip [J] at each node in the computed periods.
    state : array
        State of the system at the end.
    status : Status
        How the last block ended.
    """

    law: WearLaw
    thickness: float
    acceleration: float
    x: Array
    tributary: Array
    gap: Array
    cycles: Array
    time: Array
    depth: Array
    normal_force: Array
    slip_work: Array
    state: Array
    status: Status = field(default=Status.FINISHED)

    @property
    def volume(self) -> Array:
        """Volume (B + 1,) worn off the face [m3]."""
        return self.thickness * (self.depth @ self.tributary)

    @property
    def line_load(self) -> Array:
        """Mean normal force per length (B, n) in each block [N/m]."""
        return self.normal_force / self.tributary

    def summary(self) -> list[tuple[str, str]]:
        """Law, blocks, cycles, depth and volume."""
        deepest = int(self.depth[-1].argmax())
        return [
            ("law", f"{type(self.law).__name__}, thickness {quantity(self.thickness, 'm')}"),
            ("blocks", f"{len(self.cycles) - 1}"),
            ("cycles", f"{self.cycles[-1]:.5g}, {self.acceleration:.5g} per computed period"),
            ("depth", f"{quantity(float(self.depth[-1].min()), 'm')} ... "
                      f"{quantity(float(self.depth[-1].max()), 'm')}, most at x = "
                      f"{quantity(float(self.x[deepest]), 'm')}"),
            ("volume", f"{self.volume[-1]:.4g} m3"),
        ]

    def worn(self, system: ContactSystem) -> ContactSystem:
        """The system with its gap as it is at the end."""
        require_kind("WearHistory.worn", ContactSystem, system=system)
        return system.with_(gap=tuple(self.gap + self.depth[-1]))


def wear_history(
    system: ContactSystem,
    law: WearLaw,
    thickness: float | None,
    *,
    acceleration: float,
    blocks: int,
    periods: int = 1,
    settling: int = 0,
    period: float | None = None,
    initial: Initial = "rest",
    outputs: int = 401,
    solver: Solver = AUTO,
    rtol: float = 1e-6,
    progress: bool = False,
) -> WearHistory:
    """Wear of a contact face that changes its gap, so that the loads redistribute.

    Each block computes some periods of the motion; the depth that they wear off, times the
    ``acceleration``, is added to the gap of each node, ``g' = acceleration x depth'``, and the body
    sinks with its static equilibrium. The next block goes on from the end of the last one.

    Halve the acceleration and double the blocks: what then changes is the error of the blocks.

    Parameters
    ----------
    system : ContactSystem
        The system; its gap is that of the unworn body.
    law : EnergyWear or ArchardWear
        Wear law.
    thickness : float or None
        Out-of-plane thickness of the face [m]; None for solids.
    acceleration : float
        Cycles that each computed period stands for, above zero.
    blocks, periods : int
        Number of blocks, and of computed periods in each.
    settling : int
        Number of periods before the first block that wear nothing.
    period : float, optional
        Duration of a cycle [s]; by default the common period of the excitation.
    initial, solver, rtol
        As for :func:`fecontact.simulate`.
    outputs : int
        Output times of each block.
    progress : bool
        Show a progress bar.

    Raises
    ------
    InputError
        For values out of range.
    AnalysisError
        If there is no period, no equilibrium to start from, or a block does not reach its end.

    Warns
    -----
    ModelWarning
        If one block changes the profile by half of the penetration or more: loads swing then.
    """
    require_kind("wear_history", ContactSystem, system=system)
    require_kind("wear_history", WearLaw, law=law)
    solid = system.basis.dimension == 3
    if solid and thickness is not None:
        raise InputError(f"wear_history: thickness = {thickness!r} is for plane bodies; give None "
                         f"for a solid.")
    across = 1.0 if solid else cast(float, thickness)
    require_positive("wear_history", acceleration=acceleration, thickness=across)
    for name, count, least in (("blocks", blocks, 1), ("periods", periods, 1),
                               ("settling", settling, 0)):
        as_count(count, f"wear_history: {name}", least)
    if period is not None:
        require_positive("wear_history", period=period)
    cycle = forcing_period(system) if period is None else float(period)
    options: dict[str, Any] = {"solver": solver, "rtol": rtol}
    time = float(initial.time[-1]) if isinstance(initial, Trajectory) else 0.0
    require_finite("wear_history", time=time)
    state = initial_state(system, initial, time)
    n = system.basis.contact_nodes
    gap = np.broadcast_to(np.asarray(system.gap, dtype=float), (n,)).copy()
    depth, cycles, times = [np.zeros(n)], [0.0], [time]
    forces, works = [], []
    with shown(progress or None, lambda: progress_bar("Wearing", float(blocks), 0.0)) as tell:
        if settling:
            state = _end(simulate(system, time + settling * cycle, t_start=time, initial=state,
                                  outputs=2, keep_steps=False, **options), "settling").states[-1]
            time += settling * cycle
            times[0] = time
        worn = system
        for block in range(1, blocks + 1):
            end = time + periods * cycle
            run = simulate(worn, end, t_start=time, initial=state, outputs=outputs, **options)
            if run.status is Status.INTERRUPTED:
                break
            _end(run, f"block {block}")
            added = acceleration * run.wear_depth(law, None if solid else across)[-1]
            _warn_of_swings(added, run, block)
            depth.append(depth[-1] + added)
            cycles.append(cycles[-1] + periods * acceleration)
            times.append(end)
            forces.append(np.trapezoid(run.normal_force, run.time, axis=0) / (end - time))
            works.append(run.slip_work[-1])
            before, worn = worn, system.with_(gap=tuple(gap + depth[-1]))
            state, time = _sunk(run.states[-1], before, worn, end), end
            if tell is not None:
                tell(float(block))
    status = Status.FINISHED if len(works) == blocks else Status.INTERRUPTED
    if not works:
        raise KeyboardInterrupt
    return WearHistory(
        law, float(across), float(acceleration), system.basis.contact_x,
        system.basis.tributary, gap, np.array(cycles), np.array(times), np.array(depth),
        np.array(forces), np.array(works), state, status)


def _end(run: Trajectory, where: str) -> Trajectory:
    """The run, if it reached its end."""
    if run.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if run.status is not Status.FINISHED:
        raise AnalysisError(f"wear_history: {where} did not reach its end: {run.status.value}")
    return run


def _sunk(state: Array, before: ContactSystem, worn: ContactSystem, time: float) -> Array:
    """The state after the body has sunk by the change of its normal equilibrium."""
    try:
        change = (equilibrium_coordinates(worn, "rest", time, standing=True)
                  - equilibrium_coordinates(before, "rest", time, standing=True))
    except AnalysisError:
        # Nothing presses it: an impacting body has no equilibrium on the ground.
        return state
    moved = state.copy()
    moved[: len(change)] += change
    return moved


def _warn_of_swings(added: Array, run: Trajectory, block: int) -> None:
    deepest = float(run.penetration.max())
    if np.ptp(added) > _UNEVEN * max(deepest, 0.0) and np.ptp(added) > 0.0:
        warnings.warn(f"Block {block} wears {np.ptp(added):.3g} m more off some contact nodes than "
                      f"off others, against a penetration of {deepest:.3g} m: the loads swing from "
                      f"block to block; choose a smaller acceleration, and more blocks.",
                      ModelWarning, stacklevel=3)
