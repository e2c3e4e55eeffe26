r"""Friction of elastic Coulomb elements on tori.

An element sticks, z' = slip velocity, or slides at its limit \|z\| = mu F / k. On a torus its
deflection is a function of both angles, as displacements are. It is followed along lines (see
`.series`) from sample to sample, with straight paths between these: where one slides, the angle
psi between z and the path falls as tan(psi / 2) does with exp(-way / limit), the solution of
z' = v - (n.v) n with n = z / \|z\|. A line begins with the deflection that others end with, so that
z is found by Newton's method for the starts of all lines. What an element has slid, z - x with the
displacement x, is carried from line to line: elements that stick for ever keep it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.layout import Layout, kept_by
from fecontact.bifurcation.harmonic.memory import LEAK, Kept
from fecontact.bifurcation.harmonic.series import functions_at, turned
from fecontact.bifurcation.tori.series import complex_coefficients, on_lines, orders
from fecontact.core.compiled import helper, kernel
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.records import Array4, Block, Matrix, Vector
from fecontact.core.types import Array
from fecontact.laws.friction.maxwell_slip import RETURN_TIME
from fecontact.system.elastic_sliders import limit_of, slider_counts, without_elements
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.node_forces import normal_gradients
from fecontact.system.nodes import (
    SystemArrays,
    ground_motion,
    ground_travel,
    motion_in,
    node_contact,
)

# Rounds from line to line: before Newton's method, of it, and without it; relative change that ends
# them.
_FIRST, _NEWTON, _ROUNDS, _REPEATS = 4, 40, 5000, 1e-11
# Part of its limit by which a deflection that slides may be short of it.
_AT_LIMIT = 1e-9
# Step of the complex step.
_TINY = 1e-30


@kernel
def _pressing(
    j: int, t: Vector, moved: Block, s: SystemArrays, pressing: Matrix, slopes: Block,
    travel: Matrix,
) -> None:
    """Fill what presses node j (Q, P), its derivatives (Q, P, 2 d), and the ground's travel (P, t).

    ``moved`` (Q, P, 2 d) are places and speeds along the d axes on Q lines at times t (P,).
    """
    Q, P, wide = moved.shape
    d = wide // 2
    gradients = np.empty((d + 1, wide))
    for p in range(P):
        ground = ground_motion(t[p], s)
        for tangent in range(d - 1):
            travel[p, tangent] = ground_travel(tangent, j, ground, s)
        for q in range(Q):
            contact = node_contact(j, motion_in(moved[q, p], d), ground, s)
            pressing[q, p] = normal_gradients(j, contact, s, gradients)[1]
            for k in range(wide):
                slopes[q, p, k] = gradients[d, k]


@helper
def _shortened(one, other, limit):
    """Factor that brings a deflection within its limit."""
    size = one * one + other * other
    return limit / np.sqrt(size) if size.real > limit.real * limit.real else 1.0 + 0.0 * limit


@helper
def _edge(across, limit):
    """Distance along a path at which the limit is met, from the place abeam of its middle."""
    square = limit * limit - across * across
    return np.sqrt(square) if square.real > 0.0 else 0.0 * square


@helper
def _moved(one, other, d_one, d_other, limit):
    """Deflection (one, other) after a straight path, within its limit; numbers may be complex."""
    if limit.real <= 0.0:
        return 0.0 * limit, 0.0 * limit
    way = d_one * d_one + d_other * d_other
    if not way.real > 0.0:
        part = _shortened(one, other, limit)
        return part * one + d_one, part * other + d_other
    way = np.sqrt(way)
    c, s = d_one / way, d_other / way
    along, across = one * c + other * s, other * c - one * s
    edge = _edge(across, limit)
    if not (edge.real > 0.0 > along.real and (along + edge + way).real >= 0.0):
        # Unless the path leads back within a limit that has fallen.
        part = _shortened(one, other, limit)
        one, other, along, across = part * one, part * other, part * along, part * across
        edge = _edge(across, limit)
    if (edge - along).real >= way.real:
        return one + d_one, other + d_other
    half = across / (limit + edge) * np.exp((edge - along - way) / limit)
    along = limit * (1.0 - half * half) / (1.0 + half * half)
    across = 2.0 * limit * half / (1.0 + half * half)
    return along * c - across * s, along * s + across * c


@helper
def _stretch(way, q, p):
    """Path from the sample before p of line q, none at the first one."""
    if p == 0:
        return 0.0, 0.0
    return way[q, p, 0] - way[q, p - 1, 0], way[q, p, 1] - way[q, p - 1, 1]


@kernel
def _follow(way: Block, limits: Matrix, start: Matrix, z: Block) -> None:
    """Fill z (Q, P, 2) on lines that begin with ``start`` (Q, 2), on paths ``way`` (Q, P, 2)."""
    Q, P = limits.shape
    for q in range(Q):
        one, other = start[q, 0], start[q, 1]
        for p in range(P):
            d_one, d_other = _stretch(way, q, p)
            one, other = _moved(one, other, d_one, d_other, limits[q, p])
            z[q, p, 0], z[q, p, 1] = one, other


@kernel
def _derive(way: Block, limits: Matrix, start: Matrix, z: Block, by: Array4) -> None:
    """Fill ``by`` (Q, P, 2, 5), derivatives of z to that before, to the path and to the limit."""
    Q, P = limits.shape
    given = np.empty(5, dtype=np.complex128)
    for q in range(Q):
        for p in range(P):
            before = start[q] if p == 0 else z[q, p - 1]
            given[0], given[1], given[4] = before[0], before[1], limits[q, p]
            given[2], given[3] = _stretch(way, q, p)
            for k in range(5):
                given[k] += _TINY * 1j
                one, other = _moved(given[0], given[1], given[2], given[3], given[4])
                given[k] = given[k].real
                by[q, p, 0, k], by[q, p, 1, k] = one.imag / _TINY, other.imag / _TINY


@kernel
def _transfer(by: Array4, whole: Block) -> None:
    """Fill ``whole`` (Q, t, t), derivatives of the end of each line to its start."""
    Q, P, _, _ = by.shape
    t = whole.shape[1]
    for q in range(Q):
        for k in range(t):
            one, other = (1.0, 0.0) if k == 0 else (0.0, 1.0)
            for p in range(P):
                own = by[q, p]
                one, other = (own[0, 0] * one + own[0, 1] * other,
                              own[1, 0] * one + own[1, 1] * other)
            whole[q, 0, k] = one
            if t > 1:
                whole[q, 1, k] = other


class _Line(NamedTuple):
    """Derivatives of the deflections of an element within a step, and of what they depend on.

    ``by`` as of :func:`_derive`; ``slopes`` (Q, P, 2 d) are those of its limit to places and speeds
    of the node, ``values`` and ``speeds`` (Q, P, L) the functions of the series and their rates.
    """

    by: Array4
    slopes: Block
    values: Block
    speeds: Block


@kernel
def _carry(line: _Line, stiffness: float, begun: Block, rows: Array4, ends: Block) -> None:
    """Add ``stiffness`` times the derivatives of z to ``rows`` (Q, P, t, d L).

    Those at the ends of the lines, less those of the displacements there, fill ``ends``
    (Q, t, d L); ``begun`` (Q, t, d L) are those with which lines begin, less those of the
    displacements.
    """
    Q, P, L = line.values.shape
    t, columns = begun.shape[1], begun.shape[2]
    d = columns // L
    was = np.empty((2, columns))
    for q in range(Q):
        was[:, :] = 0.0
        was[:t] = begun[q]
        for p in range(P):
            own, values, speeds = line.by[q, p], line.values[q, p], line.speeds[q, p]
            for axis in range(d):
                place, speed = line.slopes[q, p, axis], line.slopes[q, p, d + axis]
                first = axis * L
                for k in range(L):
                    one, other = was[0, first + k], was[1, first + k]
                    change = values[k] - (line.values[q, p - 1, k] if p > 0 else 0.0)
                    if axis == 0:
                        # The first z is slid + x; each later one follows the change of x.
                        one += change if p == 0 else 0.0
                    elif axis == 2:
                        other += change if p == 0 else 0.0
                    limit = place * values[k] + speed * speeds[k]
                    for i in range(t):
                        total = own[i, 0] * one + own[i, 1] * other + own[i, 4] * limit
                        if p > 0 and axis == 0:
                            total += own[i, 2] * change
                        elif p > 0 and axis == 2:
                            total += own[i, 3] * change
                        was[i, first + k] = total
            if stiffness != 0.0:
                for i in range(t):
                    for k in range(columns):
                        rows[q, p, i, k] += stiffness * was[i, k]
        for i in range(t):
            for k in range(columns):
                ends[q, i, k] = was[i, k]
            for k in range(L):
                ends[q, i, 2 * i * L + k] -= line.values[q, P - 1, k]


class Friction(NamedTuple):
    """Friction of elements at places of lines.

    Attributes
    ----------
    forces : (Q, P, n, t) array
        Along the t tangents of n nodes, against their motion.
    deflections : (Q, P, c) array
        Within their limits.
    sliding : (Q, P, c) array
        Distances beyond them that elements have which slide and return within the time of their
        law.
    stiffness : (n, t) array
        Mean of the springs that stick.
    rows : list of (Q, P, t, d L) array
        Derivatives of the forces of each node to its coefficients along d axes; none if not asked.
    """

    forces: Array
    deflections: Array
    sliding: Array
    stiffness: Array
    rows: list[Array]


@dataclass(frozen=True, eq=False)
class TorusElements:
    """Elastic Coulomb elements of a contact system on tori.

    Attributes
    ----------
    field : ContactField
        The system with its elements.
    kept : Kept
        Their numbers, and the deflections of those that never slide.
    """

    field: ContactField
    kept: Kept

    def friction(
        self, X: Array, harmonics: tuple[int, int], frequencies: tuple[float, float], taus: Array,
        count: int, values: Array, *, derivatives: bool = False,
    ) -> Friction:
        """Friction at tau (P,), ascending from 0 to 1, of ``count`` lines.

        X (L, m) are coefficients of the displacements with H1 and H2 ``harmonics``.

        Raises
        ------
        AnalysisError
            If an element does not come to repeat.
        """
        first = 1 if taus[0] > 0.0 else 0
        places = np.concatenate([np.zeros(first), taus, np.ones(int(taus[-1] < 1.0))])
        some = slice(first, first + len(taus))
        s, ratio = self.field.arrays(values), frequencies[1] / frequencies[0]
        n, d, _ = s.rows.shape
        turns = 2.0 * np.pi * orders(*harmonics) @ np.array(frequencies)
        series = np.einsum("jam,lm->lja", s.rows, X).reshape(len(X), n * d)
        both = np.concatenate([series, turned(series, turns)], axis=1)
        moved = on_lines(complex_coefficients(both, *harmonics), places, count, ratio).reshape(
            count, len(places), 2, n, d)
        lines = _Lines(
            places / frequencies[0], _shift(count, ratio),
            _functions(harmonics, turns, places, count, ratio) if derivatives else None)
        shape = count, len(places)
        c = len(self.kept.offsets)
        found = Friction(np.zeros((*shape, n, d - 1)), np.zeros((*shape, c)),
                         np.zeros((*shape, c)), np.zeros((n, d - 1)), [])
        for j in range(n):
            rows = np.zeros((*shape, d - 1, d * len(X)) if derivatives else (0, 0, 0, 0))
            self._add_node(j, s, lines, moved[:, :, :, j], found, rows)
            if derivatives:
                found.rows.append(rows[:, some])
        return Friction(found.forces[:, some], found.deflections[:, some], found.sliding[:, some],
                        found.stiffness, found.rows)

    def _add_node(
        self, j: int, s: SystemArrays, lines: "_Lines", moved: Array, found: Friction, rows: Array
    ) -> None:
        """Add the friction of node j, whose places and speeds are ``moved`` (Q, P, 2, d)."""
        elements, states = int(self.kept.elements[j]), len(self.kept.offsets) // len(s.rows)
        Q, P, _, d = moved.shape
        t = d - 1
        pressing, slopes, travel = np.empty((Q, P)), np.empty((Q, P, 2 * d)), np.empty((P, t))
        _pressing(j, lines.times, np.ascontiguousarray(moved.reshape(Q, P, 2 * d)),
                  without_elements(s), pressing, slopes, travel)
        x, way = np.zeros((Q, P, 2)), np.zeros((Q, P, 2))
        x[:, :, :t] = moved[:, :, 0, ::2]
        way[:, :, :t] = x[:, :, :t] - travel
        for i in range(elements):
            own = slice(j * states + t * i, j * states + t * (i + 1))
            stiffness = float(s.friction_parameters[j, 1 + i])
            softness = float(limit_of(j, i, elements, 1.0, s))
            limits, offset, z = softness * pressing, np.zeros(2), np.empty((Q, P, 2))
            offset[:t] = self.kept.offsets[own]
            by, whole = _repeating(way, limits, x, offset, lines.shift, z, t)
            found.forces[:, :, j] += stiffness * z[:, :, :t]
            found.deflections[:, :, own] = z[:, :, :t]
            found.sliding[:, :, own] = _beyond(z, way, limits, lines.times)[:, :, :t]
            for k in range(t):
                found.stiffness[j, k] += stiffness * by[:, :, k, 2 + k].mean()
            if lines.functions is not None:
                _add_rows(_Line(by, softness * slopes, *lines.functions), stiffness, whole,
                          lines.shift, rows)


class _Lines(NamedTuple):
    """Lines that elements are followed along.

    Attributes
    ----------
    times : (P,) array
        From 0 to 1 / f1 [s].
    shift : (Q, Q) array
        See :func:`_shift`.
    functions : ((Q, P, L), (Q, P, L)) arrays, optional
        See :func:`_functions`; not for forces alone.
    """

    times: Array
    shift: Array
    functions: tuple[Array, Array] | None


def _repeating(
    way: Array, limits: Array, x: Array, offset: Array, shift: Array, z: Array, t: int
) -> tuple[Array, Array]:
    """Fill z (Q, P, 2) with deflections that repeat, along t tangents.

    Returns derivatives, those of :func:`_derive` and those (Q, t, t) of the ends to the starts.
    """
    Q, P = limits.shape
    slid = np.tile(offset, (Q, 1))
    by, whole = np.empty((Q, P, 2, 5)), np.empty((Q, t, t))
    scale = max(float(np.abs(offset).max()), float(np.abs(x).max()), 1e-300)

    def left(slid: Array) -> Array:
        _follow(way, limits, slid + x[:, 0], z)
        return np.asarray(shift @ (z[:, -1] - x[:, -1]) - slid)

    def derive(slid: Array) -> None:
        _derive(way, limits, slid + x[:, 0], z, by)
        _transfer(by, whole)

    for turn in range(_FIRST + _NEWTON):
        change = left(slid)
        if turn >= _FIRST and not np.abs(change).max() <= _REPEATS * scale:
            derive(slid)
            change[:, :t] = _repeated(whole, shift, change[:, :t, None])[..., 0]
        slid = slid + change
        if np.abs(change).max() <= _REPEATS * scale:
            break
    else:
        slid = np.tile(offset, (Q, 1))
        for _ in range(_ROUNDS):
            change = left(slid)
            slid += change
            if np.abs(change).max() <= _REPEATS * scale:
                break
        else:
            raise AnalysisError("An elastic Coulomb element does not come to repeat on the torus; "
                                "take more samples.")
    left(slid)
    derive(slid)
    return by, whole


def _repeated(whole: Array, shift: Array, given: Array) -> Array:
    """Solution (Q, t, k) of y = shift whole y + given."""
    Q, t, _ = whole.shape
    # Without the leak, elements that stick for ever would have no derivative.
    matrix = np.eye(Q * t) - (1.0 - LEAK) * (
        shift[:, None, :, None] * whole.transpose(1, 0, 2)[None]).reshape(Q * t, Q * t)
    return np.asarray(np.linalg.solve(matrix, given.reshape(Q * t, -1)),
                      dtype=float).reshape(given.shape)


def _add_rows(line: _Line, stiffness: float, whole: Array, shift: Array, rows: Array) -> None:
    """Add derivatives (Q, P, t, d L) of the forces of an element."""
    Q, _, t, columns = rows.shape
    nothing, ends = np.zeros((Q, t, columns)), np.empty((Q, t, columns))
    _carry(line, 0.0, nothing, rows, ends)
    given = np.tensordot(shift, ends, axes=1)
    _carry(line, stiffness, np.ascontiguousarray(_repeated(whole, shift, given)), rows, ends)


def _shift(count: int, ratio: float) -> Array:
    """Values (Q, Q) of a function at the starts of lines from those where lines end."""
    k = np.arange(-((count - 1) // 2), (count - 1) // 2 + 1)
    phases = np.arange(count)[:, None] / count - ratio - np.arange(count) / count
    found = np.exp(2.0j * np.pi * phases[:, :, None] * k).real.sum(axis=2)
    if count % 2 == 0:
        found += np.cos(np.pi * count * phases)
    return np.asarray(found / count)


def _functions(
    harmonics: tuple[int, int], turns: Array, places: Array, count: int, ratio: float
) -> tuple[Array, Array]:
    """Functions of the series (Q, P, L) at tau (P,) of lines, and their rates [1/s]."""
    k = orders(*harmonics)
    phis = np.arange(count)[:, None] / count + ratio * places
    values = functions_at(2.0 * np.pi * (k[1:, 0] * places[:, None] + k[1:, 1] * phis[:, :, None]))
    speeds = np.zeros_like(values)
    speeds[..., 1::2], speeds[..., 2::2] = (-turns[1:] * values[..., 2::2],
                                            turns[1:] * values[..., 1::2])
    return values, speeds


def _beyond(z: Array, way: Array, limits: Array, times: Array) -> Array:
    """Distances (Q, P, 2) beyond their limits of deflections that slide at the end of a path."""
    speeds = np.zeros_like(z)
    speeds[:, 1:] = np.diff(way, axis=1) / np.diff(times)[None, :, None]
    size = np.hypot(z[..., 0], z[..., 1])
    at_limit = (size >= (1.0 - _AT_LIMIT) * limits) & (size > 0.0)
    n = np.where(at_limit, 1.0 / np.where(at_limit, size, 1.0), 0.0)[..., None] * z
    return np.asarray(RETURN_TIME * np.maximum((n * speeds).sum(axis=2), 0.0)[..., None] * n)


def elements_of(field: VectorField, layout: Layout) -> TorusElements | None:
    """The elastic Coulomb elements of a field; None if it has none.

    Raises
    ------
    InputError
        If there are other internal variables beside them.
    """
    if not (isinstance(field, ContactField) and slider_counts(field.system()).any()):
        return None
    kept = kept_by(field, layout)
    if not kept.exact:
        raise InputError("torus_branch: friction has elastic Coulomb elements (JenkinsFriction, "
                         "IwanFriction, FourParameterIwanFriction) beside other internal "
                         "variables; take the same kind at all contact nodes.")
    return TorusElements(field, kept)
