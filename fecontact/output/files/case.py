"""Case files (HDF5): a run, the model it was computed from, and frames for ParaView."""

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.analysis.histories import component_of
from fecontact.core.checks import as_path, require_kind
from fecontact.core.errors import InputError
from fecontact.core.files.stored import DamagedError, array, from_json, member, reading, text, texts
from fecontact.core.units import Summarised
from fecontact.integrate.event_table import Events
from fecontact.integrate.kept_steps import KeptSteps
from fecontact.integrate.recorded import RecordedContact
from fecontact.integrate.trajectory import Status, StoredSystem, Trajectory
from fecontact.laws.own_files import UntrustedError, law_files, trusting
from fecontact.output.files.dataset import to_pandas, to_xarray
from fecontact.output.files.frames import frame_indices
from fecontact.output.files.hdf5 import new_file, open_file, store_compressed
from fecontact.output.files.stored_system import StoredTables, store_model, stored_tables
from fecontact.output.files.vtkhdf import write_vtkhdf
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system import columns
from fecontact.system.columns import POWERS

if TYPE_CHECKING:
    import pandas
    import xarray

    from fecontact.system.contact_system import ContactSystem

_STATE = {"time": "s", "modal_coordinates": "kg^0.5 m", "modal_velocities": "kg^0.5 m/s",
          "work": "J"}
_OPTIONAL = {"memory": "as the friction law says", "node_friction_work": "J",
             "node_creep_work": "J",
             "held_normal_force": "N", "held_friction_force": "N"}
_STATES = "0 open, 1 stick, 2 slip"
# Motion between the outputs.
_KEPT_FORCES = {"normal_force": "N", "friction_force": "N"}
_KEPT = {"time": "s", "states": "as y = [q, q', z]", "work": "J", **_KEPT_FORCES,
         "contact_state": _STATES}
# Recorded results of user-defined laws, so that a run can be drawn without their code.
_OF_LAWS = {"penetration_rate": "m/s", "ground_rate": "m/s", "contact_energy": "J"}
_CONTACT = {"normal_force": "N", "friction_force": "N", "penetration": "m",
            "slip_velocity": "m/s", "contact_state": _STATES}
# In space, along both tangents.
_IN_SPACE = {"friction_force": "friction_forces", "slip_velocity": "slip_velocities"}
_TANGENTS = ("t", "t2")
# Columns of a contact history.
_COLUMNS = {"normal_force": columns.NORMAL_FORCE, "friction_force": columns.FRICTION_FORCE,
            "penetration": columns.PENETRATION, "penetration_rate": columns.PENETRATION_RATE,
            "slip_velocity": columns.SLIP_VELOCITY, "ground_rate": columns.GROUND_RATE}
_ACROSS = {columns.FRICTION_FORCE: columns.FRICTION_ACROSS,
           columns.SLIP_VELOCITY: columns.SLIP_ACROSS}
# Most numbers of the forces between outputs that a file takes up, 16 MB, and rows in one go.
_MOST_FORCES, _ROWS = 4_000_000, 1000


@dataclass(frozen=True, repr=False)
class Case(Summarised):
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

    def summary(self) -> list[tuple[str, str]]:
        """Summary of the run, whether its study is known, and the version that computed it."""
        return [*self.trajectory.summary(), ("study", "none" if self.study is None else "stored"),
                ("fecontact", self.versions.get("fecontact", "unknown"))]

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
        if len(indices) and trajectory.basis.mode_shapes is not None:
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
    case = stored_case(path, trust=trust)
    _ = case.trajectory.system
    return case


def stored_case(path: str | Path, *, trust: bool | Iterable[Path] = False) -> Case:
    """Read a run like :func:`read_case`, but make its system where it is first asked for.

    Curves are then drawn without loading and compiling laws, of which InputError is raised later.
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
        recorded = _read_recorded(stored, basis, len(state["time"]))
        status = Status[text(stored, "status")]
        statistics = from_json(text(stored, "statistics"), dict, "the statistics")
    memory, events = state.get("memory"), state.get("events")
    make = partial(_system, model, path, trust, 0 if memory is None else memory.shape[1],
                   None if events is None else events.states.shape[1], recorded)
    system: Any = StoredSystem(basis, make)
    if recorded.energy is not None:  # laws of users
        from fecontact.output.files.recorded_laws import RecordedSystem

        system = make()
        if isinstance(system, RecordedSystem):
            # Other quantities of these laws are not recorded between the outputs.
            state.pop("kept", None)
    return Case(Trajectory(system=system, status=status, statistics=statistics,
                           recorded=recorded, **state), model.study, model.versions)


def _system(
    model: StoredTables, path: Path, trust: bool | Iterable[Path], memory: int,
    state: int | None, recorded: RecordedContact,
) -> "ContactSystem":
    """The system of a stored run whose states have ``memory`` internal variables.

    ``state`` is the size of the states at its events.
    """
    from fecontact.system.tables import system_from_tables

    with trusting(trust):
        try:
            system = system_from_tables(model.basis, model.tables, str(path))
        except UntrustedError as error:
            if recorded.energy is None:
                raise
            from fecontact.output.files.recorded_laws import recorded_system

            system = recorded_system(model.basis, model.tables, str(path), memory, str(error))
    with reading(path):
        wanted = model.basis.contact_nodes * system.memory
        if memory != wanted:
            raise DamagedError(f"states have {memory} internal variables, not {wanted}")
        if state is not None and state != system.size:
            raise DamagedError(f"states at events do not have {system.size} values")
    return system


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
        state["kept"] = _read_kept(member(stored, "kept"), state, m, n, basis.dimension)
    if "events" in stored:
        events = member(stored, "events")
        times = array(events, "time", (None,))
        nodes = array(events, "node", (len(times),), "i")
        if len(nodes) and not (nodes.min() >= -1 and nodes.max() < n):
            raise DamagedError("events name contact nodes that the basis lacks")
        state["events"] = Events(times, tuple(texts(events, "kind", len(times))), nodes,
                                 array(events, "states", (len(times), None)))
    return state


def _read_kept(
    stored: Any, state: dict[str, Any], m: int, n: int, dimension: int
) -> KeptSteps:
    """Motion kept between the outputs of a run; ``state`` has the arrays at these."""
    time = array(stored, "time", (None,))
    count, outputs = len(time), state["time"]
    if not ((np.diff(time) > 0.0).all() and (time > outputs[0]).all() and (
            time < outputs[-1]).all() and not np.isin(time, outputs).any()):
        raise DamagedError("the times kept between the outputs are not ascending between these")
    memory = 0 if state.get("memory") is None else state["memory"].shape[1]
    of_friction = (count, n) if dimension == 2 else (count, n, 2)
    return KeptSteps(
        time, array(stored, "states", (count, 2 * m + memory)),
        array(stored, "work", (count, len(POWERS))),
        **{name: array(stored, name, shape).astype(float)
           for name, shape in zip(_KEPT_FORCES, ((count, n), of_friction), strict=True)
           if name in stored or state.get(f"held_{name}") is not None},
        contact_state=array(stored, "contact_state", (count, n), "i").astype(np.int8)
        if "contact_state" in stored else None)


def _read_recorded(stored: Any, basis: ModalBasis, count: int) -> RecordedContact:
    """Recorded contact quantities; of laws of users all of them, and the energy."""
    shape = count, basis.contact_nodes
    contact = {}
    for name, column in _COLUMNS.items():
        in_space = basis.dimension == 3 and name in _IN_SPACE
        stored_as = _IN_SPACE[name] if in_space else name
        if stored_as not in stored:
            continue
        values = array(stored, stored_as, (*shape, 2) if in_space else shape)
        contact[column] = values[..., 0] if in_space else values
        if in_space:
            contact[_ACROSS[column]] = values[..., 1]
    return RecordedContact(
        contact, array(stored, "contact_state", shape, "i").astype(np.int8),
        array(stored, "contact_energy", (count,)) if "contact_energy" in stored else None,
        tuple(from_json(text(stored, "limits"), list, "the limits")) if "limits" in stored.attrs
        else None,
        text(stored, "component") if "component" in stored.attrs else "")


def _write_trajectory(group: Any, trajectory: Trajectory) -> None:
    import h5py

    from fecontact.system.tables import system_tables

    kept = {name: unit for name, unit in _OPTIONAL.items()
            if getattr(trajectory, name) is not None}
    of_laws = _of_laws(trajectory) if law_files(system_tables(trajectory.system)) else {}
    contact = _CONTACT if trajectory.basis.dimension == 2 else {
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
        found = _contact_of_kept(trajectory, steps)
        for name, unit in _KEPT.items():
            if (values := found.get(name, getattr(steps, name))) is not None:
                store_compressed(between, name, values)
                between[name].attrs["unit"] = unit
    if trajectory.events is not None:
        events = group.create_group("events")
        for name, unit in (("time", "s"), ("node", ""), ("states", "as y = [q, q', z]")):
            data = events.create_dataset(name, data=getattr(trajectory.events, name))
            data.attrs["unit"] = unit
        events.create_dataset("kind", data=list(trajectory.events.kind), dtype=h5py.string_dtype())
    group.attrs["status"] = trajectory.status.name
    group.attrs["component"] = component_of(trajectory)
    group.attrs["limits"] = json.dumps(trajectory.limits_exceeded)
    group.attrs["statistics"] = json.dumps(trajectory.statistics, default=lambda x: x.item())


def _contact_of_kept(trajectory: Trajectory, steps: KeptSteps) -> dict[str, Any]:
    """Forces of laws to 7 digits, and contact states, between the outputs, for pictures.

    Nothing if they are too many.
    """
    basis = trajectory.basis
    if steps.normal_force is not None or (
            steps.time.size * basis.contact_nodes * basis.dimension > _MOST_FORCES):
        return {}
    found: dict[str, list[Any]] = {"normal_force": [], "friction_force": [], "contact_state": []}
    memory = trajectory.memory is not None
    m = basis.modes
    for k in range(0, len(steps.time), _ROWS):
        part = steps.part(slice(k, k + _ROWS))
        rows = trajectory.with_rows(
            time=part.time, modal_coordinates=part.states[:, :m],
            modal_velocities=part.states[:, m : 2 * m], work=part.work, kept=None, recorded=None,
            memory=part.states[:, 2 * m :] if memory else None,
            node_friction_work=None, node_creep_work=None)
        friction = rows.friction_force if basis.dimension == 2 else rows.friction_forces
        found["normal_force"].append(rows.normal_force.astype(np.float32))
        found["friction_force"].append(friction.astype(np.float32))
        found["contact_state"].append(rows.contact_state)
    return {name: np.concatenate(parts) for name, parts in found.items()}


def _of_laws(trajectory: Trajectory) -> dict[str, Any]:
    return {"penetration_rate": trajectory.penetration_rate,
            "ground_rate": trajectory._column(columns.GROUND_RATE),
            "contact_energy": trajectory.energies.contact}
