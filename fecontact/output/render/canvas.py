"""Pictures by matplotlib within movies."""

from typing import Any

# Dots per inch, and a part of a pixel that rounding may not take away.
_DPI, _SPARE = 100, 0.1


def canvas_of(width: int, height: int) -> tuple[Any, Any]:
    """A white figure of exactly so many pixels, and its canvas."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=((width + _SPARE) / _DPI, (height + _SPARE) / _DPI), dpi=_DPI,
                    facecolor="white")
    return figure, FigureCanvasAgg(figure)
