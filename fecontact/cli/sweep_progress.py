"""How far a sweep is, on a terminal: a bar, the rate, the time left."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from fecontact.cli.console import PATIENCE


@contextmanager
def sweep_bar() -> Iterator[Callable[[int, int, int], None]]:
    """A function that is told how many cases are done, failed and there are at all."""
    if not sys.stderr.isatty():
        yield lambda done, failed, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    bar = Progress(TextColumn("Sweeping"), BarColumn(), MofNCompleteColumn(),
                   TextColumn("{task.fields[note]}"), console=Console(stderr=True), transient=True)
    task = bar.add_task("", total=None, note="")
    begin = time.perf_counter()
    first: int | None = None

    def show(done: int, failed: int, total: int) -> None:
        nonlocal first
        # Cases of an earlier sweep took no time.
        first = done if first is None else first
        passed = time.perf_counter() - begin
        if passed > PATIENCE:
            bar.start()
            bar.update(task, completed=done, total=total,
                       note=note(done, failed, total, first, passed))

    try:
        yield show
    finally:
        bar.stop()


def note(done: int, failed: int, total: int, first: int, passed: float) -> str:
    """``12.3 cases/s, 1:05 left, 2 failed``, after ``passed`` seconds from ``first`` cases on."""
    if done <= first:
        return "starting"
    rate = (done - first) / passed
    parts = [f"{rate:.3g} cases/s" if rate >= 1.0 else f"{1.0 / rate:.3g} s a case",
             f"{clock((total - done) / rate)} left"]
    return ", ".join(parts + ([f"{failed} failed"] if failed else []))


def clock(seconds: float) -> str:
    """``1:05``, ``2:03:04``."""
    whole = round(seconds)
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"
