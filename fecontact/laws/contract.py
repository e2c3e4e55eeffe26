"""What a law is: signatures, signs and units, and the base class of all of them.

A law is a frozen dataclass of its parameters together with a scalar function, written once in
plain Python and compiled. The functions allocate nothing and raise nothing.

===========  ==========================  =========================================================
kind         function                    returns
===========  ==========================  =========================================================
normal       ``f(u, v, p)``              F, dF/du, dF/dv: normal force on the body [N], zero or
                                         above, from penetration u [m] and its rate v [m/s]
friction     ``f(v, F, p)``              R, dR/dv, dR/dF: friction force [N] that acts on the body
                                         against +x, with the sign of the slip velocity v of the
                                         body relative to the ground [m/s], from the normal
                                         force F [N]
ground       ``f(xi, p)``                y, y', y'': height [m] at the abscissa xi of the ground's
                                         own frame [m] and its derivatives
motion       ``f(t, p)``                 value and rate of a motion given in time: travel of the
                                         ground [m], displacement of the drive [m]
===========  ==========================  =========================================================

``p`` holds the parameters in the order of the dataclass's fields; for normal and friction laws
it is that of the contact node. A parameter given as one number holds for every node; an extensive
one (stiffness, damping) is then the total of the contact face and is shared by tributary length.
A parameter given as a sequence has one value per node and is not shared.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.compiled import CompiledLaw, compile_law, f8, function_at, vector
from fecontact.errors import InputError

NORMAL = types.UniTuple(f8, 3)(f8, f8, vector)
FRICTION = types.UniTuple(f8, 3)(f8, f8, vector)
GROUND = types.UniTuple(f8, 3)(f8, vector)
MOTION = types.UniTuple(f8, 2)(f8, vector)

normal_at = function_at(NORMAL)
friction_at = function_at(FRICTION)
ground_at = function_at(GROUND)
motion_at = function_at(MOTION)

PerNode = float | tuple[float, ...]


def normal_law(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(u, v, p) -> F, dF/du, dF/dv``."""
    return compile_law(NORMAL, function)


def friction_law(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(v, F, p) -> R, dR/dv, dR/dF``."""
    return compile_law(FRICTION, function)


def ground_profile(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(xi, p) -> y, y', y''``."""
    return compile_law(GROUND, function)


def motion(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(t, p) -> value, rate``."""
    return compile_law(MOTION, function)


@dataclass(frozen=True)
class NodeLaw:
    """A law whose parameters may differ from contact node to contact node."""

    kernel: ClassVar[CompiledLaw]
    extensive: ClassVar[frozenset[str]] = frozenset()

    def __post_init__(self) -> None:
        for entry in fields(self):
            given = getattr(self, entry.name)
            try:
                array = np.asarray(given)
            except ValueError:
                array = np.empty(0)
            if array.dtype.kind not in "iuf" or array.ndim > 1 or not array.size:
                raise InputError(f"{self._title(entry.name)} = {given!r} must be a number or a "
                                 f"list of numbers, one per contact node.")
            value = tuple(float(item) for item in array) if array.ndim else float(array)
            if not np.isfinite(value).all():
                raise InputError(f"{self._title(entry.name)} = {value!r} must be finite.")
            object.__setattr__(self, entry.name, value)

    def table(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Parameters (n, k) of n nodes; ``share`` (n,) is each node's part of the face."""
        columns = []
        for entry in fields(self):
            value = np.asarray(getattr(self, entry.name), dtype=float)
            if value.ndim and value.shape != share.shape:
                raise InputError(f"{self._title(entry.name)} has {value.size} values for "
                                 f"{share.size} contact nodes; give one number or one per node.")
            if not value.ndim and entry.name in self.extensive:
                value = value * share
            columns.append(np.broadcast_to(value, share.shape))
        return np.array(columns).T.copy()

    def require(self, allowed: str, test: Callable[[NDArray[np.float64]], Any],
                *names: str) -> None:
        """Raise :class:`InputError` unless every value of the named parameters passes a test."""
        for name in names:
            value = getattr(self, name)
            if not np.all(test(np.asarray(value, dtype=float))):
                raise InputError(f"{self._title(name)} = {value!r} must be {allowed}.")

    def _title(self, name: str) -> str:
        return f"{type(self).__name__}: {name}"
