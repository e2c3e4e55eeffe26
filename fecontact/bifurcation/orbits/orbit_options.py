"""Options of branches of orbits: what is left out, and what it then means."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.bifurcation.continuation.problem import Settings
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, require_positive

Array = NDArray[np.float64]


def settings_of(settings: Settings | None, bounds: tuple[float, float] | None) -> Settings:
    """The settings, with other bounds if these are given."""
    require_kind("A branch", (Settings, type(None)), settings=settings)
    chosen = settings or Settings()
    return chosen if bounds is None else replace(chosen, bounds=bounds)


def sizes_of(given: ArrayLike | None, found: Array) -> tuple[Array, Array | None]:
    """Scales (d,) of the states, and up to where they grow with the orbit."""
    if given is None:
        return found, 100.0 * found
    sizes = as_floats(given, "scales")
    if sizes.shape != found.shape or not (sizes > 0.0).all():
        raise InputError(f"scales = {given!r} must hold {len(found)} numbers above zero, one for "
                         f"each state.")
    return sizes, None


def width_of(given: float | None, settings: Settings, value: float) -> float:
    """Width of the diagram in the parameter, by default that of the bounds."""
    if given is not None:
        require_positive("A branch", width=given)
        return given
    span = settings.bounds[1] - settings.bounds[0]
    return float(span) if np.isfinite(span) else abs(float(value)) or 1.0
