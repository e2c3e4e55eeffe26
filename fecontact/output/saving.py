"""Figures as files: PNG, PDF or SVG, written whole or not at all."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.arguments import as_path
from fecontact.errors import InputError
from fecontact.output.figures import STYLE
from fecontact.whole_files import replaced

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SUFFIXES = (".png", ".pdf", ".svg")


def save_figure(path: str | Path, figure: Callable[[], "Figure"]) -> Path:
    """Draw a figure in the package's style and write it.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    path = as_path(path, "a plot")
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{path} must end in {', '.join(_SUFFIXES[:-1])} or {_SUFFIXES[-1]}.")
    if not path.parent.is_dir():
        raise InputError(f"{path} cannot be written: folder {path.parent} does not exist.")
    from matplotlib import rc_context

    with replaced(path) as part, rc_context(STYLE):
        figure().savefig(part, format=path.suffix[1:].lower())
    return path
