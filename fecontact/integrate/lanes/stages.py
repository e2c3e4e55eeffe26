"""A step of Rodas5P for eight small systems at once, each with its own time and step.

Coefficients are those of :mod:`fecontact.integrate.rodas5p.tableau`; a stage is reduced to the
size of the modes as in :mod:`fecontact.integrate.rodas5p.stage_solver`.
"""

from fecontact.core.compiled import helper, routine
from fecontact.core.lanes.vectors import chosen, magnitude, read, spread, write
from fecontact.integrate.lanes import equations
from fecontact.integrate.rodas5p.tableau import DENSE, GAMMA, NODES, STAGES, TIME, A, C


@routine
def _set_inverse(work, inverse):
    """Fill the inverse (m, m, 8) of ``work``, which is overwritten.

    Gauss-Jordan elimination with row interchanges, lane by lane by selection.
    """
    m = len(work)
    for i in range(m):
        for k in range(m):
            write(inverse[i, k], spread(1.0 if i == k else 0.0))
    for k in range(m):
        for i in range(k + 1, m):
            larger = magnitude(read(work[i, k])) > magnitude(read(work[k, k]))
            for c in range(k, m):
                above, below = read(work[k, c]), read(work[i, c])
                write(work[k, c], chosen(larger, below, above))
                write(work[i, c], chosen(larger, above, below))
            for c in range(m):
                above, below = read(inverse[k, c]), read(inverse[i, c])
                write(inverse[k, c], chosen(larger, below, above))
                write(inverse[i, c], chosen(larger, above, below))
        pivot = 1.0 / read(work[k, k])
        for c in range(k + 1, m):
            write(work[k, c], read(work[k, c]) * pivot)
        for c in range(m):
            write(inverse[k, c], read(inverse[k, c]) * pivot)
        for i in range(m):
            if i != k:
                factor = read(work[i, k])
                for c in range(k + 1, m):
                    write(work[i, c], read(work[i, c]) - factor * read(work[k, c]))
                for c in range(m):
                    write(inverse[i, c], read(inverse[i, c]) - factor * read(inverse[k, c]))


@helper
def _set_solver(G, w):
    """Fill ``w.inverse`` with G (G^2 - G Jv - Jq)^-1 and ``w.answers`` with that matrix times Jq.

    With them u_v = inverse r_v + answers r_q solves a stage.
    """
    m = len(w.work)
    for i in range(m):
        for k in range(m):
            total = -G * read(w.by_speed[i, k]) - read(w.by_place[i, k])
            write(w.work[i, k], total + G * G if i == k else total)
    _set_inverse(w.work, w.inverse)
    for i in range(m):
        for k in range(m):
            total = spread(0.0)
            for c in range(m):
                total += read(w.inverse[i, c]) * read(w.by_place[c, k])
            write(w.answers[i, k], total)
    for i in range(m):
        for k in range(m):
            write(w.inverse[i, k], G * read(w.inverse[i, k]))


@routine
def _solve(i, h_part, per_G, w):
    """Stage i for the right side w.right (2 m, 8), to which time rates are added."""
    m = len(w.work)
    u = w.stages[i]
    for k in range(m):
        write(w.right[m + k], read(w.right[m + k]) + h_part * read(w.time_rate[k]))
    for row in range(m):
        total = spread(0.0)
        for k in range(m):
            total += (read(w.inverse[row, k]) * read(w.right[m + k])
                      + read(w.answers[row, k]) * read(w.right[k]))
        write(u[m + row], total)
        write(u[row], (read(w.right[row]) + total) * per_G)


@helper
def _combine(i, per_h, state, w):
    """Fill ``w.stage`` with the state of stage i, and ``w.right`` with what stages add to f."""
    for k in range(len(state)):
        place, push = spread(0.0), spread(0.0)
        for j in range(i):
            known = read(w.stages[j, k])
            place += A[i, j] * known
            push += C[i, j] * known
        write(w.stage[k], read(state[k]) + place)
        write(w.right[k], push * per_h)


@routine
def step(t, h, target, s, progress, w):
    """A step from times t to ``target``, of lengths h: its stages and its end ``w.after``."""
    size = len(progress.state)
    G = 1.0 / (h * GAMMA)
    per_G, per_h = h * GAMMA, 1.0 / h
    speed = read(progress.ground)
    equations.set_derivatives(s, progress.forces, w.by_place, w.by_speed)
    equations.set_time_rate(t, t + 1e-4 * h, speed, s, progress.forces, w.time_rate)
    _set_solver(G, w)
    for i in range(STAGES):
        if i == 0:
            for k in range(size):
                write(w.right[k], read(progress.rate[k]))
        else:
            if i < 6:
                now = target if i == 5 else t + NODES[i] * h
                equations.set_given(now, s, w.load)
                if s.steady == 0:
                    speed = equations.ground_speed(now, s)
            _combine(i, per_h, progress.state, w)
            equations.set_rate(w.stage, speed, s, w.load, w.places, w.speeds, w.base)
            for k in range(size):
                write(w.right[k], read(w.right[k]) + read(w.base[k]))
        _solve(i, TIME[i] * h, per_G, w)
    for k in range(size):
        write(w.after[k], read(w.stage[k]) + read(w.stages[STAGES - 1, k]))
    return speed


@helper
def set_dense(w):
    """Fill ``w.dense`` (3, 2 m, 8) with the coefficients of the interpolant."""
    for row in range(3):
        for k in range(w.dense.shape[1]):
            total = spread(0.0)
            for j in range(STAGES):
                total += DENSE[row, j] * read(w.stages[j, k])
            write(w.dense[row, k], total)
