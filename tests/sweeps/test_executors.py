"""Worker processes: how they end."""

import os
import time
from collections import deque
from types import SimpleNamespace

from fecontact.sweeps.dispatch import Job, results
from fecontact.sweeps.executors import Processes


def wait_a_little(batch):
    time.sleep(0.01)
    return os.getpid()


def test_workers_that_end_after_an_interruption_leave_no_complaint():
    """Pending calls are not cancelled twice: the thread that manages the processes ends quietly."""
    pool = Processes(2)
    pool.window = 100  # more than the executor hands to its processes
    batch = SimpleNamespace(cases=())
    found = results(deque(Job(wait_a_little, batch) for _ in range(200)), pool)
    next(found)
    found.close()
    managing = pool.executor._executor_manager_thread
    for process in list(pool.executor._processes.values()):
        process.kill()
    # An exception in the thread is a warning, and warnings are errors.
    managing.join(20.0)
    assert not managing.is_alive()
    pool.close(at_once=True)
