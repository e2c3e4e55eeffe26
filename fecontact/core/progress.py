"""Progress bars: drawn on a terminal or in a notebook, and nowhere else.

A computation takes ``progress``, which is True for a bar of its own or a function that is told how
far it is. Functions further down take the function alone, and draw nothing.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from html import escape
from importlib import import_module
from typing import Any, Protocol

from fecontact.core.errors import InputError

PATIENCE = 2.0  # nothing is shown of work that takes less [s]
_PAUSE = 0.1  # between two drawings [s]


class Show(Protocol):
    """Told what is being done, which part of it is done (0 to 1), and what to write beside it.

    An empty note stands for the time that is left.
    """

    def __call__(self, what: str, part: float, note: str = "") -> None:
        """Draw."""


class _Bar(Protocol):
    """What a bar is drawn on."""

    def draw(self, what: str, part: float, note: str) -> None: ...

    def clear(self) -> None: ...


@contextmanager
def shown(
    progress: bool | Callable[..., None] | None,
    bar: Callable[[], AbstractContextManager[Callable[..., None]]],
) -> Iterator[Callable[..., None] | None]:
    """The function that a computation tells how far it is, for its argument ``progress``.

    Parameters
    ----------
    progress : bool or callable, optional
        True for a bar; a function is handed on as it is; else there is nobody to tell.
    bar : callable
        Makes the bar, as a context manager that gives the function to call.

    Raises
    ------
    InputError
        If ``progress`` is none of these.
    """
    if progress is None or progress is False:
        yield None
    elif progress is True:
        with bar() as tell:
            yield tell
    elif callable(progress):
        yield progress
    else:
        raise InputError(f"progress = {progress!r} must be True, for a bar, or a function that is "
                         f"told how far the work is.")


@contextmanager
def progress_bar(
    what: str, total: float, start: float = 0.0
) -> Iterator[Callable[[float], None]]:
    """A function that is told how far the work is, from ``start`` to ``total``."""
    with titled_bar() as show:
        yield lambda done: show(what, (done - start) / (total - start))


@contextmanager
def counting_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A function that is told how many things are done, and how many there are."""
    with titled_bar() as show:
        yield lambda done, total: show(what, done / total)


@contextmanager
def titled_bar() -> Iterator[Show]:
    """A function that draws how far work is on a terminal or in a notebook, if there is one.

    Nothing is drawn in the first two seconds, and nothing is left at the end.
    """
    kind = _kind()
    bar: _Bar | None = None
    begin = latest = since = time.perf_counter()
    title, first = "", 0.0

    def show(what: str, part: float, note: str = "") -> None:
        nonlocal bar, latest, since, title, first
        now = time.perf_counter()
        if what != title:
            title, since, first = what, now, part
        if kind is not None and now - begin > PATIENCE and now - latest > _PAUSE:
            latest, bar = now, bar or kind()
            bar.draw(what, part, note or _left(part, first, now - since))

    try:
        yield show
    finally:
        if bar is not None:
            bar.clear()


def clock(seconds: float) -> str:
    """``1:05``, ``2:03:04``."""
    whole = round(seconds)
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


def _left(part: float, first: float, passed: float) -> str:
    """The time left, if work goes on as it did from its part ``first`` on."""
    return f"{clock(passed * (1.0 - part) / (part - first))} left" if part > first else ""


def _kind() -> Callable[[], _Bar] | None:
    """The bar that suits where the process writes to, or None if nobody would see it."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if getattr(shell, "kernel", None) is not None:
        return _NotebookBar
    return _TerminalBar if sys.stderr is not None and sys.stderr.isatty() else None


class _TerminalBar:
    """A line of a terminal, on stderr."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        self._bar = Progress(
            TextColumn("{task.description}", markup=False), BarColumn(),
            TextColumn("{task.percentage:.0f} %"), TextColumn("{task.fields[note]}", markup=False),
            console=Console(stderr=True), transient=True, auto_refresh=False)
        self._task = self._bar.add_task("", total=1.0, note="")

    def draw(self, what: str, part: float, note: str) -> None:
        self._bar.start()
        self._bar.update(self._task, description=what, completed=part, note=note,
                         refresh=True)

    def clear(self) -> None:
        self._bar.stop()


class _NotebookBar:
    """An output of a notebook's cell, in HTML and as text.

    The bars of rich need ipywidgets in a notebook; this one asks only for IPython, which is there.
    """

    def __init__(self) -> None:
        self._handle: Any = None

    def draw(self, what: str, part: float, note: str) -> None:
        percent = f"{100.0 * min(max(part, 0.0), 1.0):.0f}"
        self._set({
            "text/plain": f"{what} {percent} % {note}".rstrip(),
            "text/html": f'{escape(what)} <progress value="{percent}" max="100"></progress> '
                         f"{percent} % {escape(note)}".rstrip()})

    def clear(self) -> None:
        self._set({"text/plain": "", "text/html": ""})

    def _set(self, shapes: dict[str, str]) -> None:
        if self._handle is None:
            display = import_module("IPython.display").display
            self._handle = display(shapes, raw=True, display_id=True)
        else:
            self._handle.update(shapes, raw=True)
