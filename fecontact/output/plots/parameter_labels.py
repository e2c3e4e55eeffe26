"""Labels of axes: of parameters and stored values of branches, with ticks in suitable units."""

from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib.ticker import Formatter

from fecontact.core.types import Array
from fecontact.core.units import has_prefixes, suitable_unit
from fecontact.system.parameter_labels import parameter_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fecontact.bifurcation.continuation.branch import Branch

_ROOM = 1e3  # largest ratio of the ends of a logarithmic axis with labels between decades

_UNITS = {"period": "s", "time": "s", "frequency_hz": "Hz"}


class _InUnit(Formatter):
    """Ticks at values in SI units, labelled in a prefixed unit."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x / self.factor:.10g}".replace("-", "\N{MINUS SIGN}")


class _BetweenDecades(_InUnit):
    """Minor ticks of a logarithmic axis in a prefixed unit: 2 and 5, where they have room."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        digit = round(x / 10.0 ** np.floor(np.log10(x) + 1e-9))
        low, high = np.abs(self.axis.get_view_interval())  # type: ignore[union-attr]
        return super().__call__(x, pos) if digit in (2, 5) and high < _ROOM * low else ""


def name_axis(axes: "Axes", which: Literal["x", "y"], label: str, values: Array) -> None:
    """Label an axis whose data are in SI units, with ticks in a unit that suits the values.

    ``ground speed [m/s]`` with values up to 4e-3 becomes ``ground speed [mm/s]``, with a tick 4
    there. Labels without a unit, or with one that has no prefixes, stay as they are.
    """
    factor, label = in_unit(label, values)
    axes.set(**{f"{which}label": label})
    if factor != 1.0:
        axis = axes.xaxis if which == "x" else axes.yaxis
        axis.set_major_formatter(_InUnit(factor))
        if axis.get_scale() == "log":
            axis.set_minor_formatter(_BetweenDecades(factor))


def in_unit(label: str, values: Array) -> tuple[float, str]:
    """Factor of the unit that suits some values, and the label with this unit."""
    name, _, unit = label.rpartition(" [")
    unit = unit.removesuffix("]")
    finite = np.abs(values[np.isfinite(values)])
    if not (name and has_prefixes(unit) and len(finite)):
        return 1.0, label
    factor, symbol = suitable_unit(float(finite.max()), unit)
    return factor, f"{name} [{symbol}]"


def branch_label(branch: "Branch", name: str | int = "parameter") -> str:
    """Axis label of the parameter, of a stored value or of a state of a branch, with its unit.

    Branches store labels of their parameters, ``labels``, and of what was observed of them,
    ``observed_label``. Without them parameters have those of
    :func:`~fecontact.system.parameter_labels.parameter_label`.
    """
    known = branch.attributes
    if isinstance(name, int):
        states = known.get("state_names", ())
        return str(states[name]) if -len(states) <= name < len(states) else f"state {name}"
    names = branch.parameter_names
    if name == "parameter" or name in names:
        place = 0 if name == "parameter" else names.index(name)
        labels = known.get("labels", ())
        return str(labels[place]) if place < len(labels) else parameter_label(names[place])
    if name.startswith("observed_"):
        what = str(known.get("observed_label", "observed displacement"))
        return {"observed_maximum": f"largest {what}", "observed_minimum": f"smallest {what}",
                "observed_amplitude": f"amplitude of {what}",
                "observed_section": f"once per period: {what}"}.get(name, what)
    words = name.removesuffix("_hz").replace("_", " ")
    return f"{words} [{_UNITS[name]}]" if name in _UNITS else words
