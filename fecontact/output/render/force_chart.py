"""Chart of the total contact forces over time, with a cursor, above the scene of flat bodies."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.resolved import resolved
from fecontact.core.types import Array
from fecontact.core.units import suitable_unit
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.diagrams.colours import COLOURS, DASHES, distinct_colours
from fecontact.output.diagrams.diagram import thinned
from fecontact.output.plots.style import legend_label
from fecontact.output.render.canvas import canvas_of
from fecontact.output.render.frames_data import Motion
from fecontact.reduction.assembly.contact_faces import contact_faces

Image = NDArray[np.uint8]

_DARK, _GRID, _CURSOR = "#303030", "#e4e2de", (178, 24, 43)


class _Line(NamedTuple):
    name: str
    values: Array
    colour: str
    style: Any = "-"


def _totals(trajectory: Trajectory, part: Any) -> list[_Line]:
    """Sums of normal and friction forces over the chosen times; no friction without any."""
    normal, friction = trajectory.normal_force, -trajectory.friction_force
    faces = contact_faces(trajectory.system.basis)
    if trajectory.system.basis.dimension == 3:
        return _totals_in_space(trajectory, part)
    if not faces[0].name:
        lines = [_Line("normal force", normal[part].sum(axis=1), _DARK)]
        if friction.any():
            lines.append(_Line("friction on the body, +x", friction[part].sum(axis=1),
                               COLOURS[3]))
        return lines
    lines = []
    for face, colour in zip(faces, distinct_colours(len(faces)), strict=True):
        lines.append(_Line(f"{face.name}: normal", normal[part, face.nodes].sum(axis=1), colour))
        if friction[:, face.nodes].any():
            lines.append(_Line(f"{face.name}: friction", friction[part, face.nodes].sum(axis=1),
                               colour, DASHES))
    return lines


def _totals_in_space(trajectory: Trajectory, part: Any) -> list[_Line]:
    """Sums of the normal forces, and of friction along x and y; of interfaces its size."""
    basis = trajectory.system.basis
    faces, normal = contact_faces(basis), trajectory.normal_force[part]
    friction = -np.einsum("fnk,nkd->fnd", trajectory.friction_forces[part], basis.tangents)
    if not faces[0].name:
        lines = [_Line("normal", normal.sum(axis=1), _DARK)]
        for axis, name in enumerate("xy"):
            if friction[..., axis].any():
                lines.append(_Line(f"friction {name}", friction[..., axis].sum(axis=1),
                                   COLOURS[(0, 1)[axis]]))
        return lines
    lines = []
    for face, colour in zip(faces, distinct_colours(len(faces)), strict=True):
        lines.append(_Line(f"{face.name}: normal", normal[:, face.nodes].sum(axis=1), colour))
        if friction[:, face.nodes].any():
            total = np.linalg.norm(friction[:, face.nodes].sum(axis=1), axis=1)
            lines.append(_Line(f"{face.name}: friction", total, colour, DASHES))
    return lines


@dataclass(frozen=True, eq=False)
class ForceChart:
    """A strip with the sums of the forces on the body over the time that is drawn.

    The normal forces are positive in +y, friction in +x, as the arrows of the scene: -R. With
    several bodies, sums of each interface along its normals and tangents. In space normal forces,
    and friction on the body along x and y; of interfaces the size of its sum.

    Attributes
    ----------
    motion : Motion
    width, height : int
        Size in pixels.
    font : float
        Size of text in points, at 100 pixels an inch.
    """

    motion: Motion
    width: int
    height: int
    font: float

    def image(self, frame: int) -> Image:
        """The strip (height, width, 3) with the cursor at a frame."""
        lines, (low, high), columns = self._drawn
        image = lines.copy()
        half = max(1, round(0.1 * self.font))
        column = int(columns[frame])
        image[low:high, column - half : column + half] = _CURSOR
        return image

    @cached_property
    def _drawn(self) -> tuple[Image, tuple[int, int], NDArray[np.intp]]:
        """The strip without cursor, the rows of its axes, and the column of each frame."""
        figure, canvas = canvas_of(self.width, self.height)
        left, below = 7.0 * self.font / self.width, 3.4 * self.font / self.height
        motion, trajectory = self.motion, self.motion.trajectory
        first, last = float(motion.times[0]), float(motion.times[-1])
        # To repeat runs of solids may take minutes.
        if last > first and trajectory.system.basis.dimension == 2:
            trajectory = resolved(trajectory.between(first, last)).trajectory
        part = (first <= trajectory.time) & (trajectory.time <= last)
        totals = _totals(trajectory, part)
        columns = 4 if len(totals) > 2 else 2
        columns = min(columns, max(2, int(self.width / (13.0 * self.font))))
        # The legend stands above the axes, where the cursor does not cross it.
        above = 1.8 * self.font * -(-len(totals) // columns) / self.height
        right = min(0.97, 1.0 - 1.9 * self.font / self.width)
        axes: Any = figure.add_axes((left, below, right - left, 0.98 - above - below))
        time_unit, symbol = suitable_unit(float(np.abs(motion.times).max()), "s")
        largest = max(float(np.abs(line.values).max()) for line in totals)
        unit, force_symbol = suitable_unit(largest, "N")
        for line in totals:
            axes.plot(*thinned(trajectory.time[part] / time_unit, line.values / unit),
                      color=line.colour, linestyle=line.style, linewidth=0.1 * self.font,
                      label=legend_label(line.name))
        # Nearly constant forces stay clear of the border.
        axes.margins(y=0.1)
        if len(motion.times) > 1:
            axes.set_xlim(motion.times[0] / time_unit, motion.times[-1] / time_unit)
        axes.set_ylabel(f"total [{force_symbol}]", fontsize=0.9 * self.font, color=_DARK)
        axes.set_xlabel(f"t [{symbol}]", fontsize=0.9 * self.font, color=_DARK, labelpad=0.0)
        axes.tick_params(labelsize=0.9 * self.font, colors=_DARK, length=0.3 * self.font)
        axes.locator_params(axis="y", nbins=4)
        axes.grid(color=_GRID)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        legend = axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns,
                    fontsize=0.9 * self.font, frameon=False, borderaxespad=0.0, borderpad=0.2)
        for text in legend.get_texts():
            text.set_parse_math(False)
        canvas.draw()
        image = np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
        box = axes.get_window_extent()
        cursor = axes.transData.transform(
            np.column_stack([motion.times / time_unit, np.zeros(len(motion.times))]))[:, 0]
        cursor = np.clip(np.round(cursor), 2, self.width - 3).astype(np.intp)
        return image, (self.height - int(box.y1), self.height - int(box.y0)), cursor
