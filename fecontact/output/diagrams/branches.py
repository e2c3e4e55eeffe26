"""Diagrams of branches: equilibria and orbits, frequency responses, nonlinear modes, resonances."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.harmonic.response import FrequencyResponse, amplitude_label
from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode
from fecontact.bifurcation.nonlinear_modes.resonance_curve import ResonanceCurve
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array
from fecontact.core.units import has_prefixes, suitable_unit
from fecontact.output.diagrams.colours import distinct_colours
from fecontact.output.diagrams.diagram import Curve, Diagram, Level, Mark
from fecontact.output.diagrams.labels import branch_label, level_label, name_and_unit
from fecontact.output.diagrams.special_points import SPECIAL
from fecontact.output.diagrams.spectra import beyond_band
from fecontact.system.complex_modes import followed

Quantity = str | int | Callable[[BranchPoint], float]

_STABLE = 1.8  # width of stable parts [points]


def branch_diagram(
    branches: Sequence[Branch], names: Sequence[str], y: Quantity, x: Quantity = "parameter", *,
    colours: Sequence[str] = (), x_label: str | None = None, y_label: str | None = None,
) -> Diagram:
    """Diagram of quantities of branches, with letters at special points.

    ``names`` has a name of each branch; branches of one name have one of the ``colours``. Points of
    one kind are numbered; one that two branches share is marked once. For quantities and labels see
    :func:`fecontact.plot.plot_branches`; raises InputError for a quantity that is not stored.
    """
    distinct = list(dict.fromkeys(names))
    shades = dict(zip(distinct, colours or distinct_colours(len(distinct)), strict=False))
    curves: list[Curve] = []
    known: dict[str, list[tuple[float, float]]] = {}
    for name, branch in zip(names, branches, strict=True):
        abscissae, rows = values_along(branch, x), values_along(branch, y, rows=True)
        heights = rows.reshape(len(branch), -1)
        curves += [branch_curve(branch, abscissae, column, name, shades[name])
                   for column in heights.T]
        for index, point in enumerate(branch.points):
            if point.kind is not None:
                known.setdefault(point.kind, []).append((abscissae[index], heights[index, 0]))
    return Diagram(_label(x, branches[0]) if x_label is None else x_label,
                   _label(y, branches[0]) if y_label is None else y_label,
                   tuple(curves), tuple(_numbered(known)))


def branch_curve(branch: Branch, x: Array, y: Array, name: str, colour: str) -> Curve:
    """Curve of values along a branch, whose unstable parts are dashed."""
    return Curve(name, colour, np.asarray(x, dtype=float), np.asarray(y, dtype=float), _STABLE,
                 stable=stable_pieces(branch))


def stable_pieces(branch: Branch) -> NDArray[np.bool_]:
    """Whether each piece (N - 1,) between neighbours is stable, judged by its regular points."""
    stable = [None if point.kind is not None else bool(point.values.get("stable", True))
              for point in branch.points]
    pieces: list[bool] = []
    for before, after in pairwise(stable):
        known = [value for value in (before, after) if value is not None]
        pieces.append(all(known) if known else (pieces[-1] if pieces else True))
    return np.array(pieces or [True], dtype=bool)


def _numbered(known: dict[str, list[tuple[float, float]]]) -> list[Mark]:
    found: list[Mark] = []
    for kind, places in known.items():
        distinct: list[tuple[float, float]] = []
        for place in places:
            if not any(np.allclose(place, other, rtol=1e-6) for other in distinct):
                distinct.append(place)
        letters = SPECIAL.get(kind, ("", ""))[0]
        found += [Mark(kind, x, y, f"{letters or kind}"
                       f"{number + 1 if letters and len(distinct) > 1 else ''}")
                  for number, (x, y) in enumerate(distinct)]
    return found


def values_along(branch: Branch, quantity: Quantity, rows: bool = False) -> Array:
    """Values (N,) of a quantity along a branch, or (N, s) of a row of them where allowed."""
    if callable(quantity):
        return np.array([quantity(point) for point in branch.points], dtype=float)
    if not isinstance(quantity, str):
        return np.array([_of_state(point, int(quantity)) for point in branch.points])
    if quantity == "parameter":
        return branch.parameter
    found = branch.column(quantity)
    if rows and quantity == "observed_section" and found.ndim == 2:
        return found
    if found.ndim != 1 or found.dtype.kind not in "fiub":
        plain = [name for name, value in branch.points[0].values.items()
                 if np.ndim(value) == 0 and not isinstance(value, complex)]
        raise InputError(f"{quantity!r} is not one number at each point; choose from "
                         f"{choices(plain)}, the number of a state, or give a function.")
    return found.astype(float)


def value_at(point: BranchPoint, quantity: Quantity) -> float:
    """A quantity of one point; of a row of them the first."""
    if callable(quantity):
        return float(quantity(point))
    if quantity == "parameter":
        return point.parameter
    if not isinstance(quantity, str):
        return _of_state(point, int(quantity))
    if quantity not in point.values:
        raise InputError(f"{point.place}, of an inset, stores no value {quantity!r}; make the "
                         f"inset from a point of a branch that is drawn.")
    return float(np.ravel(point.values[quantity])[0])


def _of_state(point: BranchPoint, number: int) -> float:
    """A state of an equilibrium, or its largest value over an orbit."""
    states = point.values.get("state", point.values.get("maximum"))
    if states is None or not -len(states) <= number < len(states):
        many = "no states" if states is None else f"{len(states)} states, from 0"
        raise InputError(f"There is no state {number}: the branch stores {many}.")
    return float(states[number])


def _label(quantity: Quantity, branch: Branch) -> str:
    if callable(quantity):
        return ""
    return branch_label(branch, quantity if isinstance(quantity, str) else int(quantity))


def eigenvalue_diagrams(
    branch: Branch, range_hz: tuple[float, float], x_label: str | None = None
) -> tuple[Diagram, Diagram]:
    """Frequencies [Hz] and growth rates [1/s] of the modes along a branch of equilibria.

    Modes that are never within ``range_hz`` are left out, and Hopf points outside of it; lines
    stand at the others.
    """
    modes = []
    for mode in followed(branch.column("eigenvalues")).T:
        hertz = mode.imag / (2.0 * np.pi)
        inside = (hertz >= range_hz[0]) & (hertz <= range_hz[1])
        if (hertz >= 0.0).all() and hertz.any() and inside.any():
            modes.append(mode)
    x, colours = branch.parameter, distinct_colours(len(modes))
    hopf = tuple(Level(point.parameter, "x", dashed=True) for point in branch.of_kind("Hopf")
                 if range_hz[0] <= point.frequency_hz <= range_hz[1])
    ends = (float(x.min()), float(x.max())) if x.min() < x.max() else (None, None)
    frequency, growth = (
        tuple(Curve("", colour, x, part(mode)) for mode, colour in zip(modes, colours, strict=True))
        for part in (lambda mode: mode.imag / (2.0 * np.pi), lambda mode: mode.real))
    label = x_label or branch_label(branch)
    return (Diagram(label, "frequency [Hz]", frequency, levels=hopf, x_limits=ends),
            Diagram(label, "growth rate [1/s]", growth, levels=(Level(0.0), *hopf), x_limits=ends))


def response_diagrams(
    response: FrequencyResponse, *, logarithmic: bool = False, y_label: str | None = None,
    usable_hz: float = np.inf,
) -> tuple[Diagram, Diagram]:
    """Amplitude, or the force that holds it, and phase [degrees] of a response over its parameter.

    Over frequency what lies beyond ``usable_hz`` is shaded.
    """
    branches = response.branches
    heading, names = level_texts(response)
    label = branch_label(branches[0])
    x = [branch.parameter for branch in branches]
    sizes = [drawn(response, level) for level in range(len(branches))]
    phases = [np.degrees(response.phase(level)) for level in range(len(branches))]
    bands = beyond_band(np.concatenate(x), usable_hz) if label.endswith("[Hz]") else ()
    upper, lower = _curves(branches, x, (sizes, phases), names)
    return (Diagram(label, y_label or drawn_label(response), upper, _marks(branches, x, sizes),
                    bands, heading=heading, logarithmic="y" * logarithmic,
                    y_limits=(None if logarithmic else 0.0, None)),
            Diagram(label, "phase [°]", lower, bands=bands, heading=heading))


def level_texts(response: FrequencyResponse) -> tuple[str, list[str]]:
    """Name of the parameter of the levels, and their values in a unit that suits them, all
    different; empty texts for a response without levels.
    """
    if not response.level_name:
        return "", [""] * len(response.branches)
    levels = response.levels
    words, unit = name_and_unit(level_label(response.branches[0]))
    factor, symbol = 1.0, unit
    if has_prefixes(unit):
        factor, symbol = suitable_unit(float(np.median(np.abs(levels))), unit)
    texts = [f"{level / factor:.4g} {symbol}".strip() for level in levels]
    return words, [text + f" ({number})" * (text in texts[:number])
                            for number, text in enumerate(texts)]


def drawn(response: FrequencyResponse, level: int) -> Array:
    """Amplitude (N,) over the parameter, or the force where the amplitude is held."""
    return response.amplitude(level) if response.force_name is None else response.force(level)


def drawn_label(response: FrequencyResponse) -> str:
    """Label of what is drawn over the parameter, with its unit."""
    if response.force_name is None:
        return amplitude_label(response.observed)
    return branch_label(response.branches[0], response.force_name)


def mode_diagrams(
    modes: Sequence[NonlinearMode], names: Sequence[str], *, logarithmic: bool = True
) -> tuple[Diagram, Diagram]:
    """Frequency, and damping ratio or energy where all are conservative, over the amplitude."""
    lossless = all(mode.conservative for mode in modes)
    branches, x = [mode.branch for mode in modes], [mode.amplitude for mode in modes]
    below: list[Any] = [mode.energy if lossless else mode.damping_ratio for mode in modes]
    hertz = [mode.frequency_hz for mode in modes]
    upper, lower = _curves(branches, x, (hertz, below), names)
    label, over = _amplitude(modes[0].observed), "x" * logarithmic
    grows = lossless or any((one < 0.0).any() for one in below)
    return (Diagram(label, "frequency [Hz]", upper, _marks(branches, x, hertz), logarithmic=over),
            Diagram(label, "energy [J]" if lossless else "damping ratio", lower,
                    logarithmic=over + "y" * lossless, y_limits=(None if grows else 0.0, None)))


def resonance_diagrams(
    curves: Sequence[ResonanceCurve], names: Sequence[str]
) -> tuple[Diagram, Diagram]:
    """Amplitude and frequency of resonances over their parameter."""
    branches, x = [curve.branch for curve in curves], [curve.parameter for curve in curves]
    sizes = [curve.amplitude for curve in curves]
    upper, lower = _curves(branches, x, (sizes, [curve.frequency_hz for curve in curves]), names)
    label = branch_label(branches[0])
    return (Diagram(label, _amplitude(curves[0].observed), upper, _marks(branches, x, sizes),
                    y_limits=(0.0, None)),
            Diagram(label, "frequency [Hz]", lower))


def _amplitude(observed: str) -> str:
    unit = "rad" if observed.split()[-1].startswith("phi") else "m"
    return f"amplitude of {observed} [{unit}]"


def _curves(
    branches: Sequence[Branch], x: Sequence[Array], heights: Sequence[Sequence[Array]],
    names: Sequence[str],
) -> tuple[tuple[Curve, ...], ...]:
    """Curves of all branches for each diagram."""
    colours = distinct_colours(len(branches))
    named = list(names) or [""] * len(branches)
    return tuple(tuple(branch_curve(*one) for one in zip(
        branches, x, each, named, colours, strict=True)) for each in heights)


def _marks(
    branches: Sequence[Branch], x: Sequence[Array], y: Sequence[Array]
) -> tuple[Mark, ...]:
    """Special points of branches, without letters."""
    return tuple(Mark(point.kind, float(xs[place]), float(ys[place]))
                 for branch, xs, ys in zip(branches, x, y, strict=True)
                 for place, point in enumerate(branch.points) if point.kind is not None)
