"""Elimination with row interchanges of eight matrices of the same size at once, one in each lane.

Each interval of an orbit gives a matrix of some ten to a hundred rows, too small for vector
instructions to pay; eight of them side by side are not. This takes 1.7 times less time than
:mod:`fecontact.core.dense_lu` for eight matrices of 8 rows, 2.5 times for 16 rows and 3.5 times
for 48. What is left in place of a matrix is the same; arrays have a last axis of eight lanes.
"""

from fecontact.core.compiled import helper
from fecontact.core.simd.kinds import WIDTH
from fecontact.core.simd.vectors import read, select, spread, write


@helper
def _with_pivot(a, k, order, workspace):
    """Move the largest entry of column k to row k in each lane; returns and stores its inverse."""
    rows, columns, _ = a.shape
    largest, place = abs(read(a[k, k])), spread(float(k))
    for i in range(k + 1, rows):
        size = abs(read(a[i, k]))
        above = size > largest
        place = select(above, float(i), place)
        largest = select(above, size, largest)
    write(workspace, place)
    row, same = int(workspace[0]), True
    for lane in range(1, WIDTH):
        same = same and workspace[lane] == workspace[0]
    if same and row != k:
        for c in range(columns):
            above = read(a[k, c])
            write(a[k, c], read(a[row, c]))
            write(a[row, c], above)
    for lane in range(WIDTH):
        row = int(workspace[lane])
        if row != k:
            order[k, lane], order[row, lane] = order[row, lane], order[k, lane]
            if not same:
                for c in range(columns):
                    a[k, c, lane], a[row, c, lane] = a[row, c, lane], a[k, c, lane]
    inverse = spread(1.0) / read(a[k, k])
    write(a[k, k], inverse)
    return inverse


@helper
def eliminate_simd(a, count, order, workspace):
    """Eliminate the first columns of a (rows, columns, 8); ``order`` (rows, 8) is filled.

    ``order`` says which row came to each place; ``workspace`` (8,) is overwritten. Four columns are
    eliminated from the rows below at once: less is read and written.
    """
    rows, columns, _ = a.shape
    for i in range(rows):
        for lane in range(WIDTH):
            order[i, lane] = i
    for first in range(0, count, 4):
        last = min(first + 4, count)
        for k in range(first, last):
            inverse = _with_pivot(a, k, order, workspace)
            for i in range(k + 1, rows):
                factor = read(a[i, k]) * inverse
                write(a[i, k], factor)
                for c in range(k + 1, last):
                    write(a[i, c], read(a[i, c]) - factor * read(a[k, c]))
        for k in range(first + 1, last):
            for above in range(first, k):
                factor = read(a[k, above])
                for c in range(last, columns):
                    write(a[k, c], read(a[k, c]) - factor * read(a[above, c]))
        i = last
        while last - first == 4 and i + 1 < rows:
            k, low = first, i + 1
            f0, f1, f2, f3 = (read(a[i, k]), read(a[i, k + 1]), read(a[i, k + 2]),
                              read(a[i, k + 3]))
            g0, g1, g2, g3 = (read(a[low, k]), read(a[low, k + 1]), read(a[low, k + 2]),
                              read(a[low, k + 3]))
            for c in range(last, columns):
                p0, p1, p2, p3 = (read(a[k, c]), read(a[k + 1, c]), read(a[k + 2, c]),
                                  read(a[k + 3, c]))
                write(a[i, c], read(a[i, c]) - f0 * p0 - f1 * p1 - f2 * p2 - f3 * p3)
                write(a[low, c], read(a[low, c]) - g0 * p0 - g1 * p1 - g2 * p2 - g3 * p3)
            i += 2
        while i < rows:
            for k in range(first, last):
                factor = read(a[i, k])
                for c in range(last, columns):
                    write(a[i, c], read(a[i, c]) - factor * read(a[k, c]))
            i += 1


@helper
def reduce_row_simd(a, count, row, weights):
    """Eliminate the first entries of a further row (columns, 8)."""
    columns = len(row)
    for k in range(count):
        factor = read(row[k]) * read(a[k, k])
        write(weights[k], factor)
        for c in range(k + 1, columns):
            write(row[c], read(row[c]) - factor * read(a[k, c]))


@helper
def forward_simd(a, count, r):
    """Reduce a right side r (rows, 8) whose rows are in their ``order`` already."""
    rows = len(r)
    for k in range(count):
        known = read(r[k])
        for i in range(k + 1, rows):
            write(r[i], read(r[i]) - read(a[i, k]) * known)


@helper
def forward_lanes_transposed(a, count, r):
    """The transpose of :func:`forward_simd`."""
    rows = len(r)
    for k in range(count - 1, -1, -1):
        total = read(r[k])
        for i in range(k + 1, rows):
            total = total - read(a[i, k]) * read(r[i])
        write(r[k], total)


@helper
def back_simd(a, count, r, known):
    """Back-substitution of r (count, 8): fill known[:count] (.., 8) from its other entries."""
    width = len(known)
    for i in range(count):
        total, other = read(r[i]), spread(0.0)
        c = count
        while c + 1 < width:
            total = total - read(a[i, c]) * read(known[c])
            other = other - read(a[i, c + 1]) * read(known[c + 1])
            c += 2
        if c < width:
            total = total - read(a[i, c]) * read(known[c])
        write(known[i], total + other)
    for k in range(count - 1, -1, -1):
        found = read(known[k]) * read(a[k, k])
        write(known[k], found)
        for i in range(k):
            write(known[i], read(known[i]) - read(a[i, k]) * found)
