"""Solvers of runs: classes of their options with a method ``run``."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from fecontact.core.checks import as_floats, as_path, require_kind
from fecontact.core.errors import InputError, choices, nearest, require_choice, shown
from fecontact.integrate.task import SetValuedOptions, Task
from fecontact.integrate.trajectory import Solution, Status

# Abilities that not all solvers have, and the verb and object of a sentence about them.
ABILITIES = {"events": "locates events", "fields": "runs vector fields",
             "derivatives": "carries derivatives of the motion along"}


class Solver(ABC):
    """Base class of solvers: frozen dataclasses of their options.

    Attributes
    ----------
    abilities : frozenset of str
        Some of: ``events``, located within steps; ``fields``, runs of vector fields; and
        ``derivatives`` of the motion, that it has.
    smooth : bool
        Whether forces are functions of the state, so that energy growth without work is an error.
    """

    abilities: ClassVar[frozenset[str]] = frozenset()
    smooth: ClassVar[bool] = True

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the solver in study files and in the statistics of a run."""

    @abstractmethod
    def run(self, task: Task) -> Solution:
        """Integrate; if the run ends early, return the results up to then."""


@dataclass(frozen=True)
class CompiledSolver(Solver):
    """Base class of the compiled solvers of smooth laws of contact and friction.

    Parameters
    ----------
    checkpoint : path, optional
        File to which the run is saved every minute and on interruption. If it exists, the run is
        resumed from it with bit-for-bit the same results; it is removed at the end.
    keep_checkpoint : bool
        Keep the file at the end, to be removed once the run is written.

    Raises
    ------
    InputError
        If the checkpoint is not a path, or for other values; in a run, for a system that the
        solver cannot run.
    """

    checkpoint: str | Path | None = None
    keep_checkpoint: bool = False

    method: ClassVar[str]

    def __post_init__(self) -> None:
        if self.checkpoint is not None:
            as_path(self.checkpoint, "a checkpoint")
        require_kind(type(self).__name__, bool, keep_checkpoint=self.keep_checkpoint)

    @property
    def name(self) -> str:
        """The name of the method."""
        return self.method

    def run(self, task: Task) -> Solution:
        """See :meth:`Solver.run`; InputError for a checkpoint of another run."""
        from fecontact.integrate.rodas5p.driver import integrate

        path = None if self.checkpoint is None else Path(self.checkpoint)
        if path is not None and not path.parent.is_dir():
            raise InputError(f"checkpoint = {str(path)!r} cannot be written: there is no folder "
                             f"{path.parent}.")
        found = integrate(task, self.method, path)
        if path is not None and not self.keep_checkpoint and found.status is not Status.INTERRUPTED:
            path.unlink(missing_ok=True)
        return found


@dataclass(frozen=True)
class Auto(CompiledSolver):
    """Choice of a compiled solver by the system and the tolerance; the default.

    Auto takes the first of these solvers whose conditions hold. :class:`PowerSeries`: the system
    allows it and has up to four modes and four nodes, no derivatives are requested, and no mode is
    several hundred times faster than the slowest motion. :class:`Radau`: the system allows it, and
    ``rtol`` is 1e-7 or less. :class:`Rodas5P`: always, and for vector fields.
    ``statistics["method"]`` of a run names the solver.
    """

    method: ClassVar[str] = "auto"
    abilities: ClassVar[frozenset[str]] = frozenset(ABILITIES)


@dataclass(frozen=True)
class Rodas5P(CompiledSolver):
    """The compiled Rosenbrock method of order 5, for all smooth laws of contact and friction.

    References
    ----------
    G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P, BIT 63 (2023) 27.
    """

    method: ClassVar[str] = "rodas5p"
    abilities: ClassVar[frozenset[str]] = frozenset(ABILITIES)


@dataclass(frozen=True)
class Radau(CompiledSolver):
    """Compiled collocation of order 9 (Radau IIA), for small tolerances.

    For plane systems of up to four modes and two nodes on flat ground, with laws without memory,
    without events. Steps end where forces switch.

    References
    ----------
    E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer 1996, IV.5.
    """

    method: ClassVar[str] = "radau"
    abilities: ClassVar[frozenset[str]] = frozenset({"derivatives"})


@dataclass(frozen=True)
class PowerSeries(CompiledSolver):
    """Power series in time between switches of contacts, exact to nearly round-off.

    For piecewise polynomial laws the coefficients of the motion follow from a recursion.
    Series need a plane system on flat ground without friction, with
    :class:`~fecontact.laws.RoughSurface` or :class:`~fecontact.laws.LinearContact`, or
    :class:`~fecontact.laws.PowerContact` or :class:`~fecontact.laws.TwoSidedStop` with exponents 1
    or 2, constant or harmonic drives and loads, and no events other than ContactEvents.
    """

    method: ClassVar[str] = "power-series"
    abilities: ClassVar[frozenset[str]] = frozenset({"events"})


class _Coefficients(dict[str, Any]):
    """Coefficients by interfaces, hashable as part of a frozen solver."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))


def _coefficient(owner: str, name: str, given: Any, most: float) -> Any:
    """A coefficient as a number, a tuple, or a mapping of these by interfaces.

    Raises
    ------
    InputError
        For what is no number from 0 to ``most``.
    """
    if isinstance(given, Mapping):
        return _Coefficients((str(key), _coefficient(owner, f"{name}.{key}", value, most))
                             for key, value in given.items())
    values = None if isinstance(given, str | bool) else as_floats(given, f"{owner}: {name}")
    if values is None or values.ndim > 1 or not ((values >= 0.0) & (values <= most)
                                                 & np.isfinite(values)).all():
        limits = "a number from 0 to 1" if most == 1.0 else "a number, zero or above"
        raise InputError(f"{owner}: {name} = {shown(given)} must be {limits}, one for each "
                         f"contact node, or a mapping from interfaces to such numbers.")
    # Tuples make the solver hashable, and plain numbers go into files.
    return float(values) if values.ndim == 0 else tuple(values.tolist())


@dataclass(frozen=True)
class SetValued(SetValuedOptions, Solver):
    r"""Friction without smoothing, sticking by constraint, and rigid stops.

    .. math::

        |R_j| \le \mu(0^+) F_j \ \text{ where } v_j = 0, \qquad
        R_j = \mu(|v_j|) F_j\, \mathrm{sign}(v_j) \ \text{ else}

    This is the limit of infinite ``smoothing_slope``, which friction laws must have. On solids R
    and v are vectors along the tangents, R is in the direction of v, and the set is a disc.
    :class:`EventDriven` runs plane bodies of up to eight independent slip velocities, and all plane
    bodies with rigid stops. :class:`TimeStepping` runs others. ``statistics["method"]`` says which.

    Parameters
    ----------
    restitution : float, (n,) sequence or mapping, optional
        Rigid stops in place of the normal law, with a coefficient of restitution from 0 to 1: for
        all contact nodes, for each, or by the names of interfaces, ``{"stop": 0.5}``. Interfaces
        that are not named have 0.
    static_coefficient : float, (n,) sequence or mapping, optional
        Limit of \|R\|/F in stick [-], given in the same ways, at least that of the law, which is
        the default.
    impact_law : 'newton' or 'poisson'
        Whether restitution is a ratio of velocities or of impulses. With friction, Newton's law
        gains energy in some impacts unless both coefficients are equal; the status of a run
        says so. Poisson's law does not; it is for plane bodies.
    tangential_restitution : float, (n,) sequence or mapping
        Newton's coefficient along the ground, from 0 to 1, of contacts that stick in an impact;
        given in the same ways. Nodes that always slip together need one value.

    Raises
    ------
    InputError
        For values out of range.
    """

    method: ClassVar[str] = "set-valued"
    abilities: ClassVar[frozenset[str]] = frozenset({"events", "derivatives"})
    smooth: ClassVar[bool] = False
    impact_laws: ClassVar[tuple[str, ...]] = ("newton", "poisson")

    def __post_init__(self) -> None:
        owner = type(self).__name__
        for name, most in (("restitution", 1.0), ("tangential_restitution", 1.0),
                           ("static_coefficient", np.inf)):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _coefficient(owner, name, value, most))
        require_choice(owner, "impact_law", self.impact_law, self.impact_laws)
        if self.impact_law == "poisson" and self.tangential_restitution != 0.0:
            raise InputError(f"{owner}: tangential_restitution = "
                             f"{self.tangential_restitution!r} is for impact_law = 'newton' "
                             f"alone; leave it out.")
        if self.restitution is None and (self.impact_law != "newton"
                                         or self.tangential_restitution != 0.0):
            raise InputError(f"{owner}: impact_law and tangential_restitution are for "
                             f"rigid stops; give a restitution too.")

    @property
    def name(self) -> str:
        """The name of the method."""
        return self.method

    def run(self, task: Task) -> Solution:
        """See :meth:`Solver.run`; InputError for a system that it cannot run."""
        from fecontact.integrate.nonsmooth.driver import integrate_set_valued

        found = integrate_set_valued(task, self)
        # Options in the statistics make the run reproducible.
        counted = {name: getattr(self, name) for name in (
            "restitution", "impact_law", "tangential_restitution", "static_coefficient")}
        return replace(found, statistics=found.statistics | counted)


@dataclass(frozen=True)
class EventDriven(SetValued):
    """:class:`SetValued` by an explicit method of order 8 whose steps end at stick and slip.

    For plane bodies whose nodes have independent slip velocities; equal ones count once.
    """

    method: ClassVar[str] = "event-driven"


@dataclass(frozen=True)
class TimeStepping(SetValued):
    """:class:`SetValued` by implicit steps of order 3, for any number of nodes and for solids.

    Steps do not end where nodes begin to stick or slip; the order is one there. Events are not
    located. Rigid stops are for solids only, by the scheme of Moreau and Jean.
    """

    method: ClassVar[str] = "time-stepping"
    abilities: ClassVar[frozenset[str]] = frozenset({"derivatives"})


@dataclass(frozen=True)
class Scipy(Solver):
    """A solver of ``scipy.integrate``, as a reference.

    Parameters
    ----------
    method : 'Radau', 'BDF' or 'LSODA'
        Name of the method in scipy.

    Raises
    ------
    InputError
        For another method.
    """

    method: str = "Radau"

    methods: ClassVar[tuple[str, ...]] = ("Radau", "BDF", "LSODA")
    abilities: ClassVar[frozenset[str]] = frozenset({"events"})

    def __post_init__(self) -> None:
        require_choice("Scipy", "method", self.method, self.methods)

    @property
    def name(self) -> str:
        """``scipy-`` and the method in small letters."""
        return f"scipy-{self.method.lower()}"

    def run(self, task: Task) -> Solution:
        """See :meth:`Solver.run`."""
        from fecontact.integrate.reference.driver import integrate
        from fecontact.integrate.reference.scipy import ScipySteps

        return integrate(task, partial(ScipySteps, self.method))


@dataclass(frozen=True)
class CVODE(Solver):
    """CVODE of SUNDIALS, as a reference; requires scikit-sundae."""

    abilities: ClassVar[frozenset[str]] = frozenset({"events"})

    @property
    def name(self) -> str:
        """``cvode``."""
        return "cvode"

    def run(self, task: Task) -> Solution:
        """See :meth:`Solver.run`; MissingLibraryError without scikit-sundae."""
        from fecontact.integrate.reference.cvode import CvodeSteps
        from fecontact.integrate.reference.driver import integrate

        return integrate(task, CvodeSteps)


# Default solvers.
AUTO, SET_VALUED = Auto(), SetValued()

SOLVERS: dict[str, Solver] = {solver.name: solver for solver in (
    AUTO, Rodas5P(), Radau(), PowerSeries(), SET_VALUED, EventDriven(), TimeStepping(),
    *(Scipy(method) for method in Scipy.methods), CVODE())}


def solver_by_name(name: str, options: Mapping[str, Any]) -> Solver:
    """Solver by its name in files; options that are None keep their defaults.

    Raises
    ------
    InputError
        For an unknown name, options of other solvers, and values out of range.
    """
    if name not in SOLVERS:
        raise InputError(f"solver = {name!r} must be one of {choices(SOLVERS)}"
                         f"{nearest(str(name), SOLVERS)}.")
    given = {key: value for key, value in options.items() if value is not None}
    for key, value in given.items():
        owners = [other for other, solver in SOLVERS.items() if key in _options(solver)]
        if name not in owners:
            raise InputError(f"{key} = {value!r} is only for solver = {choices(owners)}, not "
                             f"'{name}'; leave it out.")
    return replace(SOLVERS[name], **given)  # type: ignore[type-var]


def _options(solver: Any) -> set[str]:
    return {entry.name for entry in fields(solver)}


def require_solver(solver: Any, *needed: str) -> None:
    """Raise InputError for anything but a solver, such as its name, and for one that lacks a need.

    Needs are names of :data:`ABILITIES`.
    """
    if not isinstance(solver, Solver):
        shown = solver.__name__ if isinstance(solver, type) else repr(solver)
        names = list(dict.fromkeys(type(one).__name__ for one in SOLVERS.values()))
        raise InputError(f"solver = {shown} must be a solver with its options: one of "
                         f"{', '.join(f'{name}()' for name in names)}.")
    for need in needed:
        if need not in solver.abilities:
            others = [f"{type(one).__name__}()" for one in SOLVERS.values()
                      if need in one.abilities]
            raise InputError(f"solver = {solver!r} is not one that {ABILITIES[need]}; take one of "
                             f"{', '.join(others)}.")
