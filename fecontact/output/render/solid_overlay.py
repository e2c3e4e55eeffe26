"""The whole picture of solids: scene, maps of the contact faces, forces over time, legends."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fecontact.core.units import quantity, suitable_unit
from fecontact.output.render.canvas import canvas_of
from fecontact.output.render.face_maps import PRESSURE_MAP, FaceMaps
from fecontact.output.render.force_chart import ForceChart
from fecontact.output.render.overlay import FONT, Overlay, pixels
from fecontact.output.render.pixels import DARK, blend, label_image
from fecontact.output.render.solid_motion import SolidMotion, motion_words

Image = NDArray[np.uint8]

_SCENE = 0.58  # of the width
_CHART = 0.27  # of the height of the column beside it


class SolidOverlay(Overlay):
    """Strips around the scene of a run of solids, and a column beside it.

    The motion is a SolidMotion; the column shows maps of its contact faces and the total forces.
    """

    motion: SolidMotion

    @property
    def scene_width(self) -> int:
        """Width of the scene in pixels."""
        return 2 * round(0.5 * _SCENE * self.width)

    @property
    def scene_height(self) -> int:
        """Height of the scene in pixels."""
        return self.height - self.header_height - self.footer_height

    @property
    def chart_height(self) -> int:
        """Height of the chart of forces in pixels."""
        return 2 * round(0.5 * _CHART * self.scene_height)

    def around(self, scene: Image, frame: int) -> Image:
        """The whole picture (height, width, 3) from that of the scene."""
        header = self._header.copy()
        clock = self._clock(frame)
        header[:, -clock.shape[1] :] = clock
        if self._moving is not None:
            scene = scene.copy()
            blend(scene, self._moving, round(0.955 * scene.shape[0]),
                  scene.shape[1] - self._moving.shape[1] // 2)
        column = np.concatenate([self._maps.image(frame), self._chart.image(frame)])
        return np.concatenate([header, np.concatenate([scene, column], axis=1), self._footer])

    @cached_property
    def _moving(self) -> NDArray[np.float64] | None:
        """Image of the words for the motion of ground and sliding bodies; None without any."""
        moving = [*motion_words(self.motion), *self.motion.sliding]
        return label_image("   ".join(moving), 14.0 * self.size) if moving else None

    @cached_property
    def _maps(self) -> FaceMaps:
        return FaceMaps(self.motion, self.width - self.scene_width,
                        self.scene_height - self.chart_height, FONT * self.size)

    @cached_property
    def _chart(self) -> ForceChart:
        return ForceChart(self.motion, self.width - self.scene_width, self.chart_height,
                          0.92 * FONT * self.size)

    @cached_property
    def _footer(self) -> Image:
        figure, canvas = canvas_of(self.width, self.footer_height)
        self._colour_scale(figure, (0.03, 0.25))
        top = self.motion.largest_pressure
        factor, symbol = suitable_unit(top, "Pa")
        self.colour_scale(figure, f"contact pressure [{symbol}]", top / factor or 1.0,
                          PRESSURE_MAP, False, (0.33, 0.25))
        self._states(figure, "s", 0.635, 0.085)
        force = self.motion.largest_friction
        if force > 0.0:
            from matplotlib.patches import FancyArrow

            figure.add_artist(FancyArrow(
                0.628, 0.34, 0.03, 0.0, width=0.06, head_width=0.22, head_length=0.012,
                length_includes_head=True, facecolor="white", edgecolor=DARK,
                linewidth=0.6 * self.size))
            self._text(figure, 0.665, 0.34, f"friction up to {quantity(force, 'N')}")
        return pixels(canvas)
