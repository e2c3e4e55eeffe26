"""A branch of solutions, and its file."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.arguments import require_kind
from fecontact.errors import InputError, choices

Array = NDArray[np.float64]


class Status(Enum):
    """How a branch ended; the value is the sentence for people."""

    POINTS = "The branch has as many points as were asked for."
    BOUND = "The branch reached a bound of its parameter."
    STOPPED = "The branch reached a point at which it was to stop."
    CLOSED = ("The branch came back to its start, or to where it would run through the same orbits "
              "again.")
    STALLED = ("The steps became too small to go on; what was computed until then is kept. Look "
               "whether the solution changes abruptly here, or start with smaller steps.")
    INTERRUPTED = "The continuation was interrupted; what was computed until then is kept."


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """One solution on a branch.

    Attributes
    ----------
    u : (N + 1,) array
        Unknowns, the parameter last.
    tangent : (N + 1,) array
        Direction of the branch.
    values : mapping
        What the problem stores of each solution, such as states and stability.
    kind : str or None
        What is special about the point: 'fold', 'Hopf', ...; None for the others.
    details : mapping
        What is known of a special point, such as its normal form.
    """

    u: Array
    tangent: Array
    values: Mapping[str, Any] = field(default_factory=dict)
    kind: str | None = None
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def parameter(self) -> float:
        """Value of the parameter."""
        return float(self.u[-1])


@dataclass(frozen=True, eq=False)
class Branch:
    """Solutions over a parameter, in their order along the branch.

    Attributes
    ----------
    name : str
        Name of the parameter.
    points : tuple of BranchPoint
        All points, special ones in their places.
    status : Status
        How its forward end was reached.
    message : str
        What the last failed step complained of; empty without.
    attributes : mapping
        What else belongs to the branch: numbers, texts, arrays.
    """

    name: str
    points: tuple[BranchPoint, ...]
    status: Status = Status.POINTS
    message: str = ""
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[BranchPoint]:
        return iter(self.points)

    @property
    def parameter(self) -> Array:
        """Parameter (N,) of each point."""
        return np.array([point.parameter for point in self.points])

    @property
    def special(self) -> tuple[BranchPoint, ...]:
        """The special points."""
        return tuple(point for point in self.points if point.kind is not None)

    def of_kind(self, kind: str) -> tuple[BranchPoint, ...]:
        """The special points of one kind."""
        return tuple(point for point in self.points if point.kind == kind)

    def column(self, name: str) -> NDArray[Any]:
        """One stored value (N, ...) of all points.

        Raises
        ------
        InputError
            If no such value is stored; it lists those that are.
        """
        known = self.points[0].values if self.points else {}
        if name not in known:
            raise InputError(f"The branch stores no value {name!r}; it has: {choices(known)}.")
        return np.array([point.values[name] for point in self.points])

    def reversed(self) -> "Branch":
        """The branch in the other direction."""
        turned = tuple(replace(point, tangent=-point.tangent) for point in self.points[::-1])
        return replace(self, points=turned)

    def save(self, path: str | Path) -> Path:
        """Write the branch into one HDF5 file, whole or not at all.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        from fecontact.output.hdf5 import new_file

        with new_file(path) as file:
            self.write(file.create_group("branch"))
        return Path(path)

    def write(self, group: Any) -> None:
        """Write the branch into an empty HDF5 group; see :meth:`read`."""
        group.attrs.update(parameter=self.name, status=self.status.name, message=self.message)
        group.create_dataset("kind", data=[point.kind or "" for point in self.points])
        for name in ("u", "tangent"):
            _write(group, name, [getattr(point, name) for point in self.points])
        for name in self.points[0].values if self.points else ():
            _write(group, f"values/{name}", [point.values[name] for point in self.points])
        for index, point in enumerate(self.points):
            for name, value in point.details.items():
                group.create_dataset(f"details/{index}/{name}", data=value)
        for name, value in self.attributes.items():
            group.create_dataset(f"attributes/{name}", data=value)

    @classmethod
    def load(cls, path: str | Path) -> "Branch":
        """Read a branch that :meth:`save` wrote.

        Raises
        ------
        InputError
            If there is no such file, or it holds no branch.
        """
        from fecontact.output.hdf5 import open_file

        with open_file(path, "branch") as file:
            return cls.read(file["branch"], path)

    @classmethod
    def read(cls, group: Any, path: str | Path) -> "Branch":
        """Read a branch from an HDF5 group that :meth:`write` filled, of the file ``path``."""
        from fecontact.stored import array, member, reading, text, texts

        with reading(path):
            kinds = texts(group, "kind") if len(member(group, "kind")) else []
            count = len(kinds)
            u = array(group, "u", (count, None) if count else (0,))
            tangent = array(group, "tangent", u.shape)
            stored = {name: _read(item, count)
                      for name, item in _members(group, "values").items()}
            details = {int(index): {name: _value(item) for name, item in part.items()}
                       for index, part in _members(group, "details").items()}
            points = tuple(
                BranchPoint(u[k], tangent[k], {name: row[k] for name, row in stored.items()},
                            kinds[k] or None, details.get(k, {})) for k in range(count))
            attributes = {name: _value(item)
                          for name, item in _members(group, "attributes").items()}
            return cls(text(group, "parameter"), points, Status[text(group, "status")],
                       text(group, "message"), attributes)


def require_on_branch(owner: str, branch: object, point: object) -> None:
    """Raise :class:`InputError` unless these are a branch, and a point of one."""
    require_kind(owner, Branch, branch=branch)
    require_kind(owner, BranchPoint, point=point)


def _write(group: Any, name: str, values: list[Any]) -> None:
    """One dataset for values of the same shape, else one for each."""
    if len({np.shape(value) for value in values}) <= 1:
        group.create_dataset(name, data=np.array(values) if not values
                             or not isinstance(values[0], str) else values)
        return
    for index, value in enumerate(values):
        group.create_dataset(f"{name}/{index}", data=value)


def _members(group: Any, name: str) -> Any:
    """The members of a group that may be missing."""
    from fecontact.stored import DamagedError, member

    if name not in group:
        return {}
    found = member(group, name)
    if not hasattr(found, "items"):
        raise DamagedError(f"'{name}' is no group")
    return found


def _read(item: Any, count: int) -> list[Any]:
    from fecontact.stored import require_lengths, values

    if not hasattr(item, "shape"):
        return [_value(item[str(index)]) for index in range(count)]
    found = [_plain(value) for value in np.atleast_1d(values(item))]
    require_lengths(f"'{item.name}'", count, found)
    return found


def _value(item: Any) -> Any:
    from fecontact.stored import values

    return _plain(values(item))


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
