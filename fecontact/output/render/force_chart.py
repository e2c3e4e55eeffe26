"""Chart of the total contact forces over time, with a cursor, above the scene of flat bodies."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.resolved import resolved
from fecontact.output.diagrams.colours import INK
from fecontact.output.diagrams.runs import forces_on_body_diagram
from fecontact.output.plots.drawing import draw
from fecontact.output.render.canvas import canvas_of
from fecontact.output.render.frames_data import Motion

Image = NDArray[np.uint8]

_GRID, _CURSOR = "#e4e2de", (178, 24, 43)


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
        motion = self.motion
        first, last = float(motion.times[0]), float(motion.times[-1])
        trajectory = motion.trajectory
        if last > first:
            trajectory = resolved(trajectory.between(first, last)).trajectory
        diagram = forces_on_body_diagram(trajectory, 0.1 * self.font)
        columns = 4 if len(diagram.curves) > 2 else 2
        columns = min(columns, max(2, int(self.width / (13.0 * self.font))))
        # The legend stands above the axes, where the cursor does not cross it.
        above = 1.8 * self.font * -(-len(diagram.curves) // columns) / self.height
        right = min(0.97, 1.0 - 1.9 * self.font / self.width)
        axes: Any = figure.add_axes((left, below, right - left, 0.98 - above - below))
        draw(axes, diagram)
        # Nearly constant forces stay clear of the border.
        axes.margins(y=0.1)
        axes.set_ylabel(axes.get_ylabel(), fontsize=0.9 * self.font, color=INK)
        axes.set_xlabel(axes.get_xlabel(), fontsize=0.9 * self.font, color=INK, labelpad=0.0)
        axes.tick_params(labelsize=0.9 * self.font, colors=INK, length=0.3 * self.font)
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
            np.column_stack([motion.times, np.zeros(len(motion.times))]))[:, 0]
        cursor = np.clip(np.round(cursor), 2, self.width - 3).astype(np.intp)
        return image, (self.height - int(box.y1), self.height - int(box.y0)), cursor
