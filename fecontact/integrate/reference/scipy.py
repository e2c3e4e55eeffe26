"""Steps of scipy's stiff solvers."""

from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.integrate.reference.driver import Equations, Steps


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

    def attempt(self) -> tuple[float, Array] | str:
        """See :meth:`Steps.attempt`."""
        solver = self._solver
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                message = solver.step()
        except (ValueError, ArithmeticError, np.linalg.LinAlgError):
            # scipy's linear algebra raises this for values that are not finite.
            return "The motion is no longer finite."
        if solver.status == "failed":
            return str(message)
        if not np.isfinite(solver.y).all():
            return "The motion is no longer finite."
        if solver.t > self.t:
            self._dense = solver.dense_output()
        return float(solver.t), solver.y

    def dense(self, t: float) -> Array:
        """See :meth:`Steps.dense`."""
        return np.asarray(self._dense(t))
