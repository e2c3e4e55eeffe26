"""Case files (HDF5): a run, the model it was computed from, and frames for ParaView."""

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import as_path, require_kind
from fecontact.core.errors import InputError
from fecontact.core.files.stored import DamagedError, array, from_json, member, reading, text, texts
from fecontact.integrate.events import Events
from fecontact.integrate.kept_steps import KeptSteps
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.laws.registry import UntrustedError, law_files, trusting
from fecontact.output.files.dataset import to_pandas, to_xarray
from fecontact.output.files.frames import frame_indices
from fecontact.output.files.hdf5 import new_file, open_file, store_compressed
from fecontact.output.files.stored_system import store_model, stored_tables
from fecontact.output.files.vtkhdf import write_vtkhdf
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem
from fecontact.system.kernels import GROUND_RATE
from fecontact.system.powers import POWERS
from fecontact.system.tables import system_from_tables, system_tables

if TYPE_CHECKING:
    import pandas
    import xarray

_STATE = {"time": "s", "modal_coordinates": "kg^0.5 m", "modal_velocities": "kg^0.5 m/s",
          "work": "J"}
_OPTIONAL = {"memory": "as the friction law says", "node_friction_work": "J",
             "node_creep_work": "J",
             "held_normal_force": "N", "held_friction_force": "N"}
# Motion between the outputs.
_KEPT_FORCES = {"normal_force": "N", "friction_force": "N"}
_KEPT = {"time": "s", "states": "as y = [q, q', z]", "work": "J"} | _KEPT_FORCES
# Recorded results of user-defined laws, so that a run can be drawn without their code.
_OF_LAWS = {"penetration_rate": "m/s", "ground_rate": "m/s", "contact_energy": "J"}
_CONTACT = {"normal_force": "N", "friction_force": "N", "penetration": "m",
            "slip_velocity": "m/s", "contact_state": "0 open, 1 stick, 2 slip"}
# In space, along both tangents.
_IN_SPACE = {"friction_force": "friction_forces", "slip_velocity": "slip_velocities"}
_TANGENTS = ("t", "t2")
# Columns of a contact history, in order.
_COLUMNS = ("normal_force", "friction_force", "penetration", "penetration_rate", "slip_velocity",
            "ground_rate")


@dataclass(frozen=True)
class Case:
    """A run read from its file.

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

    def to_xarray(self) -> "xarray.Dataset":
        """The run as an :class:`xarray.Dataset`; see :func:`fecontact.io.to_xarray`."""
        return to_xarray(self.trajectory)

    def to_pandas(self) -> "pandas.DataFrame":
        """The run as a :class:`pandas.DataFrame`; see :func:`fecontact.io.to_pandas`."""
        return to_pandas(self.trajectory)


def write_case(
    path: str | Path, trajectory: Trajectory, *, frames: int = 200, study: str | None = None,
    root: str | Path | None = None,
) -> Path:
    """Write a run into one HDF5 file, whole or not at all.

    With frames it is also a temporal VTKHDF file: name it ``NAME.vtkhdf`` to open it in ParaView.
    Other data lie outside the group /VTKHDF: /basis, /trajectory, /system, /study and /versions.

    Parameters
    ----------
    path : str or Path
        The file; it is replaced if it exists.
    trajectory : Trajectory
        The run.
    frames : int
        Number of evenly spaced output times whose fields are stored, at most all. /VTKHDF is
        omitted for zero frames, or if the modal basis has no shapes over the body.
    study : str, optional
        The study that described the run, as TOML text.
    root : str or Path, optional
        User law files below this folder are named relative to the case, so that the folder can be
        moved as a whole; by default the folder of the case. Other law files are named by absolute
        paths.

    Raises
    ------
    InputError
        If ``frames`` is negative, or the file cannot be written.
    """
    require_kind("write_case", Trajectory, trajectory=trajectory)
    path = as_path(path, "a run")
    indices = frame_indices(trajectory.time, frames)
    with new_file(path) as file:
        store_model(file, path, trajectory.system, study, root)
        _write_trajectory(file.create_group("trajectory"), trajectory)
        if len(indices) and trajectory.system.basis.mode_shapes is not None:
            write_vtkhdf(file, trajectory, indices)
    return Path(path)


def read_case(path: str | Path, *, trust: bool | Iterable[Path] = False) -> Case:
    """Read a run written by :func:`write_case`.

    Parameters
    ----------
    path : str or Path
        The file.
    trust : bool or files
        Whether to execute code of laws that the file names as ``FILE.py:CLASS``, or the Python
        files that may be executed. Untrusted laws are not loaded: forces, contact states and
        energies are those stored in the file, and anything that needs the laws themselves raises
        InputError. Laws from modules that are already loaded are used.

    Raises
    ------
    InputError
        If the file does not exist, is not HDF5, was not written by fecontact, holds no run or is
        damaged, if its system has parameters unknown to this version, or if its ground, drive or
        load needs untrusted code.
    """
    path = as_path(path, "a run")
    with open_file(path, "basis") as file:
        if "trajectory" not in file:
            kind, how = (("branches", "read_branches") if "branches" in file else
                         ("a modal basis", "read_basis"))
            raise InputError(f"{path} holds {kind} but no run; read it with {how}.")
        model = stored_tables(file, path)
        basis = model.basis
        stored = member(file, "trajectory")
        state = _read_state(stored, basis)
        of_laws = _read_of_laws(stored, basis, len(state["time"]))
        status = Status[text(stored, "status")]
        statistics = from_json(text(stored, "statistics"), dict, "the statistics")
    with trusting(trust):
        try:
            system = system_from_tables(basis, model.tables, str(path))
        except UntrustedError as error:
            if of_laws is None:
                raise
            # Forces of these laws between the outputs are not recorded.
            state.pop("kept", None)
            from fecontact.output.files.recorded_laws import recorded_system

            system = recorded_system(basis, model.tables, str(path), state, *of_laws, str(error))
    with reading(path):
        _require_states(system, state)
    return Case(Trajectory(system=system, status=status, statistics=statistics, **state),
                model.study, model.versions)


def _read_state(stored: Any, basis: ModalBasis) -> dict[str, Any]:
    """Arrays of a trajectory, without system, status and statistics."""
    time = array(stored, "time", (None,))
    N, m, n = len(time), basis.modes, basis.contact_nodes
    if not (N and np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
        raise DamagedError("the output times are not ascending")
    widths = {"modal_coordinates": m, "modal_velocities": m, "work": len(POWERS), "memory": None}
    state: dict[str, Any] = {"time": time}
    for name in (*_STATE, *_OPTIONAL):
        if name != "time" and (name in _STATE or name in stored):
            shape: tuple[int | None, ...] = (N, widths.get(name, n))
            if name == "held_friction_force" and basis.dimension == 3:
                shape = (N, n, 2)
            state[name] = array(stored, name, shape)
    if "kept" in stored:
        state["kept"] = _read_kept(member(stored, "kept"), state, m, n)
    if "events" in stored:
        events = member(stored, "events")
        times = array(events, "time", (None,))
        nodes = array(events, "node", (len(times),), "i")
        if len(nodes) and not (nodes.min() >= -1 and nodes.max() < n):
            raise DamagedError("events name contact nodes that the basis lacks")
        state["events"] = Events(times, tuple(texts(events, "kind", len(times))), nodes,
                                 array(events, "states", (len(times), None)))
    return state


def _read_kept(stored: Any, state: dict[str, Any], m: int, n: int) -> KeptSteps:
    """Motion kept between the outputs of a run; ``state`` has the arrays at these."""
    time = array(stored, "time", (None,))
    count, outputs = len(time), state["time"]
    if not ((np.diff(time) > 0.0).all() and (time > outputs[0]).all() and (
            time < outputs[-1]).all() and not np.isin(time, outputs).any()):
        raise DamagedError("the times kept between the outputs are not ascending between these")
    memory = 0 if state.get("memory") is None else state["memory"].shape[1]
    held = {name: state.get(f"held_{name}") for name in _KEPT_FORCES}
    return KeptSteps(
        time, array(stored, "states", (count, 2 * m + memory)),
        array(stored, "work", (count, len(POWERS))),
        **{name: array(stored, name, (count, *values.shape[1:]))
           for name, values in held.items() if values is not None})


def _require_states(system: ContactSystem, state: dict[str, Any]) -> None:
    """Raise DamagedError unless the states have the internal variables required by the laws."""
    n, memory = system.basis.contact_nodes, state.get("memory")
    found = 0 if memory is None else memory.shape[1]
    if found != n * system.memory:
        raise DamagedError(f"states have {found} internal variables, not {n * system.memory}")
    if "events" in state and state["events"].states.shape[1] != system.size:
        raise DamagedError(f"states at events do not have {system.size} values")


def _read_of_laws(stored: Any, basis: ModalBasis, count: int) -> tuple[Any, Any, Any] | None:
    """Recorded contact history, contact states and contact energy of user-defined laws."""
    if not all(name in stored for name in _OF_LAWS):
        return None
    shape = count, basis.contact_nodes
    if basis.dimension == 2:
        history = [array(stored, name, shape) for name in _COLUMNS]
    else:
        read = {name: array(stored, _IN_SPACE.get(name, name),
                            (*shape, 2) if name in _IN_SPACE else shape) for name in _COLUMNS}
        history = [read[name][..., 0] if name in _IN_SPACE else read[name] for name in _COLUMNS]
        history += [read[name][..., 1] for name in _IN_SPACE]
    return (np.stack(history, axis=2),
            array(stored, "contact_state", shape, "i"),
            array(stored, "contact_energy", (count,)))


def _write_trajectory(group: Any, trajectory: Trajectory) -> None:
    import h5py

    kept = {name: unit for name, unit in _OPTIONAL.items()
            if getattr(trajectory, name) is not None}
    of_laws = _of_laws(trajectory) if law_files(system_tables(trajectory.system)) else {}
    contact = _CONTACT if trajectory.system.basis.dimension == 2 else {
        _IN_SPACE.get(name, name): unit for name, unit in _CONTACT.items()}
    for name, unit in (_STATE | kept | contact | _OF_LAWS).items():
        if name in _OF_LAWS and not of_laws:
            continue
        data = group.create_dataset(name, data=of_laws[name] if name in of_laws
                                    else getattr(trajectory, name))
        data.attrs["unit"] = unit
        if name in _IN_SPACE.values():
            data.attrs["component_names"] = list(_TANGENTS)
    if (steps := trajectory.kept) is not None and len(steps.time):
        between = group.create_group("kept")
        for name, unit in _KEPT.items():
            if (values := getattr(steps, name)) is not None:
                store_compressed(between, name, values)
                between[name].attrs["unit"] = unit
    if trajectory.events is not None:
        events = group.create_group("events")
        for name, unit in (("time", "s"), ("node", ""), ("states", "as y = [q, q', z]")):
            data = events.create_dataset(name, data=getattr(trajectory.events, name))
            data.attrs["unit"] = unit
        events.create_dataset("kind", data=list(trajectory.events.kind), dtype=h5py.string_dtype())
    group.attrs["status"] = trajectory.status.name
    group.attrs["statistics"] = json.dumps(trajectory.statistics, default=lambda x: x.item())


def _of_laws(trajectory: Trajectory) -> dict[str, Any]:
    contact = trajectory.system.contact_history(trajectory.time, trajectory.states)
    return {"penetration_rate": trajectory.penetration_rate,
            "ground_rate": contact[:, :, GROUND_RATE],
            "contact_energy": trajectory.energies.contact}
