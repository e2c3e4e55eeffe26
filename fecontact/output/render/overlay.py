"""The picture around a scene, drawn by matplotlib: title, clock, colour scales, legends."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.output.render.pixels import DARK, pixels

Image = NDArray[np.uint8]

FONT = 10.5  # points at 960 x 540
# Dots per inch, and a part of a pixel that rounding may not take away.
_DPI, _SPARE = 100, 0.1


class Overlay:
    """A whole picture: strips above and below a scene, and what else stands beside it.

    All of it is drawn once; what changes is drawn over it in each frame.

    Attributes
    ----------
    width, height : int
        Size of the whole picture [pixels].
    size : float
        Size of text and lines, one at 960 x 540.
    header_height, footer_height : int
        Heights of the strips [pixels].
    scene_width, scene_height, scene_top : int
        Size of the scene, which lies at the left border, and its distance from the top [pixels].
    """

    def __init__(self, width: int, height: int, title: str | None = None, note: str = "") -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.width, self.height = width, height
        self.size = min(width / 960.0, height / 540.0)
        self.header_height = 2 * round(22 * self.size)
        self.footer_height = 2 * round(34 * self.size)
        self.scene_width, self.scene_top = width, self.header_height
        self.scene_height = height - self.header_height - self.footer_height
        self.figure = Figure(figsize=((width + _SPARE) / _DPI, (height + _SPARE) / _DPI), dpi=_DPI,
                             facecolor="white")
        self._canvas: Any = FigureCanvasAgg(self.figure)
        self._changing: list[tuple[Callable[[int], None], tuple[Any, ...]]] = []
        self.header = self.strip(0, 0, width, self.header_height)
        self.footer = self.strip(0, height - self.footer_height, width, self.footer_height)
        self._write(title, note)

    def strip(self, left: float, top: float, width: float, height: float) -> Any:
        """Axes without frame over a part of the picture [pixels], with coordinates from 0 to 1."""
        axes = self.figure.add_axes((left / self.width, 1.0 - (top + height) / self.height,
                                     width / self.width, height / self.height))
        axes.set_axis_off()
        return axes

    def text(self, strip: Any, x: float, y: float, text: str, **options: Any) -> Any:
        """Write into a strip."""
        options = {"fontsize": FONT * self.size, "color": DARK, "va": "center",
                   "family": "DejaVu Sans"} | options
        return strip.text(x, y, text, parse_math=False, **options)

    def _write(self, title: str | None, note: str) -> None:
        """Write a title, shortened to the space that a note leaves beside it."""
        beside = self.text(self.header, 0.81, 0.46, note, ha="right")
        if not title:
            return
        drawn = self.text(self.header, 0.03, 0.46, title, fontsize=1.25 * FONT * self.size)
        space = beside.get_window_extent().x0 - 0.05 * self.width
        while drawn.get_window_extent().width > space and len(title) > 1:
            title = title[:-1]
            drawn.set_text(title.rstrip() + "…")

    def colour_scale(
        self, label: str, largest: float, colours: str, beyond: bool = False,
        span: tuple[float, float] = (0.03, 0.42),
    ) -> None:
        """Draw the colour scale from zero into the footer, pointed if values lie beyond.

        ``span`` are its left end and its width, as parts of the strip.
        """
        from matplotlib import colormaps
        from matplotlib.ticker import MaxNLocator

        left, width = span
        axes = self.footer.inset_axes((left, 0.42, width, 0.17))
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
        self.text(self.footer, left, 0.80, label)

    def changing(self, change: Callable[[int], None], *artists: Any) -> None:
        """Draw artists in each frame, after ``change`` was called with its number."""
        for artist in artists:
            artist.set_animated(True)
        self._changing.append((change, artists))

    @cached_property
    def _still(self) -> Any:
        """Picture of all that does not change."""
        self._canvas.draw()
        return self._canvas.copy_from_bbox(self.figure.bbox)

    def around(self, scene: Image, frame: int) -> Image:
        """The whole picture (height, width, 3) from that of the scene."""
        self._canvas.restore_region(self._still)
        for change, artists in self._changing:
            change(frame)
            for artist in artists:
                self.figure.draw_artist(artist)
        picture = pixels(self._canvas)
        picture[self.scene_top :][: self.scene_height, : self.scene_width] = scene
        return picture
