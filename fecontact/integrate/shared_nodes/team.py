"""Parts of the contact nodes of a large system, which threads may share; see ``node_work``."""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.records import IntegerVector, Matrix, Vector

# Nodes that are near the other side are shared from so many on, in an even number of parts, of at
# least so many each where there are more than two: loops over fewer nodes cost more.
SHARED_FROM, _IN_PART = 256, 250
_MOST_PARTS, MOST_OF_MODES = 16, 4
# Parts begin at multiples of this, the numbers of a vector instruction.
_TOGETHER = 8


class Team(NamedTuple):
    """What threads that share the nodes of a run work with; results do not depend on their number.

    Attributes
    ----------
    words : (w,) integer array
        What they tell each other, and how to wait; see ``tasks``.
    numbers : (3,) array
        What a task needs to know.
    sums : (p, k) array
        Sums over the nodes of each part: of modal forces, or of powers.
    most : int
        Largest number of parts p; zero if nothing is shared.
    helpers : int
        Threads besides that of the run.
    share, work : int
        Addresses of what does a task, and of what does a part of it.
    """

    words: IntegerVector
    numbers: Vector
    sums: Matrix
    most: int
    helpers: int
    share: int
    work: int


ALONE = Team(np.zeros(1, dtype=np.int64), np.zeros(1), np.zeros((1, 1)), 0, 0, 0, 0)


@helper
def _parts(nodes):
    return 2 * max(1, min(_MOST_PARTS // 2, nodes // (2 * _IN_PART)))


def parts_for(nodes: int) -> int:
    """Largest number of parts of the nodes of a system; zero if they are not shared."""
    return int(_parts.py_func(nodes)) if nodes >= SHARED_FROM else 0


@helper
def shares(room):
    """Whether the nodes that are near are so many that they are shared."""
    return room.team.most > 0 and room.near.used[0] >= SHARED_FROM


@helper
def parts_of(room):
    """Number of parts of the near nodes, whoever works on them."""
    return _parts(room.near.used[0])


@helper
def parts_of_modes(room):
    """Number of parts of the modes that products are shared by: they give the same numbers."""
    if room.team.helpers == 0:
        return 1
    return max(1, min(MOST_OF_MODES, len(room.near.shapes) // 8))


@helper
def ends_of(part, parts, used):
    """First and last place of a part of the near nodes."""
    begin, end = used * part // parts, used * (part + 1) // parts
    return (begin // _TOGETHER * _TOGETHER,
            used if part + 1 == parts else end // _TOGETHER * _TOGETHER)
