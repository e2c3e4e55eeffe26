"""Base classes of the laws of contact nodes, and the ranges of their parameters.

:mod:`fecontact.laws.signatures` defines arguments and results of their functions.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, ClassVar, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

from fecontact.core.compiled import CompiledLaw
from fecontact.core.docstrings import InheritsDocumentation
from fecontact.core.errors import LARGEST, InputError, require_choice, shown
from fecontact.core.types import Array
from fecontact.laws.friction_curve import stick_velocity
from fecontact.laws.sampling import stored_energy

PerNode = TypeAliasType("PerNode", float | tuple[float, ...])


@dataclass(frozen=True)
class Bound:
    """Range of a parameter, as part of its annotation: ``Annotated[PerNode, Bound]``.

    Attributes
    ----------
    allowed : str
        The range in words: ``parameter = -1.0 must be {allowed}``.
    holds : callable
        Whether each number of an array is within the range.
    """

    allowed: str
    holds: Callable[[Array], Any]

    def __repr__(self) -> str:
        return self.allowed


ABOVE_ZERO = Bound("above zero", lambda x: x > 0.0)
ZERO_OR_ABOVE = Bound("zero or above", lambda x: x >= 0.0)
ONE_OR_ABOVE = Bound("one or above", lambda x: x >= 1.0)
Positive = Annotated[PerNode, ABOVE_ZERO]
NotNegative = Annotated[PerNode, ZERO_OR_ABOVE]
OneOrAbove = Annotated[PerNode, ONE_OR_ABOVE]
UpToOne = Annotated[PerNode, Bound("above zero and at most 1", lambda x: (x > 0.0) & (x <= 1.0))]


@cache
def _annotations(law: Any) -> Mapping[str, tuple[Any, tuple[Bound, ...]]]:
    """Types and ranges of a law's parameters, from their annotations."""
    try:
        hints = get_type_hints(law, include_extras=True)
    except NameError as error:
        raise InputError(f"{law.__name__}: an annotation cannot be resolved ({error}); use names "
                         f"that are defined in the module of the law.") from None
    return {name: (getattr(hint, "__origin__", hint) if get_origin(hint) is Annotated else hint,
                   tuple(item for item in getattr(hint, "__metadata__", ())
                         if isinstance(item, Bound)))
            for name, hint in hints.items()}


@dataclass(frozen=True)
class NodeLaw(InheritsDocumentation):
    """A law whose parameters may differ between contact nodes.

    A subclass describes only its own fields; the descriptions of inherited fields and the errors
    below are added to its docstring.

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    kernel: ClassVar[CompiledLaw]
    extensive: ClassVar[frozenset[str]] = frozenset()
    # Parameters that are lists, but not of one value per node.
    shared_fields: ClassVar[frozenset[str]] = frozenset()
    # Fields that are no numbers, which the class checks itself.
    own_fields: ClassVar[frozenset[str]] = frozenset()
    choices: ClassVar[Mapping[str, tuple[str, ...]]] = {}

    def __post_init__(self) -> None:
        law: Any = type(self)
        for entry in fields(self):
            given = getattr(self, entry.name)
            if entry.name in self.own_fields:
                continue
            if entry.name in self.choices:
                require_choice(type(self).__name__, entry.name, given, self.choices[entry.name])
                continue
            try:
                array = np.asarray(given)
            except ValueError:
                array = np.empty(0)
            if array.dtype.kind not in "iuf" or array.ndim > 1 or not array.size:
                raise InputError(f"{self._title(entry.name)} = {given!r} must be a number or a "
                                 f"list of numbers, one per contact node.")
            kind, ranges = _annotations(law)[entry.name]
            if array.ndim and kind in (float, int):
                raise InputError(f"{self._title(entry.name)} = {given!r} must be a number; only "
                                 f"parameters annotated as PerNode take one per contact node.")
            value: Any = tuple(float(item) for item in array) if array.ndim else float(array)
            if not np.isfinite(value).all():
                raise InputError(f"{self._title(entry.name)} = {value!r} must be finite.")
            if np.abs(value).max() > LARGEST:
                raise InputError(f"{self._title(entry.name)} = {shown(value)} must be a number "
                                 f"from {-LARGEST:g} to {LARGEST:g}.")
            object.__setattr__(self, entry.name, given if kind is int else value)
            for one in ranges:
                self.require(one.allowed, one.holds, entry.name)
            if kind is int:
                object.__setattr__(self, entry.name, int(value))

    def node_count(self) -> int | None:
        """Number of values of the parameters given per contact node; None if there are none.

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

    def table(self, share: Array) -> Array:
        """Parameters (n, k) of n nodes; ``share`` (n,) is each node's fraction of the face.

        Without the :attr:`shared_fields`.
        """
        entries = [entry for entry in fields(self) if entry.name not in self.shared_fields]
        table = np.empty((len(share), len(entries)))
        for column, entry in enumerate(entries):
            given = getattr(self, entry.name)
            if entry.name in self.choices:
                given = self.choices[entry.name].index(given)
            value = np.asarray(given, dtype=float)
            if value.ndim and value.shape != share.shape:
                raise InputError(f"{self._title(entry.name)} has {value.size} values for "
                                 f"{share.size} contact nodes; give one number or one per node.")
            if not value.ndim and entry.name in self.extensive:
                value = value * share
            table[:, column] = value
        return table

    def require(self, allowed: str, test: Callable[[Array], Any],
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
    """A normal law; ``kernel`` is a :func:`fecontact.laws.normal_law`."""

    # Whether it pulls as well as pushes, as a spring does and no contact.
    bilateral: ClassVar[bool] = False
    # Whether it has no force of the penetration; see RigidStop.
    rigid: ClassVar[bool] = False

    @property
    def penetration_scale(self) -> float:
        """Characteristic penetration of the law [m], the smallest of all nodes.

        It determines tolerances of time integration and starting values of equilibria.
        """
        raise NotImplementedError

    def onsets(self, nodes: int) -> Array:
        """Penetrations (k, n) of n nodes at which a force begins or ends [m]; zero by default.

        The time integrator locates them within its steps.
        """
        return np.zeros((1, nodes))

    def untouched(self, nodes: int) -> Array:
        """Penetrations (n,) up to which F, dF/du and dF/dv are zero at every rate [m].

        The time integrator leaves out nodes that stay below them. -inf, the default, stands for a
        law of which this is not known.
        """
        return np.full(nodes, -np.inf)

    def pieces(self, share: Array) -> Array | None:
        """Pieces (n, p, 11) of a law that is polynomial piece by piece, else None.

        See :mod:`fecontact.laws.pieces`; the time integrator expands the motion with them.
        """
        return None

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) stored in the contact [J]: the integral of F(u, 0) from 0 to u."""
        return stored_energy(self.kernel.address, penetration, self.table(share),
                             self.penetration_scale)


@dataclass(frozen=True)
class FrictionLaw(NodeLaw):
    """A friction law.

    Its ``kernel`` is a :func:`fecontact.laws.friction_law` or a
    :func:`fecontact.laws.memory_friction_law`. In space laws without memory act along the slip
    direction; those with memory need a ``planar_kernel`` there.
    """

    planar_kernel: ClassVar[CompiledLaw | None] = None

    @property
    def memory(self) -> int:
        """Number s of internal variables per node; zero for laws without memory."""
        return 0

    # Whether the scales of internal variables and slip velocity are those under 1 N.
    scales_with_force: ClassVar[bool] = False

    @property
    def state_scale(self) -> Array:
        """Scale (s,) of each internal variable, for tolerances."""
        return np.ones(self.memory)

    @property
    def velocity_scale(self) -> float:
        """Slip velocity [m/s] over which the force rises, the smallest of all nodes."""
        raise NotImplementedError

    def bristle_stiffness_of(self, share: Array) -> Array:
        """Stiffness of the internal variables of n nodes (2, n, s): a and b.

        The internal variable z stores ``(a + b F) z^2 / 2`` [J] under the normal force F, which
        friction gives back. Zero by default: then all that friction takes counts as lost.
        """
        return np.zeros((2, len(share), self.memory))

    def sliders(self, share: Array) -> tuple[Array, Array] | None:
        """Springs c (n, s) [N/m] of n nodes and the limits phi (n, s) of their sliders; or None.

        For laws whose internal variables z are deflections of springs in series with sliders:
        their forces are c z, at most phi F. Quasi-static loading needs no velocity for them.
        """
        return None

    def stick_velocity(self, nodes: int) -> Array:
        """Slip velocity (n,) below which a node in contact counts as sticking [m/s].

        The slip velocity of the largest friction force at a given normal force; ten times
        :attr:`velocity_scale` if there is no maximum, and for laws with memory.
        """
        if self.memory:
            return np.full(nodes, 10.0 * self.velocity_scale)
        return stick_velocity(self, nodes)

    def sticks(
        self,
        slip_velocity: Array,
        normal_force: Array,
        friction_force: Array,
    ) -> NDArray[np.bool_]:
        """Whether nodes in contact stick, from their slip velocities, F and R, each (N, n)."""
        return np.abs(slip_velocity) < self.stick_velocity(slip_velocity.shape[-1])
