"""Movies of whole wheels from one sector: modes of nodal diameters, responses to engine orders."""

from pathlib import Path

import numpy as np

from fecontact.bifurcation.harmonic.wheel_orbits import WheelMotion
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ComplexArray, Integers
from fecontact.fem.faces.surface import triangles_if_mixed
from fecontact.fem.fields import linear_cells, of_one_width
from fecontact.output.render.mode_movie import ModeMotion, write_motion
from fecontact.output.render.movie import Progress
from fecontact.reduction.mode_shapes import ModeShapes
from fecontact.reduction.reduce_body import first_order
from fecontact.reduction.sector_modes import SectorModes


def render_wheel(
    wheel: SectorModes | WheelMotion,
    path: str | Path,
    diameter: int = 0,
    mode: int = 0,
    *,
    frames: int = 50,
    periods: int = 2,
    fps: float = 25,
    size: tuple[int, int] = (960, 720),
    scale: float = 1.0,
    title: str | None = None,
    progress: bool | Progress | None = None,
) -> Path:
    """Draw a whole wheel as a movie or as numbered pictures, whole or not at all.

    A double mode is drawn as a wave that travels around the wheel, a response with all its
    harmonics.

    Parameters
    ----------
    wheel : SectorModes or WheelMotion
        Result of :func:`fecontact.reduction.sector_modes`, or of
        :func:`fecontact.bifurcation.wheel_motion`.
    path : str or Path
        See :func:`fecontact.render`.
    diameter, mode : int
        Nodal diameter and number of the mode, from 0; without meaning for a response.
    frames, periods, fps, size, scale, title, progress
        See :func:`fecontact.plot.render_mode`; pictures of a wheel are taller.

    Returns the movie, the folder, or the first picture.

    Raises
    ------
    InputError, MissingLibraryError
        For a mode that is not there, and as :func:`fecontact.render`.
    """
    require_kind("render_wheel", (SectorModes, WheelMotion), wheel=wheel)
    if isinstance(wheel, WheelMotion):
        motion, words = _of_response(wheel)
    else:
        motion, words = _of_mode(wheel, diameter, mode)
    return write_motion(motion, path, words if title is None else title, frames=frames,
                        periods=periods, fps=fps, size=size, scale=scale, progress=progress)


def _of_mode(wheel: SectorModes, diameter: int, mode: int) -> tuple[ModeMotion, str]:
    """A mode prepared for drawing, and its description."""
    real, turned = (wheel.on_wheel(diameter, mode, phase) for phase in (0.0, 0.5 * np.pi))
    hertz = float(wheel.frequencies_hz[wheel.row(diameter), mode])
    words = f"diameter {diameter}, " + (f"{hertz:.5g} Hz" if hertz else "rigid")
    shapes = {1: real.displacement - 1j * turned.displacement}
    return ModeMotion(_drawn(real.nodes, real.cells, real.outline), shapes, np.zeros(0)), words


def _of_response(motion: WheelMotion) -> tuple[ModeMotion, str]:
    """A response prepared for drawing, without its mean, and its description."""
    if not motion.wheel.bodies:
        raise InputError("render_wheel: the wheel is one of reduced bodies, without meshes; make "
                         "it by cyclic_basis to draw it.")
    symmetry, first = motion.wheel.symmetry, 0
    nodes, cells, outlines, starts = [], [], [], []
    shapes: dict[int, list[ComplexArray]] = {h: [] for h in motion.amplitudes if h}
    for name, body in motion.wheel.bodies.items():
        own = linear_cells(body.nodes, body.elements)
        edges = first_order(body, body.mesh.outline)
        for s in range(symmetry.sectors):
            nodes.append(symmetry.turned(body.nodes, s))
            cells.append(own)
            outlines.append(edges)
            starts.append(first)
            first += len(body.nodes)
            turn = symmetry.rotation(body.dimension, s).T
            for h, found in shapes.items():
                found.append(motion.harmonic(name, h, s) @ turn)
    whole = {h: np.concatenate(found) for h, found in shapes.items()}
    words = f"engine order {motion.order}, {1.0 / motion.period:.5g} Hz"
    joined = [np.concatenate([array + start for array, start in zip(
        of_one_shape(arrays), starts, strict=True)])
        for arrays, of_one_shape in ((cells, of_one_width), (outlines, triangles_if_mixed))]
    return ModeMotion(_drawn(np.concatenate(nodes), *joined), whole, np.zeros(0)), words


def _drawn(nodes: Array, cells: Integers, outline: Integers) -> ModeShapes:
    """Nodes, cells and outline of a body, without shapes and stress."""
    import scipy.sparse as sp

    d = nodes.shape[1]
    return ModeShapes(nodes, cells, outline, np.zeros((len(nodes), d, 0)),
                      np.zeros((len(nodes), 4 if d == 2 else 6, 0)),
                      sp.csr_array((0, nodes.size)))
