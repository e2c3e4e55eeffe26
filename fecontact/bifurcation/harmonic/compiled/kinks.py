r"""Contact that begins or ends between two samples of harmonic balance.

A normal law has a kink where its force begins: F = c max(0, x) with x = u - b, the penetration past
an onset b. Sampled as it is, each sample at which x changes sign is a kink of the equations, and
branches turn there. With the penetration a straight line about a sample, x + v s, and a kernel K
over the distance s, the force at a sample becomes the mean

.. math:: \int K(s / h)\, F(x + v s)\, ds / h = c\, w\, S(x / w), \qquad w = |v| h

h is the distance of samples and K = B_4 - B_4'' / 6, the cubic B-spline B_4 without its second
moment. Its shifts by h sum to one, so that the sum over all samples does not depend on where
between them the kink lies; without a second moment the sum is that of the integral but for h^3.
Jumps of the force, as of dashpots, are treated alike. Forces more than two samples from a kink are
those of the law.
"""

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Block, Matrix, Vector
from fecontact.core.types import Array, Integers
from fecontact.system.node_forces import (
    friction_entry,
    normal_force,
    normal_values,
    pressing_force,
    set_friction,
    slip_entry,
)
from fecontact.system.nodes import SystemArrays, ground_motion, node_contact, node_motion

# Distance from a kink in w up to which forces are means.
_REACH = 2.0
# Distance from an onset, in w and relative to it, at which the law on either side is taken.
_BESIDE, _ROUNDING = 1e-9, 1e-12
# Onsets beyond are none.
_NOWHERE = 1e99
# Relative jump of force or stiffness at an onset from which it is a kink, and distance from it in
# characteristic penetrations at which the law is taken for that.
_JUMP, _NEAR = 1e-3, 1e-6
# Relative change of a parameter at which onsets are compared.
_CHANGE = 1e-3
# Onsets of fields, by the free parameter and the values of the others.
_KNOWN: WeakKeyDictionary[ContactField, dict[tuple[int, bytes], Array]] = WeakKeyDictionary()
_MOST_KNOWN = 100


@helper
def kernel_integrals(y):
    """K at y, and its integrals up to there, once, twice and three times."""
    # Signed binomials of the fourth difference.
    value, first, second, third = 0.0, 0.0, 0.0, 0.0
    factor = 1.0
    for i in range(5):
        r = y + 2.0 - i
        if r > 0.0:
            square = r * r
            value += factor * r * (square - 1.0) / 6.0
            first += factor * square * (square / 24.0 - 1.0 / 12.0)
            second += factor * square * r * (square / 120.0 - 1.0 / 36.0)
            third += factor * square * square * (square / 720.0 - 1.0 / 144.0)
        factor *= -(4.0 - i) / (i + 1.0)
    return value, first, second, third


@helper
def kink_change(u, v, b, h, j, s):
    """Change of the normal force of node j near its onset b, with its derivatives to u and v.

    Also the part w dF/dw of the latter that is due to the width w, times v; and the force far from
    the onset, on the side where it is larger.
    """
    x, w = u - b, abs(v) * h
    off = _BESIDE * w + _ROUNDING * abs(b)
    above, above_u, above_v = normal_force(j, b + off, v, s)
    below, below_u, below_v = normal_force(j, b - off, v, s)
    jump, bend, jump_v = above - below, above_u - below_u, above_v - below_v
    value, first, second, _ = kernel_integrals(x / w)
    past = 1.0 if x > 0.0 else 0.0
    change = jump * (first - past) + bend * (w * second - past * x)
    change_u = jump * value / w + bend * (first - past)
    # w grows with |v|.
    by_width = -jump * value * x / (w * w) + bend * (second - first * x / w)
    change_v = jump_v * (first - past) + by_width * (h if v >= 0.0 else -h)
    one, other = normal_force(j, b + 3.0 * w, v, s)[0], normal_force(j, b - 3.0 * w, v, s)[0]
    return (change, change_u, change_v, by_width * w,
            one if abs(one) > abs(other) else other)


@helper
def changes_near(u, v, onsets, h, j, s):
    """Sums of :func:`kink_change` over the onsets (k, n) of node j nearby; whether there are any.

    The force far from onsets is that of the last one.
    """
    change, change_u, change_v, by_width, far, found = 0.0, 0.0, 0.0, 0.0, 0.0, False
    for k in range(len(onsets)):
        if abs(u - onsets[k, j]) < _REACH * abs(v) * h:
            one, one_u, one_v, one_w, far = kink_change(u, v, onsets[k, j], h, j, s)
            change, change_u, change_v = change + one, change_u + one_u, change_v + one_v
            by_width, found = by_width + one_w, True
    return (change, change_u, change_v, by_width, far), found


@helper
def _add_friction(j, contact, F, part, s, force, by_force):
    """Add to ``force`` (d - 1, d) a part of the friction of node j under a normal force F.

    For each tangent the force, and its derivatives to the slip velocities; those to F are added to
    ``by_force`` (2, d - 1), and are its second row.
    """
    own, rates, nothing = np.empty(8), np.empty((0, 4)), np.empty(0)
    pressing = pressing_force(j, contact, F, s)
    set_friction(j, contact.slip, pressing, nothing, s.friction_parameters[j], s, own, rates)
    scale = pressing / F if F != 0.0 else 0.0
    for k in range(len(force)):
        first = friction_entry(k, 0)
        force[k, 0] += part * own[first]
        for other in range(len(force)):
            force[k, 1 + other] += part * own[first + slip_entry(other, 0)]
        by_force[1, k] = part * scale * own[first + 2]
        by_force[0, k] += by_force[1, k]


class SampledRates(NamedTuple):
    """Rates f (N, d) at N samples, their Jacobians J (N, d, d), and widths (m, N).

    The latter are what the Jacobians contain of velocities times derivatives through the width w,
    which stays where velocities change with the period.
    """

    f: Matrix
    J: Block
    widths: Matrix


@helper
def _add_node(j, n, contact, change, s, derivatives, out):
    """Add the change of a normal force, as :func:`kink_change` returns it, to a sample's rates."""
    dF, dF_u, dF_v, by_width, far = change
    f, A, widths = out.f[n], out.J[n if derivatives else 0], out.widths
    _, d, m = s.rows.shape
    F, F_u, F_v = normal_force(j, contact.penetration, contact.rate, s)
    new, slip = F + dF, contact.slip
    # Change of friction with derivatives to slip, to F, and to its change alone.
    friction, by_force = np.zeros((d - 1, d)), np.zeros((2, d - 1))
    if s.memory[j] == 0:
        _add_friction(j, contact, F, -1.0, s, friction, by_force)
        _add_friction(j, contact, new, 1.0 if new * far >= 0.0 else -1.0, s, friction, by_force)
    node_force, by_change = np.empty(d), np.empty(d)
    node_force[1], by_change[1] = dF, 1.0
    for k in range(d - 1):
        by_change[2 * k] = -by_force[1, k]
        node_force[2 * k] = -friction[k, 0]
        if s.follows_surface:
            by_change[2 * k] -= contact.slope[k]
            node_force[2 * k] -= contact.slope[k] * dF
    for axis in range(d):
        for i in range(m):
            f[m + i] += s.rows[j, axis, i] * node_force[axis]
            if derivatives:
                widths[i, n] += s.rows[j, axis, i] * by_change[axis] * by_width
    if not derivatives:
        return
    # Derivatives of u and v, then of the forces, to displacements and velocities along the axes.
    u_of, v_of, partial = np.empty(d), np.zeros(d), np.empty((d, 2 * d))
    u_of[1] = -1.0
    for k in range(d - 1):
        bend = contact.curvature[k]
        u_of[2 * k], v_of[2 * k] = contact.slope[k], bend[0] * slip[0] + bend[1] * slip[1]
    for axis in range(d):
        for other in range(d):
            place = by_change[axis] * (dF_u * u_of[other] + dF_v * v_of[other])
            speed = by_change[axis] * dF_v * u_of[other]
            if axis != 1:
                by = by_force[0, axis // 2]
                place -= by * (F_u * u_of[other] + F_v * v_of[other])
                speed -= by * F_v * u_of[other]
                if other != 1:
                    speed -= friction[axis // 2, 1 + other // 2]
                    if s.follows_surface:
                        place -= dF * contact.curvature[axis // 2][other // 2]
            partial[axis, other], partial[axis, d + other] = place, speed
    for axis in range(d):
        for k in range(m):
            place, speed = 0.0, 0.0
            for other in range(d):
                place += partial[axis, other] * s.rows[j, other, k]
                speed += partial[axis, d + other] * s.rows[j, other, k]
            for i in range(m):
                A[m + i, k] += s.rows[j, axis, i] * place
                A[m + i, m + k] += s.rows[j, axis, i] * speed


@kernel
def add_kinks(
    t: Vector, x: Matrix, s: SystemArrays, onsets: Matrix, h: float, derivatives: int,
    out: SampledRates,
) -> None:
    """Add to the rates at samples t (N,), x (N, d) a distance h apart what kinks change.

    ``onsets`` (k, n) are penetrations of the nodes; with ``derivatives`` the Jacobians change too,
    and the widths are filled. Friction with memory feels the force of the law.
    """
    if derivatives:
        out.widths[:, :] = 0.0
    if len(onsets) == 0:
        return
    for n in range(len(t)):
        moved = ground_motion(t[n], s)
        for j in range(len(s.rows)):
            contact = node_contact(j, node_motion(j, x[n], s), moved, s)
            change, found = changes_near(contact.penetration, contact.rate, onsets, h, j, s)
            if found:
                _add_node(j, n, contact, change, s, derivatives != 0, out)


def kink_onsets(field: ContactField, values: Array, free: int) -> Array:
    """Penetrations (k, n) of the nodes at which normal laws have kinks; k is zero without any.

    Onsets that move with the free parameter are left out.
    """
    known = _KNOWN.setdefault(field, {})
    others = values.copy()
    others[free] = 0.0
    key = free, others.tobytes()
    if key not in known:
        if len(known) >= _MOST_KNOWN:
            known.clear()
        known[key] = _found(field, values, free)
    return known[key]


def _found(field: ContactField, values: Array, free: int) -> Array:
    """Onsets as :func:`kink_onsets` returns them."""
    moved = values.copy()
    moved[free] += _CHANGE * (abs(float(values[free])) or 1.0)
    here, there = (_onsets(field, one) for one in (values, moved))
    if here.shape != there.shape:
        return here[:0]
    with np.errstate(invalid="ignore"):
        still = (here == there).all(axis=0)
    kept = np.where(still[None, :], here, np.inf)
    return np.ascontiguousarray(kept[np.isfinite(kept).any(axis=1)])


def _onsets(field: ContactField, values: Array) -> Array:
    """Onsets (k, n) of all nodes that are kinks, filled up with infinity."""
    system = field.system(values)
    s, n = system.arrays, system.basis.contact_nodes
    columns: list[list[float]] = [[] for _ in range(n)]
    for nodes, _, law in system.law_groups("normal"):
        places = np.arange(n)[nodes]
        scale = law.penetration_scale
        for row in law.onsets(len(places)):
            bent = _bent(s, places, row, scale)
            for j, b in zip(places[bent], row[bent], strict=True):
                columns[j].append(float(b))
    found = np.full((max(map(len, columns), default=0), n), np.inf)
    for j, column in enumerate(columns):
        found[: len(column), j] = column
    return found


def _bent(s: SystemArrays, nodes: Integers, b: Array, scale: float) -> NDArray[np.bool_]:
    """True for nodes (k,) whose force or stiffness jumps at penetrations b (k,)."""
    near = np.abs(b) < _NOWHERE
    b = np.where(near, b, 0.0)  # polynomial forces overflow at places that stand for none
    off = _NEAR * scale + _ROUNDING * np.abs(b)

    def evaluated(u: Array, v: float) -> tuple[Array, Array]:
        force, slope = np.empty(len(b)), np.empty(len(b))
        normal_values(s.normal[nodes], u, np.full(len(b), v), s.normal_parameters[nodes], force,
                      slope)
        return force, slope

    found = np.zeros(len(b), dtype=bool)
    for v in (-scale, 0.0, scale):
        (above, above_u), (below, below_u) = evaluated(b + off, v), evaluated(b - off, v)
        size = np.maximum(*(np.abs(evaluated(b + side * scale, v)[0]) for side in (-1.0, 1.0)))
        found |= ((np.abs(above - below) > _JUMP * size)
                  | (np.abs(above_u - below_u) * scale > _JUMP * size))
    return found & near
