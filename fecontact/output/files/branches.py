"""Branches in HDF5 files."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch, BranchStatus
from fecontact.bifurcation.continuation.points import details_of, special_point
from fecontact.bifurcation.harmonic.layout import layout_from
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.harmonic.response import FrequencyResponse, response_of
from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode, mode_of
from fecontact.bifurcation.nonlinear_modes.resonance_curve import ResonanceCurve, resonances_of
from fecontact.bifurcation.orbit_methods import Method
from fecontact.bifurcation.stored_methods import method_from_text, method_text
from fecontact.core.checks import as_path, require_kind
from fecontact.core.errors import InputError, shown
from fecontact.core.files.stored import (
    DamagedError,
    bounded,
    member,
    reading,
    require_lengths,
    text,
    texts,
    values,
)
from fecontact.core.types import Array
from fecontact.output.files.hdf5 import new_file, open_file
from fecontact.output.files.stored_system import store_model
from fecontact.system.contact_system import ContactSystem


def write_branch(path: str | Path, branch: Branch) -> Path:
    """Write a branch into an HDF5 file, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    require_kind("write_branch", Branch, branch=branch)
    with new_file(path) as file:
        _store(file.create_group("branch"), branch)
    return Path(path)


def read_branch(path: str | Path) -> Branch:
    """Read a branch written by :func:`write_branch`, or the first of several.

    Raises
    ------
    InputError
        If there is no such file, or it holds no branch.
    """
    with open_file(path, "branch") as file:
        return _stored(file["branch"], path)


def write_branches(
    path: str | Path, branches: Mapping[str, Branch], *, system: ContactSystem | None = None,
    study: str | None = None, root: str | Path | None = None,
) -> Path:
    """Write branches by name into one HDF5 file, whole or not at all.

    They are stored as ``branches/0``, ``branches/1``, ... with their names as attributes.

    Parameters
    ----------
    path : str or Path
        The file; it is replaced if it exists.
    branches : mapping of name to Branch
        Branches by name, at least one.
    system : ContactSystem, optional
        System of the branches; with it reports and movies can be made from the file alone, and
        :func:`fecontact.io.read_system` reads it.
    study : str, optional
        The study that described the system, as TOML text.
    root : str or Path, optional
        See :func:`fecontact.write_case`.

    Raises
    ------
    InputError
        If there are none, or the file cannot be written.
    """
    from h5py import SoftLink

    require_kind("write_branches", (ContactSystem, type(None)), system=system)
    require_kind("write_branches", Mapping, branches=branches)
    for branch in branches.values():
        require_kind("write_branches", Branch, branch=branch)
    if not branches:
        raise InputError(f"There are no branches to write into {path}.")
    path = as_path(path, "branches")
    with new_file(path) as file:
        if system is not None:
            store_model(file, path, system, study, root)
        for number, (name, branch) in enumerate(branches.items()):
            group = file.create_group(f"branches/{number}")
            group.attrs["name"] = name
            _store(group, branch)
        file["branch"] = SoftLink("/branches/0")
    return path


def read_branches(path: str | Path) -> dict[str, Branch]:
    """Read the branches written by :func:`write_branches`, in their order.

    Raises
    ------
    InputError
        If there is no such file, it is damaged, or it holds no branches.
    """
    with open_file(path, "branches") as file:
        groups = member(file, "branches")
        return {text(groups[key], "name"): _stored(groups[key], path)
                for key in sorted(groups, key=int)}


def write_response(
    path: str | Path, response: FrequencyResponse, *, system: ContactSystem | None = None,
    study: str | None = None, root: str | Path | None = None,
) -> Path:
    """Write a frequency response into one HDF5 file, whole or not at all.

    Its branches are stored as by :func:`write_branches`, which describes the other arguments.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    require_kind("write_response", FrequencyResponse, response=response)
    return write_branches(path, {f"level {number}": branch
                                 for number, branch in enumerate(response.branches)},
                          system=system, study=study, root=root)


def read_response(path: str | Path) -> FrequencyResponse:
    """Read a frequency response written by :func:`write_response`.

    Raises
    ------
    InputError
        If there is no such file, it is damaged, or it holds no response.
    """
    return response_of(read_branches(path))


def write_mode(
    path: str | Path, mode: NonlinearMode, *, system: ContactSystem | None = None,
    study: str | None = None, root: str | Path | None = None,
) -> Path:
    """Write a nonlinear mode into an HDF5 file, whole or not at all.

    Its branch is stored as by :func:`write_branches`, which describes the other arguments.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    require_kind("write_mode", NonlinearMode, mode=mode)
    return write_branches(path, {f"mode {mode.number}": mode.branch}, system=system, study=study,
                          root=root)


def read_mode(path: str | Path) -> NonlinearMode:
    """Read a nonlinear mode written by :func:`write_mode`.

    Raises
    ------
    InputError
        If there is no such file, it is damaged, or it holds no mode.
    """
    return mode_of(read_branch(path))


def write_resonance_curve(path: str | Path, curve: ResonanceCurve) -> Path:
    """Write a curve of resonances into an HDF5 file, whole or not at all.

    Its branch is stored as by :func:`write_branch`.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    require_kind("write_resonance_curve", ResonanceCurve, curve=curve)
    return write_branch(path, curve.branch)


def read_resonance_curve(path: str | Path) -> ResonanceCurve:
    """Read a curve of resonances written by :func:`write_resonance_curve`.

    Raises
    ------
    InputError
        If there is no such file, it is damaged, or it holds no such curve.
    """
    return resonances_of(read_branch(path))


def _store(group: Any, branch: Branch) -> None:
    """Write a branch into an empty HDF5 group."""
    group.attrs.update(parameter=branch.parameter_name, status=branch.status.name,
                       message=branch.message)
    group.create_dataset("kind", data=[point.kind or "" for point in branch.points])
    for name in ("u", "tangent"):
        _write(group, name, [getattr(point, name) for point in branch.points])
    for name in branch.points[0].values if branch.points else ():
        _write(group, f"values/{name}", [point.values[name] for point in branch.points])
    for index, point in enumerate(branch.points):
        for name, value in details_of(point).items():
            group.create_dataset(f"details/{index}/{name}", data=value)
    for name, value in branch.attributes.items():
        group.create_dataset(f"attributes/{name}",
                             data=method_text(value) if name == "method" else value)


def _stored(group: Any, path: str | Path) -> Branch:
    """Read a branch from an HDF5 group written by :func:`_store` in the file ``path``."""
    with reading(path):
        kinds = texts(group, "kind") if len(member(group, "kind")) else []
        count = len(kinds)
        u, tangent = (_vectors(group, name, count) for name in ("u", "tangent"))
        if [len(each) for each in u] != [len(each) for each in tangent]:
            raise DamagedError("'u' and 'tangent' differ in length")
        stored = {name: _read(item, count)
                  for name, item in _members(group, "values").items()}
        details = {int(index): {name: _value(item) for name, item in part.items()}
                   for index, part in _members(group, "details").items()}
        points = tuple(
            special_point(u[k], tangent[k], {name: row[k] for name, row in stored.items()},
                          kinds[k] or None, details.get(k, {})) for k in range(count))
        attributes = {name: _value(item)
                      for name, item in _members(group, "attributes").items()}
        _require_kinds(attributes)
        if "method" in attributes:
            attributes["method"] = _method(attributes["method"])
        _require_orbits(attributes, u, stored)
        _require_tori(attributes, u, stored)
        return Branch(text(group, "parameter"), points, BranchStatus[text(group, "status")],
                      text(group, "message"), attributes)


# Attributes of branches by what they are.
_COUNTS = ("displacements", "memory", "memory_nodes", "mode_number", "periods",
           "torus_displacements", "torus_memory")
_LAYOUT = ("displacements", "memory", "memory_nodes", "method", "state_names")
_NUMBERS = ("level",)
_TEXTS = ("condition", "kind", "level_label", "level_name", "method", "observed")
_LISTS = ("labels", "parameter_names", "parameters", "state_names")
_ARRAYS = ("limits", "parameter_values", "scales", "torus_harmonics", "torus_samples", "widths")
_TORI = ("torus_harmonics", "torus_samples", "torus_displacements", "torus_multipliers",
         "tolerance", "periods", "scales", "state_names")


def _require_kinds(attributes: dict[str, Any]) -> None:
    """Raise DamagedError for attributes of another kind."""
    for name, value in attributes.items():
        if name in _COUNTS:
            sound = isinstance(value, int) and value >= 0
        elif name in _NUMBERS:
            sound = isinstance(value, int | float) and not math.isinf(value)  # NaN without a level
        elif name in _TEXTS:
            sound = isinstance(value, str)
        elif name in _LISTS:
            sound = (all(isinstance(one, str) for one in value) if isinstance(value, list)
                     else isinstance(value, np.ndarray) and not value.size)
        elif name in _ARRAYS:
            sound = isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fiu"
        else:
            sound = True
        if not sound:
            raise DamagedError(f"the attribute '{name}' is {shown(value)}")


def _method(written: str) -> Method:
    try:
        return method_from_text(written)
    except InputError as error:
        raise DamagedError(f"the attribute 'method' is {shown(written)}") from error


def _require_orbits(attributes: dict[str, Any], u: list[Array], stored: dict[str, Any]) -> None:
    """Raise DamagedError where responses and orbits by harmonic balance lack a part, or disagree.

    ``u`` are the unknowns of the points, ``stored`` their values by name.
    """
    method, response = attributes.get("method"), "level" in attributes
    balanced = "displacements" in attributes or isinstance(method, HarmonicBalance)
    needed = (_LAYOUT if balanced else ()) + (
        ("level_name", "observed", "periods") if response else ())
    values = (("period", "truncation_error") if balanced else ()) + (
        ("observed_amplitude", "period") if response else ())
    for name, one in stored.items():
        if name == "period" or name.startswith("observed_"):
            if not np.isfinite(one).all():
                raise DamagedError(f"'values/{name}' holds values that are not finite")
        elif name == "unstable" and not all(isinstance(each, int) for each in one):
            raise DamagedError("'values/unstable' holds no whole numbers")
    missing = [*(name for name in needed if name not in attributes),
               *(name for name in values if u and name not in stored)]
    if missing:
        raise DamagedError(f"it lacks '{missing[0]}'")
    if response and any(not 0 < attributes["periods"] < len(each)
                        for each in stored.get("observed_harmonics", [])):
        raise DamagedError(f"the attribute 'periods' is {attributes['periods']}")
    if not balanced:
        return
    if not isinstance(method, HarmonicBalance):
        raise DamagedError("the attribute 'method' is not harmonic balance")
    layout = layout_from(attributes)
    count = (2 * method.highest + 1) * layout.harmonic
    if not (2 * layout.displacements + layout.memory <= layout.states and layout.nodes <= (
            layout.memory) and all(count < len(each) for each in u)):
        raise DamagedError(f"{layout.states} states do not fit its displacements and harmonics")
    if layout.memory and u and any(np.shape(each)[1:] != (layout.memory,)
                                   for each in stored.get("memory", [()])):
        raise DamagedError(f"'values/memory' has no {layout.memory} internal variables")


def _require_tori(attributes: dict[str, Any], u: list[Array], stored: dict[str, Any]) -> None:
    """Raise DamagedError where tori lack a part, or parts disagree; see _require_orbits."""
    if "torus_harmonics" not in attributes:
        return
    missing = [*(name for name in _TORI if name not in attributes),
               *(name for name in ("frequency_1", "frequency_2") if u and name not in stored)]
    if missing:
        raise DamagedError(f"it lacks '{missing[0]}'")
    states, m = len(attributes["state_names"]), attributes["torus_displacements"]
    harmonics, c = attributes["torus_harmonics"].tolist(), attributes.get("torus_memory", 0)
    if len(harmonics) != 2 or min(harmonics) < 1 or not 2 * m + c <= states:
        raise DamagedError(f"the attribute 'torus_harmonics' is {shown(harmonics)}")
    L = (2 * harmonics[0] + 1) * (2 * harmonics[1] + 1)
    if not all(L * (states - m - c) < len(each) for each in u):
        raise DamagedError(f"{states} states do not fit the harmonics {shown(harmonics)}")
    if c and u and any(np.shape(each) != (L, c) for each in stored.get("memory", [()])):
        raise DamagedError(f"'values/memory' has no {L} coefficients of {c} deflections")


def _write(group: Any, name: str, values: list[Any]) -> None:
    """Write one dataset for values of equal shape, else one for each value."""
    if len({np.shape(value) for value in values}) <= 1:
        group.create_dataset(name, data=np.array(values) if not values
                             or not isinstance(values[0], str) else values)
        return
    for index, value in enumerate(values):
        group.create_dataset(f"{name}/{index}", data=value)


def _vectors(group: Any, name: str, count: int) -> list[Any]:
    """Vectors written by :func:`_write`."""
    if hasattr(member(group, name), "shape"):
        return [*bounded(group, name, (count, None) if count else (0,), 1e100)]
    return [bounded(group, f"{name}/{index}", (None,), 1e100) for index in range(count)]


def _members(group: Any, name: str) -> Any:
    """Members of a group; empty if it is missing."""
    if name not in group:
        return {}
    found = member(group, name)
    if not hasattr(found, "items"):
        raise DamagedError(f"'{name}' is no group")
    return found


def _read(item: Any, count: int) -> list[Any]:
    if not hasattr(item, "shape"):
        return [_value(item[str(index)]) for index in range(count)]
    found = [_plain(value) for value in np.atleast_1d(values(item))]
    require_lengths(f"'{item.name}'", count, found)
    return found


def _value(item: Any) -> Any:
    return _plain(values(item))


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
