"""Steps of CVODE of SUNDIALS."""

import numpy as np

from fecontact.core.errors import MissingLibraryError
from fecontact.core.types import Array
from fecontact.integrate.reference.driver import Equations, Steps


class CvodeSteps(Steps):
    """Steps of CVODE's backward differentiation formulas.

    Raises
    ------
    MissingLibraryError
        If scikit-sundae is not installed.
    """

    def __init__(self, equations: Equations, begin: float, y: Array, end: float) -> None:
        try:
            from sksundae.cvode import CVODE  # type: ignore[import-untyped]
        except ImportError:
            raise MissingLibraryError("The solver CVODE needs scikit-sundae: pip install "
                                      "'fecontact[cvode]'.") from None

        # CVODE's arrays are read-only, which the compiled functions do not accept.
        def rate(t: float, y: Array, out: Array) -> None:
            out[:] = equations.rate(t, y.copy())

        def jacobian(t: float, y: Array, out: Array, into: Array) -> None:
            into[:] = equations.jacobian(t, y.copy())

        self.begin, self.t, self.y = begin, begin, y
        self._end = end
        self._solver = CVODE(rate, jacfn=jacobian, method="BDF", rtol=equations.rtol,
                             atol=equations.tolerance, max_step=equations.longest)
        self._solver.init_step(begin, y)

    def attempt(self) -> tuple[float, Array] | str:
        """See :meth:`Steps.attempt`; after outputs within a step CVODE returns to its end first."""
        try:
            found = self._solver.step(self._end, method="onestep", tstop=self._end)
        except (ValueError, RuntimeError, ArithmeticError, np.linalg.LinAlgError) as error:
            return str(error)
        if not found.success or not np.isfinite(found.y).all():
            return str(found.message)
        return float(found.t), np.array(found.y, dtype=float)

    def dense(self, t: float) -> Array:
        """See :meth:`Steps.dense`."""
        if t >= self.t:
            return self.y
        return np.array(self._solver.step(t, tstop=self._end).y, dtype=float)
