"""Files and folders that are written whole or not at all.

Content is written to a new private folder beside the target, ``.NAME.1.part``, and then moved, so
that existing links are not followed and existing files not overwritten. A lock tells the folder of
a running process from that of a killed one, which the next writer of the same name removes.
"""

import errno
import hashlib
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fecontact.core.checks import as_path
from fecontact.core.errors import InputError

_LOCK, _CONTENT, _EARLIER = "lock", "content", "earlier"
_MARK = b"a file is being written by fecontact\n"
_NAME = re.compile(r"\..+\.[0-9]+\.part")
_MOST = 1000  # writers of one name at a time
_LONGEST = 200  # bytes of the name used for the folder
_LONGEST_PART = 40  # bytes of a name of a body in that of a file

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """Yield a path whose content replaces the file when the block ends without an error.

    The content is synchronised to disk before it replaces an earlier file. A link of that name is
    replaced, not followed. If several processes write at once, the last one wins.

    Raises
    ------
    InputError
        If it cannot be written, or the path exists and is not a file.
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
    """Yield a new folder that replaces the one named when the block ends without an error.

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
    """Synchronise a finished file to disk and move it to its path; OSError on failure."""
    _synchronise(content)
    os.replace(content, path)


@contextmanager
def beside(path: Path) -> Iterator[Path]:
    """Yield a private folder beside a path, removed when the block ends.

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
    """Remove the unfinished files that killed processes of this package left in a folder."""
    with suppress(OSError):
        for entry in os.scandir(folder):
            if _NAME.fullmatch(entry.name):
                _clear(Path(entry.path), None)


def _workplace(path: Path) -> tuple[Path, int]:
    """A new folder beside a path, and the open lock in it; leftovers of the name are cleared."""
    # Leftovers are found by counting up, without listing a folder that may hold many files.
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
    """Make and lock a folder; None if it exists, or another process has removed it."""
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        return None
    try:
        lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    except (FileNotFoundError, FileExistsError):  # a race with another process
        return None
    except OSError:
        with suppress(OSError):
            folder.rmdir()
        raise
    try:
        # One write, not synchronised: later writes report a full disk.
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
    """Remove the folder of a killed process; leave those of running ones alone.

    A process killed while replacing a folder leaves the earlier one in it, which is restored if its
    path is known.
    """
    with suppress(OSError):
        if not stat.S_ISDIR(os.lstat(folder).st_mode):
            return
        with suppress(OSError):
            folder.rmdir()  # killed before it made the lock
            return
        lock = os.open(folder / _LOCK, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
        try:
            if os.read(lock, 100) != _MARK or not _take(lock, wait=False):
                return
            if not os.fstat(lock).st_nlink:  # its process has finished and removed it
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
    """Lock an open file; return whether it succeeded. The lock ends with the process."""
    try:
        import fcntl
    except ImportError:  # Windows
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:  # locked by another process, or not supported by the file system
        return False
    return True


def _require_file(path: Path) -> None:
    """Raise InputError if the path exists and is neither a file nor a link."""
    with suppress(FileNotFoundError, NotADirectoryError):
        mode = os.lstat(path).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISLNK(mode)):
            kind = "a folder" if stat.S_ISDIR(mode) else "not a file"
            raise InputError(f"{path} cannot be written: it is {kind}; choose another name.")


def _synchronise(path: Path) -> None:
    """Synchronise a file to disk; OSError on failure."""
    file = os.open(path, os.O_RDWR)
    try:
        os.fsync(file)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # not supported by the file system
            raise
    finally:
        os.close(file)


def _synchronise_folder(folder: Path) -> None:
    """Synchronise the entries of a folder to disk, where the system supports it."""
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
    """Message for a file that cannot be written."""
    reason = (error.strerror or str(error).strip().partition("\n")[0] or "no reason given").lower()
    remedy = ""
    if error.errno in _FULL:
        remedy = "; make room on the disk, or choose another folder"
    elif error.errno == errno.ENAMETOOLONG:
        remedy = "; choose a shorter name"
    elif isinstance(error, FileNotFoundError | NotADirectoryError | PermissionError):
        remedy = "; choose a folder that exists and is writable"
    return f"{path} cannot be written ({reason}){remedy}."


def require_possible(path: Path | None) -> None:
    """Raise InputError for the name of a file to write that the file system does not allow."""
    if path is not None:
        with _readable_errors(path), suppress(FileNotFoundError, NotADirectoryError):
            os.lstat(path)


@contextmanager
def output_folder(folder: Path) -> Iterator[Path]:
    """Yield a writable folder, made if necessary and removed if it is left empty.

    Raises
    ------
    InputError
        If it cannot be made or written.
    """
    made: list[Path] = []
    try:
        made += [path for path in (folder, *folder.parents) if not path.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        _remove_empty(made)
        reason = (error.strerror or str(error)).lower()
        if isinstance(error, FileExistsError | NotADirectoryError):
            file = next((path for path in (folder, *folder.parents) if path.is_file()), folder)
            reason = f"{file} is a file, not a folder"
        raise InputError(f"The folder {folder} cannot be written ({reason}); choose another "
                         f"one.") from None
    try:
        yield folder
    finally:
        _remove_empty(made)


def name_part(name: str, longest: int = _LONGEST_PART) -> str:
    """Part of the name of a file from any name: what file systems do not allow becomes ``_``."""
    allowed = "".join(letter if letter.isprintable() else "_" for letter in name)
    part = re.sub(r'[/\\:*?"<>|]', "_", allowed)
    return part.encode()[:longest].decode(errors="ignore")


def name_parts(names: Iterable[str], longest: int = _LONGEST_PART) -> list[str]:
    """Parts of names of files by :func:`name_part`, a different one for each name.

    Parts that are equal, or differ in case alone, get numbers.
    """
    parts: list[str] = []
    taken: set[str] = set()
    for name in names:
        first = part = name_part(name, longest)
        number = 1
        while part.casefold() in taken:
            number += 1
            part = f"{first}-{number}"
        taken.add(part.casefold())
        parts.append(part)
    return parts


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    with output_folder(path.parent), replaced(path) as part:
        part.write_text(text, encoding="utf-8")


def _remove_empty(folders: list[Path]) -> None:
    for path in folders:
        with suppress(OSError):
            path.rmdir()
