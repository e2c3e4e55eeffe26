"""Diagrams of a fit: measured and computed curves, residuals, profiles, posterior distributions."""

from itertools import combinations

import numpy as np

from fecontact.core.types import Array
from fecontact.fitting.posterior import Posterior
from fecontact.fitting.profile import ProfileLikelihood
from fecontact.fitting.result import Fit
from fecontact.output.diagrams.colours import COLOURS
from fecontact.output.diagrams.diagram import Curve, Diagram, Level
from fecontact.output.diagrams.labels import name_and_unit
from fecontact.study.fit_section import values_of

# Points from which on measured values are drawn small, and up to which they have bars; reach of
# these in standard deviations, 95 %.
_MOST, _BARS, _DEVIATIONS = 400, 60, 1.96
# Samples of a posterior that are drawn, bins of its marginals, points of an ellipse of the fit.
_SAMPLES, _BINS, _ELLIPSE = 1500, 40, 97


def fit_diagrams(fit: Fit, level: float = 0.95) -> list[tuple[Diagram, Diagram]]:
    """Measured and fitted values with the band of the model, and residuals, for each curve."""
    found = []
    for one, part, band in zip(fit.data, fit.problem.parts, fit.bands(level), strict=True):
        residuals = fit.residuals[part]
        for curve in one.curves():
            x, seen = curve.x, one.measured[curve.part]
            size = 2.0 if len(x) > _MOST else 3.5
            bars = None if one.deviations is None or len(x) > _BARS else (
                _DEVIATIONS * one.deviations[curve.part])
            low, high = (end[curve.part] for end in band)
            log = "x" * curve.logarithmic
            name, unit = name_and_unit(curve.y_label)
            width, marker = (1.6, 0.0) if curve.joined else (0.0, 7.0)
            values = Diagram(curve.x_label, curve.y_label, (
                Curve("fitted", COLOURS[1], x, fit.predicted[part][curve.part], width, marker,
                      limits=(low, high), limits_name=f"{100.0 * level:g} %"),
                Curve("measured", COLOURS[6], x, seen, 0.0, size, bars=bars)),
                title=name if name == one.title else f"{one.title}: {name}", logarithmic=log)
            weighted = fit.problem.weighted
            found.append((values, Diagram(
                curve.x_label, "residual / deviation" if weighted or not unit else
                f"residual [{unit}]",
                (Curve("", COLOURS[0], x, residuals[curve.part], 0.0, size),),
                levels=tuple(Level(height, dashed=True) for height in (-2.0, 2.0) if weighted),
                logarithmic=log)))
    return found


def profile_diagram(profile: ProfileLikelihood) -> Diagram:
    """Rise of chi square over a parameter, with its limit and the interval."""
    known = np.isfinite(profile.chi_square)
    return Diagram(
        profile.name, "rise of chi square",
        (Curve("", COLOURS[0], profile.values[known],
               profile.chi_square[known] - profile.best, marker=3.5),),
        levels=(Level(profile.limit, name=f"{100.0 * profile.level:g} %", dashed=True),
                *(Level(end, "x") for end in profile.interval if np.isfinite(end))))


def marginal_diagrams(chains: Posterior, level: float = 0.95) -> list[Diagram]:
    """Probability densities of the parameters, largest value one, with their intervals."""
    found = []
    for (name, ends), values, log in zip(
            chains.intervals(level).items(), chains.samples.T, _logarithmic(chains), strict=True):
        bins = np.geomspace if log else np.linspace
        edges = bins(float(values.min()), float(values.max()), _BINS + 1)
        # Over the scale of the parameter, bins are of equal width.
        density = np.histogram(values, edges)[0] if np.ptp(values) > 0.0 else np.ones(_BINS)
        x = np.repeat(edges, 2)
        y = np.concatenate([[0.0], np.repeat(density / density.max(), 2), [0.0]])
        found.append(Diagram(
            name, "density", (Curve("", COLOURS[0], x, y, limits=(np.zeros(len(y)), y)),),
            levels=tuple(Level(end, "x", dashed=True) for end in ends),
            logarithmic="x" * log, y_limits=(0.0, None)))
    return found


def pair_diagrams(chains: Posterior, level: float = 0.95) -> dict[tuple[int, int], Diagram]:
    """Samples and the ellipse of the fit for each pair of parameters, by their numbers."""
    fit, log = chains.fit, _logarithmic(chains)
    every = max(1, len(chains.samples) // _SAMPLES)
    samples = chains.samples[::every]
    turn = np.linspace(0.0, 2.0 * np.pi, _ELLIPSE)
    circle = fit.reach(level, 2) * np.array([np.cos(turn), np.sin(turn)])
    found = {}
    for i, j in combinations(range(len(fit.names)), 2):
        covariance = fit.place_covariance[np.ix_([i, j], [i, j])]
        curves = [Curve("samples", COLOURS[0], samples[:, i], samples[:, j], 0.0, 1.6)]
        if np.isfinite(covariance).all():
            size, axes = np.linalg.eigh(covariance)
            places = np.array(fit.places)[:, None] + np.zeros(_ELLIPSE)
            places[[i, j]] += axes @ (np.sqrt(np.maximum(size, 0.0))[:, None] * circle)
            values = np.array([values_of(fit.problem.parameters, u) for u in places.T])
            curves.append(Curve(f"{100.0 * level:g} % of the fit", COLOURS[1], values[:, i],
                                values[:, j], 1.4))
        found[i, j] = Diagram(fit.names[i], fit.names[j], tuple(curves),
                              logarithmic="x" * log[i] + "y" * log[j])
    return found


def _logarithmic(chains: Posterior) -> list[bool]:
    """True for parameters whose samples, sought on a logarithmic scale, differ by a factor of 3."""
    ratio: Array = chains.samples.max(axis=0) / np.where(
        (low := chains.samples.min(axis=0)) > 0.0, low, np.inf)
    return [one.scale == "log" and bool(span > 3.0)
            for one, span in zip(chains.fit.problem.parameters, ratio, strict=True)]
