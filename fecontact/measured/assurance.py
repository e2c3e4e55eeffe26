"""Comparison of modes by their shapes, and of frequency responses."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.checks import as_floats, as_numbers
from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.core.units import Summarised, span

# Least assurance of a pair; ratio of sizes from which on units are asked about, and its tolerance.
_PAIR = 0.5
_THOUSAND, _ABOUT = 1000.0, 0.3


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ModePairs(Summarised):
    """Modes of a test and of a model, paired by the likeness of their shapes.

    Attributes
    ----------
    assurance : (a, b) array
        Modal assurance criterion of each mode of the test with each of the model, from 0 to 1.
    tested, computed : (k,) integer arrays
        Numbers of the paired modes from 0, in the order of those of the test.
    tested_frequencies, computed_frequencies : (a,) and (b,) arrays
        All frequencies of both [Hz].
    """

    assurance: Array
    tested: Integers
    computed: Integers
    tested_frequencies: Array
    computed_frequencies: Array

    def __len__(self) -> int:
        return len(self.tested)

    @property
    def errors(self) -> Array:
        """Relative errors (k,) of the computed frequencies of the pairs."""
        return np.asarray(self.computed_frequencies[self.computed]
                          / self.tested_frequencies[self.tested] - 1.0)

    def rows(self) -> list[tuple[str, ...]]:
        """Rows of a table: modes of test and model, frequencies, error, assurance."""
        return [(f"{t + 1}", f"{c + 1}", f"{self.tested_frequencies[t]:.5g}",
                 f"{self.computed_frequencies[c]:.5g}", f"{100.0 * error:+.2f} %",
                 f"{self.assurance[t, c]:.3f}")
                for t, c, error in zip(self.tested, self.computed, self.errors, strict=True)]

    def summary(self) -> list[tuple[str, str]]:
        """Numbers of pairs, their assurance and frequency errors."""
        return [("pairs", f"{len(self)} of {self.assurance.shape[0]} tested modes"),
                ("assurance", span(self.assurance[self.tested, self.computed])),
                ("frequency error", f"{span(100.0 * self.errors)} %" if len(self) else "none")]


def modal_assurance(first: ArrayLike, second: ArrayLike) -> Array:
    r"""Modal assurance criterion (a, b) of two sets of mode shapes.

    .. math:: \mathrm{MAC}_{ij} = \frac{|x_i^H y_j|^2}{(x_i^H x_i)(y_j^H y_j)}

    It is one for shapes that differ by a complex factor alone, and zero for orthogonal ones.

    Parameters
    ----------
    first, second : (N, a) and (N, b) arrays
        Real or complex shapes in columns, at the same N degrees of freedom in the same order.

    Raises
    ------
    InputError
        For shapes of different lengths, that are zero, or not finite.
    """
    x, y = _shapes(first, "first"), _shapes(second, "second")
    if len(x) != len(y):
        raise InputError(f"modal_assurance: the shapes have {len(x)} and {len(y)} degrees of "
                         f"freedom; give both at the same places and directions.")
    # Columns are scaled to one first, so that squares neither overflow nor underflow.
    return np.asarray(np.minimum(np.abs(x.conj().T @ y) ** 2, 1.0))


def _shapes(given: ArrayLike, name: str) -> Any:
    shapes = as_numbers(given, f"modal_assurance: {name}")
    shapes = shapes[:, None] if shapes.ndim == 1 else shapes
    if shapes.ndim != 2 or not shapes.size or not np.isfinite(shapes).all():
        raise InputError(f"modal_assurance: {name} must be finite shapes in the columns of a "
                         f"matrix.")
    size = np.abs(shapes).max(axis=0)
    if not (size > 0.0).all():
        raise InputError(f"modal_assurance: shape {int(np.argmin(size))} of {name} is zero; leave "
                         f"it out.")
    shapes = shapes / size
    return shapes / np.linalg.norm(shapes, axis=0)


def pair_modes(
    tested: ArrayLike, computed: ArrayLike, tested_frequencies: ArrayLike,
    computed_frequencies: ArrayLike, *, least: float = _PAIR,
) -> ModePairs:
    """Pair modes of a test with modes of a model by their shapes.

    The pairs have the largest possible sum of their assurance; no mode is in two of them.

    Parameters
    ----------
    tested, computed : (N, a) and (N, b) arrays
        Shapes in columns at the same degrees of freedom.
    tested_frequencies, computed_frequencies : (a,) and (b,) arrays
        Frequencies of both [Hz].
    least : float
        Smallest assurance of a pair.

    Raises
    ------
    InputError
        As in :func:`modal_assurance`, for numbers of frequencies that do not fit, or a bound out of
        range.
    """
    from scipy.optimize import linear_sum_assignment

    table = modal_assurance(tested, computed)
    hertz = [as_floats(values, f"pair_modes: {name}") for name, values in (
        ("tested_frequencies", tested_frequencies),
        ("computed_frequencies", computed_frequencies))]
    if tuple(values.shape for values in hertz) != ((table.shape[0],), (table.shape[1],)):
        raise InputError(f"pair_modes: there are {table.shape[0]} and {table.shape[1]} shapes, but "
                         f"frequencies of shapes {hertz[0].shape} and {hertz[1].shape}; give one "
                         f"for each.")
    bound = as_floats(least, "pair_modes: least")
    if bound.ndim or not 0.0 <= bound <= 1.0:
        raise InputError(f"pair_modes: least = {least!r} must be from 0 to 1.")
    rows, columns = linear_sum_assignment(-table)
    kept = table[rows, columns] >= bound
    return ModePairs(table, rows[kept], columns[kept], *hertz)


def response_assurance(measured: ArrayLike, computed: ArrayLike) -> Array:
    r"""Frequency response assurance criterion (C,) of responses at equal frequencies.

    .. math:: \mathrm{FRAC} = \frac{|\sum_k H_k^* \hat H_k|^2}
        {\sum_k |H_k|^2\, \sum_k |\hat H_k|^2}

    It is one for responses that differ by a complex factor alone; :func:`scale_question` asks about
    a factor.

    Parameters
    ----------
    measured, computed : (F,) or (F, C) complex arrays
        Responses at the same frequencies.

    Raises
    ------
    InputError
        For arrays of different shapes, that are zero, or not finite.
    """
    x, y = _responses(measured, computed)
    x, y = (values / np.linalg.norm(values, axis=0) for values in (x, y))
    return np.asarray(np.minimum(np.abs((x.conj() * y).sum(axis=0)) ** 2, 1.0))


def scale_question(measured: ArrayLike, computed: ArrayLike, names: Sequence[str] = ()) -> str:
    """Question about units if responses differ by a factor of about 1000; empty if not.

    Parameters
    ----------
    measured, computed : (F,) or (F, C) arrays
        Values at the same places.
    names : sequence of str, optional
        Names of the channels.

    Raises
    ------
    InputError
        As in :func:`response_assurance`.
    """
    x, y = _responses(measured, computed)
    ratio = np.linalg.norm(x, axis=0) / np.linalg.norm(y, axis=0)
    for k, value in enumerate(ratio):
        for factor in (_THOUSAND, 1.0 / _THOUSAND, _THOUSAND**2, _THOUSAND**-2):
            if abs(np.log10(value / factor)) < _ABOUT:
                name = f" of '{names[k]}'" if k < len(names) else ""
                return (f"The measured values{name} are {value:.3g} times those of the model: are "
                        f"they in a unit that is {factor:g} times the SI unit? Then give units.")
    return ""


def _responses(measured: ArrayLike, computed: ArrayLike) -> tuple[Any, Any]:
    both = [as_numbers(values, "response_assurance: responses") for values in (measured, computed)]
    both = [values[:, None] if values.ndim == 1 else values for values in both]
    if both[0].shape != both[1].shape or both[0].ndim != 2 or not both[0].size:
        raise InputError(f"response_assurance: the responses have the shapes {both[0].shape} and "
                         f"{both[1].shape}; give both at the same frequencies.")
    for name, values in zip(("measured", "computed"), both, strict=True):
        if not np.isfinite(values).all() or not (np.abs(values).max(axis=0) > 0.0).all():
            raise InputError(f"response_assurance: the {name} responses must be finite and not "
                             f"zero.")
    return both[0], both[1]
