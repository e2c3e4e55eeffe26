"""Runs and fields for other programs: CSV, MATLAB, netCDF; VTU for ParaView."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_path, require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.files.atomic_write import replaced
from fecontact.core.files.csv_text import csv_text
from fecontact.fem.fields import BodyFields
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.dataset import columns, coordinates, to_xarray, variables
from fecontact.output.files.vtk_cells import written_cells
from fecontact.output.files.vtu import VtuField, write_vtu

SUFFIXES = {"csv": ".csv", "mat": ".mat", "netcdf": ".nc"}


def export_csv(trajectory: Trajectory, path: str | Path) -> Path:
    """Write a run as a CSV table: one row per time, one column per quantity, headers with units.

    Numbers read back exactly. Modal coordinates are omitted.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    table = columns(trajectory)

    def write(part: Path) -> None:
        with part.open("w", encoding="utf-8", newline="\n") as file:
            file.write(csv_text([list(table)]))
            for first in range(0, len(trajectory.time), 1000):
                rows = np.column_stack([values[first : first + 1000] for values in table.values()])
                # Shortest decimals that read back exactly.
                file.writelines(",".join(map(repr, row)) + "\n" for row in rows.tolist())

    return _whole(path, write)


def export_mat(trajectory: Trajectory, path: str | Path) -> Path:
    """Write a run for MATLAB and Octave (version 5).

    Variables as of :func:`fecontact.output.files.dataset.variables`, ``time`` and the other
    coordinates, and a structure ``units`` with the unit of each.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    from scipy.io import savemat

    everything = coordinates(trajectory) | variables(trajectory)
    content: dict[str, Any] = {
        name: variable.values.astype(object) if variable.values.dtype.kind == "U"
        else variable.values for name, variable in everything.items()}
    content["units"] = {name: variable.unit for name, variable in everything.items()}
    content["status"] = trajectory.status.value

    def write(part: Path) -> None:
        savemat(part, content, appendmat=False, do_compression=True, oned_as="column",
                long_field_names=True)

    return _whole(path, write)


def export_netcdf(trajectory: Trajectory, path: str | Path) -> Path:
    """Write a run as netCDF (version 3, 64-bit offsets), as :func:`to_xarray` names it.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        If it cannot be written.
    MissingLibraryError
        If xarray is not installed.
    """
    dataset = to_xarray(trajectory)

    def write(part: Path) -> None:
        dataset.to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")

    return _whole(path, write)


def export_run(
    trajectory: Trajectory, case: Path, form: str, output: Path | None = None, frames: int = 200
) -> Path:
    """Write a stored run in another format beside its file, or to ``output``.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    case : Path
        The file it is stored in.
    form : 'pvd', 'csv', 'mat' or 'netcdf'
        The format.
    output : Path, optional
        A file; for 'pvd' a folder.
    frames : int
        Number of fields over the body, for 'pvd'.

    Raises
    ------
    InputError
        For an unknown format, a wrong file suffix, or a file that cannot be written.
    """
    if form == "pvd":
        from fecontact.output.files.pvd import export_pvd

        folder = output or case.with_name(f"{case.stem}-pvd")
        return export_pvd(trajectory, folder / f"{case.stem}.pvd", frames=frames)
    if form not in SUFFIXES:
        raise InputError(f"format = {form!r} must be one of {choices(('pvd', *SUFFIXES))}"
                         f"{nearest(form, SUFFIXES)}.")
    path = output or case.with_suffix(SUFFIXES[form])
    if path.suffix != SUFFIXES[form]:
        raise InputError(f"{path} must end in {SUFFIXES[form]} for the format {form}.")
    writers = {"csv": export_csv, "mat": export_mat, "netcdf": export_netcdf}
    return writers[form](trajectory, path)


def export_fields(fields: BodyFields, path: str | Path) -> Path:
    """Write displacement and stress over a body as a VTU file, for ParaView and other programs.

    At the nodes of the undeformed body: ``displacement`` [m], ``stress_xx``, ``stress_yy``,
    ``stress_zz``, ``stress_xy``, of solids ``stress_yz`` and ``stress_xz``, and ``von_mises`` [Pa].

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        If the name does not end in .vtu, or the file cannot be written.
    """
    require_kind("export_fields", BodyFields, fields=fields)
    path = as_path(path, "fields")
    if path.suffix.lower() != ".vtu":
        raise InputError(f"{path}: fields are written as VTU files; choose a name that ends in "
                         f".vtu.")
    d = fields.nodes.shape[1]
    moved = np.zeros((len(fields.nodes), 3))
    moved[:, :d] = fields.displacement
    with replaced(path) as part:
        write_vtu(part, fields.nodes, written_cells(fields.nodes, fields.elements, fields.cells), [
            VtuField("displacement", "Point", moved, ("x", "y", "z")),
            *(VtuField(f"stress_{name}", "Point", values) for name, values in zip(
                ("xx", "yy", "zz", "xy", "yz", "xz")[: 4 if d == 2 else 6], fields.stress.T,
                strict=True)),
            VtuField("von_mises", "Point", fields.von_mises)])
    return path


def _whole(path: str | Path, write: Callable[[Path], None]) -> Path:
    """Write to a temporary file and move it into place when it is complete."""
    path = as_path(path, "a table")
    with replaced(path) as part:
        write(part)
    return path
