"""Files that are written whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from fecontact.errors import InputError


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A path beside the file, whose content takes the file's place when the block ends well.

    Several processes may do so at once; the last one's content stays.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    part = path.with_name(f"{path.name}.{uuid4().hex}.part")
    try:
        yield part
        os.replace(part, path)
    except OSError as error:
        remedy = ("; choose a folder that exists and is writable"
                  if isinstance(error, FileNotFoundError | NotADirectoryError | PermissionError)
                  else "")
        raise InputError(f"{path} cannot be written "
                         f"({(error.strerror or str(error)).lower()}){remedy}.") from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
