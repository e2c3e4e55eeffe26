"""Worker processes: how they end. Servers that are no Dask schedulers."""

import os
import socket
import threading
import time
from collections import deque
from types import SimpleNamespace

import pytest

from fecontact.core.errors import InputError
from fecontact.sweeps.dispatch import Job, results
from fecontact.sweeps.executors import Processes, dask_executor


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


@pytest.mark.parametrize("answer", [None, b"HTTP/1.1 400 Bad Request\r\n\r\n", bytes(8000)])
def test_a_server_that_is_no_scheduler_is_not_waited_for(answer):
    pytest.importorskip("distributed")
    with socket.create_server(("127.0.0.1", 0)) as server:
        kept = []

        def serve():
            while True:
                try:
                    kept.append(server.accept()[0])
                except OSError:
                    return
                if answer is not None:
                    kept[-1].sendall(answer)

        threading.Thread(target=serve, daemon=True).start()
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with (
            pytest.raises(InputError, match=f"No Dask scheduler answers at {address} within"),
            dask_executor(address, timeout=0.5),
        ):
            pass
        server.shutdown(socket.SHUT_RDWR)
        for one in kept:
            one.close()
