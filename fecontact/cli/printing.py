"""What commands print: results on stdout, complaints on stderr."""

import sys
from pathlib import Path
from typing import Any


def show(renderable: Any) -> None:
    """Print a table."""
    from rich.console import Console

    Console().print(renderable)


def say(text: str) -> None:
    """Print a line."""
    print(text)


def say_written(*files: Path) -> None:
    """Print which files were written, and their sizes."""
    from fecontact.report import file_size

    for file in files:
        size = f" ({file_size(file)})" if file.is_file() else ""
        say(f"wrote {file}{size}")


def note_age(file: Path, current: bool) -> None:
    """Note that a study was changed after its run."""
    if not current:
        print(f"note: the run was computed with other values than {file} has now; run it again to "
              f"see these.", file=sys.stderr)


def complain(message: str, code: int) -> int:
    """Print an error; the exit code that goes with it."""
    print(f"error: {message}", file=sys.stderr)
    return code
