"""Keys of cases: hashes of everything on which their results depend."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fecontact import __version__
from fecontact.core.dotted_parameters import flattened
from fecontact.core.errors import InputError
from fecontact.core.files.named_files import content_hash, named_file
from fecontact.core.tables import shown
from fecontact.study.study import Study, of_the_run
from fecontact.sweeps.case import of_basis

_DIGITS = 24  # of a hash: 96 bits


def case_keys(
    study: Study, names: Sequence[str], rows: Sequence[Sequence[Any]], request: Mapping[str, Any]
) -> tuple[list[str], list[str]]:
    """Keys of all cases and of their modal bases.

    A key is the hash of the resolved study with the values of the case, the files that it names,
    ``request`` (the results to store) and the package version. Equal cases of different sweeps
    have equal keys.

    Raises
    ------
    InputError
        If a parameter does not exist, or a value of the first case is invalid.
    """
    digest = _digester(study.folder)
    base = flat(study)
    resolved = flat(study.with_(**dict(zip(names, rows[0], strict=True))))
    convert = [_converter(name, [row[k] for row in rows], base) for k, name in enumerate(names)]
    simple = all(convert)
    keys, bases = [], []
    seen: dict[str, str] = {}
    for row in rows:
        if simple:
            for name, value, function in zip(names, row, convert, strict=True):
                resolved[name] = function(value)  # type: ignore[misc]
        else:
            try:
                resolved = flat(study.with_(**dict(zip(names, row, strict=True))))
            except InputError:
                # This case will fail; hash the values as given.
                resolved = base | dict(zip(names, row, strict=True))
        prestress = bool(resolved.get("basis.prestress"))
        body = {name: value for name, value in resolved.items()
                if of_basis(name, prestress=prestress)}
        text = json.dumps(body, sort_keys=True)
        if text not in seen:
            seen[text] = digest({"basis": body})
        bases.append(seen[text])
        keys.append(digest({"study": resolved, "request": request}))
    return keys, bases


def flat(study: Study) -> dict[str, Any]:
    """Resolved study by dotted names, without keys that do not affect the run."""
    return flattened(of_the_run(study.tables()))


def _converter(
    name: str, values: Sequence[Any], base: Mapping[str, Any]
) -> Callable[[Any], Any] | None:
    """Conversion of axis numbers to values of the resolved study; None if there is none."""
    present = base.get(name)
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool)
                  for value in values)
    if isinstance(present, bool) or not numbers:
        return None
    if isinstance(present, float):
        return float
    if isinstance(present, int) and all(isinstance(value, int) for value in values):
        return int
    return None


def _digester(folder: Path) -> Callable[[Mapping[str, Any]], str]:
    contents: dict[str, str] = {}

    def stand_in(value: Any) -> Any:
        """Replace the name of a file by its content."""
        if isinstance(value, str):
            if value not in contents:
                contents[value] = _with_content(value, folder)
            return contents[value]
        if isinstance(value, list | tuple):
            return [stand_in(item) for item in value]
        if isinstance(value, Mapping):
            return {key: stand_in(item) for key, item in value.items()}
        return value

    def digest(what: Mapping[str, Any]) -> str:
        text = json.dumps({"version": __version__, **stand_in(what)}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]

    return digest


def _with_content(text: str, folder: Path) -> str:
    file = named_file(text, folder)
    if file is None:
        return text
    _, colon, rest = text.partition(".py:")
    try:
        return f"{content_hash(file)}{colon}{rest}"
    except OSError as error:
        raise InputError(f"{shown(text)} cannot be read "
                         f"({(error.strerror or str(error)).lower()}).") from None
