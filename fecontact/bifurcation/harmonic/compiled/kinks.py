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

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Block, Matrix, Vector
from fecontact.core.types import Array, Integers
from fecontact.laws.signatures import normal_at
from fecontact.system.kernels import normal_values
from fecontact.system.node_forces import normal_force, plane_friction, pressing_force
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
def kink_change(u, v, b, h, law, p):
    """Change of a normal force near its onset b, with its derivatives to u and v.

    Also the part w dF/dw of the latter that is due to the width w, times v; and the force far from
    the onset, on the side where it is larger.
    """
    x, w = u - b, abs(v) * h
    off = _BESIDE * w + _ROUNDING * abs(b)
    above, above_u, above_v = normal_at(law)(b + off, v, p)
    below, below_u, below_v = normal_at(law)(b - off, v, p)
    jump, bend, jump_v = above - below, above_u - below_u, above_v - below_v
    value, first, second, _ = kernel_integrals(x / w)
    past = 1.0 if x > 0.0 else 0.0
    change = jump * (first - past) + bend * (w * second - past * x)
    change_u = jump * value / w + bend * (first - past)
    # w grows with |v|.
    by_width = -jump * value * x / (w * w) + bend * (second - first * x / w)
    change_v = jump_v * (first - past) + by_width * (h if v >= 0.0 else -h)
    one, other = normal_at(law)(b + 3.0 * w, v, p)[0], normal_at(law)(b - 3.0 * w, v, p)[0]
    return (change, change_u, change_v, by_width * w,
            one if abs(one) > abs(other) else other)


@helper
def is_near(u, v, b, h):
    """Whether a sample lies within two samples of a kink at the onset b."""
    return abs(u - b) < _REACH * abs(v) * h


@helper
def _add_node(j, n, contact, change, far, s, f, A, widths, derivatives):
    """Add the change of a normal force to the rates f (d,) and their Jacobian A (d, d)."""
    dF, dF_u, dF_v, by_width = change
    m = s.rows.shape[2]
    F, F_u, F_v = normal_force(j, contact.penetration, contact.rate, s)
    ground, curvature, slip = contact.slope[0], contact.curvature[0][0], contact.slip[0]
    new = F + dF
    # Change of friction, its derivatives to slip and place, and of the pressing force to F.
    dR, dR_v, by_F, by_change = 0.0, 0.0, 0.0, 0.0
    if s.memory[j] == 0:
        R, R_v, R_F = 0.0, 0.0, 0.0
        if F != 0.0:
            scale = pressing_force(j, contact, F, s) / abs(F)
            R, R_v, R_F = plane_friction(j, slip, scale * abs(F), s)
            R_F *= scale if F >= 0.0 else -scale
        dR, dR_v, by_F = -R, -R_v, -R_F
        if new != 0.0:
            scale = pressing_force(j, contact, new, s) / abs(new)
            side = 1.0 if new * far >= 0.0 else -1.0
            R, R_v, R_F = plane_friction(j, slip, scale * abs(new), s)
            dR, dR_v = dR + side * R, dR_v + side * R_v
            R_F *= side * (scale if new >= 0.0 else -scale)
            by_F, by_change = by_F + R_F, R_F
    slope = ground if s.follows_surface else 0.0
    dT = dR + slope * dF
    for i in range(m):
        f[m + i] += s.rows[j, 1, i] * dF - s.rows[j, 0, i] * dT
    if not derivatives:
        return
    for i in range(m):
        widths[i, n] += (s.rows[j, 1, i] - s.rows[j, 0, i] * (by_change + slope)) * by_width
    # Derivatives to x, y, x', y' of the node.
    u_x, v_x = ground, curvature * slip
    for k in range(m):
        tx, ty = s.rows[j, 0, k], s.rows[j, 1, k]
        u_q, v_q, v_w = u_x * tx - ty, v_x * tx, ground * tx - ty
        F_q, F_w = dF_u * u_q + dF_v * v_q, dF_v * v_w
        T_q = (by_F * (F_u * u_q + F_v * v_q) + (by_change + slope) * F_q
               + (curvature * tx * dF if s.follows_surface else 0.0))
        T_w = by_F * F_v * v_w + (by_change + slope) * F_w + dR_v * tx
        for i in range(m):
            A[m + i, k] += s.rows[j, 1, i] * F_q - s.rows[j, 0, i] * T_q
            A[m + i, m + k] += s.rows[j, 1, i] * F_w - s.rows[j, 0, i] * T_w


@kernel
def add_kinks(
    t: Vector, x: Matrix, s: SystemArrays, onsets: Matrix, h: float, derivatives: int, f: Matrix,
    J: Block, widths: Matrix,
) -> None:
    """Add to rates f (N, d) at samples t (N,), x (N, d) a distance h apart what kinks change.

    ``onsets`` (k, n) are penetrations of the nodes; with ``derivatives`` the Jacobians J (N, d, d)
    change too, and widths (m, N) is filled with what these contain of velocities times derivatives
    through the width w, which stays where velocities change with the period. Nodes of plane bodies
    alone. Friction with memory feels the force of the law.
    """
    if derivatives:
        widths[:, :] = 0.0
    if s.rows.shape[1] > 2 or len(onsets) == 0:
        return
    for n in range(len(t)):
        moved = ground_motion(t[n], s)
        for j in range(len(s.rows)):
            contact = node_contact(j, node_motion(j, x[n], s), moved, s)
            u, v = contact.penetration, contact.rate
            dF, dF_u, dF_v, by_width, far, found = 0.0, 0.0, 0.0, 0.0, 0.0, False
            for k in range(len(onsets)):
                if is_near(u, v, onsets[k, j], h):
                    one, one_u, one_v, one_w, far = kink_change(
                        u, v, onsets[k, j], h, s.normal[j], s.normal_parameters[j])
                    dF, dF_u, dF_v = dF + one, dF_u + one_u, dF_v + one_v
                    by_width, found = by_width + one_w, True
            if found:
                _add_node(j, n, contact, (dF, dF_u, dF_v, by_width), far, s, f[n],
                          J[n] if derivatives else J[0], widths, derivatives != 0)


def kink_onsets(field: ContactField, values: Array, free: int) -> Array:
    """Penetrations (k, n) of the nodes at which normal laws have kinks; k is zero without any.

    Onsets that move with the free parameter are left out, and so are all of solids.
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
    if s.rows.shape[1] > 2:
        return np.zeros((0, n))
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
