"""A run at one time as a grid of PyVista."""

from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.errors import InputError, MissingLibraryError
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.fields_of_frames import FrameFields
from fecontact.output.files.frames import require_drawable, require_field
from fecontact.output.files.vtk_cells import cells_of_vtk

if TYPE_CHECKING:
    import pyvista


def to_pyvista(trajectory: Trajectory, time: float | None = None) -> "pyvista.UnstructuredGrid":
    """The bodies of a run at the output nearest to a time, with their fields.

    Points are those of the undeformed bodies; ``grid.warp_by_vector("displacement")`` deforms them.
    Data are those of files for ParaView: displacement [m], velocity [m/s], von_mises [Pa],
    contact_force [N] and contact_state at points, stress [Pa] in cells, of solids pressure and
    traction of contacts [Pa] too; ``time`` [s] is field data.

    Parameters
    ----------
    trajectory : Trajectory
        Run whose modal basis holds shapes over the body.
    time : float, optional
        Time of the state [s]; by default the end of the run.

    Raises
    ------
    InputError
        Without shapes, and for a time outside the run.
    MissingLibraryError
        If PyVista is not installed.

    Examples
    --------
    >>> import fecontact as fc
    >>> from fecontact.io import to_pyvista
    >>> from fecontact.laws import ConstantFriction, LinearContact
    >>> body = fc.ElasticBody(fc.generate(fc.Block(0.1, 0.05, 0.05)))
    >>> system = fc.ContactSystem(fc.modal_basis(body, 5), LinearContact(1e7),
    ...                           ConstantFriction(0.3), load=fc.Load(100.0))
    >>> run = fc.simulate(system, 1e-3, outputs=11)
    >>> grid = to_pyvista(run)
    >>> grid.point_data["displacement"].shape == (grid.n_points, 3), sorted(grid.cell_data)
    (True, ['stress'])
    """
    try:
        import pyvista
    except ImportError:
        raise MissingLibraryError("PyVista is not installed; install it with pip install "
                                  "'fecontact[render]'.") from None
    field, outputs = require_field(trajectory), trajectory.time
    time = float(outputs[-1]) if time is None else time
    if not (isinstance(time, Real) and outputs[0] <= time <= outputs[-1]):
        raise InputError(f"to_pyvista: time = {time!r} must be from {outputs[0]:g} to "
                         f"{outputs[-1]:g} s, as the run goes.")
    at = int(np.argmin(np.abs(outputs - time)))
    which = slice(at, at + 1)
    require_drawable(trajectory, which)
    d = field.nodes.shape[1]
    points = np.zeros((len(field.nodes), 3))
    points[:, :d] = field.nodes
    fields = FrameFields(trajectory)
    connectivity, offsets, types = cells_of_vtk(fields.cells, d)
    cells = np.insert(connectivity, offsets[:-1], np.diff(offsets))
    grid = pyvista.UnstructuredGrid(cells, types, points)
    values = fields.at(which)
    for kind in fields.kinds:
        data = grid.point_data if kind.of == "Point" else grid.cell_data
        data[kind.name] = kind.flat(values[kind.of, kind.name])
    grid.field_data["time"] = [outputs[at]]
    return grid
