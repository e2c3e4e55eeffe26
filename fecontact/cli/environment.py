"""Environment of the process that runs a command: descriptors, encoding, variables."""

import codecs
import os
import sys
from typing import Any

from fecontact.core.errors import InputError, require_docstrings

_ASCII = str.maketrans({
    "\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u", "\N{MINUS SIGN}": "-",
    "\N{MULTIPLICATION SIGN}": "x", "\N{MIDDLE DOT}": "*", "\N{SUPERSCRIPT TWO}": "2",
    "\N{SUPERSCRIPT THREE}": "3", "\N{HORIZONTAL ELLIPSIS}": ".", "\N{RIGHTWARDS ARROW}": ">",
    "\N{BOX DRAWINGS LIGHT HORIZONTAL}": "-", "\N{BOX DRAWINGS LIGHT VERTICAL}": "|",
    **dict.fromkeys("╭╮╰╯┌┐└┘├┤┬┴┼", "+")})


def prepare() -> None:
    """Repair what a command cannot work with.

    Closed standard descriptors become the null device: a result file would get their number, and
    messages of libraries would end in it. Letters that the encoding of the output lacks are
    replaced. A width of the terminal (COLUMNS, LINES) that is no positive number is dropped.
    Figures are only written to files, for which MPLBACKEND does not matter.

    Raises
    ------
    InputError
        If NUMBA_NUM_THREADS is not a whole number of 1 or more, or Python was started with -OO.
    """
    require_docstrings()
    _open_descriptors()
    codecs.register_error("fecontact", _replace)
    for stream in (sys.stdout, sys.stderr):
        reconfigure: Any = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="fecontact")
    for size in ("COLUMNS", "LINES"):
        if not _is_positive(os.environ.get(size, "1")):
            del os.environ[size]
    os.environ["MPLBACKEND"] = "agg"
    threads = os.environ.get("NUMBA_NUM_THREADS", "1")
    if not _is_positive(threads):
        raise InputError(f'the environment variable NUMBA_NUM_THREADS = "{threads}" must be a '
                         f"whole number of 1 or more; set it so, or unset it.")


def _is_positive(text: str) -> bool:
    return text.isascii() and text.isdigit() and int(text) > 0


def _open_descriptors() -> None:
    """Open the null device on closed descriptors 0, 1 and 2."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            # The system gives the lowest free number, which is this one.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115


def _replace(error: UnicodeError) -> tuple[str, int]:
    """Replacement of letters that the encoding lacks: like ones of ASCII, or question marks."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start:error.end].translate(_ASCII)
    return "".join(letter if letter.isascii() else "?" for letter in text), error.end
