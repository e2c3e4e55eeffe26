"""The report of a run inside a notebook: in a frame, or as a widget that Python can talk to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from typing import Any

from fecontact.analysis.histories import Point
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.report.page import page, script, styles
from fecontact.output.report.run_report import run_block


@dataclass(frozen=True, eq=False, repr=False)
class ReportFrame:
    """A page that a notebook shows in a frame of its own; see :func:`report_frame`.

    The frame keeps styles, script and the keyboard of the page apart from those of the notebook,
    and releases the graphics memory when its cell is cleared.

    Attributes
    ----------
    html : str
        The page, as :func:`fecontact.io.report` writes it.
    height : int
        Height of the frame [pixels].
    """

    html: str
    height: int

    def __repr__(self) -> str:
        return f"<ReportFrame of {len(self.html) / 1e6:.2g} MB>"

    def _repr_html_(self) -> str:
        return (f'<iframe srcdoc="{escape(self.html)}" width="100%" height="{self.height}" '
                f'style="border: none"></iframe>')


def report_frame(
    run: Trajectory, *, height: int = 900, title: str = "Run", study: str | None = None,
    points: Sequence[Point] = (), scale: float | None = None,
    versions: Mapping[str, str] | None = None,
) -> ReportFrame:
    """The report of a run for a notebook: the last line of a cell shows it.

    Nothing is written to disk but by the notebook itself, which stores the page with its cell, and
    no further library is needed.

    Parameters
    ----------
    run : Trajectory
        The run.
    height : int
        Height of the frame [pixels], positive.
    title, study, points, scale, versions
        See :func:`fecontact.io.report`.

    Raises
    ------
    InputError
        For a point that does not exist, or a height or scale that is not positive.
    """
    require_kind("report_frame", Trajectory, run=run)
    require_positive("report_frame", height=height)
    block = run_block(run, title, study, points, scale, versions)
    return ReportFrame(page(title, block), int(height))


def report_widget(
    run: Trajectory, *, title: str = "Run", study: str | None = None,
    points: Sequence[Point] = (), scale: float | None = None,
    versions: Mapping[str, str] | None = None,
) -> Any:
    """The report of a run as a widget of Jupyter, VS Code, Colab or marimo.

    It is the page of :func:`fecontact.io.report`, whose time Python can read and set: ``widget.time
    = 0.01`` [s] shows that instant, and a click on a chart changes ``widget.time``. Graphics memory
    is released when the widget is closed. Needs anywidget, ``pip install 'fecontact[notebook]'``.

    Parameters
    ----------
    run : Trajectory
        The run.
    title, study, points, scale, versions
        See :func:`fecontact.io.report`.

    Returns
    -------
    anywidget.AnyWidget
        With the traits ``time``, ``block`` and ``styles``.

    Raises
    ------
    InputError
        Without anywidget, for a point that does not exist, or a scale that is not positive.
    """
    require_kind("report_widget", Trajectory, run=run)
    made = _widget_class()
    return made(block=run_block(run, title, study, points, scale, versions), styles=styles(),
                time=float(run.time[0]))


@cache
def _widget_class() -> Any:
    try:
        import anywidget
        import traitlets
    except ImportError:
        raise InputError("report_widget needs anywidget: pip install 'fecontact[notebook]'; "
                         "report_frame shows the same page without it.") from None

    class ReportWidget(anywidget.AnyWidget):
        """A report of a run; see :func:`report_widget`."""

        _esm = script("widget")
        block = traitlets.Bytes().tag(sync=True)
        styles = traitlets.Unicode().tag(sync=True)
        time = traitlets.Float().tag(sync=True)

    return ReportWidget
