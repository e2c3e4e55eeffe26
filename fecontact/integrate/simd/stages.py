"""A step of Rodas5P for eight small systems at once, each with its own time and step.

Coefficients are those of :mod:`fecontact.integrate.rodas5p.tableau`; a stage is reduced to the
size of the modes as in :mod:`fecontact.integrate.rodas5p.stage_solver`.
"""

from fecontact.core.compiled import helper, routine
from fecontact.core.simd.vectors import magnitude, mask_of, read, select, spread, write
from fecontact.integrate.rodas5p.error_control import DEFECT_POINTS, DEFECT_WEIGHTS
from fecontact.integrate.rodas5p.tableau import DENSE, GAMMA, NODES, STAGES, TIME, A, C
from fecontact.integrate.simd import equations


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
                write(work[k, c], select(larger, below, above))
                write(work[i, c], select(larger, above, below))
            for c in range(m):
                above, below = read(inverse[k, c]), read(inverse[i, c])
                write(inverse[k, c], select(larger, below, above))
                write(inverse[i, c], select(larger, above, below))
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
    """Fill ``w.inverse`` with A = G (G^2 - G Jv - Jq)^-1, ``w.stiffness_inverse`` with A Jq.

    With them u_v = inverse r_v + stiffness_inverse r_q solves a stage.
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
            write(w.stiffness_inverse[i, k], total)
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
                      + read(w.stiffness_inverse[row, k]) * read(w.right[k]))
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
    """A step from times t to ``target``, of lengths h: its stages and its end ``w.after``.

    Returns the speed of the ground at the end, and a mask of the lanes in which a normal force has
    another sign at a stage than at the start.
    """
    size = len(progress.state)
    G = 1.0 / (h * GAMMA)
    per_G, per_h = h * GAMMA, 1.0 / h
    speed = read(progress.ground)
    equations.set_derivatives(s, progress.forces, w.by_place, w.by_speed)
    equations.set_time_rate(t, t + 1e-4 * h, speed, s, progress.forces, w.time_rate)
    _set_solver(G, w)
    switched = mask_of(0)
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
            equations.set_rate(w.stage, speed, s, w.load, w.places, w.speeds, w.forces, w.base)
            switched = switched | equations.switches(w.forces, progress.forces)
            for k in range(size):
                write(w.right[k], read(w.right[k]) + read(w.base[k]))
        _solve(i, TIME[i] * h, per_G, w)
    for k in range(size):
        write(w.after[k], read(w.stage[k]) + read(w.stages[STAGES - 1, k]))
    return speed, switched


@helper
def set_dense(w):
    """Fill ``w.dense`` (3, 2 m, 8) with the coefficients of the interpolant."""
    for row in range(3):
        for k in range(w.dense.shape[1]):
            total = spread(0.0)
            for j in range(STAGES):
                total += DENSE[row, j] * read(w.stages[j, k])
            write(w.dense[row, k], total)


@routine
def set_defect(t, h, s, progress, w):
    """Fill ``w.stages[0]`` with the filtered defect of the interpolant.

    See :func:`fecontact.integrate.rodas5p.error_control.defect_error`. What is known of the end of
    the step stays, but for ``w.load``.
    """
    m, speed, rate = len(w.work), read(progress.ground), w.stages[1]
    for k in range(m):
        write(w.right[m + k], read(w.after[m + k]) - read(progress.state[m + k]))
    for point in range(len(DEFECT_POINTS)):
        part = DEFECT_POINTS[point]
        now, weight = t + part * h, DEFECT_WEIGHTS[point] * h
        for k in range(2 * m):
            write(w.stage[k], (1.0 - part) * read(progress.state[k]) + part * (
                read(w.after[k]) + (1.0 - part) * (read(w.dense[0, k]) + part * (
                    read(w.dense[1, k]) + part * read(w.dense[2, k])))))
        equations.set_given(now, s, w.load)
        if s.steady == 0:
            speed = equations.ground_speed(now, s)
        equations.set_rate(w.stage, speed, s, w.load, w.inner[0], w.inner[1], w.inner_forces, rate)
        for k in range(m, 2 * m):
            write(w.right[k], read(w.right[k]) - weight * read(rate[k]))
    G = 1.0 / (h * GAMMA)
    for row in range(m):
        total = spread(0.0)
        for k in range(m):
            total += read(w.inverse[row, k]) * read(w.right[m + k])
        write(w.stages[0, row], total)
        write(w.stages[0, m + row], G * total)
