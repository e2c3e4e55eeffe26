"""A case in one HDF5 file: the run, all that it was computed from, and frames for ParaView."""

import json
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import tomli_w

from fecontact.arguments import as_path, require_kind
from fecontact.errors import InputError
from fecontact.integrate.events import Events
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.laws.names import movable, with_folder
from fecontact.output.frames import frame_indices
from fecontact.output.hdf5 import new_file, open_file, read_basis, write_basis
from fecontact.output.vtkhdf import write_vtkhdf
from fecontact.tables import system_from_tables, system_tables

_PACKAGES = ("fecontact", "numpy", "scipy", "numba", "scikit-fem")
_STATE = {"time": "s", "modal_coordinates": "kg^0.5 m", "modal_velocities": "kg^0.5 m/s",
          "work": "J"}
_OPTIONAL = {"memory": "as the friction law says", "node_friction_work": "J",
             "held_normal_force": "N", "held_friction_force": "N"}
_CONTACT = {"normal_force": "N", "friction_force": "N", "penetration": "m",
            "slip_velocity": "m/s", "contact_state": "0 open, 1 stick, 2 slip"}


@dataclass(frozen=True)
class Case:
    """A run as read from its file.

    Attributes
    ----------
    trajectory : Trajectory
        Equal to the one that was written, to the last bit.
    study : str or None
        The study that described the run, as TOML text.
    versions : mapping
        Versions of fecontact and the libraries it ran with.
    """

    trajectory: Trajectory
    study: str | None = None
    versions: dict[str, str] = field(default_factory=dict)


def write_case(
    path: str | Path, trajectory: Trajectory, *, frames: int = 200, study: str | None = None,
    root: str | Path | None = None,
) -> Path:
    """Write a run into one HDF5 file, whole or not at all.

    With frames the file is a temporal VTKHDF file too: call it ``NAME.vtkhdf`` and ParaView opens
    it by double click. The rest lies outside its group /VTKHDF: /basis, /trajectory, /system,
    /study and /versions.

    Parameters
    ----------
    path : str or Path
        The file; it is replaced if it exists.
    trajectory : Trajectory
        The run.
    frames : int
        Number of output times whose fields are stored, evenly spaced, never more than there are;
        zero, or a modal basis without shapes over the body, leaves /VTKHDF out.
    study : str, optional
        The study that described the run, as TOML text.
    root : str or Path, optional
        Laws in files of your own that lie below this folder are named relative to the case, so
        that the folder can be moved as a whole; by default that of the case. Laws elsewhere are
        named by their absolute paths.

    Raises
    ------
    InputError
        If ``frames`` is negative, or the file cannot be written.
    """
    require_kind("write_case", Trajectory, trajectory=trajectory)
    path = as_path(path, "a run")
    indices = frame_indices(trajectory.time, frames)
    folder = Path(path).parent
    root = folder if root is None else Path(root)
    with new_file(path) as file:
        for name, text in _versions().items():
            file.require_group("versions").attrs[name] = text
        write_basis(file.create_group("basis"), trajectory.system.basis)
        file.create_group("system").attrs["json"] = json.dumps(
            movable(system_tables(trajectory.system), folder, root))
        if study is not None:
            file.create_group("study").attrs["toml"] = _changed(
                study, lambda table: movable(table, folder, root))
        _write_trajectory(file.create_group("trajectory"), trajectory)
        if len(indices) and trajectory.system.basis.field is not None:
            write_vtkhdf(file, trajectory, indices)
    return Path(path)


def read_case(path: str | Path) -> Case:
    """Read a run that :func:`write_case` wrote.

    Raises
    ------
    InputError
        If there is no such file, it is not HDF5, was not written by fecontact, holds no run, is
        damaged, or its system has parameters that this version does not know.
    """
    path = as_path(path, "a run")
    with open_file(path, "basis") as file:
        if "trajectory" not in file:
            raise InputError(f"{path} holds a modal basis but no run; read it with "
                             f"ModalBasis.load.")
        try:
            basis = read_basis(file["basis"])
            tables = with_folder(json.loads(file["system"].attrs["json"]), Path(path).parent)
            stored = file["trajectory"]
            state = {name: stored[name][()] for name in _STATE}
            state |= {name: stored[name][()] for name in _OPTIONAL if name in stored}
            if "events" in stored:
                events = stored["events"]
                state["events"] = Events(
                    events["time"][()], tuple(kind.decode() for kind in events["kind"][()]),
                    events["node"][()], events["states"][()])
            status = Status[stored.attrs["status"]]
            statistics = json.loads(stored.attrs["statistics"])
            study = (_changed(str(file["study"].attrs["toml"]),
                              lambda table: with_folder(table, Path(path).parent))
                     if "study" in file else None)
            versions = {name: str(text) for name, text in file["versions"].attrs.items()}
        except (KeyError, OSError, json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
            raise InputError(f"{path} is damaged or of another version of fecontact "
                             f"({error}).") from None
    system = system_from_tables(basis, tables, str(path))
    return Case(Trajectory(system=system, status=status, statistics=statistics, **state),
                study, versions)


def _changed(study: str, change: Callable[[Any], Any]) -> str:
    """A study with its tables changed, but for that of the mesh; the same text where none is."""
    tables = tomllib.loads(study)
    changed = {name: table if name == "geometry" else change(table)
               for name, table in tables.items()}
    return study if changed == tables else tomli_w.dumps(changed)


def _write_trajectory(group: Any, trajectory: Trajectory) -> None:
    import h5py

    kept = {name: unit for name, unit in _OPTIONAL.items()
            if getattr(trajectory, name) is not None}
    for name, unit in (_STATE | kept | _CONTACT).items():
        data = group.create_dataset(name, data=getattr(trajectory, name))
        data.attrs["unit"] = unit
    if trajectory.events is not None:
        events = group.create_group("events")
        for name, unit in (("time", "s"), ("node", ""), ("states", "as y = [q, q', z]")):
            data = events.create_dataset(name, data=getattr(trajectory.events, name))
            data.attrs["unit"] = unit
        events.create_dataset("kind", data=list(trajectory.events.kind), dtype=h5py.string_dtype())
    group.attrs["status"] = trajectory.status.name
    group.attrs["statistics"] = json.dumps(trajectory.statistics, default=lambda x: x.item())


def _versions() -> dict[str, str]:
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
