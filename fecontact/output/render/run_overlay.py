"""The picture around the scene of a run: clock, legends, forces over time, maps of solids."""

from typing import Any

import numpy as np

from fecontact.core.units import quantity, suitable_unit
from fecontact.output.diagrams.colours import PRESSURE_MAP
from fecontact.output.render.face_maps import draw_face_maps
from fecontact.output.render.force_chart import draw_force_chart
from fecontact.output.render.frames_data import COLOURS, Motion
from fecontact.output.render.overlay import FONT, Overlay
from fecontact.output.render.pixels import DARK
from fecontact.output.render.plane_parts import needed_height
from fecontact.output.render.scene import COLOUR_MAPS, FORCE_COLOUR, NODE_COLOURS

_LEAST_CHART = 90.0  # pixels at 960 x 540
_MOST_CHART = 0.6  # of the height between title and legend
_SPARE = 1.04  # height of a scene below a chart, relative to what it needs
# Of solids: width of the scene, and height of the chart in the column beside it.
_SCENE, _CHART = 0.58, 0.27


class RunOverlay(Overlay):
    """Overlay of a run: above flat bodies, or beside solids, are the total forces over time.

    ``slowness`` are seconds of the movie per second of the motion; None for pictures.
    """

    def __init__(
        self, motion: Motion, width: int, height: int, title: str | None = None,
        slowness: float | None = None,
    ) -> None:
        super().__init__(width, height, title, _scales(motion, slowness))
        self.motion, below = motion, self.scene_height
        if motion.solid:
            self.scene_width = left = 2 * round(0.5 * _SCENE * width)
            self.chart_height = 2 * round(0.5 * _CHART * below)
            top = self.header_height + below - self.chart_height
            draw_face_maps(self, motion, (left, self.header_height, width - left,
                                          below - self.chart_height))
            draw_force_chart(self, motion, (left, top, width - left, self.chart_height),
                             0.92 * FONT * self.size)
            self._solid_legend()
        else:
            self.chart_height = self._chart_height()
            self.scene_top += self.chart_height
            self.scene_height -= self.chart_height
            if self.chart_height:
                draw_force_chart(self, motion, (0, self.header_height, width, self.chart_height),
                                 FONT * self.size)
            self._plane_legend()
        self._add_clock()

    def _chart_height(self) -> int:
        """Height of the chart above flat bodies in pixels, or zero if they leave none.

        The scene keeps little more than it needs, and at least a third. Without contact nodes there
        is no chart.
        """
        if not self.motion.trajectory.basis.contact_nodes:
            return 0
        needed = _SPARE * needed_height(self.motion) * self.width
        left = min(self.scene_height - needed, _MOST_CHART * self.scene_height)
        return 2 * int(0.5 * left) if left >= _LEAST_CHART * self.size else 0

    def _add_clock(self) -> None:
        times = self.motion.times
        factor, symbol = suitable_unit(float(np.abs(times).max()), "s")
        step = np.diff(times).min() / factor if len(times) > 1 else 0.001
        decimals = int(np.clip(np.ceil(-np.log10(max(step, 1e-9)) + 0.3), 0, 4))
        clock = self.text(self.header, 0.97, 0.46, "", ha="right", fontsize=1.1 * FONT * self.size)
        self.changing(lambda frame: clock.set_text(
            f"t = {times[frame] / factor:.{decimals}f} {symbol}"), clock)

    def _body_colours(self, span: tuple[float, float]) -> None:
        name, unit = COLOURS[self.motion.colour]
        largest = self.motion.largest_colour or 1.0
        factor, symbol = suitable_unit(largest, unit)
        beyond = self.motion.peak > largest
        label = f"{name} [{symbol}]" + (f", peak {self.motion.peak / factor:.3g}" if beyond else "")
        self.colour_scale(label, largest / factor, COLOUR_MAPS[self.motion.colour], beyond, span)

    def _states(self, marker: str, left: float, apart: float) -> None:
        """Draw the contact states with their colours into the footer."""
        from matplotlib.lines import Line2D

        for number, name in enumerate(self.motion.state_names):
            x = left + number * apart
            self.footer.add_artist(Line2D(
                [x], [0.80], marker=marker, markersize=8.5 * self.size, clip_on=False,
                markerfacecolor=NODE_COLOURS[name], markeredgecolor=DARK,
                markeredgewidth=0.8 * self.size, linestyle=""))
            self.text(self.footer, x + 0.013, 0.80, name)

    def _arrow(self, x: float, length: float, **options: Any) -> None:
        from matplotlib.patches import FancyArrow

        self.footer.add_artist(FancyArrow(x, 0.34, length, 0.0, length_includes_head=True,
                                          **options))

    def _plane_legend(self) -> None:
        motion, force = self.motion, self.motion.largest_force
        self._body_colours((0.03, 0.42))
        self.text(self.footer, 0.49, 0.80, "contact nodes")
        self._states("o", 0.64, 0.09)
        self.text(self.footer, 0.49, 0.34, "contact force" if motion.labels else "force on body")
        if force > 0.0:
            self._arrow(0.615, 0.035, width=0.05, head_width=0.2, head_length=0.013,
                        color=FORCE_COLOUR, linewidth=0.0)
        self.text(self.footer, 0.66 if force > 0.0 else 0.615, 0.34,
                  f"up to {quantity(force, 'N')}" if force > 0.0 else "none")
        self.text(self.footer, 0.97, 0.34, motion.moving, ha="right")

    def _solid_legend(self) -> None:
        motion, force = self.motion, self.motion.largest_friction
        self._body_colours((0.03, 0.25))
        factor, symbol = suitable_unit(motion.largest_pressure, "Pa")
        self.colour_scale(f"contact pressure [{symbol}]", motion.largest_pressure / factor or 1.0,
                          PRESSURE_MAP, span=(0.33, 0.25))
        self._states("s", 0.635, 0.085)
        if force > 0.0:
            self._arrow(0.628, 0.03, width=0.06, head_width=0.22, head_length=0.012,
                        facecolor="white", edgecolor=DARK, linewidth=0.6 * self.size)
            self.text(self.footer, 0.665, 0.34, f"friction up to {quantity(force, 'N')}")


def _scales(motion: Motion, slowness: float | None) -> str:
    """Words for the factors of the displacements and of the time."""
    parts = [f"deformation × {motion.scale:g}" if motion.scale != 1.0 else "true deformation"]
    if slowness is not None and slowness >= 1.05:
        parts.append(f"slowed down {_short(slowness)} ×")
    elif slowness is not None and 0.0 < slowness <= 0.95:
        parts.append(f"sped up {_short(1.0 / slowness)} ×")
    return "     ".join(parts)


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 100.0 else f"{float(f'{value:.2g}'):.0f}"
