"""What a law is: signatures, signs and units, and the base classes of all of them.

A law is a frozen dataclass of its parameters together with a scalar function, written once in
plain Python and compiled. The functions allocate nothing and raise nothing.

===========  ==========================  =========================================================
kind         function                    returns
===========  ==========================  =========================================================
normal       ``f(u, v, p)``              F, dF/du, dF/dv: normal force on the body [N] from
                                         penetration u [m] and its rate v [m/s]; zero or above,
                                         except that a stop above the body pushes it down, F < 0
friction     ``f(v, F, p)``              R, dR/dv, dR/dF: friction force [N] that acts on the body
                                         against +x, with the sign of the slip velocity v of the
                                         body relative to the ground [m/s], from the normal
                                         force F >= 0 [N]
friction     ``f(v, F, z, p, force,      nothing; fills ``force`` (3 + s,) with R, dR/dv, dR/dF and
with memory  rates)``                    the s derivatives dR/dz, and ``rates`` (s, 3 + s) with a
                                         row z', dz'/dv, dz'/dF, dz'/dz per internal variable z
ground       ``f(xi, p)``                y, y', y'': height [m], or factor of the friction force,
                                         at the abscissa xi of the ground's own frame [m] and its
                                         derivatives
signal       ``f(t, p)``                 value and rate of what is given in time: travel of the
                                         ground [m], displacement of the drive [m], load [N]
===========  ==========================  =========================================================

``p`` holds the parameters in the order of the dataclass's fields; for normal and friction laws
it is that of the contact node. A parameter given as one number holds for every node; an extensive
one (stiffness, damping) is then the total of the contact face and is shared by tributary length.
A parameter given as a sequence has one value per node and is not shared. A parameter that is a
name out of a few holds for every node; ``p`` has its index among :attr:`NodeLaw.choices`.

Internal variables of friction with memory are states of the system, integrated with it. Their
rates must be continuous where R depends on them; at F = 0, where it does not, they fall back to
zero.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, ClassVar, get_type_hints

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.compiled import CompiledLaw, compile_law, f8, function_at, matrix, vector
from fecontact.errors import InputError, choices, nearest

NORMAL = types.UniTuple(f8, 3)(f8, f8, vector)
FRICTION = types.UniTuple(f8, 3)(f8, f8, vector)
MEMORY = types.void(f8, f8, vector, vector, vector, matrix)
GROUND = types.UniTuple(f8, 3)(f8, vector)
SIGNAL = types.UniTuple(f8, 2)(f8, vector)

normal_at = function_at(NORMAL)
friction_at = function_at(FRICTION)
memory_at = function_at(MEMORY)
ground_at = function_at(GROUND)
signal_at = function_at(SIGNAL)

NORMAL_FORM = "f(u, v, p) -> F, dF/du, dF/dv"
FRICTION_FORM = "f(v, F, p) -> R, dR/dv, dR/dF"
MEMORY_FORM = "f(v, F, z, p, force, rates)"

PerNode = float | tuple[float, ...]


@dataclass(frozen=True)
class Range:
    """Values that a parameter may have, as part of its annotation: ``Annotated[PerNode, Range]``.

    Attributes
    ----------
    allowed : str
        The values in words: ``parameter = -1.0 must be {allowed}``.
    holds : callable
        Whether each number of an array is one of them.
    """

    allowed: str
    holds: Callable[[NDArray[np.float64]], Any]


Positive = Annotated[PerNode, Range("above zero", lambda x: x > 0.0)]
NotNegative = Annotated[PerNode, Range("zero or above", lambda x: x >= 0.0)]
OneOrAbove = Annotated[PerNode, Range("one or above", lambda x: x >= 1.0)]
UpToOne = Annotated[PerNode, Range("above zero and at most 1", lambda x: (x > 0.0) & (x <= 1.0))]


@cache
def _ranges(law: Any) -> Mapping[str, tuple[Range, ...]]:
    """Ranges that the annotations of a law's parameters name."""
    try:
        hints = get_type_hints(law, include_extras=True)
    except NameError as error:
        raise InputError(f"{law.__name__}: an annotation cannot be understood ({error}); use names "
                         f"that the module of the law knows.") from None
    return {name: tuple(item for item in getattr(hint, "__metadata__", ())
                        if isinstance(item, Range))
            for name, hint in hints.items()}


def normal_law(function: Callable[..., Any]) -> CompiledLaw:
    """Decorator of a function ``f(u, v, p) -> F, dF/du, dF/dv``, compiled at its first use.

    Arguments, results, units and signs stand at the top of the module. InputError at that use for
    another form, or a statement that cannot be compiled.
    """
    return compile_law(NORMAL, NORMAL_FORM, function)


def friction_law(function: Callable[..., Any]) -> CompiledLaw:
    """Decorator of a function ``f(v, F, p) -> R, dR/dv, dR/dF``, compiled at its first use.

    Arguments, results, units and signs stand at the top of the module. InputError at that use for
    another form, or a statement that cannot be compiled.
    """
    return compile_law(FRICTION, FRICTION_FORM, function)


def ground_profile(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(xi, p) -> y, y', y''``."""
    return compile_law(GROUND, "f(xi, p) -> y, y', y''", function)


def memory_friction_law(function: Callable[..., Any]) -> CompiledLaw:
    """Decorator of a function ``f(v, F, z, p, force, rates)`` that fills force and rates.

    As :func:`friction_law`.
    """
    return compile_law(MEMORY, MEMORY_FORM, function)


def signal(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(t, p) -> value, rate``."""
    return compile_law(SIGNAL, "f(t, p) -> value, rate", function)


@dataclass(frozen=True)
class NodeLaw:
    """A law whose parameters may differ from contact node to contact node."""

    kernel: ClassVar[CompiledLaw]
    extensive: ClassVar[frozenset[str]] = frozenset()
    # Parameters whose lists are not one value per node.
    shared_fields: ClassVar[frozenset[str]] = frozenset()
    choices: ClassVar[Mapping[str, tuple[str, ...]]] = {}

    def __post_init__(self) -> None:
        law: Any = type(self)
        for entry in fields(self):
            given = getattr(self, entry.name)
            if entry.name in self.choices:
                names = self.choices[entry.name]
                if not isinstance(given, str) or given not in names:
                    raise InputError(f"{self._title(entry.name)} = {given!r} must be one of "
                                     f"{choices(names)}{nearest(str(given), names)}.")
                continue
            try:
                array = np.asarray(given)
            except ValueError:
                array = np.empty(0)
            if array.dtype.kind not in "iuf" or array.ndim > 1 or not array.size:
                raise InputError(f"{self._title(entry.name)} = {given!r} must be a number or a "
                                 f"list of numbers, one per contact node.")
            if array.ndim and entry.type in (float, "float"):
                raise InputError(f"{self._title(entry.name)} = {given!r} must be a number; only "
                                 f"parameters annotated as PerNode take one per contact node.")
            value = tuple(float(item) for item in array) if array.ndim else float(array)
            if not np.isfinite(value).all():
                raise InputError(f"{self._title(entry.name)} = {value!r} must be finite.")
            object.__setattr__(self, entry.name, value)
            for one in _ranges(law)[entry.name]:
                self.require(one.allowed, one.holds, entry.name)

    def node_count(self) -> int | None:
        """Number of contact nodes for which parameters are given one by one; None if for none.

        Raises
        ------
        InputError
            If two parameters have different numbers of values.
        """
        sizes = {entry.name: len(value) for entry in fields(self)
                 if entry.name not in self.shared_fields
                 and isinstance(value := getattr(self, entry.name), tuple)}
        if len(set(sizes.values())) > 1:
            listed = ", ".join(f"{name} has {size}" for name, size in sizes.items())
            raise InputError(f"{type(self).__name__}: parameters given per contact node need as "
                             f"many values each, but {listed}.")
        return next(iter(sizes.values()), None)

    def table(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Parameters (n, k) of n nodes; ``share`` (n,) is each node's part of the face."""
        columns = []
        for entry in fields(self):
            given = getattr(self, entry.name)
            if entry.name in self.choices:
                given = self.choices[entry.name].index(given)
            value = np.asarray(given, dtype=float)
            if value.ndim and value.shape != share.shape:
                raise InputError(f"{self._title(entry.name)} has {value.size} values for "
                                 f"{share.size} contact nodes; give one number or one per node.")
            if not value.ndim and entry.name in self.extensive:
                value = value * share
            columns.append(np.broadcast_to(value, share.shape))
        return np.array(columns).T.reshape(len(share), -1).copy()

    def require(self, allowed: str, test: Callable[[NDArray[np.float64]], Any],
                *names: str) -> None:
        """Raise :class:`InputError` unless every value of the named parameters passes a test."""
        for name in names:
            value = getattr(self, name)
            if not np.all(test(np.asarray(value, dtype=float))):
                raise InputError(f"{self._title(name)} = {value!r} must be {allowed}.")

    def _title(self, name: str) -> str:
        return f"{type(self).__name__}: {name}"


@dataclass(frozen=True)
class NormalLaw(NodeLaw):
    """A normal law; ``kernel`` is a :func:`normal_law`."""

    @property
    def penetration_scale(self) -> float:
        """Penetration [m] over which the law changes its character, the smallest of all nodes.

        Tolerances of time integration and starting values of equilibria follow from it.
        """
        raise NotImplementedError

    def onsets(self, nodes: int) -> NDArray[np.float64]:
        """Penetrations (k, n) of n nodes at which a force begins or ends [m]; here zero.

        The time integrator looks for touches between its steps there.
        """
        return np.zeros((1, nodes))

    def stored_energy(
        self, penetration: NDArray[np.float64], share: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Energy (..., n) stored in the contact [J]: the integral of F(u, 0) from 0 to u."""
        from fecontact.laws.potential import stored_energy

        return stored_energy(self, penetration, share)


@dataclass(frozen=True)
class FrictionLaw(NodeLaw):
    """A friction law; ``kernel`` is a :func:`friction_law` or a :func:`memory_friction_law`."""

    @property
    def memory(self) -> int:
        """Number s of internal variables per node; zero for laws without memory."""
        return 0

    @property
    def state_scale(self) -> NDArray[np.float64]:
        """Scale (s,) of each internal variable, for tolerances."""
        return np.ones(self.memory)

    @property
    def velocity_scale(self) -> float:
        """Slip velocity [m/s] over which the force rises, the smallest of all nodes."""
        raise NotImplementedError

    def stick_velocity(self, nodes: int) -> NDArray[np.float64]:
        """Slip velocity (n,) below which a node in contact counts as sticking [m/s].

        It is where the friction force is largest for a given normal force; where it has no
        maximum, and for laws with memory, ten times :attr:`velocity_scale`.
        """
        from fecontact.laws.friction_curve import stick_velocity

        if self.memory:
            return np.full(nodes, 10.0 * self.velocity_scale)
        return stick_velocity(self, nodes)

    def sticks(
        self,
        slip_velocity: NDArray[np.float64],
        normal_force: NDArray[np.float64],
        friction_force: NDArray[np.float64],
    ) -> NDArray[np.bool_]:
        """Whether nodes in contact stick, from their slip velocities, F and R, each (N, n)."""
        return np.abs(slip_velocity) < self.stick_velocity(slip_velocity.shape[-1])
