"""Stroboscopic sweeps: states once per period, each batch run as a compiled ensemble."""

from collections.abc import Callable, Sequence

import numpy as np

from fecontact.analysis.periodicity import count_periods
from fecontact.core.errors import FecontactError
from fecontact.core.types import Array
from fecontact.integrate.ensembles import ensemble
from fecontact.integrate.initial_state import initial_state
from fecontact.integrate.trajectory import Status
from fecontact.study.study import Study
from fecontact.study.sweep_section import Strobing
from fecontact.sweeps.case import Row, SweepCase
from fecontact.system.contact_system import ContactSystem
from fecontact.system.forcing_period import forcing_period

_PHASES = 8  # states per period, to measure the range of the motion


def strobed_rows(
    cases: Sequence[SweepCase], strobing: Strobing, study_of: Callable[[SweepCase], Study],
    in_all: int,
) -> list[Row]:
    """Rows of cases, computed in ensembles of cases with equal numbers of states.

    The results are those of :func:`fecontact.ensemble` for each case alone, with the number of
    cases ``in_all``.
    """
    rows: dict[str, Row] = {}
    groups: dict[tuple[int, float], list[tuple[SweepCase, ContactSystem, Array, Array]]] = {}
    for case in cases:
        try:
            study = study_of(case)
            system, settings = study.system(), study.simulation
            system.basis.point_index(strobing.point)
            times = settings.t_start + strobe_times(forcing_period(system), strobing)
            state = initial_state(system, study.initial(), settings.t_start)
        except FecontactError as error:
            rows[case.key] = Row(case=case.key, values={}, reason=str(error))
        else:
            groups.setdefault((system.size, settings.rtol), []).append(
                (case, system, times, state))
    for (_, rtol), members in groups.items():
        found = ensemble([system for _, system, _, _ in members],
                         np.array([times for _, _, times, _ in members]),
                         initial=np.array([state for _, _, _, state in members]), rtol=rtol,
                         in_all=in_all, workers=1)
        for (case, system, _, _), states, status in zip(members, found.states, found.status,
                                                        strict=True):
            if status is Status.INTERRUPTED:
                raise KeyboardInterrupt
            rows[case.key] = (_row(case, system, states[strobing.transient_periods > 0 :], strobing)
                              if status is Status.FINISHED
                              else Row(case=case.key, values={}, reason=status.value))
    return [rows[case.key] for case in cases]


def strobe_times(period: float, strobing: Strobing) -> Array:
    """Output times [s]: the start, then eight per period from the last transient period on.

    They end at the last state to keep, after ``transient_periods + keep - 1`` periods.
    """
    phases = np.arange(-_PHASES + 1, _PHASES * (strobing.keep - 1) + 1)
    later = (strobing.transient_periods + phases / _PHASES) * period
    return np.concatenate([[0.0], later[later > 0.0]])


def _row(case: SweepCase, system: ContactSystem, states: Array, strobing: Strobing) -> Row:
    m = system.basis.modes
    row = system.basis.point_row(strobing.point, strobing.component)
    once = states[len(states) - 1 - _PHASES * (strobing.keep - 1) :: _PHASES]
    return Row(case=case.key, values={"periods": _periods(states, once, system)}, reason="",
               points=(once[:, :m] @ row).tolist())


def _periods(states: Array, once: Array, system: ContactSystem) -> float:
    """Number of periods after which the states repeat; 0 if they do not, NaN for too few states.

    By displacements and velocities of B and the contact nodes, as
    :func:`fecontact.analysis.periodicity`.
    """
    basis, m = system.basis, system.basis.modes
    seen_at = [0, *range(2, 2 + basis.contact_nodes)]
    rows = basis.T[seen_at, : basis.dimension].reshape(-1, m).T
    seen = np.hstack([states[:, :m] @ rows, states[:, m : 2 * m] @ rows])
    size = np.ptp(seen, axis=0)
    moves = np.concatenate([part > 1e-9 * part.max(initial=0.0) for part in np.split(size, 2)])
    if not moves.any():
        return 1.0
    largest = min(16, len(once) // 3)
    if len(once) < 11:
        return float("nan")
    points = np.hstack([once[:, :m] @ rows, once[:, m : 2 * m] @ rows])[:, moves]
    return float(count_periods(points, size[moves], largest=largest).periods or 0)
