"""Folders for results: made when they are needed, unmade when nothing was put there."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fecontact.core.atomic_write import replaced
from fecontact.core.errors import InputError


@contextmanager
def output_folder(folder: Path) -> Iterator[Path]:
    """A folder that can be written, made if need be; unmade if nothing was put there.

    Raises
    ------
    InputError
        If it cannot be made or written.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        _remove_empty(made)
        raise InputError(f"The folder {folder} cannot be written "
                         f"({(error.strerror or str(error)).lower()}); choose another "
                         f"one.") from None
    try:
        yield folder
    finally:
        _remove_empty(made)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    with output_folder(path.parent), replaced(path) as part:
        part.write_text(text, encoding="utf-8")


def _remove_empty(folders: list[Path]) -> None:
    for path in folders:
        with suppress(OSError):
            path.rmdir()
