"""The model in a file of results: basis, parameters, study, and the versions that computed it."""

import json
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any

import tomli_w

from fecontact.core.checks import as_path, require_kind
from fecontact.core.errors import InputError, shown
from fecontact.core.files.stored import DamagedError, from_json, member, text
from fecontact.core.tables import parsed
from fecontact.laws.own_files import movable, trusting, with_folder
from fecontact.output.files.hdf5 import open_file, store_basis, stored_basis
from fecontact.reduction.modal_basis import ModalBasis

if TYPE_CHECKING:
    from fecontact.system.contact_system import ContactSystem

_PACKAGES = ("fecontact", "numpy", "scipy", "numba", "scikit-fem")


@dataclass(frozen=True)
class StoredTables:
    """A model as its file has it, before code of its laws is loaded."""

    basis: ModalBasis
    tables: dict[str, Any]
    study: str | None
    versions: dict[str, str]


@dataclass(frozen=True)
class StoredModel:
    """A model read from a file of results."""

    system: "ContactSystem"
    study: str | None
    versions: dict[str, str]


def store_model(
    file: Any, path: Path, system: "ContactSystem", study: str | None, root: str | Path | None,
) -> None:
    """Write a model into a new HDF5 file that will be ``path``.

    Files of user laws below ``root``, by default the folder of the file, are named relative to it.
    """
    from fecontact.system.tables import system_tables

    folder = path.parent
    root = folder if root is None else as_path(root, "the folder of laws")
    require_kind("study", (str, NoneType), study=study)
    for name, number in library_versions().items():
        file.require_group("versions").attrs[name] = number
    store_basis(file.create_group("basis"), system.basis)
    file.create_group("system").attrs["json"] = json.dumps(
        movable(system_tables(system), folder, root))
    if study is not None:
        attributes = file.create_group("study").attrs
        attributes["toml"] = _changed(study, lambda table: movable(table, folder, root))
        attributes["folder"] = (
            os.path.relpath(root.resolve(), folder.resolve())
            if folder.resolve().is_relative_to(root.resolve()) else str(root.resolve()))


def stored_tables(file: Any, path: Path) -> StoredTables:
    """Read what :func:`store_model` has written."""
    basis = stored_basis(member(file, "basis"))
    tables = from_json(text(member(file, "system"), "json"), dict, "the system")
    _require_no_data_files(tables)
    tables = with_folder(tables, path.parent)
    study = (_changed(text(member(file, "study"), "toml"),
                      lambda table: with_folder(table, path.parent)) if "study" in file else None)
    versions = {name: str(one) for name, one in member(file, "versions").attrs.items()}
    return StoredTables(basis, tables, study, versions)


def read_study_text(path: str | Path) -> tuple[str, Path | None]:
    """TOML text of the study in a file of results, and the folder of that study, if stored.

    Raises
    ------
    InputError
        If there is no such file, it is damaged or holds no study.
    """
    path = as_path(path, "a file of results")
    with open_file(path, "study") as file:
        group = member(file, "study")
        return text(group, "toml"), (path.parent / text(group, "folder")
                                     if "folder" in group.attrs else None)


def read_tables(path: str | Path) -> StoredTables:
    """Tables of the model of a file of branches or responses; no code of laws is executed.

    Raises
    ------
    InputError
        If there is no such file, or it holds no model.
    """
    path = as_path(path, "a file of results")
    with open_file(path, "branches") as file:
        if "system" not in file:
            raise InputError(f"{path} holds branches alone, without the system that they are of; "
                             f"write it with the argument system, or by a command.")
        return stored_tables(file, path)


def _require_no_data_files(table: Any) -> None:
    """Raise :class:`DamagedError` where a stored system names a file of data for a known law.

    The data itself is stored; a file named instead is not by :func:`store_model`.
    """
    if isinstance(table, list):
        for item in table:
            _require_no_data_files(item)
    elif isinstance(table, dict):
        if table.get("file") is not None and ".py:" not in str(table.get("law")):
            raise DamagedError(f"the system names the file {shown(table['file'])}, where its data "
                               f"must be stored")
        for item in table.values():
            _require_no_data_files(item)


def read_model(path: str | Path, trust: bool | Iterable[Path] = False) -> StoredModel:
    """The model of a file of branches or responses.

    Raises
    ------
    InputError
        If there is no such file, it holds no model or needs code that is not trusted.
    """
    from fecontact.system.tables import system_from_tables

    stored = read_tables(path)
    with trusting(trust):
        system = system_from_tables(stored.basis, stored.tables, str(path))
    return StoredModel(system, stored.study, stored.versions)


def read_system(path: str | Path, *, trust: bool | Iterable[Path] = False) -> "ContactSystem":
    """Read the system that was written with branches or a frequency response.

    Parameters
    ----------
    path : str or Path
        A file of :func:`fecontact.io.write_branches`, :func:`fecontact.io.write_response` or the
        commands ``branch`` and ``response``.
    trust : bool or files
        Whether to execute code of laws that the file names, as for :func:`read_case`.

    Raises
    ------
    InputError
        If there is no such file, it holds no system, or needs code that is not trusted.
    """
    return read_model(path, trust).system


def _changed(study: str, change: Callable[[Any], Any]) -> str:
    """Study text with changed tables, except those of geometries; comments at its end are kept.

    The same text if nothing changes.
    """
    tables = parsed(study, "study")
    changed = {name: table if name in ("geometry", "bodies") else change(table)
               for name, table in tables.items()}
    comments = "".join(f"{line}\n" for line in study.splitlines() if line.startswith("# "))
    return study if changed == tables else f"{tomli_w.dumps(changed)}\n{comments}"


def library_versions() -> dict[str, str]:
    """Versions of fecontact and the libraries that compute."""
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
