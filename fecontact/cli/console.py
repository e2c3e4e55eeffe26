"""Console output of commands, and the signals that end them."""

import ctypes
import os
import re
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

from fecontact.cli.printable import printable
from fecontact.core import progress

INTERRUPTED = 130  # exit code after Ctrl-C
_ENDING = ("SIGTERM", "SIGHUP")
_ends = {getattr(signal, name) for name in ("SIGINT", *_ENDING) if hasattr(signal, name)}
_PATIENCE = 5.0  # seconds for Python to answer a signal
_PendingCall = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)
_ended_by: list[int] = []  # first signal received


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """Show a spinner on a terminal, after two seconds, for work of unknown duration.

    Without a terminal, a line is printed on stderr every 30 seconds.
    """
    if not progress.on_terminal():
        with _lines(what):
            yield
        return
    from rich.console import Console

    status = Console(stderr=True).status(f"{what} ...")
    try:
        with progress.after_patience(status.start):
            yield
    finally:
        status.stop()


@contextmanager
def _lines(what: str) -> Iterator[None]:
    """Print a line every 30 seconds from another thread."""
    ended, begin = threading.Event(), time.perf_counter()

    def show() -> None:
        while not ended.wait(progress.LINES):
            progress.line(f"{what} ... {progress.clock(time.perf_counter() - begin)}")

    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


@contextmanager
def loading() -> Iterator[None]:
    """Like :func:`waiting`, for loading and compiling: Ctrl-C ends the process at once.

    An exception would be lost in the callbacks of the compiler. No files are written meanwhile.
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
    """Exit code of an interrupted command: 130 after Ctrl-C, else 128 plus the signal number."""
    return 128 + _ended_by[0] if _ended_by else INTERRUPTED


@contextmanager
def ending_signals() -> Iterator[None]:
    """Let SIGTERM and SIGHUP do what Ctrl-C does at the time.

    Batch systems and closing terminals may send them repeatedly. Only the first counts, so that
    writing the results is not interrupted. Signals already ignored, as under nohup, stay ignored.
    Where compiled code does not return, a second signal ends the process, see
    :func:`_second_signal_ends`.
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
        else:  # background jobs of a shell ignore Ctrl-C
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
        with _second_signal_ends():
            yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)
        _ended_by.clear()


@contextmanager
def _second_signal_ends() -> Iterator[None]:
    """Let a second signal end the process where Python has not answered the first one.

    Python answers signals between calls of compiled functions only, so that a law that never
    returns would make the process deaf. A thread reads each signal from the socket of
    :func:`signal.set_wakeup_fd`.
    """
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    before = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_watch, args=(reader,), daemon=True).start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        writer.close()


def _watch(signals: socket.socket) -> None:
    """Read numbers of signals until the other end is closed; see :func:`_second_signal_ends`."""
    answered = threading.Event()

    def answer(_: object) -> int:
        answered.set()
        return 0

    call = _PendingCall(answer)  # by the main thread, as soon as it can
    with signals:
        while received := signals.recv(1):
            if received[0] not in _ends:
                continue
            answered.clear()
            ctypes.pythonapi.Py_AddPendingCall(call, None)
            if answered.wait(_PATIENCE):
                continue
            note(f"Compiled code has not returned for {_PATIENCE:g} s, perhaps a law of your own "
                 f"that never does; another signal ends the process without writing more.")
            again = signals.recv(1)
            if again and not answered.is_set():
                os.write(2, b"error: interrupted.\n")
                os._exit(128 + again[0])
            # A call that is pending must not be freed.
            answered.wait()


def _leave_terminal(descriptors: list[int]) -> None:
    """Redirect output away from a closed terminal, where writing would fail."""
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
    """Print a line; control characters from names are shown escaped."""
    print("\n".join(map(printable, text.split("\n"))))


def note(text: str) -> None:
    """Print a line on stderr; control characters from names are shown escaped."""
    print(printable(text), file=sys.stderr)


def echo_written(*files: Path) -> None:
    """Print the files written and their sizes."""
    from fecontact.cli.tables import file_size

    for file in files:
        size = f" ({file_size(file)})" if file.is_file() else ""
        echo(f"wrote {file}{size}")


def warn_if_stale(file: Path, current: bool) -> None:
    """Warn if the study was changed after its run."""
    if not current:
        note(f"note: the run was computed with other values than {file} has now; run it again to "
             f"see these.")


def fail(message: str, code: int) -> int:
    """Print an error in one line; returns its exit code."""
    print(f"error: {_one_line(message)}", file=sys.stderr)
    return code


def _one_line(message: str) -> str:
    """Remove line breaks and terminal control characters from a message.

    Both may come from the names of files and keys that it quotes.
    """
    text = " ".join(line.strip() for line in message.splitlines())
    text = re.sub(rf"(\S{{{_LONGEST}}})\S+", r"\1...", text)
    return printable(text)
