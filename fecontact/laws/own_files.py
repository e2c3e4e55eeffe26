"""Python files of users' laws that tables name: where they are, and whether they may be run."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from fecontact.core.errors import InputError


class UntrustedError(InputError):
    """A file names code that may not be run."""


_trusted: ContextVar[frozenset[str] | None] = ContextVar("trusted", default=None)


def trusted_files() -> frozenset[str] | None:
    """Python files whose laws may be run; None for all."""
    return _trusted.get()


@contextmanager
def trusting(files: bool | Iterable[Path]) -> Iterator[None]:
    """Allow laws from all Python files, from none, or from the named ones only.

    Others raise :class:`UntrustedError`, unless their module is already loaded.
    """
    allowed = None if files is True else frozenset(
        str(file.resolve()) for file in files or ())
    token = _trusted.set(allowed)
    try:
        yield
    finally:
        _trusted.reset(token)


def law_files(table: Any) -> set[Path]:
    """Python files of the laws in a table."""
    if isinstance(table, list | tuple):
        return {file for item in table for file in law_files(item)}
    if not isinstance(table, Mapping):
        return set()
    found = {file for item in table.values() for file in law_files(item)}
    name = table.get("law")
    if isinstance(name, str) and ".py:" in name:
        found.add(Path(name.rpartition(":")[0]))
    return found


def with_folder(table: Any, folder: Path) -> Any:
    """A table with files of laws and data named relative to the current folder."""
    def located(key: str, value: Any) -> Any:
        named = isinstance(value, str) and (key == "file" or (key == "law" and ".py:" in value))
        return str(folder.resolve() / value) if named else value

    return _changed(table, located)


def movable(table: Any, folder: Path, root: Path) -> Any:
    """A table with files of laws below ``root`` named relative to a folder.

    The reverse of :func:`with_folder`; ``root`` can then be moved with its contents.
    """
    folder, root = folder.resolve(), root.resolve()

    def relative(key: str, value: Any) -> Any:
        if key != "law" or not isinstance(value, str) or ".py:" not in value:
            return value
        path, _, title = value.rpartition(":")
        if not Path(path).is_relative_to(root):
            return value
        return f"{Path(os.path.relpath(path, folder)).as_posix()}:{title}"

    return _changed(table, relative)


def _changed(table: Any, change: Callable[[str, Any], Any]) -> Any:
    """A table of tables and lists with other values, by their keys."""
    if isinstance(table, list):
        return [_changed(item, change) for item in table]
    if not isinstance(table, Mapping):
        return table
    return {key: change(key, _changed(value, change)) for key, value in table.items()}
