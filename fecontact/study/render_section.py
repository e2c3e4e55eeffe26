"""The section of the moving picture."""

from dataclasses import dataclass
from typing import Annotated, Literal

from fecontact.core.checks import require_frame_rate, require_scale
from fecontact.core.errors import InputError, require_finite
from fecontact.core.tables import convert_fields
from fecontact.core.units import Unit


@dataclass(frozen=True)
class RenderSettings:
    """``[render]``: the moving picture; see :func:`fecontact.render`.

    Parameters
    ----------
    frames : int
        Number of frames.
    fps : float
        Frames per second.
    size : (int, int)
        Width and height [pixels], even numbers, at least 320 x 180.
    colour : 'displacement' or 'von_mises'
        Quantity that colours the body.
    scale : float, optional
        Magnification of displacements; by default chosen so that the largest is clearly visible.
    title : str, optional
        Title shown at the top of the picture.
    t_start, t_end : float, optional
        Time interval to draw [s].
    view : 'above' or 'below'
        View of solids, from above or from below, where their contact faces show.
    """

    frames: int = 200
    fps: float = 25.0
    size: tuple[int, int] = (960, 540)
    colour: Literal["displacement", "von_mises"] = "displacement"
    scale: float | None = None
    title: str | None = None
    t_start: Annotated[float | None, Unit("s")] = None
    t_end: Annotated[float | None, Unit("s")] = None
    view: Literal["above", "below"] = "above"

    def __post_init__(self) -> None:
        convert_fields(self)
        if self.frames < 1:
            raise InputError(f"RenderSettings: frames = {self.frames} must be at least 1.")
        require_frame_rate("RenderSettings", self.fps)
        width, height = self.size
        if width < 320 or height < 180 or width % 2 or height % 2:
            raise InputError(f"RenderSettings: size = {list(self.size)} must be an even width and "
                             f"height in pixels, at least [320, 180].")
        if self.scale is not None:
            require_scale("RenderSettings", self.scale)
        for name in ("t_start", "t_end"):
            if getattr(self, name) is not None:
                require_finite("RenderSettings", **{name: getattr(self, name)})
        if self.t_start is not None and self.t_end is not None and not self.t_start <= self.t_end:
            raise InputError(f"RenderSettings: t_end = {self.t_end!r} must not be before t_start = "
                             f"{self.t_start!r}.")
