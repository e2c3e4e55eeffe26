"""Experimental modal analysis: poles and shapes of measured frequency responses by sdypy-EMA."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.checks import as_count, as_floats, require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.extras import optional
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.core.units import Summarised, count
from fecontact.measured.measured_units import response_kind
from fecontact.measured.measurement import Measurement

# Distance from a given frequency within which its pole is sought; changes of frequency and damping
# ratio from one order to the next up to which a pole is stable; stable poles that a mode needs.
_NEAR, _FREQUENCY, _DAMPING, _FEWEST = 0.05, 2e-3, 0.1, 3
_EVEN = 1e-3  # largest deviation of a frequency from a multiple of the step, in steps


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ExperimentalModes(Summarised):
    """Modes of measured frequency responses.

    Attributes
    ----------
    poles : (a,) complex array
        Poles s with positive imaginary parts [1/s].
    residues : (C, a) complex array
        Residues R of the receptance ``sum R / (i w - s) + R* / (i w - s*)`` at C channels. As
        columns they are the mode shapes, up to factors.
    synthesised : (N, C) complex array
        Responses of these modes with residuals of modes beyond, in the unit of the measurement;
        NaN where they were not fitted, at 0 Hz and in the last line.
    scatter : (a,) array
        Standard deviation of each frequency among the orders at which its pole is stable [Hz].
    stable : (a,) integer array
        Number of these orders.
    """

    poles: ComplexArray
    residues: ComplexArray
    synthesised: ComplexArray
    scatter: Array
    stable: Array

    @property
    def frequencies_hz(self) -> Array:
        """Natural frequencies ``|s| / (2 pi)`` (a,) [Hz]."""
        return np.abs(self.poles) / (2.0 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios ``-Re s / |s|`` (a,)."""
        return np.asarray(-self.poles.real / np.abs(self.poles))

    @property
    def shapes(self) -> ComplexArray:
        """Mode shapes (C, a), one at the channel where each is largest."""
        largest = np.abs(self.residues).argmax(axis=0)
        return np.asarray(self.residues / self.residues[largest, np.arange(len(self.poles))])

    def rows(self) -> list[tuple[str, ...]]:
        """Rows of a table: number, frequency, scatter [Hz], damping [%], stable orders."""
        return [(f"{k + 1}", f"{f:.5g}", f"{off:.2g}", f"{100.0 * ratio:.3g}", f"{orders}")
                for k, (f, off, ratio, orders) in enumerate(zip(
                    self.frequencies_hz, self.scatter, self.damping_ratios, self.stable,
                    strict=True))]

    def summary(self) -> list[tuple[str, str]]:
        """Frequency and damping of each mode."""
        return [("modes", count(len(self.poles), "mode")),
                *((f"mode {row[0]}", f"{row[1]} Hz, damping {row[3]} %") for row in self.rows())]


def experimental_modes(
    measured: Measurement, frequencies_hz: ArrayLike, *, order: int = 30,
) -> ExperimentalModes:
    """Find modes of measured frequency responses by the LSCF and LSFD methods of sdypy-EMA.

    Parameters
    ----------
    measured : Measurement
        Receptances, mobilities or accelerances of C places to one excitation, by their units, over
        evenly spaced frequencies that are multiples of their step. The band is that of all
        frequencies; :meth:`Measurement.between` takes a part.
    frequencies_hz : (a,) array
        About where the modes are [Hz], to 5 %, such as the peaks of the responses.
    order : int
        Highest order of the polynomials; poles that change little from one order to the next are
        stable, and the one in their middle is taken.

    Raises
    ------
    InputError, AnalysisError, MissingLibraryError
        For responses that cannot be used, frequencies without a stable pole, and without sdypy-EMA
        (``pip install 'fecontact[modal]'``).

    Notes
    -----
    Verboven (2002), Frequency-domain system identification for modal analysis, Vrije Universiteit
    Brussel.
    """
    require_kind("experimental_modes", Measurement, measured=measured)
    about = np.atleast_1d(as_floats(frequencies_hz, "experimental_modes: frequencies_hz"))
    as_count(order, "experimental_modes: order", 4)
    step, first = _lines(measured)
    low, high = measured.abscissa[[0, -1]]
    if about.ndim != 1 or not len(about) or not ((about > low) & (about < high)).all():
        raise InputError(f"experimental_modes: frequencies_hz must lie between {low:g} and "
                         f"{high:g} Hz, where the responses are.")
    library = optional("sdypy.EMA", "Experimental modal analysis")
    # From 0 Hz on, as the method needs it; what was not measured has no weight.
    responses = np.concatenate([np.zeros((first, len(measured.channels))), measured.values]).T
    lowest = max(first, 1)
    model = library.Model(responses, step * np.arange(responses.shape[1]), lower=lowest * step,
                          upper=high, pol_order_high=order, frf_form=_kind(measured))
    try:
        model.get_poles(show_progress=False)
    except np.linalg.LinAlgError:
        raise AnalysisError(f"experimental_modes: order = {order} is too high for "
                            f"{len(measured)} frequencies; take a lower one.") from None
    chosen = [_stable(model.all_poles, float(one)) for one in about]
    model.pole_ind = np.array([where for where, _, _ in chosen])
    if len({tuple(where) for where, _, _ in chosen}) < len(about):
        raise AnalysisError("experimental_modes: two of frequencies_hz lead to the same pole; "
                            "give each mode once.")
    # The limits of the library are a line above those that it takes.
    synthesised, residues = model.get_constants(f_upper=float(model.freq[-1]))
    fitted = np.full(measured.values.shape, np.nan, dtype=complex)
    fitted[lowest - first:-1] = synthesised[:, lowest:].T
    places, scatter, orders = zip(*chosen, strict=True)
    return ExperimentalModes(np.array([model.all_poles[n][k] for n, k in places]), residues, fitted,
                             np.array(scatter), np.array(orders))


def _lines(measured: Measurement) -> tuple[float, int]:
    """Step of the frequencies, and the number of steps before the first."""
    f = measured.abscissa
    if measured.axis != "frequency" or len(f) < 8:
        raise InputError("experimental_modes: measured must be frequency responses at eight "
                         "frequencies or more.")
    if not np.isfinite(measured.values).all():
        raise InputError("experimental_modes: measured has values that are not finite; take a "
                         "part without them, by between(low, high).")
    step = float(f[-1] - f[0]) / (len(f) - 1)
    lines = f / step if step > 0.0 else f
    if not step > 0.0 or np.abs(lines - lines[0].round() - np.arange(len(f))).max() > _EVEN:
        raise InputError("experimental_modes: the frequencies must be multiples of one step, as "
                         "those of a Fourier transform are; interpolate the responses.")
    return step, int(lines[0].round())


def _kind(measured: Measurement) -> str:
    units = {one.unit for one in measured.channels}
    kinds = {response_kind(unit) for unit in units}
    if len(kinds) > 1:
        raise InputError(f"experimental_modes: the channels have the units "
                         f"{', '.join(sorted(units))}; give displacements, velocities or "
                         f"accelerations alone.")
    return str(kinds.pop())


def _stable(orders: Any, about: float) -> tuple[tuple[int, int], float, int]:
    """Order and place of the middle one of the stable poles near a frequency [Hz]."""
    found: list[tuple[float, int, int]] = []
    before = np.empty(0, dtype=complex)
    for n, poles in enumerate(orders):
        f = np.abs(poles) / (2.0 * np.pi)
        good = np.isfinite(poles) & (poles.imag > 0.0) & (poles.real < 0.0)
        near = np.flatnonzero(good & (np.abs(f - about) < _NEAR * about))
        for k in near.tolist():
            size, real = np.abs(before), np.abs(poles[k])
            same = (np.abs(size - real) < _FREQUENCY * real) & (
                np.abs(before.real - poles[k].real) < _DAMPING * -poles[k].real)
            if same.any():
                found.append((float(f[k]), n, k))
        before = poles[good]
    if len(found) < _FEWEST:
        raise AnalysisError(f"experimental_modes: there is no stable pole near {about:g} Hz; give "
                            f"another frequency, or a higher order.")
    # Those about the closest one, and of these the one of median frequency.
    closest = min(found, key=lambda one: abs(one[0] - about))[0]
    found = sorted(one for one in found if abs(one[0] - closest) < 2.0 * _FREQUENCY * closest)
    _, n, k = found[len(found) // 2]
    return (n, k), float(np.std([one[0] for one in found])), len(found)
