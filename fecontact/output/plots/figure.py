"""Figures in the package's style, for notebooks and files."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib import RcParams, rc_context, rc_params_from_file
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text

from fecontact.core.checks import as_path
from fecontact.core.errors import InputError, nearest, shown
from fecontact.core.files.atomic_write import replaced
from fecontact.output.plots.style import STYLE

_SUFFIXES = (".png", ".pdf", ".svg")
# The font of pictures has no control characters, and half a pair of surrogates is an error.
_CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
# Of names; labels of the package are shorter.
_LONG_WORD, _LONG_LINE = re.compile(r"(\S{40})\S+"), re.compile(r"(.{90}).+")
_PIXELS_PER_INCH = 96  # of a notebook's page
_style: ContextVar[Any] = ContextVar("style", default=MappingProxyType({}))


@contextmanager
def styled(style: str | Path | Mapping[str, Any]) -> Iterator[None]:
    """Draw all plots that are made within a block in a style of matplotlib.

    ``with styled({"font.size": 14}): plot_phase(run)``. It is put over the package's style: fonts,
    sizes, grids and backgrounds follow it, the colours of curves and states keep their meaning.
    Blocks may be nested. Figures keep their style when they are drawn or saved later.

    Parameters
    ----------
    style : str, Path or mapping
        Name of a matplotlib style, a file of one (``NAME.mplstyle``), or its settings.

    Raises
    ------
    InputError
        If there is no such style, file or setting.
    """
    token = _style.set({**_style.get(), **_settings(style)})
    try:
        yield
    finally:
        _style.reset(token)


def _settings(style: str | Path | Mapping[str, Any]) -> Any:
    from matplotlib.style import available, library

    if not isinstance(style, str | Path | Mapping):
        raise InputError(f"style = {shown(style)} must be the name of a matplotlib style, a file "
                         f"NAME.mplstyle, or settings.")
    if isinstance(style, Mapping):
        try:
            return RcParams(style)
        except (KeyError, ValueError) as error:
            raise InputError(f"style: {_first_line(error)} in {shown(style)}.") from None
    path = Path(style)
    if path.suffix == ".mplstyle":
        if not path.is_file():
            raise InputError(f"{path} does not exist; give the file of a matplotlib style.")
        try:
            return rc_params_from_file(path, use_default_template=False)
        except (OSError, ValueError, KeyError) as error:
            raise InputError(f"{path} is no matplotlib style: {_first_line(error)}.") from None
    if str(style) not in library:
        raise InputError(f"style = '{style}' is no style of matplotlib"
                         f"{nearest(str(style), available)}; give a name that is one of "
                         f"matplotlib.style.available, such as 'ggplot', or a file NAME.mplstyle.")
    return library[str(style)]


def _first_line(error: Exception) -> str:
    return str(error).strip("'\"").split("\n")[0].split("\\n")[0].rstrip(".")


class StyledFigure(Figure):
    """A matplotlib Figure that always draws in the style it was made in, the package's by default.

    Ticks, fonts of PDF files and other parts read the settings of matplotlib when a figure is
    drawn, not when it is made.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._settings: Any = {**STYLE, **_style.get()}

    def draw(self, renderer: RendererBase) -> None:
        """See :meth:`matplotlib.figure.Figure.draw`."""
        # Names may contain dollars; ticks of logarithmic axes alone are mathematical text.
        for text in self.findobj(Text):
            if isinstance(text, Text) and not _is_tick(written := text.get_text()):
                text.set_parse_math("$" not in written)
                if (shown := _legible(written)) != written:
                    text.set_text(shown)
        with rc_context(self._settings):
            super().draw(renderer)

    def savefig(self, fname: Any, **options: Any) -> None:
        """See :meth:`matplotlib.figure.Figure.savefig`."""
        with rc_context(self._settings):
            super().savefig(fname, **options)

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """The picture for a notebook, and its size on the page."""
        drawn = BytesIO()
        self.savefig(drawn, format="png")
        width, height = (round(_PIXELS_PER_INCH * inches) for inches in self.get_size_inches())
        return drawn.getvalue(), {"width": width, "height": height}


def _is_tick(text: str) -> bool:
    """True for mathematical text of ticks, False for names that only look like it."""
    if r"\mathdefault" not in text:
        return False
    try:
        MathTextParser("path").parse(text)
    except ValueError:
        return False
    return True


def _legible(text: str) -> str:
    """The text, control characters escaped, and cut where a name leaves no space for axes."""
    text = _CONTROL.sub(lambda found: ascii(found[0])[1:-1], text)
    return _LONG_LINE.sub("\\1\N{HORIZONTAL ELLIPSIS}",
                          _LONG_WORD.sub("\\1\N{HORIZONTAL ELLIPSIS}", text))


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
    # Margins beside the largest numbers overflow.
    with rc_context({**STYLE, **_style.get()}), np.errstate(over="ignore"):
        figure = StyledFigure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
    if target is not None:
        # Written at once: matplotlib loses the error of a full disk while it draws a PDF.
        drawn = BytesIO()
        with np.errstate(over="ignore"):
            figure.savefig(drawn, format=target.suffix[1:].lower())
        with replaced(target) as part:
            part.write_bytes(drawn.getvalue())


def _target(path: str | Path) -> Path:
    """The path to write, checked before anything is drawn."""
    path = as_path(path, "a plot")
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{path} must end in {', '.join(_SUFFIXES[:-1])} or {_SUFFIXES[-1]}.")
    if not path.parent.is_dir():
        raise InputError(f"{path} cannot be written: folder {path.parent} does not exist.")
    return path
