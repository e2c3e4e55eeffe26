"""Solvers of runs: classes of their options with a method ``run``."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from fecontact.core.checks import as_floats, as_path, require_kind
from fecontact.core.errors import InputError, choices, nearest, shown
from fecontact.core.types import Array
from fecontact.integrate.coefficients import Coefficient
from fecontact.integrate.events import AnyEvent
from fecontact.integrate.trajectory import Solution, Status
from fecontact.system.contact_system import ContactSystem


@dataclass(frozen=True, eq=False)
class Task:
    """Input of a solver.

    Attributes
    ----------
    system : ContactSystem
        The system.
    state : (2 m + n s,) array
        y = [q, q', z] at the first time.
    times : (N,) array
        Output times, ascending [s].
    rtol : float
        Relative tolerance.
    max_step : float or None
        Longest step [s].
    events : sequence of ContactEvents, Crossing and Event
        Events to locate; empty unless the solver ``locates_events``.
    progress : callable or None
        Called occasionally with the time reached [s].
    """

    system: ContactSystem
    state: Array
    times: Array
    rtol: float
    max_step: float | None = None
    events: Sequence[AnyEvent] = ()
    progress: Callable[[float], None] | None = None


class Solver(ABC):
    """Base class of solvers: frozen dataclasses of their options.

    Attributes
    ----------
    locates_events : bool
        Whether it locates the ``events`` of :func:`fecontact.simulate`.
    smooth : bool
        Whether forces are functions of the state, so that energy growth without work is an error.
    """

    locates_events: ClassVar[bool] = False
    smooth: ClassVar[bool] = True

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the solver in study files and in the statistics of a run."""

    @abstractmethod
    def run(self, task: Task) -> Solution:
        """Integrate; if the run ends early, return the results up to then."""


@dataclass(frozen=True)
class Rodas5P(Solver):
    """The compiled Rosenbrock method of order 5, for smooth laws of contact and friction.

    Between two switches of contacts whose laws are polynomials piece by piece, without friction,
    the motion is a power series in time, whose coefficients follow from one another: such systems
    are integrated by these series instead, to nearly round-off and several times faster.

    Parameters
    ----------
    series : 'auto', 'always' or 'never'
        Whether to use power series: by default for up to four modes and nodes, where no mode is
        several hundred times faster than the slowest motion. They need flat ground, no friction,
        :class:`~fecontact.laws.RoughSurface` or
        :class:`~fecontact.laws.LinearContact`, or :class:`~fecontact.laws.PowerContact` or
        :class:`~fecontact.laws.TwoSidedStop` with exponents 1 or 2, constant or harmonic drives
        and loads, and no events other than ContactEvents. Sensitivities are those of Rodas5P.
    collocation : 'auto', 'always' or 'never'
        Whether to take steps of order 9 instead, which are longer where little error is allowed: by
        default if ``rtol`` is 1e-7 or less, for plane systems of up to four modes and two nodes
        on flat ground, of laws without memory, without events; with derivatives or without. A run
        by series stays one.
    checkpoint : path, optional
        File to which the run is saved every minute and on interruption. If it exists, the run is
        resumed from it with bit-for-bit the same results; it is removed at the end.
    keep_checkpoint : bool
        Keep the file at the end, to be removed once the run is written.

    Raises
    ------
    InputError
        If the checkpoint is not a path, or for other values; in a run, if series or collocation
        are 'always' to be used, and cannot be.

    References
    ----------
    G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P, BIT 63 (2023) 27.
    """

    checkpoint: str | Path | None = None
    keep_checkpoint: bool = False
    series: str = "auto"
    collocation: str = "auto"

    locates_events: ClassVar[bool] = True
    uses: ClassVar[tuple[str, ...]] = ("auto", "always", "never")

    def __post_init__(self) -> None:
        for name in ("series", "collocation"):
            use = getattr(self, name)
            if use not in self.uses:
                raise InputError(f"Rodas5P: {name} = {use!r} must be one of "
                                 f"{choices(self.uses)}{nearest(str(use), self.uses)}.")
        if self.series == self.collocation == "always":
            raise InputError("Rodas5P: series and collocation = 'always' exclude each other; leave "
                             "one of them out.")
        if self.checkpoint is not None:
            as_path(self.checkpoint, "a checkpoint")
        require_kind("Rodas5P", bool, keep_checkpoint=self.keep_checkpoint)

    @property
    def name(self) -> str:
        """``rodas5p``."""
        return "rodas5p"

    def run(self, task: Task) -> Solution:
        """See :meth:`Solver.run`; InputError for a checkpoint of another run."""
        from fecontact.integrate.rodas5p.driver import integrate

        path = None if self.checkpoint is None else Path(self.checkpoint)
        if path is not None and not path.parent.is_dir():
            raise InputError(f"checkpoint = {str(path)!r} cannot be written: there is no folder "
                             f"{path.parent}.")
        found = integrate(task.system, task.state, task.times, rtol=task.rtol,
                          max_step=task.max_step, progress=task.progress, checkpoint=path,
                          events=task.events, series=self.series,
                          collocation=self.collocation)
        if path is not None and not self.keep_checkpoint and found.status is not Status.INTERRUPTED:
            path.unlink(missing_ok=True)
        return found


class _Coefficients(dict[str, Any]):
    """Coefficients by interfaces, hashable as part of a frozen solver."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))


def _coefficient(name: str, given: Any, most: float) -> Any:
    """A coefficient as a number, a tuple, or a mapping of these by interfaces.

    Raises
    ------
    InputError
        For what is no number from 0 to ``most``.
    """
    if isinstance(given, Mapping):
        return _Coefficients((str(key), _coefficient(f"{name}.{key}", value, most))
                             for key, value in given.items())
    values = None if isinstance(given, str | bool) else as_floats(given, f"SetValued: {name}")
    if values is None or values.ndim > 1 or not ((values >= 0.0) & (values <= most)
                                                 & np.isfinite(values)).all():
        limits = "a number from 0 to 1" if most == 1.0 else "a number, zero or above"
        raise InputError(f"SetValued: {name} = {shown(given)} must be {limits}, one for each "
                         f"contact node, or a mapping from interfaces to such numbers.")
    # Tuples make the solver hashable, and plain numbers go into files.
    return float(values) if values.ndim == 0 else tuple(values.tolist())


@dataclass(frozen=True)
class SetValued(Solver):
    r"""Friction without smoothing, sticking by constraint, and rigid stops.

    .. math::

        |R_j| \le \mu(0^+) F_j \ \text{ where } v_j = 0, \qquad
        R_j = \mu(|v_j|) F_j\, \mathrm{sign}(v_j) \ \text{ else}

    This is the limit of infinite ``smoothing_slope``, which friction laws must have. On solids R
    and v are vectors along the tangents, R is in the direction of v, and the set is a disc.

    Parameters
    ----------
    restitution : float, (n,) sequence or mapping, optional
        Rigid stops in place of the normal law, with a coefficient of restitution from 0 to 1: for
        all contact nodes, for each, or by the names of interfaces, ``{"stop": 0.5}``. Interfaces
        that are not named have 0.
    static_coefficient : float, (n,) sequence or mapping, optional
        Limit of \|R\|/F in stick [-], given in the same ways; default that of the law.
    scheme : 'auto', 'events' or 'stepping'
        Event-driven, for few nodes, or time-stepping, for any number of nodes and for solids.
    impact_law : 'newton' or 'poisson'
        Whether restitution is a ratio of velocities or of impulses. With friction, Newton's law
        gains energy in some impacts unless both coefficients are equal; the status of a run
        says so. Poisson's law does not; it is for plane bodies.
    tangential_restitution : float, (n,) sequence or mapping
        Newton's coefficient along the ground, from 0 to 1, of contacts that stick in an impact;
        given in the same ways. Nodes that always move along the ground together need one value.

    Raises
    ------
    InputError
        For values out of range.
    """

    restitution: Coefficient | None = None
    static_coefficient: Coefficient | None = None
    scheme: str = "auto"
    impact_law: str = "newton"
    tangential_restitution: Coefficient = 0.0

    locates_events: ClassVar[bool] = True
    smooth: ClassVar[bool] = False
    schemes: ClassVar[tuple[str, ...]] = ("auto", "events", "stepping")
    impact_laws: ClassVar[tuple[str, ...]] = ("newton", "poisson")

    def __post_init__(self) -> None:
        for name, most in (("restitution", 1.0), ("tangential_restitution", 1.0),
                           ("static_coefficient", np.inf)):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _coefficient(name, value, most))
        if self.impact_law not in self.impact_laws:
            raise InputError(f"SetValued: impact_law = {self.impact_law!r} must be one of "
                             f"{choices(self.impact_laws)}"
                             f"{nearest(str(self.impact_law), self.impact_laws)}.")
        if self.impact_law == "poisson" and self.tangential_restitution != 0.0:
            raise InputError(f"SetValued: tangential_restitution = {self.tangential_restitution!r} "
                             f"is for impact_law = 'newton' alone; leave it out.")
        if self.restitution is None and (self.impact_law != "newton"
                                         or self.tangential_restitution != 0.0):
            raise InputError("SetValued: impact_law and tangential_restitution are for rigid "
                             "stops; give a restitution too.")
        if self.scheme not in self.schemes:
            raise InputError(f"SetValued: scheme = {self.scheme!r} must be one of "
                             f"{choices(self.schemes)}{nearest(str(self.scheme), self.schemes)}.")

    @property
    def name(self) -> str:
        """``set-valued``."""
        return "set-valued"

    def run(self, task: Task) -> Solution:
        """See :meth:`Solver.run`; InputError for a system that it cannot run."""
        from fecontact.integrate.nonsmooth.driver import integrate_set_valued
        from fecontact.integrate.reference.scipy import longest_step

        found = integrate_set_valued(
            task.system, task.state, task.times, rtol=task.rtol, restitution=self.restitution,
            impact_law=self.impact_law, tangential_restitution=self.tangential_restitution,
            static_coefficient=self.static_coefficient, scheme=self.scheme,
            longest=longest_step(task.system, task.times, task.max_step), max_step=task.max_step,
            events=task.events, progress=task.progress)
        # Options in the statistics make the run reproducible.
        told = {name: getattr(self, name) for name in (
            "restitution", "impact_law", "tangential_restitution", "static_coefficient")}
        return replace(found, statistics=found.statistics | told)


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

    def __post_init__(self) -> None:
        if self.method not in self.methods:
            raise InputError(f"Scipy: method = {self.method!r} must be one of "
                             f"{choices(self.methods)}{nearest(str(self.method), self.methods)}.")

    @property
    def name(self) -> str:
        """The method in small letters."""
        return self.method.lower()

    def run(self, task: Task) -> Solution:
        """See :meth:`Solver.run`."""
        from fecontact.integrate.reference.scipy import integrate

        return integrate(task.system, task.state, task.times, method=self.method, rtol=task.rtol,
                         max_step=task.max_step, progress=task.progress)


@dataclass(frozen=True)
class CVODE(Solver):
    """CVODE of SUNDIALS, as a reference; requires scikit-sundae."""

    @property
    def name(self) -> str:
        """``cvode``."""
        return "cvode"

    def run(self, task: Task) -> Solution:
        """See :meth:`Solver.run`; MissingLibraryError without scikit-sundae."""
        from fecontact.integrate.reference.cvode import integrate

        return integrate(task.system, task.state, task.times, rtol=task.rtol,
                         max_step=task.max_step, progress=task.progress)


# Default solver of all functions.
RODAS5P, SET_VALUED = Rodas5P(), SetValued()

SOLVERS: dict[str, Solver] = {solver.name: solver for solver in (
    RODAS5P, SET_VALUED, *(Scipy(method) for method in Scipy.methods), CVODE())}


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


def require_solver(solver: Any) -> None:
    """Raise InputError for anything but a solver, such as its name or class."""
    if not isinstance(solver, Solver):
        shown = solver.__name__ if isinstance(solver, type) else repr(solver)
        raise InputError(f"solver = {shown} must be Rodas5P(), SetValued(), Scipy('Radau') or "
                         f"CVODE(), with their options.")
