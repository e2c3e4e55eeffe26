"""Overlay of a picture: title, time, scales and legends above and below the scene."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.units import quantity, suitable_unit
from fecontact.output.render.canvas import canvas_of
from fecontact.output.render.force_chart import ForceChart
from fecontact.output.render.frames_data import COLOURS, Motion
from fecontact.output.render.pixels import DARK
from fecontact.output.render.plane_parts import needed_height
from fecontact.output.render.scene import COLOUR_MAPS, FORCE_COLOUR, NODE_COLOURS

Image = NDArray[np.uint8]

FONT = 10.5  # points at 960 x 540
_LEAST_CHART = 90.0  # pixels at 960 x 540
_MOST_CHART = 0.6  # of the room between title and legend
_SPARE = 1.04  # height of a scene below a chart, relative to what it needs


class Strips:
    """Strips of text above and below a scene.

    Attributes
    ----------
    width, height : int
        Size of the whole picture in pixels.
    """

    width: int
    height: int

    @property
    def size(self) -> float:
        """Size of text and lines, one at 960 x 540."""
        return min(self.width / 960.0, self.height / 540.0)

    @property
    def header_height(self) -> int:
        """Height of the strip above the scene in pixels."""
        return 2 * round(22 * self.size)

    @property
    def footer_height(self) -> int:
        """Height of the strip below the scene in pixels."""
        return 2 * round(34 * self.size)

    def _text(self, figure: Any, x: float, y: float, text: str, **options: Any) -> Any:
        options = {"fontsize": FONT * self.size, "color": DARK, "va": "center",
                   "family": "DejaVu Sans"} | options
        return figure.text(x, y, text, parse_math=False, **options)

    def header(self, title: str | None, note: str) -> Image:
        """The upper strip: a title, shortened to the room that a note leaves beside it."""
        figure, canvas = canvas_of(self.width, self.header_height)
        beside = self._text(figure, 0.81, 0.46, note, ha="right")
        if title:
            drawn = self._text(figure, 0.03, 0.46, title, fontsize=1.25 * FONT * self.size)
            room = beside.get_window_extent(canvas.get_renderer()).x0 - 0.05 * self.width
            text = title
            while drawn.get_window_extent(canvas.get_renderer()).width > room and len(text) > 1:
                text = text[:-1]
                drawn.set_text(text.rstrip() + "…")
        return pixels(canvas)

    def colour_scale(
        self, figure: Any, label: str, largest: float, colours: str, beyond: bool = False,
        span: tuple[float, float] = (0.03, 0.42),
    ) -> None:
        """Draw the colour scale from zero into the lower strip, pointed if values lie beyond.

        ``span`` are its left end and its width, as parts of the strip.
        """
        from matplotlib import colormaps
        from matplotlib.ticker import MaxNLocator

        left, width = span
        axes = figure.add_axes((left, 0.42, width, 0.17))
        axes.imshow(np.linspace(0.0, 1.0, 256)[None], aspect="auto", cmap=colormaps[colours],
                    extent=(0.0, largest, 0.0, 1.0))
        axes.set_yticks([])
        if beyond:
            axes.fill([1.0, 1.0, 1.025], [0.0, 1.0, 0.5], transform=axes.transAxes, clip_on=False,
                      facecolor=colormaps[colours](1.0), edgecolor=DARK,
                      linewidth=0.7 * self.size)
        axes.xaxis.set_major_locator(MaxNLocator(6 if width > 0.3 else 4, steps=[1, 2, 2.5, 5, 10]))
        axes.tick_params(labelsize=0.9 * FONT * self.size, colors=DARK, length=3 * self.size,
                         width=0.7 * self.size, pad=2 * self.size)
        for spine in axes.spines.values():
            spine.set(linewidth=0.7 * self.size, color=DARK)
        self._text(figure, left, 0.80, label)


@dataclass(frozen=True, eq=False)
class Overlay(Strips):
    """Strips above and below the scene of a run, as large as the whole picture.

    Attributes
    ----------
    motion : Motion
    width, height : int
        Size of the whole picture in pixels.
    title : str or None
    slowness : float or None
        Seconds of the movie per second of the motion; None for pictures without a clock.
    """

    motion: Motion
    width: int
    height: int
    title: str | None = None
    slowness: float | None = None

    @cached_property
    def chart_height(self) -> int:
        """Height of the force chart in pixels, from the room that a flat body leaves; or zero.

        The scene keeps little more than it needs, and at least a third. Without contact nodes there
        is no chart.
        """
        if not self.motion.trajectory.basis.contact_nodes:
            return 0
        room = self.height - self.header_height - self.footer_height
        left = min(room - _SPARE * needed_height(self.motion) * self.width, _MOST_CHART * room)
        return 2 * int(0.5 * left) if left >= _LEAST_CHART * self.size else 0

    @property
    def scene_width(self) -> int:
        """Width of the scene in pixels."""
        return self.width

    @property
    def scene_height(self) -> int:
        """Height of the scene in pixels."""
        return self.height - self.header_height - self.footer_height - self.chart_height

    def around(self, scene: Image, frame: int) -> Image:
        """The whole picture (height, width, 3) from that of the scene."""
        header = self._header.copy()
        clock = self._clock(frame)
        header[:, -clock.shape[1] :] = clock
        chart = [self._chart.image(frame)] if self.chart_height else []
        return np.concatenate([header, *chart, scene, self._footer])

    @cached_property
    def _chart(self) -> ForceChart:
        return ForceChart(self.motion, self.width, self.chart_height, FONT * self.size)

    @cached_property
    def _header(self) -> Image:
        return self.header(self.title, self._scales())

    def _scales(self) -> str:
        scale = self.motion.scale
        parts = [f"deformation × {scale:g}" if scale != 1.0 else "true deformation"]
        if self.slowness is not None and self.slowness >= 1.05:
            parts.append(f"slowed down {_short(self.slowness)} ×")
        elif self.slowness is not None and 0.0 < self.slowness <= 0.95:
            parts.append(f"sped up {_short(1.0 / self.slowness)} ×")
        return "     ".join(parts)

    @cached_property
    def _clock_parts(self) -> tuple[Any, Any, Any]:
        figure, canvas = canvas_of(round(0.17 * self.width), self.header_height)
        text = self._text(figure, 1.0 - 0.03 / 0.17, 0.46, "", ha="right",
                          fontsize=1.1 * FONT * self.size)
        return figure, canvas, text

    def _clock(self, frame: int) -> Image:
        times = self.motion.times
        factor, symbol = suitable_unit(float(np.abs(times).max()), "s")
        step = np.diff(times).min() / factor if len(times) > 1 else 0.001
        decimals = int(np.clip(np.ceil(-np.log10(max(step, 1e-9)) + 0.3), 0, 4))
        _, canvas, text = self._clock_parts
        text.set_text(f"t = {times[frame] / factor:.{decimals}f} {symbol}")
        return pixels(canvas)

    @cached_property
    def _footer(self) -> Image:
        figure, canvas = canvas_of(self.width, self.footer_height)
        self._colour_scale(figure)
        self._legend(figure)
        return pixels(canvas)

    def _states(self, figure: Any, marker: str, left: float, apart: float) -> None:
        """Draw the contact states with their colours into the lower strip."""
        from matplotlib.lines import Line2D

        for number, name in enumerate(self.motion.state_names):
            x = left + number * apart
            figure.add_artist(Line2D([x], [0.80], marker=marker, markersize=8.5 * self.size,
                                     markerfacecolor=NODE_COLOURS[name], markeredgecolor=DARK,
                                     markeredgewidth=0.8 * self.size, linestyle=""))
            self._text(figure, x + 0.013, 0.80, name)

    def _colour_scale(self, figure: Any, span: tuple[float, float] = (0.03, 0.42)) -> None:
        name, unit = COLOURS[self.motion.colour]
        largest = self.motion.largest_colour or 1.0
        factor, symbol = suitable_unit(largest, unit)
        beyond = self.motion.peak > largest
        label = f"{name} [{symbol}]" + (f", peak {self.motion.peak / factor:.3g}" if beyond else "")
        self.colour_scale(figure, label, largest / factor, COLOUR_MAPS[self.motion.colour], beyond,
                          span)

    def _legend(self, figure: Any) -> None:
        from matplotlib.patches import FancyArrow

        self._text(figure, 0.49, 0.80, "contact nodes")
        self._states(figure, "o", 0.64, 0.09)
        force = self.motion.largest_force
        self._text(figure, 0.49, 0.34,
                   "contact force" if self.motion.labels else "force on body")
        if force > 0.0:
            figure.add_artist(FancyArrow(
                0.615, 0.34, 0.035, 0.0, width=0.05, head_width=0.2, head_length=0.013,
                length_includes_head=True, color=FORCE_COLOUR, linewidth=0.0))
        self._text(figure, 0.66 if force > 0.0 else 0.615, 0.34,
                   f"up to {quantity(force, 'N')}" if force > 0.0 else "none")
        moving = []
        if self.motion.has_ground and (speed := self.motion.ground_speed):
            heading = "→" if speed > 0.0 else "←"
            moving.append(f"ground {heading} {quantity(abs(speed), 'm/s')}")
        moving += self.motion.sliding
        if moving:
            self._text(figure, 0.97, 0.34, "   ".join(moving), ha="right")


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 100.0 else f"{float(f'{value:.2g}'):.0f}"


def pixels(canvas: Any) -> Image:
    """Picture (height, width, 3) of a canvas of matplotlib."""
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
