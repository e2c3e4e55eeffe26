"""A run of a vector field by the compiled integrator."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fecontact.core.checks import require_state
from fecontact.core.records import allocate
from fecontact.core.types import Array
from fecontact.integrate.event_arrays import watch_for
from fecontact.integrate.events import AnyEvent
from fecontact.integrate.field_runs.method import Data, Output, Progress, Workspace, advance
from fecontact.integrate.field_runs.python_functions import PythonFunction
from fecontact.integrate.field_runs.variational import STATES, Varied
from fecontact.integrate.rodas5p.event_kernels import Watch
from fecontact.integrate.step_loop import (
    RUNNING,
    STEP,
    TIME,
)
from fecontact.integrate.step_runs import StepRun
from fecontact.system.fields.one_place import FieldKernel, python_field
from fecontact.system.fields.vector_field import VectorField

# Errors of a state count relative to its largest size so far, or to this part of its scale.
_FLOOR = 1e-3


@dataclass(frozen=True, eq=False)
class FieldSteps(StepRun):
    """A run of a vector field that can be left and taken up again.

    Attributes
    ----------
    moving : VectorField
        At its base values.
    kernel : FieldKernel
        Kernels of the field for the integrator, with a workspace of their own.
    function : PythonFunction or None
        Where Python evaluates it.
    progress, workspace, output, varied, watch
        State, workspace and results of the integrator; it keeps nothing between outputs.
    """

    moving: VectorField
    kernel: FieldKernel
    function: PythonFunction | None
    progress: Progress
    workspace: Workspace
    output: Output
    varied: Varied
    watch: Watch
    found: list[tuple[Array, Array]] = field(default_factory=list)
    kept: tuple[()] = ()

    @property
    def transitions(self) -> Array:
        """Derivatives (N, d, d) of the states to those at the output time before."""
        return self.varied.transitions

    def step(self, most: int) -> int:
        """Try so many steps by the loop; how it ended.

        Raises
        ------
        Exception
            The exception that a field of Python raised.
        AnalysisError
            If a complex step that was asked for turned out wrong.
        """
        status = int(advance(Data(self.kernel, self.progress, self.workspace, self.output,
                                  self.varied, self.watch), most))
        if self.function is not None and self.function.error is not None:
            raise self.function.error
        if status != RUNNING:
            self.moving.heed(self.kernel.wrong)
        return status


def start_field(
    field: VectorField,
    state: Array,
    times: Array,
    *,
    rtol: float,
    max_step: float | None = None,
    vary: bool = False,
    events: Sequence[AnyEvent] = (),
) -> FieldSteps:
    """A run of a field at its base values from ``times[0]``, before its first step.

    Parameters
    ----------
    field : VectorField
        Field to integrate.
    state : (d,) array
        At the start.
    times : (N,) array
        Output times, ascending [s].
    rtol : float
        Error of one step, of each state relative to its largest size so far, or to a thousandth of
        its scale where that is more.
    max_step : float, optional
        Longest step [s]; at most a quarter of the period of a field that depends on time. What
        acts briefly in a field without a period needs one.
    vary : bool
        Whether to carry derivatives to the state at the output time before along.
    events : sequence of Crossing and Event
        Events to watch for.

    Raises
    ------
    InputError
        For a state that is not finite, and events that are none.
    """
    require_state(state)
    d, times, values = field.dimension, np.array(times, dtype=float), field.values
    kernel, function = field.kernel(), None
    if kernel is None:
        function = PythonFunction(field)
        kernel = python_field(function.address, values, field.state_scales(values))
    period, whole = field.forcing_period(values), float(times[-1] - times[0])
    longest = whole
    if period is not None:
        longest = min(longest, 0.25 * period)
    if max_step is not None:
        longest = min(longest, float(max_step))
    sizes = {STATES: d}
    progress = allocate(Progress, sizes, state=np.array(state, dtype=float))
    progress.sizes[:] = _FLOOR * np.asarray(field.state_scales(values), dtype=float)
    progress.numbers[TIME], progress.numbers[STEP] = times[0], min(0.01 * whole, longest)
    columns = d if vary else 0
    varied = allocate(Varied, {STATES: columns}, columns=np.eye(columns),
                      transitions=np.zeros((len(times) if vary else 0, columns, columns)))
    return FieldSteps(
        field, kernel, function, progress, allocate(Workspace, sizes),
        Output(times, np.zeros((len(times), d)), float(rtol), longest),
        varied, watch_for(field, events, False))
