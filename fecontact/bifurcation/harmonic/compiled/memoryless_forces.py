"""Plain contact forces of a motion: of displacements and velocities alone, over all samples.

Plain are nodes of plane bodies on level ground of constant speed, friction without memory. Their
motion, forces and derivatives are rows over the samples, so that laws are called one after the
other and all else is done on whole rows.
"""

import numpy as np

from fecontact.bifurcation.harmonic.compiled.kinks import changes_near
from fecontact.core.compiled import helper, routine
from fecontact.laws.signatures import ground_at
from fecontact.system.node_forces import normal_force, plane_friction
from fecontact.system.nodes import ground_motion
from fecontact.system.polynomial_forces import (
    add_polynomial,
    add_polynomial_forces,
    add_polynomial_stiffness,
    has_polynomial,
)


@helper
def combine(table, factors, count, row):
    """Fill a row (N,) with the sum of factors times the first rows of a table."""
    N = len(row)
    for n in range(N):
        row[n] = 0.0
    for k in range(0, count - count % 4, 4):
        a, b, c, d = factors[k], factors[k + 1], factors[k + 2], factors[k + 3]
        t0, t1, t2, t3 = table[k], table[k + 1], table[k + 2], table[k + 3]
        for n in range(N):
            row[n] += a * t0[n] + b * t1[n] + c * t2[n] + d * t3[n]
    for k in range(count - count % 4, count):
        a, t0 = factors[k], table[k]
        for n in range(N):
            row[n] += a * t0[n]


@helper
def project(table, row, out):
    """Fill out (L,) with the products of the rows of a table (L, N) with a row (N,)."""
    L, N = len(out), len(row)
    for k in range(0, L - L % 4, 4):
        t0, t1, t2, t3 = table[k], table[k + 1], table[k + 2], table[k + 3]
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for n in range(N):
            x = row[n]
            a += t0[n] * x
            b += t1[n] * x
            c += t2[n] * x
            d += t3[n] * x
        out[k], out[k + 1], out[k + 2], out[k + 3] = a, b, c, d
    for k in range(L - L % 4, L):
        t0, a = table[k], 0.0
        for n in range(N):
            a += t0[n] * row[n]
        out[k] = a


@helper
def _node_motion(j, e):
    """Fill the rows of the height of node j, its rate and its slip velocity."""
    s, motion, node = e.contact, e.workspace.motion, e.workspace.node
    m, N = e.springs.shape[1], len(e.tau)
    for n in range(N):
        node[0, n], node[1, n], node[2, n] = 0.0, 0.0, 0.0
    slip = -s.sliding[j, 0, 0] * ground_motion(0.0, s).speed
    for n in range(N):
        node[2, n] = slip
    for i in range(m):
        tx, ty = s.rows[j, 0, i], s.rows[j, 1, i]
        for n in range(N):
            node[0, n] += ty * motion[i, n]
            node[1, n] += ty * motion[m + i, n]
            node[2, n] += tx * motion[m + i, n]


@helper
def _near_kinks(j, level, h, e):
    """Add to the rows of the normal force of node j what its kinks between samples change.

    Row 1, of the rate, becomes 1, or -1 where the force changes its sign thereby; row 8 is the part
    of velocities times derivatives that is due to the width of kinks.
    """
    s, node = e.contact, e.workspace.node
    for n in range(len(e.tau)):
        change, found = changes_near(level - node[0, n], -node[1, n], e.onsets, h, j, s)
        F, F_u, F_v, node[8, n], far = change
        node[3, n] += F
        node[4, n] -= F_u
        node[5, n] -= F_v
        node[1, n] = -1.0 if found and node[3, n] * far < 0.0 else 1.0


@routine
def _add_polynomial(derivatives, e):
    """Add polynomial forces to ``contact_forces`` (m, N), and their derivatives to ``rows``."""
    workspace, s = e.workspace, e.contact
    m, N = e.springs.shape[1], len(e.tau)
    x, force = np.empty(m), np.empty(m)
    gradient, stiffness = np.empty_like(s.polynomial_rows), np.empty((m, m))
    for n in range(N):
        for i in range(m):
            x[i], force[i] = workspace.motion[i, n], 0.0
        if not derivatives:
            add_polynomial_forces(x, s, force)
        else:
            add_polynomial(x, s, gradient, force)
            stiffness[:] = 0.0
            add_polynomial_stiffness(-1.0, gradient, s, stiffness)
            for i in range(m):
                for k in range(m):
                    workspace.rows[i * m + k, n] += stiffness[i, k]
        for i in range(m):
            workspace.contact_forces[i, n] += force[i]


@routine
def memoryless_forces(derivatives, h, e):
    """Fill ``contact_forces`` (m, N) from ``motion``, and ``rows`` of derivatives if asked for.

    Row (part m + i) m + k of these is that of force i to displacement (part 0) or velocity k.
    h [s] is the distance of samples.
    """
    workspace, s = e.workspace, e.contact
    m, N = e.springs.shape[1], len(e.tau)
    contact_forces, rows, node = workspace.contact_forces, workspace.rows, workspace.node
    for i in range(m):
        for n in range(N):
            contact_forces[i, n] = 0.0
    if derivatives:
        for i in range(m):
            for n in range(N):
                workspace.widths[i, n] = 0.0
        for p in range(2 * m * m):
            for n in range(N):
                rows[p, n] = 0.0
    if has_polynomial(s):
        _add_polynomial(derivatives, e)
    for j in range(len(s.rows)):
        _node_motion(j, e)
        level = -s.gap[j]
        if s.on_ground[j]:
            level += ground_at(s.profile)(s.places[j, 0], s.profile_parameters)[0]
        has_friction = False
        for i in range(m):
            has_friction = has_friction or s.rows[j, 0, i] != 0.0
        # Derivatives of the normal force to height and rate, of friction to slip and normal force.
        for n in range(N):
            F, F_u, F_v = normal_force(j, level - node[0, n], -node[1, n], s)
            if F == 0.0:
                F_u, F_v = 0.0, 0.0
            node[3, n], node[4, n], node[5, n] = F, -F_u, -F_v
        if len(e.onsets) > 0:
            _near_kinks(j, level, h, e)
        if has_friction:
            for n in range(N):
                F, R, R_v, R_F = node[3, n], 0.0, 0.0, 0.0
                if F != 0.0:
                    R, R_v, R_F = plane_friction(j, node[2, n], abs(F), s)
                side = node[1, n] if len(e.onsets) > 0 else 1.0
                node[0, n], node[6, n] = side * R, side * R_v
                node[7, n] = side * (R_F if F >= 0.0 else -R_F)
        for i in range(m):
            tx, ty = s.rows[j, 0, i], s.rows[j, 1, i]
            for n in range(N):
                contact_forces[i, n] += ty * node[3, n]
            if has_friction:
                for n in range(N):
                    contact_forces[i, n] -= tx * node[0, n]
            if not derivatives:
                continue
            if len(e.onsets) > 0:
                for n in range(N):
                    ratio = node[7, n] if has_friction else 0.0
                    workspace.widths[i, n] += (ty - tx * ratio) * node[8, n]
            for k in range(m):
                by, sx = s.rows[j, 1, k], tx * s.rows[j, 0, k]
                q, v = rows[i * m + k], rows[(m + i) * m + k]
                for n in range(N):
                    q[n] += ty * by * node[4, n]
                    v[n] += ty * by * node[5, n]
                if has_friction:
                    for n in range(N):
                        q[n] -= tx * by * node[7, n] * node[4, n]
                        v[n] -= tx * by * node[7, n] * node[5, n] + sx * node[6, n]
