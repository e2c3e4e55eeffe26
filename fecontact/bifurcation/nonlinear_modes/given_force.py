"""The first harmonic of the forces that excite a system."""

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ComplexArray

_SAMPLES = 32


def given_force(field: ContactField, values: Array, state: Array, period: float) -> ComplexArray:
    """Harmonic P (m,) of the modal forces in time, ``f = Re(P exp(i w t))``, at a state (d,)."""
    m = field.system().basis.modes
    phases = np.arange(_SAMPLES) / _SAMPLES
    rates = field.rates(phases * period, np.tile(state, (_SAMPLES, 1)), values)[:, m : 2 * m]
    return np.asarray(2.0 / _SAMPLES * np.exp(-2.0j * np.pi * phases) @ rates)


def require_excitation(field: ContactField, values: Array) -> float:
    """Period [s] of the excitation.

    Raises
    ------
    InputError
        If nothing excites the system with a period.
    """
    period = field.forcing_period(values)
    if period is None or not np.isfinite(period):
        raise InputError("Nothing excites the system with a period; give it a harmonic drive or "
                         "load.")
    return period
