"""Locks on files that are being written; the system releases them when their process ends."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fecontact.core.errors import InputError


@contextmanager
def locked(path: Path, busy: str, *, keep: bool = False) -> Iterator[None]:
    """Hold a lock file; other processes that request it meanwhile get an error.

    The lock belongs to the process, not to the file: the file of a killed process does not block
    others, and is removed by the next one.

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
    try:
        import fcntl
    except ImportError:  # Windows: rely on atomic writing alone
        yield
        return
    while True:
        try:
            # Do not follow a link to a foreign file.
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        except OSError as error:
            raise InputError(f"{path} cannot be written "
                             f"({(error.strerror or str(error)).lower()}).") from None
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            raise InputError(busy) from None
        except OSError:  # file systems without locks
            pass
        if _is_at(descriptor, path):
            break
        os.close(descriptor)  # removed by its last holder meanwhile
    try:
        yield
    finally:
        if not keep:
            with suppress(OSError):
                path.unlink()
        os.close(descriptor)


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path, follow_symlinks=False))
    except FileNotFoundError:
        return False
