"""Least-squares problem of a fit: residuals and their derivatives over places in the ranges."""

import hashlib
import json
import pickle
import warnings
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from fecontact import __version__
from fecontact.core.errors import AnalysisError, FecontactError, InputError, ModelWarning
from fecontact.core.types import Array
from fecontact.fitting.data import FitData
from fecontact.study.fit_section import FitParameter, values_of
from fecontact.study.study import Study
from fecontact.sweeps.batch import changed
from fecontact.sweeps.case import of_basis
from fecontact.system.contact_system import ContactSystem

STEP = 1e-3  # of differences, in parts of the range
# Relative difference of the derivatives to both sides from which on there is a kink between.
_KINK = 0.25


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

    @property
    def deviations(self) -> Array:
        """Standard deviations (n,), one for all data without."""
        return np.concatenate([np.ones(len(one.measured)) if one.deviations is None
                               else one.deviations for one in self.data])

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
        """Model of each data set with the parameters at places u (p,)."""
        made = {id(model): model for model in self._models}
        ready = {key: self.system(u, model) for key, model in made.items()}
        return [ready[id(model)] for model in self._models]

    def predicted(self, u: Array) -> Array:
        """Numbers (n,) of the model at places u (p,); FecontactError if it has none there."""
        with quiet():
            return np.concatenate([_of(one, system) for one, system in zip(
                self.data, self.systems(u), strict=True)])

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


@dataclass(eq=False)
class Evaluator:
    """Evaluates a problem and keeps what was evaluated, also in a file.

    A fit that goes on repeats its search from the numbers in the file, so that its result is that
    of a fit without interruption.

    Attributes
    ----------
    problem : Problem
    file : Path or None
        Lines of JSON: the key of the problem, then places and predicted numbers.
    """

    problem: Problem
    file: Path | None = None
    evaluations: int = 0
    kinks: dict[str, float] = field(default_factory=dict)
    exact: dict[tuple[str, str], bool] = field(default_factory=dict)
    _known: dict[bytes, Array | str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.file is None:
            return
        key = self.problem.key()
        if self.file.exists():
            text = self.file.read_text(encoding="utf-8", errors="replace")
            lines = text.splitlines()
            if not lines or lines[0] != json.dumps({"key": key}):
                raise InputError(f"{self.file} is of a fit of another model or of other data; give "
                                 f"another folder, or replace it with overwrite = True.")
            for line in lines[1:]:
                try:
                    stored = json.loads(line)
                    place = np.array([float.fromhex(one) for one in stored["u"]])
                    self._known[place.tobytes()] = (
                        stored["failed"] if "failed" in stored else
                        np.array([float.fromhex(one) for one in stored["y"]]))
                except (ValueError, KeyError, TypeError):
                    continue  # the last line of a fit that was killed
            if not text.endswith("\n"):
                with self.file.open("a", encoding="utf-8") as stream:
                    stream.write("\n")
        else:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            self.file.write_text(json.dumps({"key": key}) + "\n", encoding="utf-8")

    def predicted(self, u: Array) -> Array:
        """Numbers (n,) of the model at places u; FecontactError if it has none there."""
        mark = np.ascontiguousarray(u, dtype=float).tobytes()
        if mark not in self._known:
            self._known[mark] = self._evaluated(u)
            self._store(u, self._known[mark])
        found = self._known[mark]
        if isinstance(found, str):
            raise AnalysisError(found)
        return found

    def _evaluated(self, u: Array) -> Array | str:
        self.evaluations += 1
        try:
            return self.problem.predicted(u)
        except FecontactError as error:
            return str(error)

    def _store(self, u: Array, found: Array | str) -> None:
        if self.file is None:
            return
        line: dict[str, Any] = {"u": [float(one).hex() for one in u]}
        line |= ({"failed": found} if isinstance(found, str)
                 else {"y": [float(one).hex() for one in found]})
        with self.file.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(line) + "\n")

    def residual(self, u: Array) -> Array:
        """Weighted residuals (n,)."""
        return np.asarray((self.predicted(u) - self.problem.measured) / self.problem.deviations)

    def jacobian(self, u: Array, free: Array | None = None) -> Array:
        """Derivatives (n, p) of the weighted residuals over the places.

        Exact ones where the data have some, else central differences, one-sided at a bound and
        beside models that fail. Columns that are not ``free`` are zero.
        """
        problem = self.problem
        J = np.zeros((len(problem.measured), len(u)))
        systems: list[ContactSystem] = []
        for k, name in enumerate(problem.names):
            if free is not None and not free[k]:
                continue
            done = []
            for i, (one, part) in enumerate(zip(problem.data, problem.parts, strict=True)):
                found = None
                if problem.exact and self.exact.get((one.title, name), True):
                    with quiet():
                        systems = systems or problem.systems(u)
                        found = one.derivative(systems[i], name)
                self.exact[one.title, name] = found is not None
                if found is not None:
                    value = problem.parameters[k].value(float(u[k]))
                    J[part, k] = found * problem.parameters[k].slope(value)
                done.append(found is not None)
            if not all(done):
                column = self._difference(u, k)
                for part, exact in zip(problem.parts, done, strict=True):
                    if not exact:
                        J[part, k] = column[part]
        return J / problem.deviations[:, None]

    def _difference(self, u: Array, k: int) -> Array:
        """Derivative (n,) of the predicted numbers over place k by differences."""
        sides: dict[float, Array] = {}
        reason = ""
        for side in (-1.0, 1.0):
            moved = np.array(u, dtype=float)
            moved[k] = min(max(u[k] + side * STEP, 0.0), 1.0)
            width = moved[k] - u[k]
            if abs(width) < 0.5 * STEP:
                continue
            try:
                sides[side] = (self.predicted(moved) - self.predicted(u)) / width
            except FecontactError as error:
                reason = str(error)
        if not sides:
            raise AnalysisError(f"The model fails on both sides of {self.problem.names[k]} = "
                                f"{self.problem.parameters[k].value(float(u[k])):g}: {reason}")
        if len(sides) == 2:
            weights = 1.0 / self.problem.deviations
            apart = float(np.linalg.norm((sides[1.0] - sides[-1.0]) * weights))
            size = float(np.linalg.norm((sides[1.0] + sides[-1.0]) * weights))
            self.kinks[self.problem.names[k]] = apart / size if size > 0.0 else 0.0
        return np.asarray(sum(sides.values()) / len(sides))

    def kinked(self) -> list[str]:
        """Names of parameters whose last differences to both sides disagree."""
        return [name for name, apart in self.kinks.items() if apart > _KINK]


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


def require_picklable(problem: Problem) -> None:
    """Raise InputError unless other processes can be given the problem."""
    try:
        pickle.dumps(problem)
    except Exception as error:
        raise InputError(f"fit: the model or the data cannot be sent to other processes "
                         f"({' '.join(str(error).split())[:200]}); define functions in a module, "
                         f"or leave out workers.") from None


Loss = str
LOSSES: Mapping[str, Callable[[Array], Array]] = {
    # Derivatives of the loss functions of scipy.optimize.least_squares over z = r^2.
    "linear": np.ones_like,
    "soft_l1": lambda z: 1.0 / np.sqrt(1.0 + z),
    "huber": lambda z: np.where(z <= 1.0, 1.0, 1.0 / np.sqrt(np.maximum(z, 1.0))),
    "cauchy": lambda z: 1.0 / (1.0 + z),
}
