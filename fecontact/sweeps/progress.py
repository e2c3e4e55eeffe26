"""Progress bar of a sweep: rate of cases, remaining time, failures."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from fecontact.core.progress import clock, titled_bar


@contextmanager
def sweep_bar() -> Iterator[Callable[[int, int, int], None]]:
    """Callback for the numbers of finished, failed and all cases, which draws the bar."""
    begin = time.perf_counter()
    first: int | None = None

    def tell(done: int, failed: int, total: int) -> None:
        nonlocal first
        # Cases of an earlier sweep do not count towards the rate.
        first = done if first is None else first
        show(f"Sweeping {done}/{total}", done / max(total, 1),
             note(done, failed, total, first, time.perf_counter() - begin))

    with titled_bar() as show:
        yield tell


def note(done: int, failed: int, total: int, first: int, passed: float) -> str:
    """``12.3 cases/s, 1:05 left, 2 failed``, after ``passed`` seconds from ``first`` cases on."""
    if done <= first:
        return "starting"
    rate = (done - first) / passed
    parts = [f"{rate:.3g} cases/s" if rate >= 1.0 else f"{1.0 / rate:.3g} s a case",
             f"{clock((total - done) / rate)} left"]
    return ", ".join(parts + ([f"{failed} failed"] if failed else []))
