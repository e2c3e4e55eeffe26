"""Row of an observed quantity: a displacement of a point, or a sum of states."""

from collections.abc import Sequence

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField


def observed_row(
    field: VectorField, observe: tuple[str | int, str] | ArrayLike
) -> tuple[Array, str]:
    """Row (d,) of the observed quantity, and its name.

    Raises
    ------
    InputError
        For a point that does not exist, a row of wrong size, or internal variables.
    """
    if isinstance(field, ContactField):
        if not (isinstance(observe, Sequence) and len(observe) == 2
                and isinstance(observe[1], str)):
            raise InputError(f"observe = {observe!r} must be a point and a component, such as "
                             f"('B', 'x').")
        point, component = observe[0], observe[1]
        return field.displacement_row(point, component), f"{point} {component}"
    if isinstance(observe, tuple) and observe == ("B", "x"):
        return np.eye(field.dimension)[0], field.state_names[0]
    row = as_floats(observe, "observe")
    if row.shape != (field.dimension,):
        raise InputError(f"observe must hold {field.dimension} numbers, one for each state.")
    states = np.flatnonzero(row)
    return row, field.state_names[states[0]] if len(states) == 1 else "observed"
