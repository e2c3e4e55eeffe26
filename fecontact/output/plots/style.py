"""The style of all figures: colours, sizes, notes."""

from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from cycler import cycler

from fecontact.analysis.resolved import Resolved
from fecontact.analysis.sampling import Sampled
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.diagrams.colours import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Colours of a stress reach to this percentile if its peak is so much above it that they would show
# little: at clamped corners and below forces stresses grow with each refinement of the mesh.
PERCENTILE, _SHARP = 99, 0.7

STYLE: Any = {
    "font.size": 10.0, "axes.titlesize": 11.0, "axes.labelsize": 10.0, "legend.fontsize": 9.0,
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": "#4d4d4d",
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.grid": True, "grid.color": "#e4e2de", "grid.linewidth": 0.7, "axes.axisbelow": True,
    "lines.linewidth": 1.2, "legend.frameon": False, "axes.titleweight": "normal",
    "xtick.color": "#303030", "ytick.color": "#303030", "axes.formatter.useoffset": False,
    "agg.path.chunksize": 20000, "figure.dpi": 150, "savefig.dpi": "figure",
    "svg.fonttype": "none", "pdf.fonttype": 42,
}


def beyond_words(peak: str) -> str:
    """Words beside a bar whose colours end at the percentile of a stress."""
    return f"{PERCENTILE} % of the nodes stay below, peak {peak}"


def stress_limit(sizes: Array) -> float:
    """Upper end of the colours of a stress: the largest of its sizes at the nodes, or their 99th
    percentile where few nodes have much more than all others.
    """
    largest = float(sizes.max(initial=0.0))
    usual = float(np.percentile(sizes, PERCENTILE)) if len(sizes) else 0.0
    return usual if 0.0 < usual < _SHARP * largest else largest


def add_note(figure: "Figure", drawn: Resolved | Sampled) -> None:
    """Note below a figure that its curves are coarser than the motion."""
    if not drawn.note:
        return
    width, height = figure.get_size_inches()
    # Longer lines would be cut as names are.
    lines = wrap(drawn.note, min(int(15.0 * width), 88))
    figure.text(0.995, 0.05 / height, "\n".join(lines), ha="right", va="bottom", fontsize=8.0,
                color="#a03000")
    below = (0.05 + 0.16 * len(lines)) / height
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.set(rect=(0.0, below, 1.0, 1.0 - below))  # type: ignore[call-arg]


def state_names(trajectory: Trajectory) -> tuple[str, ...]:
    """Open, stick, slip by their numbers; open and contact in a run without friction forces."""
    return ("open", "stick", "slip") if trajectory.friction_force.any() else ("open", "contact")


def legend_label(name: str) -> str:
    """A name as matplotlib shows it in legends, which leave out what begins with an underscore."""
    return f" {name}" if name.startswith("_") else name
