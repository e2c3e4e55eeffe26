"""Data that a model is fitted to: values, deviations, and what the model gives in their place."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.study.study import Study
from fecontact.system.contact_system import ContactSystem


@dataclass(frozen=True, eq=False, kw_only=True)
class FitData:
    """Base class of data that a model is fitted to.

    Subclasses give n measured numbers, complex ones as real parts and then imaginary parts, and
    the same numbers of a model.

    Parameters
    ----------
    name : str
        Name in tables and pictures; by default that of the class.
    changes : mapping of dotted name to value
        Parameters of the model in this measurement: its level, the preload of this assembly. The
        fit sets them before it calls :meth:`predicted`.
    model : ContactSystem or Study, optional
        Model of this measurement, such as of another assembly with the same joint, in place of that
        of the fit. It has the fitted parameters by the same names.
    """

    name: str = ""
    changes: Mapping[str, Any] = field(default_factory=dict)
    model: ContactSystem | Study | None = None
    # Field that holds the measured numbers.
    compared: ClassVar[str] = "values"

    @property
    def title(self) -> str:
        """Name of the data, by default of its kind."""
        return self.name or type(self).__name__.removesuffix("Data").lower()

    @property
    def measured(self) -> Array:
        """Measured numbers (n,)."""
        return np.asarray(getattr(self, self.compared))

    @property
    def deviations(self) -> Array | None:
        """Standard deviations (n,) of the measured numbers; None if they are not known."""
        found: Array | None = getattr(self, "deviation")  # noqa: B009 (a field of subclasses)
        return found

    @property
    def deviation_freedom(self) -> float:
        """Degrees of freedom with which the deviations were estimated; infinite if known."""
        return np.inf

    def predicted(self, system: ContactSystem) -> Array:
        """Numbers (n,) that a model gives in place of the measured ones; FecontactError if none."""
        raise NotImplementedError

    def whitened(self, values: Array) -> Array:
        """Changes (n, ...) of the numbers as independent ones, in standard deviations."""
        return values if self.deviations is None else (values.T / self.deviations).T

    def coloured(self, values: Array) -> Array:
        """Changes (n, ...) of the numbers from independent ones, the inverse of whitening."""
        return values if self.deviations is None else (values.T * self.deviations).T

    def weighted_by(self, system: ContactSystem) -> "FitData":
        """Copy whose deviations are those at a model, where they depend on it; else the data."""
        return self

    def rescaled(self, factor: float) -> "FitData | None":
        """Copy whose given motion is a factor times as large; None for data without one."""
        return None

    def derivative(self, system: ContactSystem, parameter: str) -> Array | None:
        """Exact derivative (n,) of :meth:`predicted`; None where only differences give it."""
        return None

    def curves(self) -> "list[Curve]":
        """Parts of the numbers as curves, for pictures."""
        n = len(self.measured)
        return [Curve("number", np.arange(1.0, n + 1.0), self.title, slice(0, n))]


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Curve:
    """A part of the numbers of a data set, for pictures.

    Attributes
    ----------
    x_label : str
        Label of the abscissa, with its unit.
    x : array
        Abscissa.
    y_label : str
        Label of the values, with their unit.
    part : slice
        Part of the numbers of the data set.
    logarithmic : bool
        Whether the abscissa has a logarithmic axis.
    joined : bool
        Whether the numbers of the model are joined by a line.
    """

    x_label: str
    x: Array
    y_label: str
    part: slice
    logarithmic: bool = False
    joined: bool = True


def spread(deviation: Any, n: int, owner: str) -> Array | None:
    """Deviations (n,) of one number or n; None for None.

    Raises
    ------
    InputError
        For another number of them, or deviations that are not above zero.
    """
    if deviation is None:
        return None
    found = as_floats(deviation, f"{owner}: deviation")
    if found.shape not in ((), (n,)):
        raise InputError(f"{owner}: deviation has the shape {found.shape}; give one number, or "
                         f"{n}, one for each value.")
    if not ((found > 0.0) & np.isfinite(found)).all():
        raise InputError(f"{owner}: every deviation must be a finite number above zero.")
    return np.array(np.broadcast_to(found, (n,)))


def finite_columns(owner: str, **columns: Any) -> dict[str, Array]:
    """Columns of equal length as arrays; InputError unless they are finite and not empty."""
    found = {name: as_floats(values, f"{owner}: {name}") for name, values in columns.items()}
    shapes = {values.shape for values in found.values()}
    first = next(iter(found.values()))
    if len(shapes) > 1 or first.ndim != 1 or not len(first):
        listed = ", ".join(f"{name} {values.shape}" for name, values in found.items())
        raise InputError(f"{owner}: the columns have the shapes {listed}; give as many values "
                         f"in each.")
    for name, values in found.items():
        if not np.isfinite(values).all():
            raise InputError(f"{owner}: {name} holds values that are no finite numbers, the first "
                             f"in place {int(np.argmin(np.isfinite(values)))}; leave them out.")
    return found


def freeze(data: FitData, **values: Any) -> None:
    """Set fields of a frozen data set to their checked form."""
    known = {entry.name for entry in fields(data)}
    for name, value in values.items():
        assert name in known
        object.__setattr__(data, name, value)


@read_only_arrays
@dataclass(frozen=True, eq=False)
class FunctionData(FitData):
    """Numbers that a function of yours gives for a model.

    Parameters
    ----------
    function : callable
        Takes the contact system, returns n numbers. For several processes it must be defined in a
        module.
    values : (n,) array
        Measured numbers.
    deviation : float or (n,) array, optional
        Standard deviations of the numbers; without any, they follow from the residuals.
    abscissa : (n,) array, optional
        Places at which they are drawn.
    labels : (str, str)
        Labels of abscissa and values.

    Raises
    ------
    InputError
        For arrays that do not fit together or are not finite.
    """

    function: Callable[[ContactSystem], Any]
    values: Array
    deviation: Any = None
    abscissa: Array | None = None
    labels: tuple[str, str] = ("number", "value")

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise InputError(f"FunctionData: function = {self.function!r} must be a function of a "
                             f"contact system.")
        values = finite_columns("FunctionData", values=self.values)["values"]
        places = np.arange(1.0, len(values) + 1.0) if self.abscissa is None else self.abscissa
        freeze(self, **finite_columns("FunctionData", values=values, abscissa=places),
               deviation=spread(self.deviation, len(values), "FunctionData"))

    def predicted(self, system: ContactSystem) -> Array:
        """Numbers (n,) of the function."""
        found = as_floats(self.function(system), f"The function of '{self.title}'")
        if found.shape != self.values.shape or not np.isfinite(found).all():
            raise AnalysisError(f"The function of '{self.title}' returned the shape {found.shape} "
                                f"or values that are not finite, for {len(self.values)} measured "
                                f"ones.")
        return found

    def curves(self) -> list[Curve]:
        """One curve over the abscissa."""
        assert self.abscissa is not None
        return [Curve(self.labels[0], self.abscissa, self.labels[1], slice(0, len(self.values)))]
