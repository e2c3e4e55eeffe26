"""Frames of a run as PVD and VTU files, for ParaView before 5.12 and other programs."""

import re
from pathlib import Path

from fecontact.core.errors import InputError
from fecontact.core.files.atomic_write import output_folder, replaced, replaced_folder
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.case import Case, read_case
from fecontact.output.files.fields_of_frames import FrameFields
from fecontact.output.files.frames import body_numbers, frame_indices, require_field
from fecontact.output.files.vtu import VtuField, write_vtu


def export_pvd(
    case: Case | Trajectory | str | Path, path: str | Path, *, frames: int = 200,
    trust: bool = False,
) -> Path:
    """Write frames of a run into a folder of VTU files, and a PVD file that lists them.

    Each frame holds ``displacement`` [m], ``velocity`` [m/s], ``von_mises`` [Pa], ``contact_force``
    [N] and ``contact_state`` (0 open, 1 stick, 2 slip, -1 no contact node) at the nodes of the
    undeformed body and ``stress`` [Pa] of its cells, of solids also ``contact_pressure``,
    ``contact_traction`` [Pa] and ``contact_state`` of cells on the contact faces, as in
    :func:`fecontact.write_case`, and with several bodies the number ``body`` of each.

    Parameters
    ----------
    case : Case, Trajectory, str or Path
        The run, or the file it is stored in.
    path : str or Path
        ``FOLDER`` writes ``FOLDER/FOLDER.pvd`` and the frames beside it; ``NAME.pvd`` writes the
        frames to the folder ``NAME``. The folder is written whole or not at all. An existing
        folder is replaced if it contains only files of these names; missing parent folders are
        created.
    frames : int
        Number of evenly spaced frames, at most one for each output time.
    trust : bool
        Whether to run code that a file names; see :func:`fecontact.read_case`.

    Returns
    -------
    Path
        The PVD file.

    Raises
    ------
    InputError
        If the run has no shapes over the body, ``frames`` is not positive, the folder contains
        other files or cannot be written, or the case cannot be read.
    """
    trajectory = _trajectory(case, trust)
    field = require_field(trajectory)
    indices = frame_indices(trajectory.time, frames)
    if not len(indices):
        raise InputError("frames = 0 makes no files; give at least 1.")
    path = Path(path)
    beside = path.suffix == ".pvd"
    folder = path.with_suffix("") if beside else path
    name = folder.name
    collection = path if beside else folder / f"{name}.pvd"
    _require_free(folder)
    basis, fields = trajectory.basis, FrameFields(trajectory)
    body = ([VtuField("body", "Point", numbers := body_numbers(basis)),
             VtuField("body", "Cell", numbers[fields.cells[:, 0]])] if basis.parts else [])
    with output_folder(folder.parent), replaced_folder(folder) as part:
        names = []
        for number, index in enumerate(indices):
            found = fields.at(slice(index, index + 1))
            names.append(f"{name}_{number:04d}.vtu")
            write_vtu(part / names[-1], field.nodes, fields.cells, [
                *(VtuField(one.name, one.of, one.flat(found[one.of, one.name]), one.components)
                  for one in fields.kinds), *body], float(trajectory.time[index]))
        times = trajectory.time[indices].tolist()
        if not beside:
            (part / collection.name).write_text(_collection(names, times), encoding="utf-8")
    if beside:
        with replaced(collection) as file:
            file.write_text(_collection([f"{name}/{one}" for one in names], times),
                            encoding="utf-8")
    return collection


def _trajectory(case: Case | Trajectory | str | Path, trust: bool) -> Trajectory:
    if isinstance(case, Trajectory):
        return case
    return (case if isinstance(case, Case) else read_case(case, trust=trust)).trajectory


def _collection(names: list[str], times: list[float]) -> str:
    from xml.sax.saxutils import quoteattr

    sets = [f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(name)}/>'
            for name, time in zip(names, times, strict=True)]
    return "\n".join([
        '<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "  <Collection>",
        *sets, "  </Collection>", "</VTKFile>", ""])


def _require_free(folder: Path) -> None:
    if not folder.name or folder.name == "..":
        raise InputError(f"Give a folder of its own for the frames, not '{folder}'.")
    if not folder.parent.parent.is_dir():
        raise InputError(f"{folder} cannot be written: folder {folder.parent.parent} does not "
                         f"exist.")
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file; give a folder.")
    ours = re.compile(re.escape(folder.name) + r"(_\d{4,}\.vtu|\.pvd)")
    others = [item.name for item in folder.iterdir() if not ours.fullmatch(item.name)] \
        if folder.is_dir() else []
    if others:
        raise InputError(f"{folder} holds other files ({min(others)}); give a folder of its own "
                         f"for the frames.")
