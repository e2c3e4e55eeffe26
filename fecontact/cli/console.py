"""Console output of commands, and the signals that end them."""

import os
import re
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

from fecontact.core.progress import PATIENCE

INTERRUPTED = 130  # exit code after Ctrl-C
_ENDING = ("SIGTERM", "SIGHUP")
_ended_by: list[int] = []  # the first of these signals that came


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """Show on a terminal, from two seconds on, that work is going on that cannot be measured."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    status = Console(stderr=True).status(f"{what} ...")
    timer = threading.Timer(PATIENCE, status.start)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        status.stop()


@contextmanager
def loading() -> Iterator[None]:
    """Load and compile the package: as :func:`waiting`, and Ctrl-C ends the process at once.

    An exception would be lost in the callbacks of the compiler. Nothing is written meanwhile.
    """
    def leave(*_: object) -> None:
        os.write(sys.stderr.fileno(), b"error: interrupted.\n")
        os._exit(interrupted_code())

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, leave)
    try:
        with waiting("Loading, and compiling after changes"):
            yield
    finally:
        signal.signal(signal.SIGINT, before)


def interrupted_code() -> int:
    """Exit code of a command that was interrupted: 130 after Ctrl-C, else 128 and the signal."""
    return 128 + _ended_by[0] if _ended_by else INTERRUPTED


@contextmanager
def ending_signals() -> Iterator[None]:
    """Let SIGTERM and SIGHUP do what Ctrl-C does, whatever that is at the time.

    Batch systems and closing terminals send them, more than once: the first counts, so that what
    is then written is not interrupted in turn. Signals that are ignored, as by nohup, stay so.
    """
    def end(number: int, frame: FrameType | None) -> None:
        if _ended_by:
            return
        _ended_by.append(number)
        if number != signal.SIGTERM:
            _leave_terminal(terminals)
        interrupt = signal.getsignal(signal.SIGINT)
        if callable(interrupt):
            interrupt(number, frame)
        else:  # Ctrl-C is ignored by what a shell runs in the background
            raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    terminals = [descriptor for descriptor in (1, 2) if os.isatty(descriptor)]
    before = {number: signal.getsignal(number) for name in _ENDING
              if (number := getattr(signal, name, None)) is not None}
    taken = [number for number, handler in before.items() if handler is signal.SIG_DFL]
    _ended_by.clear()
    try:
        for number in taken:
            signal.signal(number, end)
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)
        _ended_by.clear()


def _leave_terminal(descriptors: list[int]) -> None:
    """Write no longer to a terminal that has been closed, which would be an error."""
    with suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for descriptor in descriptors:
            os.dup2(nowhere, descriptor)
        os.close(nowhere)


_LONGEST = 300  # letters of a word in a message

def show(renderable: Any) -> None:
    """Print a table."""
    from rich.console import Console

    Console().print(renderable)


def echo(text: str) -> None:
    """Print a line."""
    print(text)


def echo_written(*files: Path) -> None:
    """Print which files were written, and their sizes."""
    from fecontact.cli.tables import file_size

    for file in files:
        size = f" ({file_size(file)})" if file.is_file() else ""
        echo(f"wrote {file}{size}")


def warn_if_stale(file: Path, current: bool) -> None:
    """Note that a study was changed after its run."""
    if not current:
        print(f"note: the run was computed with other values than {file} has now; run it again to "
              f"see these.", file=sys.stderr)


def fail(message: str, code: int) -> int:
    """Print an error in one line; the exit code that goes with it."""
    print(f"error: {_one_line(message)}", file=sys.stderr)
    return code


def _one_line(message: str) -> str:
    """A message without line breaks and without what a terminal would take for commands.

    Names of files and keys, which stand in it, may hold either.
    """
    text = " ".join(line.strip() for line in message.splitlines())
    text = re.sub(rf"(\S{{{_LONGEST}}})\S+", r"\1...", text)
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)
