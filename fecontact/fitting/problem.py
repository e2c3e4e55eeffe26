"""Least-squares problem of a fit: numbers of its model over places in the ranges."""

import hashlib
import warnings
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from fecontact import __version__
from fecontact.core.errors import AnalysisError, ModelWarning
from fecontact.core.types import Array
from fecontact.fitting.data import FitData
from fecontact.study.fit_section import FitParameter, values_of
from fecontact.study.study import Study
from fecontact.sweeps.batch import changed
from fecontact.sweeps.case import of_basis
from fecontact.system.contact_system import ContactSystem


@dataclass(frozen=True, eq=False)
class Problem:
    """Residuals ``(predicted - measured) / deviation`` over the places u (p,) of parameters.

    Attributes
    ----------
    model : ContactSystem or Study
        Model with values that do not change.
    names : tuple of str
        Dotted names of the p parameters.
    parameters : tuple of FitParameter
        Ranges of the parameters.
    data : tuple of FitData
        Data that the model is compared with.
    exact : bool
        Whether exact derivatives are used where there are some.
    """

    model: ContactSystem | Study
    names: tuple[str, ...]
    parameters: tuple[FitParameter, ...]
    data: tuple[FitData, ...]
    exact: bool = True

    @property
    def weighted(self) -> bool:
        """True if the standard deviations of the data are known."""
        return all(one.deviations is not None for one in self.data)

    @property
    def measured(self) -> Array:
        """Measured numbers (n,) of all data."""
        return np.concatenate([one.measured for one in self.data])

    def whitened(self, values: Array) -> Array:
        """Changes (n, ...) of the numbers as independent ones, in standard deviations."""
        return np.concatenate([one.whitened(values[part])
                               for one, part in zip(self.data, self.parts, strict=True)])

    def coloured(self, values: Array) -> Array:
        """Changes (n, ...) of the numbers from independent ones, the inverse of whitening."""
        return np.concatenate([one.coloured(values[part])
                               for one, part in zip(self.data, self.parts, strict=True)])

    @property
    def deviation_freedom(self) -> float:
        """Least degrees of freedom of the deviations of the data; infinite if all are known."""
        return min(one.deviation_freedom for one in self.data)

    @property
    def parts(self) -> list[slice]:
        """Ranges of the residuals that belong to each data set."""
        ends = np.cumsum([0, *(len(one.measured) for one in self.data)]).tolist()
        return [slice(a, b) for a, b in pairwise(ends)]

    @cached_property
    def _models(self) -> list[ContactSystem | Study]:
        """Model of each data set, the same object for data with equal changes."""
        found: list[tuple[FitData, ContactSystem | Study]] = []
        for one in self.data:
            model = next((known for other, known in found if other.model is one.model
                          and other.changes == one.changes), None)
            if model is None:
                model = self.model if one.model is None else one.model
                if one.changes:
                    model = (model.with_(one.changes) if isinstance(model, ContactSystem)
                             else changed(model, one.changes))
            found.append((one, model))
        return [model for _, model in found]

    def system(self, u: Array, model: ContactSystem | Study | None = None) -> ContactSystem:
        """Model with the parameters at places u (p,); InputError for values that it refuses."""
        model = self.model if model is None else model
        values = dict(zip(self.names, values_of(self.parameters, u).tolist(), strict=True))
        if isinstance(model, ContactSystem):
            return model.with_(values)
        if not any(of_basis(name, prestress=model.basis.prestress) for name in self.names):
            _ = model.reduced  # made once, for all values
        study = changed(model, values)
        study.reuse(model)
        return study.system()

    def systems(self, u: Array) -> list[ContactSystem]:
        """Model of each data set with the parameters at places u (p,); the last ones are kept."""
        mark = u.tobytes()
        found = self._recent.get(mark)
        if found is None:
            made = {id(model): model for model in self._models}
            ready = {key: self.system(u, model) for key, model in made.items()}
            found = [ready[id(model)] for model in self._models]
            self._recent.clear()
            self._recent[mark] = found
        return found

    @cached_property
    def _recent(self) -> dict[bytes, list[ContactSystem]]:
        """Systems at the places where they were needed last."""
        return {}

    def __getstate__(self) -> dict[str, Any]:
        """Fields alone: other processes make the systems anew."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def weighted_at(self, u: Array) -> "Problem":
        """Problem with the deviations of data that depend on the model, at places u (p,)."""
        with quiet():
            data = tuple(one.weighted_by(system) for one, system in zip(
                self.data, self.systems(u), strict=True))
        same = all(one is other for one, other in zip(data, self.data, strict=True))
        return self if same else replace(self, data=data)

    def predicted(self, u: Array) -> Array:
        """Numbers (n,) of the model at places u (p,); FecontactError if it has none there."""
        with quiet():
            return np.concatenate([_of(one, system) for one, system in zip(
                self.data, self.systems(u), strict=True)])

    def derivatives(self, u: Array, k: int, wanted: tuple[int, ...]) -> list[Array | None]:
        """Exact derivatives of the numbers of some data over place k; None where there are none."""
        slope = self.parameters[k].slope(self.parameters[k].value(float(u[k])))
        with quiet():
            found = [self.data[i].derivative(self.systems(u)[i], self.names[k]) for i in wanted]
        return [None if one is None else one * slope for one in found]

    def key(self) -> str:
        """Hash of all that the numbers depend on."""
        body = hashlib.sha256(f"{__version__} {_written(self.model)} {self.names} "
                              f"{self.parameters} {self.exact}".encode())
        for one in self.data:
            body.update(repr((type(one), sorted(one.changes.items()))).encode())
            if one.model is not None:
                body.update(_written(one.model).encode())
            body.update(np.ascontiguousarray(one.measured).tobytes())
            if one.deviations is not None:
                body.update(np.ascontiguousarray(one.deviations).tobytes())
        return body.hexdigest()[:24]


def _written(model: ContactSystem | Study) -> str:
    """Text of all values of a model."""
    return (model.to_toml() if isinstance(model, Study)
            else repr(sorted(model.parameters().items(), key=lambda one: one[0])))


def _of(one: FitData, system: ContactSystem) -> Array:
    found = one.predicted(system)
    if found.shape != one.measured.shape or not np.isfinite(found).all():
        raise AnalysisError(f"'{one.title}' of the model has values that are not finite.")
    return found


@contextmanager
def quiet() -> Any:
    """Block in which warnings about the model are left out: trial values may be far off."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        yield


Loss = str
LOSSES: Mapping[str, Callable[[Array], Array]] = {
    # Derivatives of the loss functions of scipy.optimize.least_squares over z = r^2.
    "linear": np.ones_like,
    "soft_l1": lambda z: 1.0 / np.sqrt(1.0 + z),
    "huber": lambda z: np.where(z <= 1.0, 1.0, 1.0 / np.sqrt(np.maximum(z, 1.0))),
    "cauchy": lambda z: 1.0 / (1.0 + z),
}
