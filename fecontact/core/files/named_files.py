"""Files that a study names, and the hashes of their content."""

import hashlib
import os
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any


def named_file(text: str, folder: Path) -> Path | None:
    """The file that a text of a study names, ``part.msh`` or ``own.py:Law``; None for others."""
    name, colon, _ = text.partition(".py:")
    file = folder / (f"{name}.py" if colon else text)
    # False, not an error, for a text that is too long.
    return file if os.path.isfile(file) else None


def content_hash(file: Path) -> str:
    """SHA-256 of the content of a file; OSError if it cannot be read."""
    state = file.stat()
    return _content_hash(file, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=256)
def _content_hash(file: Path, written: int, size: int) -> str:
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def content_hashes(value: Any, folder: Path) -> dict[str, str]:
    """Hashes of the readable files that tables of a study name, by names relative to a folder."""
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return {name: mark for item in value for name, mark in content_hashes(item, folder).items()}
    file = named_file(value, folder) if isinstance(value, str) else None
    try:
        return {} if file is None else {_relative(file, folder): content_hash(file)}
    except OSError:  # whoever needs the file says so
        return {}


def changed_files(hashes: Mapping[str, str], folder: Path) -> list[str]:
    """Names of files that exist in a folder with another content than their hash says."""
    return [name for name, mark in hashes.items()
            if content_hashes(name, folder).get(name, mark) != mark]


def _relative(file: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # on another drive
        return str(file)
