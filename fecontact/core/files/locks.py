"""Locks on files that are being written; the system releases them when their process ends."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from fecontact.core.errors import InputError


@contextmanager
def locked(path: Path, busy: str, *, keep: bool = False) -> Iterator[None]:
    """Hold a lock file; other processes that request it meanwhile get an error.

    The lock belongs to the process, not to the file: the file of a killed process does not block
    others, and is removed by the next one. Links to other files are not followed.

    Parameters
    ----------
    path : Path
        The lock file; its folder must exist.
    busy : str
        Error message if another process holds the lock.
    keep : bool
        Whether to keep the file at the end.

    Raises
    ------
    InputError
        If another process holds the lock, or the file cannot be made.
    """
    lock = FileLock(path, timeout=0.0)
    try:
        lock.acquire()
    except Timeout:
        raise InputError(busy) from None
    except OSError as error:
        raise InputError(f"{path} cannot be written "
                         f"({(error.strerror or str(error)).lower()}).") from None
    try:
        yield
    finally:
        if not keep:
            # While the lock is held: whoever opened the file meanwhile sees that it has gone.
            with suppress(OSError):  # Windows, where the lock removes it
                path.unlink()
        lock.release()
