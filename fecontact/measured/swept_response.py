"""Frequency and damping over amplitude from a response swept through one resonance."""

import numpy as np

from fecontact.core.checks import as_floats, as_numbers
from fecontact.core.errors import AnalysisError, InputError, require_positive
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.measured.amplitude_curve import AmplitudeCurve

# Degree of the polynomial in the amplitude of the squared frequency, and fewest points.
_DEGREE, _FEWEST = 4, 8


def swept_curve(
    frequency_hz: ArrayLike, response: ArrayLike, force: ArrayLike, *,
    modal_mass: float | None = None, unit: str = "m", observed: str = "",
) -> AmplitudeCurve:
    r"""Frequency and damping over amplitude from a response swept through one resonance.

    With the first harmonics X of the displacement and P of the force, at one place and along one
    direction, the dynamic stiffness of a mode whose frequency and damping hang on its amplitude is

    .. math:: P / X = m\,(\omega_0^2 - \omega^2 + 2 i \zeta \omega_0 \omega)

    Every point of the sweep gives a frequency and a damping ratio at its own amplitude. The modal
    mass m follows from amplitudes that are met below and above resonance, with a squared frequency
    that is a polynomial of degree four in the amplitude.

    Parameters
    ----------
    frequency_hz : (N,) array
        Frequencies of the sweep [Hz], about one resonance alone.
    response : (N,) complex array
        First harmonics X of the displacement, ``x = Re(X exp(i w t))``.
    force : complex or (N,) complex array
        First harmonics P of the force [N].
    modal_mass : float, optional
        Modal mass m [kg], if it is known; see :func:`~fecontact.measured.modal_mass_at`.
    unit, observed : str
        Unit of the displacement, and its title.

    Returns
    -------
    AmplitudeCurve
        Points in the order of the sweep.

    Raises
    ------
    InputError
        For arrays of unequal lengths, fewer than eight points, or values that are not finite.
    AnalysisError
        If the sweep does not determine the modal mass, as that of one side of a resonance.
    """
    f = as_floats(frequency_hz, "swept_curve: frequency_hz")
    X, P = (np.asarray(as_numbers(values, f"swept_curve: {name}"), dtype=complex)
            for name, values in (("response", response), ("force", force)))
    if f.ndim != 1 or X.shape != f.shape or P.shape not in ((), f.shape) or len(f) < _FEWEST:
        raise InputError(f"swept_curve: frequency_hz, response and force have the shapes "
                         f"{f.shape}, {X.shape} and {P.shape}; give at least {_FEWEST} values of "
                         f"each, or one force.")
    if not ((f > 0.0).all() and np.isfinite(f).all() and np.isfinite(X).all()
            and np.isfinite(P).all() and (np.abs(X) > 0.0).all()
            and (np.abs(P) > 0.0).all()):
        raise InputError("swept_curve: frequencies must be above zero, and all values finite and "
                         "responses and forces not zero.")
    w, Z, A = 2.0 * np.pi * f, P / X, np.abs(X)
    if modal_mass is None:
        m = _modal_mass(w, Z, A)
    else:
        require_positive("swept_curve", modal_mass=modal_mass)
        m = float(modal_mass)
    square = Z.real / m + w**2
    if not (square > 0.0).all():
        raise AnalysisError(f"swept_curve: the sweep is not that of one mode of {m:.4g} kg; leave "
                            f"out frequencies far from the resonance.")
    own = np.sqrt(square)
    return AmplitudeCurve(A, own / (2.0 * np.pi), Z.imag / (2.0 * m * own * w), unit=unit,
                          observed=observed)


def _modal_mass(w: Array, Z: ComplexArray, A: Array) -> float:
    """Modal mass m of Re Z = m (w_0^2(A) - w^2), by linear least squares."""
    powers = (A / A.max())[:, None] ** np.arange(_DEGREE + 1)
    scale = float(np.mean(w) ** 2)
    columns = np.column_stack([powers, -(w**2) / scale])
    # The error of Z is that of X times |Z| / |X|.
    weight = A**2 / np.abs(A * Z).max()
    found, _, rank, _ = np.linalg.lstsq(columns * weight[:, None], Z.real * weight, rcond=1e-9)
    m = float(found[-1]) / scale
    if rank < columns.shape[1] - _DEGREE + 1 or not m > 0.0:
        raise AnalysisError("swept_curve: the sweep does not determine the modal mass; sweep "
                            "through the resonance, or give modal_mass.")
    return m
