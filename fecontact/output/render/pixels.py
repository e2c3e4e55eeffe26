"""Pixels of pictures: of figures, of names written into them, and fewer of them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

DARK = "#303030"
_EDGE = 4  # least distance of a label from the border [pixels]


def pixels(canvas: Any) -> NDArray[np.uint8]:
    """Picture (height, width, 3) of what was drawn on a canvas of matplotlib."""
    drawn = np.asarray(canvas.buffer_rgba())
    picture = np.empty((*drawn.shape[:2], 3), np.uint8)
    for colour in range(3):  # six times as fast as all at once
        picture[..., colour] = drawn[..., colour]
    return picture


def label_image(text: str, size: float) -> NDArray[np.float64]:
    """A name in dark letters with a pale rim, (h, w, 4) from 0 to 1; ``size`` in pixels."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patheffects import withStroke

    figure = Figure(figsize=((len(text) + 2) * size / 100.0, 2.0 * size / 100.0), dpi=100)
    figure.patch.set_alpha(0.0)
    rim = withStroke(linewidth=0.2 * size, foreground="white", alpha=0.8)
    figure.text(0.5, 0.5, text, parse_math=False, ha="center", va="center", color=DARK,
                family="DejaVu Sans", fontsize=0.72 * size, path_effects=[rim])
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = np.asarray(canvas.buffer_rgba()) / 255.0
    rows, columns = (np.flatnonzero(drawn[..., 3].any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return drawn
    return drawn[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]


def blend(image: NDArray[np.uint8], label: NDArray[np.float64], row: int, column: int) -> None:
    """Draw a label into a picture, centred at a pixel and moved inside where it would leave it."""
    whole = np.array(image.shape[:2])
    size = np.minimum(label.shape[:2], whole)
    edge = np.minimum(_EDGE, (whole - size) // 2)
    top, left = np.clip(np.array([row, column]) - size // 2, edge, whole - size - edge).tolist()
    height, width = size.tolist()
    part, drawn = image[top : top + height, left : left + width], label[:height, :width]
    alpha = drawn[..., 3:]
    part[:] = np.round((1.0 - alpha) * part + 255.0 * alpha * drawn[..., :3])


def reduced(image: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    """Means of factor x factor pixels of an image."""
    rows = image[::factor].astype(np.uint16)
    for k in range(1, factor):
        rows += image[k::factor]
    total = rows[:, ::factor].copy()
    for k in range(1, factor):
        total += rows[:, k::factor]
    return ((total + factor**2 // 2) // factor**2).astype(np.uint8)
