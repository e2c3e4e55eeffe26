"""Progress bars on a terminal or in a notebook, lines elsewhere, and interruption by Ctrl-C.

Public functions take ``progress``: True for a progress bar, or a callback. Internal functions take
the callback alone and draw nothing.
"""

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from html import escape
from importlib import import_module
from typing import Any, Protocol

from fecontact.core.errors import InputError

PATIENCE = 2.0  # shorter computations show no bar [s]
_PAUSE = 0.1  # between two updates of a bar [s]
LINES = 30.0  # between two lines of output that is not interactive [s]


class Show(Protocol):
    """Callback that takes a title, the completed fraction (0 to 1) and a note beside the bar.

    Without a note, the estimated remaining time is shown.
    """

    def __call__(self, what: str, part: float, note: str = "") -> None:
        """Draw."""


class _Bar(Protocol):
    """Surface that a bar is drawn on."""

    @staticmethod
    def pause() -> float:
        """Least time between two drawings [s]."""
        ...

    def draw(self, what: str, part: float, note: str) -> None: ...

    def clear(self) -> None: ...


@contextmanager
def shown(
    progress: bool | Callable[..., None] | None,
    bar: Callable[[], AbstractContextManager[Callable[..., None]]],
) -> Iterator[Callable[..., None] | None]:
    """Context with the callback for an argument ``progress``, or None.

    Parameters
    ----------
    progress : bool or callable, optional
        True for a bar; a function is used as it is; None or False for none.
    bar : callable
        Makes the bar, as a context manager that yields its callback.

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
        raise InputError(f"progress = {progress!r} must be True, for a bar, or a function to be "
                         f"called with the progress made.")


@contextmanager
def progress_bar(
    what: str, total: float, start: float = 0.0
) -> Iterator[Callable[[float], None]]:
    """Progress bar whose callback takes a value from ``start`` to ``total``."""
    with titled_bar() as show:
        yield lambda done: show(what, (done - start) / (total - start))


@contextmanager
def counting_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Progress bar whose callback takes the numbers of completed and of all items."""
    with titled_bar() as show:
        yield lambda done, total: show(what, done / total)


@contextmanager
def titled_bar() -> Iterator[Show]:
    """Progress bar with changing titles.

    On a terminal or in a notebook it appears after two seconds and is removed at the end.
    Elsewhere, as in a batch job or a log, a line is printed on stderr every 30 seconds.
    """
    bar: _Bar | None = None
    kind = _kind() or _Lines
    begin = latest = since = time.perf_counter()
    title, first = "", 0.0

    def show(what: str, part: float, note: str = "") -> None:
        nonlocal bar, latest, since, title, first
        now = time.perf_counter()
        if what != title:
            title, since, first = what, now, part
        if kind is not None and now - begin > PATIENCE and now - latest > kind.pause():
            latest, bar = now, bar or kind()
            bar.draw(what, part, note or _left(part, first, now - since))

    try:
        yield show
    finally:
        if bar is not None:
            bar.clear()


def say(text: str) -> None:
    """Print a line on stderr, where a bar would be drawn: on a terminal or in a notebook."""
    if _kind() is not None:
        line(text)


_said: set[str] = set()


@contextmanager
def said_if_slow(text: str, applies: Callable[[], bool]) -> Iterator[None]:
    """Print a line on stderr, as :func:`say`, once what follows has taken two seconds.

    A line is printed once in a process, and only if it ``applies`` then.
    """
    if text in _said:
        yield
        return

    def tell() -> None:
        if text not in _said and applies():
            _said.add(text)
            say(text)

    with after_patience(tell):
        yield


@contextmanager
def after_patience(call: Callable[[], object]) -> Iterator[None]:
    """Call a function from another thread once what follows has taken two seconds."""
    timer = threading.Timer(PATIENCE, call)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()


def clock(seconds: float) -> str:
    """``1:05``, ``2:03:04``."""
    whole = round(seconds)
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


def _left(part: float, first: float, passed: float) -> str:
    """Estimated remaining time, from the rate since the fraction ``first``."""
    return f"{clock(passed * (1.0 - part) / (part - first))} left" if part > first else ""


def _kind() -> type[_Bar] | None:
    """Class of the bar for the output of this process; None if it is not interactive."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if getattr(shell, "kernel", None) is not None:
        return _NotebookBar
    return _TerminalBar if on_terminal() else None


def on_terminal() -> bool:
    """True if stderr is a terminal; False also where it is closed."""
    return sys.stderr is not None and not sys.stderr.closed and sys.stderr.isatty()


class _TerminalBar:
    """A line of a terminal, on stderr."""

    @staticmethod
    def pause() -> float:
        """Least time between two drawings [s]."""
        return _PAUSE

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


class _Lines:
    """Lines on stderr, for batch jobs and logs."""

    @staticmethod
    def pause() -> float:
        """Least time between two lines [s]."""
        return LINES

    def draw(self, what: str, part: float, note: str) -> None:
        line(f"{what}: {100.0 * min(max(part, 0.0), 1.0):.0f} %" + f", {note}" * bool(note))

    def clear(self) -> None:
        """Lines stay."""


def line(text: str) -> None:
    """Print a line on stderr; without effect if stderr is closed."""
    with suppress(OSError, ValueError):
        if sys.stderr is not None:
            print(text, file=sys.stderr, flush=True)


class _NotebookBar:
    """An output of a notebook cell, in HTML and as text.

    The bars of rich need ipywidgets in a notebook; this one needs only IPython.
    """

    @staticmethod
    def pause() -> float:
        """Least time between two drawings [s]."""
        return _PAUSE

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


@contextmanager
def held_back_interrupt() -> Iterator[Callable[[], None]]:
    """Yield a function that raises KeyboardInterrupt if Ctrl-C was pressed within the block.

    For libraries that swallow exceptions raised in callbacks, or are left in an inconsistent state
    by them. If Ctrl-C is ignored, it stays ignored.
    """
    came: list[int] = []

    def check() -> None:
        if came:
            raise KeyboardInterrupt

    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield check
        return
    signal.signal(signal.SIGINT, lambda number, frame: came.append(number))
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
