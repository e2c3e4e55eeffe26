"""Steps of scipy's stiff solvers."""

from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.integrate.reference.driver import Equations, Steps

# So often a step is repeated that does not advance time, which LSODA does forever.
_STALLED = 100


class ScipySteps(Steps):
    """Steps of ``scipy.integrate``'s 'Radau', 'BDF' or 'LSODA'."""

    def __init__(
        self, method: str, equations: Equations, begin: float, y: Array, end: float,
    ) -> None:
        import scipy.integrate

        self.begin, self.t, self.y = begin, begin, y
        self._solver: Any = getattr(scipy.integrate, method)(
            equations.rate, begin, y, end, jac=equations.jacobian, rtol=equations.rtol,
            atol=equations.tolerance, max_step=equations.longest)

    def step(self) -> str | None:
        """See :meth:`Steps.step`."""
        solver = self._solver
        for _ in range(_STALLED):
            message = _step(solver)
            if message is not None:
                return message
            if solver.t != self.t:
                self.begin, self.t, self.y = self.t, float(solver.t), solver.y
                self._dense = solver.dense_output()
                return None
        return "Required step size is less than spacing between numbers."

    def dense(self, t: float) -> Array:
        """See :meth:`Steps.dense`."""
        return np.asarray(self._dense(t))


def _step(solver: Any) -> str | None:
    """Take one step; return a message if it failed."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            message = solver.step()
    except (ValueError, ArithmeticError, np.linalg.LinAlgError):
        # scipy's linear algebra raises this for values that are not finite.
        return "The motion is no longer finite."
    if solver.status == "failed":
        return str(message)
    return None if np.isfinite(solver.y).all() else "The motion is no longer finite."
