"""Threads that help with the contact nodes of a run."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread
from typing import Any

from fecontact.integrate.shared_nodes.tasks import LEAVE
from fecontact.integrate.shared_nodes.team import MOST_OF_MODES, parts_for

# Threads, beyond which more hardly help: a tenth of a step is not shared.
_MOST = 4


def workers_for(nodes: int, workers: int | None) -> int:
    """Number of threads that share so many contact nodes; by default where several pay.

    Where programs shall have one thread each, by ``OMP_NUM_THREADS``, it is one. More than there
    are parts would find nothing to do, and their looks for it could fill the ticket of a task.
    """
    parts = parts_for(nodes)
    if not parts:
        return 1
    if workers is None:
        return min(parts, _MOST, _allowed())
    return min(workers, max(parts, MOST_OF_MODES))


def _allowed() -> int:
    """Cores of this process, or fewer threads by ``OMP_NUM_THREADS``."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (
        os.cpu_count() or 1)
    # The first number of a list is that of threads which have no others.
    given = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
    return min(cores, int(given)) if given.isdecimal() and int(given) else cores


@contextmanager
def assisted(problem: Any, progress: Any, room: Any) -> Iterator[None]:
    """Within the block, steps of the run with these arrays have the helpers of its team."""
    if not room.team.helpers:
        yield
        return
    # Compiled for runs that need it only.
    from fecontact.integrate.shared_nodes.node_work import assist

    words, helpers = room.team.words, []
    words[LEAVE] = 0
    try:
        for _ in range(room.team.helpers):
            helper = Thread(target=assist, args=(problem, progress, room))
            try:
                helper.start()
            except RuntimeError:  # no more threads: the run does without
                break
            helpers.append(helper)
        yield
    finally:
        # If even this is interrupted, they leave on their own when nothing is to be done.
        words[LEAVE] = 1
        for helper in helpers:
            helper.join()
