"""Runs of vector fields in HDF5 files."""

from pathlib import Path
from types import MappingProxyType
from typing import Any

from fecontact.core.checks import as_path, require_kind
from fecontact.core.files.stored import array, member, require_lengths, text, texts
from fecontact.integrate.event_table import Events
from fecontact.integrate.field_runs.field_run import FieldRun
from fecontact.integrate.trajectory import Status
from fecontact.output.files.hdf5 import new_file, open_file


def write_run(path: str | Path, run: FieldRun) -> Path:
    """Write a run of a vector field into an HDF5 file, whole or not at all.

    Group ``run``: time, states with their names, parameters, events, and how it ended; the function
    of the field is not stored.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    require_kind("write_run", FieldRun, run=run)
    path = as_path(path, "a run")
    with new_file(path) as file:
        group = file.create_group("run")
        group.attrs["status"] = run.status.name
        for name in ("time", "states"):
            group.create_dataset(name, data=getattr(run, name))
        group.create_dataset("state_names", data=list(run.state_names))
        group.create_dataset("parameters/names", data=list(run.parameters), dtype=_text())
        group.create_dataset("parameters/values", data=list(run.parameters.values()), dtype=float)
        for name, value in run.statistics.items():
            if value is not None:
                group.create_dataset(f"statistics/{name}", data=value)
        if run.events is not None:
            for name in ("time", "states", "node"):
                group.create_dataset(f"events/{name}", data=getattr(run.events, name))
            group.create_dataset("events/kind", data=list(run.events.kind), dtype=_text())
    return path


def read_run(path: str | Path) -> FieldRun:
    """Read a run of a vector field written by :func:`write_run`.

    Raises
    ------
    InputError
        If there is no such file, it is damaged, or it holds no such run.
    """
    with open_file(path, "run") as file:
        group = member(file, "run")
        names = tuple(texts(group, "state_names"))
        time = array(group, "time", (None,))
        states = array(group, "states", (len(time), len(names)))
        given = member(group, "parameters")
        keys = texts(given, "names") if len(member(given, "names")) else []
        values = array(given, "values", (len(keys),))
        events = None
        if "events" in group:
            stored = member(group, "events")
            at = array(stored, "time", (None,))
            kinds = texts(stored, "kind") if len(at) else []
            require_lengths("'events'", len(at), kinds)
            events = Events(at, tuple(kinds), array(stored, "node", (len(at),), "i"),
                            array(stored, "states", (len(at), len(names))))
        statistics = {name: _plain(item[()]) for name, item in
                      (member(group, "statistics").items() if "statistics" in group else ())}
        return FieldRun(
            MappingProxyType(dict(zip(keys, values.tolist(), strict=True))), names, time, states,
            Status[text(group, "status")], statistics, events)


def _text() -> Any:
    from h5py import string_dtype

    return string_dtype()


def _plain(value: Any) -> Any:
    return value.decode() if isinstance(value, bytes) else value.tolist()
