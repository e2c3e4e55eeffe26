"""Vector fields for compiled integrators: rates and Jacobian at one place, by addresses.

A field comes as a tuple :class:`FieldKernel`, whose two addresses lead to a function that is
compiled or to one of Python.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fecontact.core.addresses import function_at
from fecontact.core.compiled import compile_law
from fecontact.core.records import IntegerVector, Matrix, Vector
from fecontact.core.types import Array
from fecontact.system.fields.function_kernels import (
    COMPLEX,
    EXTRAPOLATED,
    Place,
    Steps,
    Workspace,
    jacobian_at,
    move_to,
    rates_at,
    set_column,
    workspace_for,
)


class FieldKernel(NamedTuple):
    """A vector field of d states with fixed parameters, as kernels take it.

    Attributes
    ----------
    evaluate, derive : int
        Addresses of what gives the rates, and rates with their Jacobian.
    function, jacobian, analytic : int
        Addresses of the field's own functions: rates, Jacobian, rates of complex numbers; zero
        for those that it does not have.
    p, scales : (k,), (d,) arrays
        Parameters, and typical sizes of the states.
    workspace : Workspace
        Workspace for derivatives.
    wrong : (d,) array
        Columns of Jacobians that the complex step got wrong, counted.
    """

    evaluate: int
    derive: int
    function: int
    jacobian: int
    analytic: int
    p: Vector
    scales: Vector
    workspace: Workspace
    wrong: IntegerVector


EVALUATE = Callable[[float, Vector, FieldKernel, Vector], None]
DERIVE = Callable[[float, Vector, FieldKernel, Vector, Matrix], None]
# Functions of Python: t, and the addresses of x (d,), f (d,) and J (d, d), which may be zero.
PYTHON = Callable[[float, int, int, int], None]

evaluate_at, derive_at = function_at(EVALUATE), function_at(DERIVE)
_python_at = function_at(PYTHON)


def _by_function(t, x, field, f):
    rates_at(field.function)(t, x, field.p, f)


def _by_python(t, x, field, f):
    _python_at(field.function)(t, np.int64(x.ctypes.data), np.int64(f.ctypes.data), 0)


def _with_jacobian(t, x, field, f, J):
    rates_at(field.function)(t, x, field.p, f)
    jacobian_at(field.jacobian)(t, x, field.p, J)


def _by_steps(t, x, field, f, J):
    steps = Steps(COMPLEX if field.analytic != 0 else EXTRAPOLATED, 0.0, field.function,
                  field.analytic)
    workspace = field.workspace
    rates_at(field.function)(t, x, field.p, f)
    move_to(x, field.p, workspace)
    place = Place(t, workspace.y, workspace.q, f)
    for j in range(len(x)):
        if set_column(steps, place, workspace.y, workspace.z, j, field.scales[j], workspace,
                      J[:, j]):
            field.wrong[j] += 1


def _with_python(t, x, field, f, J):
    _python_at(field.function)(t, np.int64(x.ctypes.data), np.int64(f.ctypes.data),
                               np.int64(J.ctypes.data))


_FORM = "evaluate(t, x, field, f)"
_by_function_law = compile_law(EVALUATE, _FORM, _by_function)
_by_python_law = compile_law(EVALUATE, _FORM, _by_python)
_derivatives = {way: compile_law(DERIVE, "derive(t, x, field, f, J)", function)
                for way, function in (("jacobian", _with_jacobian), ("steps", _by_steps),
                                      ("python", _with_python))}


def compiled_field(
    rates: int, jacobian: int, analytic: int, values: Array, scales: Array
) -> FieldKernel:
    """A field of compiled functions, by their addresses; zero for a function that there is not."""
    way = _derivatives["jacobian" if jacobian else "steps"]
    return _field(_by_function_law.address, way.address,
                  (rates, jacobian, analytic), values, scales)


def python_field(function: int, values: Array, scales: Array) -> FieldKernel:
    """A field that Python evaluates, by the address of a function of the form :data:`PYTHON`."""
    return _field(_by_python_law.address, _derivatives["python"].address, (function, 0, 0), values,
                  scales)


def _field(
    evaluate: int, derive: int, functions: tuple[int, int, int], values: Array, scales: Array
) -> FieldKernel:
    d, k = len(scales), len(values)
    return FieldKernel(evaluate, derive, *functions, np.array(values, dtype=float),
                       np.array(scales, dtype=float), workspace_for(d, k),
                       np.zeros(d, dtype=np.int64))
