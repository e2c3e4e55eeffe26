"""Vector fields that Python evaluates, called from compiled code."""

from ctypes import CFUNCTYPE, c_double, c_int64, c_void_p, cast

import numpy as np

from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

_CALLED = CFUNCTYPE(None, c_double, c_int64, c_int64, c_int64)


class PythonFunction:
    """The rates and Jacobian of a field at its base values as a function in C.

    Attributes
    ----------
    address : int
        Of the function, see :data:`fecontact.system.fields.one_place.PYTHON`; valid as long as
        this object lives.
    error : BaseException or None
        Exception that the field raised; rates are NaN from then on, which ends the run.
    """

    def __init__(self, field: VectorField) -> None:
        self.error: BaseException | None = None
        self._field, self._values = field, field.values
        self._function = _CALLED(self._call)
        self.address = int(cast(self._function, c_void_p).value or 0)

    def _call(self, t: float, x: int, f: int, J: int) -> None:
        d = self._field.dimension
        rates = _array(f, d)
        rates[:] = np.nan
        if self.error is not None:
            return
        try:
            time, state = np.array([t]), _array(x, d).copy()[np.newaxis]
            if J:
                found, jacobian, _ = self._field.derivatives(time, state, self._values)
                _array(J, d * d)[:] = jacobian[0].ravel()
            else:
                found = self._field.rates(time, state, self._values)
            rates[:] = found[0]
        except BaseException as error:  # nothing may leave a function that C calls
            self.error = error


def _array(address: int, length: int) -> Array:
    """The numbers at an address."""
    return np.ctypeslib.as_array((c_double * length).from_address(address))
