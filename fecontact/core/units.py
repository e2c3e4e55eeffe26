"""Units of parameters, numbers with SI prefixes, and short representations of objects."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import MISSING, dataclass, fields
from html import escape
from itertools import chain, repeat
from typing import Any, cast

# Units by their base: factors and symbols, ascending.
UNITS = {
    "m": ((1e-9, "nm"), (1e-6, "µm"), (1e-3, "mm"), (1.0, "m")),
    "m/s": ((1e-9, "nm/s"), (1e-6, "µm/s"), (1e-3, "mm/s"), (1.0, "m/s")),
    "m/s^2": ((1e-6, "µm/s²"), (1e-3, "mm/s²"), (1.0, "m/s²")),
    "rad": ((1e-6, "µrad"), (1e-3, "mrad"), (1.0, "rad")),
    "rad/s": ((1e-3, "mrad/s"), (1.0, "rad/s")),
    "rad/s^2": ((1e-3, "mrad/s²"), (1.0, "rad/s²")),
    "s": ((1e-6, "µs"), (1e-3, "ms"), (1.0, "s")),
    "N": ((1e-3, "mN"), (1.0, "N"), (1e3, "kN")),
    "N m": ((1e-6, "µN m"), (1e-3, "mN m"), (1.0, "N m"), (1e3, "kN m")),
    "N/m": ((1.0, "N/m"), (1e3, "N/mm"), (1e6, "kN/mm")),
    "Pa": ((1.0, "Pa"), (1e3, "kPa"), (1e6, "MPa"), (1e9, "GPa")),
    "W": ((1e-6, "µW"), (1e-3, "mW"), (1.0, "W"), (1e3, "kW")),
    "Hz": ((1.0, "Hz"), (1e3, "kHz")),
    "J/m": ((1e-9, "nJ/m"), (1e-6, "µJ/m"), (1e-3, "mJ/m"), (1.0, "J/m"), (1e3, "kJ/m")),
    "J/m^2": ((1e-6, "µJ/m²"), (1e-3, "mJ/m²"), (1.0, "J/m²"), (1e3, "kJ/m²"), (1e6, "MJ/m²")),
    "J": ((1e-9, "nJ"), (1e-6, "µJ"), (1e-3, "mJ"), (1.0, "J"), (1e3, "kJ")),
}

_LONGEST = 360  # characters of a one-line representation


@dataclass(frozen=True)
class Unit:
    """Unit of a number, as part of its annotation: ``Annotated[float, Unit("m/s")]``."""

    symbol: str

    def __repr__(self) -> str:
        return self.symbol


def suitable_unit(size: float, unit: str) -> tuple[float, str]:
    """The largest prefixed unit that does not exceed a value, as factor and symbol.

    Parameters
    ----------
    size : float
        Largest magnitude to show, in ``unit``; zero gives ``unit`` itself.
    unit : str
        SI unit: m, m/s, m/s^2, rad, rad/s, rad/s^2, s, Hz, N, N m, N/m, Pa, W, J, J/m or J/m^2.

    Returns
    -------
    (float, str)
        ``value / factor`` is the number to show: ``suitable_unit(2e-5, "m") == (1e-6, "µm")``.
    """
    if not 0.0 < abs(size) < math.inf:
        return 1.0, unit
    fitting = [choice for choice in UNITS[unit] if abs(size) >= choice[0] * (1.0 - 1e-9)]
    return fitting[-1] if fitting else UNITS[unit][0]


def has_prefixes(unit: str) -> bool:
    """Whether :func:`suitable_unit` knows a unit."""
    return unit in UNITS


def round_125(value: float) -> float:
    """The largest of 1, 2 or 5 times a power of ten that does not exceed a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    digit = value / power
    return power * (5.0 if digit >= 5.0 else 2.0 if digit >= 2.0 else 1.0)


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """A value with a suitable unit: ``quantity(0.0123, "m") == "12.3 mm"``."""
    factor, symbol = suitable_unit(value, unit)
    return f"{value / factor:.{digits}g} {symbol}"


def count(number: int, noun: str) -> str:
    """A count with its noun: ``1 node``, ``2 nodes``."""
    return f"{number} {noun}" + ("" if number == 1 else "s")


def span(values: Iterable[float], unit: str = "") -> str:
    """Smallest and largest of some numbers: ``0.3 ... 9.6 Hz``; one if they agree."""
    known = [float(value) for value in values if math.isfinite(value)]
    if not known:
        return "none"
    low, high = f"{min(known):.4g}", f"{max(known):.4g}"
    return " ".join(filter(None, (low if low == high else f"{low} ... {high}", unit)))


def listed(items: Sequence[str], most: int = 4) -> str:
    """The first of some strings and the number of the others: ``a, b and 3 more``."""
    shown = ", ".join(items[:most])
    return f"{shown} and {len(items) - most} more" if len(items) > most else shown or "none"


def html_table(
    title: str, rows: Iterable[Sequence[str]], headings: Sequence[str] = ()
) -> str:
    """A table for a notebook, its first column as row headings; text is escaped."""
    def row(kinds: Iterable[str], texts: Iterable[str]) -> str:
        return "<tr>" + "".join(f'<{kind} style="text-align: left">{escape(text)}</{kind}>'
                                for kind, text in zip(kinds, texts, strict=False)) + "</tr>"

    head = f"<thead>{row(repeat('th'), headings)}</thead>" if headings else ""
    body = "".join(row(chain(["th"], repeat("td")), texts) for texts in rows)
    return f"<table><caption>{escape(title)}</caption>{head}<tbody>{body}</tbody></table>"


class Summarised:
    """Base class of objects shown as one line in a console and as a small table in a notebook.

    Subclasses define :meth:`summary`; dataclasses among them have ``repr=False``.
    """

    def summary(self) -> list[tuple[str, str]]:
        """The main properties of the object, as pairs of name and text."""
        raise NotImplementedError

    def __repr__(self) -> str:
        facts = "; ".join(f"{name}: {text}" for name, text in self.summary())
        line = " ".join(f"{type(self).__name__} {facts}".split())
        return f"<{line}>" if len(line) <= _LONGEST else f"<{line[:_LONGEST]}...>"

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self.summary())


class Brief:
    """Base class of dataclasses shown with those values that differ from their defaults.

    Dataclasses among them have ``repr=False``.
    """

    def __repr__(self) -> str:
        given: list[str] = []
        for entry in fields(cast(Any, self)):
            value = getattr(self, entry.name)
            default = (entry.default if entry.default_factory is MISSING
                       else entry.default_factory())
            if entry.repr and not _same(value, default):
                given.append(f"{entry.name}={value!r}")
        return f"{type(self).__name__}({', '.join(given)})"


def _same(value: Any, default: Any) -> bool:
    """Whether a value is the default; arrays are not compared."""
    return value is default or (type(value) is type(default)
                                and isinstance(value, int | float | str | tuple)
                                and bool(value == default))
