"""Figures in the package's style, for notebooks and files."""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from fecontact.core.checks import as_path
from fecontact.core.errors import InputError
from fecontact.core.files.atomic_write import replaced
from fecontact.output.plots.style import STYLE

_SUFFIXES = (".png", ".pdf", ".svg")
_PIXELS_PER_INCH = 96  # of a notebook's page


class StyledFigure(Figure):
    """A matplotlib Figure that always draws in the package's style.

    Ticks, fonts of PDF files and other parts read the settings of matplotlib when a figure is
    drawn, not when it is made.
    """

    def draw(self, renderer: RendererBase) -> None:
        """See :meth:`matplotlib.figure.Figure.draw`."""
        with rc_context(STYLE):
            super().draw(renderer)

    def savefig(self, fname: Any, **options: Any) -> None:
        """See :meth:`matplotlib.figure.Figure.savefig`."""
        with rc_context(STYLE):
            super().savefig(fname, **options)

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """The picture for a notebook, and its size on the page."""
        drawn = BytesIO()
        self.savefig(drawn, format="png")
        width, height = (round(_PIXELS_PER_INCH * inches) for inches in self.get_size_inches())
        return drawn.getvalue(), {"width": width, "height": height}


@contextmanager
def new_figure(
    width: float, height: float, path: str | Path | None = None
) -> Iterator[StyledFigure]:
    """An empty figure [inches] to draw into, written to a file unless the block fails.

    No plotting session knows of it: nothing has to be closed. The file is written whole or not at
    all.

    Parameters
    ----------
    width, height : float
        Size [inches].
    path : str or Path, optional
        A .png, .pdf or .svg file; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    target = None if path is None else _target(path)
    with rc_context(STYLE):
        figure = StyledFigure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
    if target is not None:
        with replaced(target) as part:
            figure.savefig(part, format=target.suffix[1:].lower())


def _target(path: str | Path) -> Path:
    """The path to write, checked before anything is drawn."""
    path = as_path(path, "a plot")
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{path} must end in {', '.join(_SUFFIXES[:-1])} or {_SUFFIXES[-1]}.")
    if not path.parent.is_dir():
        raise InputError(f"{path} cannot be written: folder {path.parent} does not exist.")
    return path
