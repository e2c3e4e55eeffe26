"""Dependence of the forcing's period on a parameter."""

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField, made_values
from fecontact.core.errors import FecontactError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Further values of a parameter, as factors, at which the period is asked for.
_BESIDE = (0.97, 1.043)
# Relative difference of numbers that count as the same.
_SAME = 1e-13
# Values at which the period is asked for are apart by this part at least: of values that are the
# same within rounding both the periods and the products are.
_APART = 0.01


def timing_of(
    field: VectorField, values: Array, free: int
) -> tuple[float | None, float | None]:
    """Period of the forcing times a parameter, and the period; None for what is not constant.

    In the first case the parameter is a frequency. In both the period need not be asked for at
    other values, which takes long with contact systems. Known where the parameter is the drive's
    frequency and nothing else repeats; else compared at values beside the given one, or at those
    for which there are systems already.
    """
    if isinstance(field, ContactField) and field.constant_period:
        return None, field.forcing_period(values)
    here = float(values[free])
    try:
        if (isinstance(field, ContactField) and here > 0.0
                and field.repeats_with_drive(values, free)):
            return 1.0, None
    except FecontactError:
        return None, None
    made = made_values(field, values, free) if isinstance(field, ContactField) else []
    places = [value for value in made if value * here > 0.0][: 1 + len(_BESIDE)]
    if len(places) <= len(_BESIDE) or np.ptp(places) < _APART * abs(here):
        places = [here, *(here * factor for factor in _BESIDE)]
    periods, products = [], []
    for value in places:
        beside = values.copy()
        beside[free] = value
        try:
            period = field.forcing_period(beside)
        except FecontactError:
            return None, None
        if period is None or value == 0.0:
            return None, None
        periods.append(period)
        products.append(period * value)
    return _constant(products), _constant(periods)


def _constant(found: list[float]) -> float | None:
    return found[0] if np.ptp(found) <= _SAME * abs(found[0]) else None
