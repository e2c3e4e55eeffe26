"""Chart of the total contact forces over time, with a cursor, beside the scene of a run."""

from typing import Any

from fecontact.analysis.resolved import resolved
from fecontact.output.diagrams.colours import INK
from fecontact.output.diagrams.runs import forces_on_body_diagram
from fecontact.output.plots.drawing import draw
from fecontact.output.render.frames_data import Motion
from fecontact.output.render.overlay import Overlay
from fecontact.output.render.scene import FORCE_COLOUR

_GRID = "#e4e2de"


def draw_force_chart(
    overlay: Overlay, motion: Motion, place: tuple[int, int, int, int], font: float
) -> None:
    """Draw the sums of the forces on the body over the time that is drawn, with a cursor.

    ``place`` is the left and upper end, width and height of the chart [pixels], ``font`` the size
    of text [points at 100 pixels an inch]. Forces are those of
    :func:`~fecontact.output.diagrams.runs.forces_on_body_diagram`.
    """
    _, _, width, height = place
    left, below = 7.0 * font / width, 3.4 * font / height
    first, last = float(motion.times[0]), float(motion.times[-1])
    trajectory = motion.trajectory
    if last > first:
        trajectory = resolved(trajectory.between(first, last)).trajectory
    diagram = forces_on_body_diagram(trajectory, 0.1 * font)
    columns = 4 if len(diagram.curves) > 2 else 2
    columns = min(columns, max(2, int(width / (13.0 * font))))
    # The legend stands above the axes, where the cursor does not cross it.
    above = 1.8 * font * -(-len(diagram.curves) // columns) / height
    right = min(0.97, 1.0 - 1.9 * font / width)
    axes: Any = overlay.strip(*place).inset_axes((left, below, right - left, 0.98 - above - below))
    draw(axes, diagram)
    # Nearly constant forces stay clear of the border.
    axes.margins(y=0.1)
    axes.set_ylabel(axes.get_ylabel(), fontsize=0.9 * font, color=INK)
    axes.set_xlabel(axes.get_xlabel(), fontsize=0.9 * font, color=INK, labelpad=0.0)
    axes.tick_params(labelsize=0.9 * font, colors=INK, length=0.3 * font)
    axes.locator_params(axis="y", nbins=4)
    axes.grid(color=_GRID)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    legend = axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns,
                         fontsize=0.9 * font, frameon=False, borderaxespad=0.0, borderpad=0.2)
    for text in legend.get_texts():
        text.set_parse_math(False)
    cursor = axes.axvline(first, color=FORCE_COLOUR, linewidth=0.14 * font,
                          antialiased=False, clip_on=False)
    overlay.changing(lambda frame: cursor.set_xdata([motion.times[frame]] * 2), cursor)
