"""The folder of a sweep: finished cases in shards, modal bases, a lock.

A shard holds the rows of one batch and is named by the hash of their keys; it is written whole or
not at all and never changed.
"""

import contextlib
import hashlib
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fecontact.core.errors import InputError
from fecontact.core.files.atomic_write import clear_leftovers, output_folder, replaced
from fecontact.core.files.locks import locked
from fecontact.core.files.stored import DamagedError, from_json, reading
from fecontact.study.bodies_section import Reduced
from fecontact.sweeps.batch import case_file, write_reduced
from fecontact.sweeps.case import Row

_SUFFIXES = {"shards": ".json", "cases": ".vtkhdf", "bases": ".h5"}
_OURS = re.compile(r"[0-9a-f]{24}")  # hashes that name shards, cases and bases


@dataclass(frozen=True)
class Store:
    """Files of a sweep on disk.

    Attributes
    ----------
    folder : Path
        Contains ``shards/``, ``bases/`` and ``cases/``.
    files : bool
        Whether each finished case has its own file.
    """

    folder: Path
    files: bool = False

    @property
    def cases(self) -> Path:
        """Folder of the files of single cases."""
        return self.folder / "cases"

    def rows(self) -> dict[str, Row]:
        """All stored rows by the keys of their cases.

        Raises
        ------
        InputError
            If a shard cannot be read.
        """
        found: dict[str, Row] = {}
        for path in self.kept("shards"):
            with reading(path, "damaged; remove it, and its cases are computed again"):
                shard = from_json(path.read_text(encoding="utf-8"), dict, "the shard")
                for row in shard["rows"]:
                    _require_row(row)
                    self._take(row, found)
        return found

    def _take(self, row: Row, found: dict[str, Row]) -> None:
        key = row["case"]
        if self.files and not row["reason"] and not case_file(self.cases, key).is_file():
            return
        if key not in found or found[key]["reason"]:
            found[key] = row

    def add(self, rows: Sequence[Row]) -> Path:
        """Store the rows of a batch; returns the path of the shard.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        keys = "".join(row["case"] for row in rows)
        name = hashlib.sha256(keys.encode()).hexdigest()[:24]
        path = self.folder / "shards" / f"{name}.json"
        body = ",\n".join(json.dumps(row, sort_keys=True) for row in rows)
        write_whole(path, f'{{"rows": [\n{body}\n]}}\n')
        return path

    def basis_file(self, key: str) -> Path:
        """Path of the file of a modal basis."""
        return self.folder / "bases" / f"{key}.h5"

    def keep_basis(self, key: str, reduced: Reduced) -> None:
        """Store a modal basis, and the gaps between several bodies, unless it exists."""
        path = self.basis_file(key)
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            write_reduced(path, reduced)

    def kept(self, what: str) -> list[Path]:
        """Files in ``shards``, ``cases`` or ``bases`` whose names show that a sweep wrote them."""
        return sorted(path for path in (self.folder / what).glob(f"*{_SUFFIXES[what]}")
                      if _OURS.fullmatch(path.stem))

    def tidy(self) -> None:
        """Remove incomplete files of a killed sweep."""
        for name in ("", "shards", "bases", "cases"):
            clear_leftovers(self.folder / name)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Lock the folder against other sweeps; the system releases the lock if the process dies.

        Raises
        ------
        InputError
            If another sweep is running in the folder.
        """
        busy = (f"Another sweep is at work in {self.folder}; wait for it, or choose another "
                f"folder.")
        with locked(self.folder / ".lock", busy, keep=True):
            yield


    @contextlib.contextmanager
    def begun(self, *, resume: bool, overwrite: bool) -> Iterator[None]:
        """Make and lock the folder; with ``overwrite`` remove what a sweep has left there.

        Raises
        ------
        InputError
            If it holds a sweep that is neither to go on nor to be removed, or another sweep is
            running in it.
        """
        with output_folder(self.folder), self.locked():
            self.tidy()
            if overwrite:
                for what in ("shards", "cases", "bases"):
                    for path in self.kept(what):
                        path.unlink(missing_ok=True)
            elif (table := self.folder / "index.csv").exists() and not (
                    self.kept("shards") or (self.folder / "sweep.toml").exists()):
                raise InputError(f"{table} is of no sweep; choose another folder, or replace it "
                                 f"with --overwrite (overwrite=True).")
            elif not resume and self.kept("shards"):
                raise InputError(f"{self.folder} holds a sweep; go on with --resume (resume=True), "
                                 f"start again with --overwrite (overwrite=True), or choose "
                                 f"another folder.")
            yield


def _require_row(row: Any) -> None:
    """Raise DamagedError unless a stored row is complete and valid."""
    if not (isinstance(row, dict) and row.keys() >= Row.__required_keys__
            and isinstance(row["case"], str) and isinstance(row["reason"], str)
            and isinstance(row.get("warning", ""), str)
            and isinstance(row["values"], dict) and isinstance(row.get("points", []), list)
            and all(isinstance(value, int | float)
                    for value in (*row["values"].values(), *row.get("points", [])))):
        raise DamagedError("a row is not whole")


def write_whole(path: Path, text: str) -> None:
    """Write a text file atomically, even if several processes write it at the same time.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with contextlib.suppress(OSError):  # reported by the write below
        path.parent.mkdir(parents=True, exist_ok=True)
    with replaced(path) as part:
        part.write_text(text, encoding="utf-8")
