"""What commands print: results on stdout, complaints on stderr."""

import re
import sys
from pathlib import Path
from typing import Any

_LONGEST = 300  # letters of a word in a message

def show(renderable: Any) -> None:
    """Print a table."""
    from rich.console import Console

    Console().print(renderable)


def say(text: str) -> None:
    """Print a line."""
    print(text)


def say_written(*files: Path) -> None:
    """Print which files were written, and their sizes."""
    from fecontact.cli.tables import file_size

    for file in files:
        size = f" ({file_size(file)})" if file.is_file() else ""
        say(f"wrote {file}{size}")


def note_age(file: Path, current: bool) -> None:
    """Note that a study was changed after its run."""
    if not current:
        print(f"note: the run was computed with other values than {file} has now; run it again to "
              f"see these.", file=sys.stderr)


def complain(message: str, code: int) -> int:
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
