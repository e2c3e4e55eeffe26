"""A run of the compiled integrator: what it goes on from, and what it has found."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.integrate.collocation.workspace import JACOBIANS, Collocation
from fecontact.integrate.rodas5p.event_kernels import Watch
from fecontact.integrate.rodas5p.method import Data, advance_for
from fecontact.integrate.rodas5p.state import Output, Problem, Progress, Workspace
from fecontact.integrate.rodas5p.variational import Vary
from fecontact.integrate.series.branches import Series
from fecontact.integrate.step_runs import StepRun


@dataclass(frozen=True, eq=False)
class Run(StepRun):
    """A run of the compiled integrator that can be left and taken up again.

    Attributes
    ----------
    problem : Problem
        Equations to integrate, and limits of the steps.
    output : Output
        Output times and what belongs to them; rows from ``outputs`` on are not filled yet. Work
        of the powers :data:`fecontact.system.columns.POWERS`, then friction work of each node and
        its part in stick [J].
    kept : Output
        Output at times between the outputs; without rows if none are kept.
    variation : Vary
        Derivatives that go with the run.
    progress : Progress
        Complete state of the run.
    watch : Watch
        Events to watch for; those found are in ``events``.
    series : Series or None
        Tables of a system whose motion is expanded in power series; else None.
    collocation : Collocation or None
        State and workspace of steps by collocation; None for steps of Rodas5P.
    """

    problem: Problem
    progress: Progress
    workspace: Workspace
    output: Output
    kept: Output
    variation: Vary
    watch: Watch
    series: Series | None = None
    collocation: Collocation | None = None
    found: list[tuple[Array, Array]] = field(default_factory=list)

    @property
    def method(self) -> str:
        """Name of its method."""
        if self.series is not None:
            return "power-series"
        return "rodas5p" if self.collocation is None else "radau"

    @property
    def work(self) -> Array:
        """Work (N, p + 2 n) up to the output times [J]."""
        return self.output.work

    @property
    def statistics(self) -> dict[str, int]:
        """Counts of steps, rejected steps, right-hand sides and Jacobians, or of expansions."""
        found = super().statistics
        if self.series is not None:
            return {"steps": found["steps"], "rejected": found["rejected"],
                    "expansions": found["right_hand_sides"]}
        if self.collocation is not None:
            return found | {"jacobians": int(self.collocation.flags[JACOBIANS])}
        return found

    @property
    def transitions(self) -> Array:
        """Derivatives (N, size, columns) of the states to those at the output time before."""
        return np.swapaxes(self.variation.transitions, 1, 2)

    def step(self, most: int) -> int:
        """Try so many steps by the loop; how it ended."""
        return self._loop(most)

    @cached_property
    def _loop(self) -> Callable[[int], int]:
        """The loop of the method, with its data."""
        data: Any
        if self.series is not None:
            # Compiled for runs that need it only.
            from fecontact.integrate.series import method as by_series

            data = by_series.Data(self.problem, self.progress, self.output, self.kept,
                                  self.watch, self.series)
            loop = by_series.advance_for(self.problem)
        elif self.collocation is not None:
            from fecontact.integrate.collocation import method as by_collocation

            data = by_collocation.Data(self.problem, self.progress, self.workspace, self.output,
                                       self.kept, self.collocation, self.variation)
            nodes, _, modes = self.problem.system.rows.shape
            loop = by_collocation.SMALL.of(modes, nodes)
        else:
            data = Data(self.problem, self.progress, self.workspace, self.output, self.kept,
                        self.variation, self.watch)
            loop = advance_for(self.problem, self.variation)
        return partial(loop, data)
