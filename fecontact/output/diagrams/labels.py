"""Labels of axes: of parameters and stored values of branches, in units that suit the values."""

from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.types import Array
from fecontact.core.units import has_prefixes, suitable_unit

if TYPE_CHECKING:
    from fecontact.bifurcation.continuation.branch import Branch

_UNITS = {"period": "s", "time": "s", "frequency_hz": "Hz"}


def in_unit(label: str, values: Array) -> tuple[float, str]:
    """Factor of the unit that suits some values, and the label with this unit."""
    name, unit = name_and_unit(label)
    finite = np.abs(values[np.isfinite(values)])
    # Frequencies stay in Hz, as tables and peaks have them.
    if unit == "Hz" or not (has_prefixes(unit) and len(finite)):
        return 1.0, label
    factor, symbol = suitable_unit(float(finite.max()), unit)
    return factor, f"{name} [{symbol}]"


def name_and_unit(label: str) -> tuple[str, str]:
    """Name and unit of a label such as ``gap [m]``; an empty unit of one without brackets."""
    name, bracket, unit = label.rpartition(" [")
    return (name, unit.removesuffix("]")) if bracket else (label, "")


def with_value(label: str, value: float) -> str:
    """A label with a value in a unit that suits it: ``force at B x = 3 N``."""
    name, unit = name_and_unit(label)
    factor, symbol = (suitable_unit(abs(value), unit) if has_prefixes(unit) and unit != "Hz"
                      else (1.0, unit))
    return f"{name} = {value / factor:.5g} {symbol}".rstrip()


def level_label(branch: "Branch") -> str:
    """Label of the parameter of the levels of a response, with its unit."""
    from fecontact.system.parameter_labels import parameter_label

    known = branch.attributes
    return str(known.get("level_label") or parameter_label(str(known["level_name"])))


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
        if place < len(labels):
            return str(labels[place])
        from fecontact.system.parameter_labels import parameter_label

        return parameter_label(names[place])
    if name.startswith("observed_"):
        what = str(known.get("observed_label", "observed displacement"))
        return {"observed_maximum": f"largest {what}", "observed_minimum": f"smallest {what}",
                "observed_amplitude": f"amplitude of {what}",
                "observed_section": f"once per period: {what}"}.get(name, what)
    words = name.removesuffix("_hz").replace("_", " ")
    return f"{words} [{_UNITS[name]}]" if name in _UNITS else words
