"""Files and folders that are written whole or not at all.

What is being written lies in a folder of its own beside its place, ``.NAME.1.part``, made anew
and readable by its owner alone, so that nothing that lies there is followed or written over. A
lock tells the folder of a process that is at work from one that was killed; the latter is cleared
by the next that writes the same name.
"""

import errno
import hashlib
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fecontact.core.checks import as_path
from fecontact.core.errors import InputError

_LOCK, _CONTENT, _EARLIER = "lock", "content", "earlier"
_MARK = b"a file is being written by fecontact\n"
_NAME = re.compile(r"\..+\.[0-9]+\.part")
_MOST = 1000  # writers of one name at a time
_LONGEST = 200  # bytes of a name that fit into that of the folder

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """A path whose content takes the file's place when the block ends well.

    The content is on the disk before it takes the place of an earlier file. A link of that name is
    replaced, not followed. Several processes may write at once; the last one's content stays.

    Raises
    ------
    InputError
        If it cannot be written, or there is something of that name that is not a file.
    """
    path = as_path(path, "a file to write")
    with _readable_errors(path):
        _require_file(path)
        with beside(path) as folder:
            content = folder / f"{_CONTENT}{path.suffix[:16]}"
            yield content
            put(content, path)
            _synchronise_folder(path.parent)


@contextmanager
def replaced_folder(path: str | Path) -> Iterator[Path]:
    """A new folder that takes the place of the one named when the block ends well.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    path = Path(path)
    with _readable_errors(path), beside(path) as folder:
        content, earlier = folder / _CONTENT, folder / _EARLIER
        content.mkdir()
        yield content
        for file in content.iterdir():
            _synchronise(file)
        if path.exists():
            os.replace(path, earlier)
        try:
            os.replace(content, path)
        except OSError:
            if earlier.exists():
                os.replace(earlier, path)
            raise
        _synchronise_folder(path.parent)


def put(content: Path, path: Path) -> None:
    """Let a finished file take its place, once it is on the disk; OSError if that fails."""
    _synchronise(content)
    os.replace(content, path)


@contextmanager
def beside(path: Path) -> Iterator[Path]:
    """A private folder on the file system of a path, gone when the block ends.

    Raises
    ------
    InputError
        If the folder of the path does not exist.
    OSError
        If it cannot be written.
    """
    if not path.parent.is_dir():
        what = (f"{path.parent} is not a folder" if path.parent.exists()
                else f"folder {path.parent} does not exist")
        raise InputError(f"{path} cannot be written: {what}; choose a folder that exists and is "
                         f"writable.")
    folder, lock = _workplace(path)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def clear_leftovers(folder: Path) -> None:
    """Remove what killed processes of this package have left half written in a folder."""
    with suppress(OSError):
        for entry in os.scandir(folder):
            if _NAME.fullmatch(entry.name):
                _clear(Path(entry.path), None)


def _workplace(path: Path) -> tuple[Path, int]:
    """A new folder beside a path, and the open lock in it; leftovers of the name are cleared."""
    # Writers of many files do not look through the whole folder each time: leftovers are found
    # by counting.
    name = os.fsencode(path.name)
    short = path.name if len(name) <= _LONGEST else hashlib.sha256(name).hexdigest()
    made: tuple[Path, int] | None = None
    for number in range(1, _MOST):
        folder = path.with_name(f".{short}.{number}.part")
        if os.path.lexists(folder):
            _clear(folder, path)
        elif made is not None:
            return made
        if made is None:
            made = _locked(folder)
    if made is None:
        raise FileExistsError(errno.EEXIST, "too many unfinished files of this name")
    return made


def _locked(folder: Path) -> tuple[Path, int] | None:
    """A folder made and locked; None if it is there, or was cleared by another process."""
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        return None
    try:
        lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    except (FileNotFoundError, FileExistsError):  # another process was between the two calls
        return None
    except OSError:
        with suppress(OSError):
            folder.rmdir()
        raise
    try:
        # Written by one call, and not awaited: a full disk is found out by what follows.
        with suppress(OSError):
            os.write(lock, _MARK)
        _take(lock, wait=True)
        if os.fstat(lock).st_nlink:
            return folder, lock
    except BaseException:
        os.close(lock)
        shutil.rmtree(folder, ignore_errors=True)
        raise
    os.close(lock)
    return None


def _clear(folder: Path, path: Path | None) -> None:
    """Remove a folder of a process that was killed; others are left as they are.

    A process that was killed while a folder took the place of another leaves the earlier one in
    it; that is put back, if its path is known.
    """
    with suppress(OSError):
        if not stat.S_ISDIR(os.lstat(folder).st_mode):
            return
        with suppress(OSError):
            folder.rmdir()  # killed before there was a lock
            return
        lock = os.open(folder / _LOCK, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
        try:
            if os.read(lock, 100) != _MARK or not _take(lock, wait=False):
                return
            if not os.fstat(lock).st_nlink:  # its process has ended well, and the name is free
                return
            earlier = folder / _EARLIER
            if earlier.exists():
                if path is None:
                    return
                if not os.path.lexists(path):
                    os.replace(earlier, path)
            shutil.rmtree(folder, ignore_errors=True)
        finally:
            os.close(lock)


def _take(lock: int, *, wait: bool) -> bool:
    """Lock an open file; whether that is sure. The system opens it when the process ends."""
    try:
        import fcntl
    except ImportError:  # Windows
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:  # held by another, or a file system without locks
        return False
    return True


def _require_file(path: Path) -> None:
    """Raise InputError if what is there is neither a file nor a link."""
    with suppress(FileNotFoundError, NotADirectoryError):
        mode = os.lstat(path).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISLNK(mode)):
            kind = "a folder" if stat.S_ISDIR(mode) else "not a file"
            raise InputError(f"{path} cannot be written: it is {kind}; choose another name.")


def _synchronise(path: Path) -> None:
    """Wait until a file is on the disk; OSError if it does not get there."""
    file = os.open(path, os.O_RDWR)
    try:
        os.fsync(file)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # file systems that cannot
            raise
    finally:
        os.close(file)


def _synchronise_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk, where systems allow it."""
    with suppress(OSError):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


@contextmanager
def _readable_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(unwritable(path, error)) from None


def unwritable(path: Path, error: OSError) -> str:
    """The sentence for a file that cannot be written."""
    reason = (error.strerror or str(error).strip().partition("\n")[0] or "no reason given").lower()
    remedy = ""
    if error.errno in _FULL:
        remedy = "; make room on the disk, or choose another folder"
    elif isinstance(error, FileNotFoundError | NotADirectoryError | PermissionError):
        remedy = "; choose a folder that exists and is writable"
    return f"{path} cannot be written ({reason}){remedy}."


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
