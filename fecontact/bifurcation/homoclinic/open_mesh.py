"""Piecewise polynomials on an interval whose ends differ, from those of periodic orbits.

Less the straight line between both ends, a solution with nodes (N m + 1, d) is periodic; the line
has no part in derivatives from the second on, so that meshes do not notice it.
"""

import numpy as np

from fecontact.bifurcation.orbits import mesh as periodic
from fecontact.bifurcation.orbits.collocation_kernels import at_points
from fecontact.bifurcation.orbits.mesh import rule
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.core.types import Array


def node_times(mesh: Array, degree: int) -> Array:
    """Times (N m + 1,) of the nodes."""
    return np.append(periodic.node_times(mesh, degree), 1.0)


def _closed(mesh: Array, nodes: Array, degree: int) -> tuple[Array, Array]:
    """Nodes (N m, d) less the line between the ends, and the rise (d,) of that line."""
    rise = nodes[-1] - nodes[0]
    line = periodic.node_times(mesh, degree)[:, None] * rise
    return np.ascontiguousarray(nodes[:-1] - line), rise


def at_gauss_points(mesh: Array, nodes: Array, degree: int) -> tuple[Array, Array]:
    """States (N m, d), and their slopes over one interval, at the Gauss points."""
    closed, rise = _closed(mesh, nodes, degree)
    x, slopes = np.empty_like(closed), np.empty_like(closed)
    basis, widths = rule(degree), np.diff(mesh)
    at_points(closed, basis.values, basis.slopes, x, slopes)
    times = (mesh[:-1, None] + widths[:, None] * basis.points).reshape(-1)
    return x + times[:, None] * rise, slopes + np.repeat(widths, degree)[:, None] * rise


def interpolate(mesh: Array, nodes: Array, degree: int, times: Array) -> Array:
    """Values (k, d) at times (k,) from 0 to 1."""
    closed, rise = _closed(mesh, nodes, degree)
    # The end itself is the start of the closed solution, which differs from it by the line alone.
    return np.asarray(periodic.interpolate(mesh, closed, times) + times[:, None] * rise)


def equidistributed(mesh: Array, nodes: Array, degree: int, intervals: int) -> Array:
    """Mesh that equidistributes the error, as for periodic orbits."""
    return periodic.equidistributed(mesh, _closed(mesh, nodes, degree)[0], degree, intervals)


def phase_row(nodes: Array, degree: int) -> Array:
    """Weights (N m + 1, d) of the nodes of x in int <x, y'> with these nodes of y."""
    basis = rule(degree)
    count = (len(nodes) - 1) // degree
    places = np.arange(count)[:, None] * degree + np.arange(degree + 1)
    rates = np.einsum("ck,jkd->jcd", basis.slopes, nodes[places])
    parts = np.einsum("c,ck,jcd->jkd", basis.weights, basis.values, rates)
    row = np.zeros_like(nodes)
    row[:-1] = parts[:, :-1].reshape(-1, nodes.shape[1])
    row[degree::degree] += parts[:, -1]
    return row


def nodes_of(u: Array, states: int) -> Array:
    """Nodes (N m + 1, d) in the unknowns of a homoclinic orbit; ``states`` is d."""
    return np.ascontiguousarray(u[: len(u) - 2 - states].reshape(-1, states))


def sampled(u: Array, mesh: Array, states: int, time: float, samples: int) -> PeriodicMotion:
    """A homoclinic orbit over its interval of length ``time`` [s], both ends included."""
    nodes, phases = nodes_of(u, states), np.linspace(0.0, 1.0, samples)
    degree = (len(nodes) - 1) // (len(mesh) - 1)
    return PeriodicMotion(phases * time, interpolate(mesh, nodes, degree, phases), time)
