"""Contact nodes between named points of two bodies, or of a body and the ground."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, shown
from fecontact.core.types import Array, ArrayLike


@dataclass(frozen=True, eq=False)
class PointPairing:
    """Contact nodes between named points of two bodies, or of a body and the ground.

    Parameters
    ----------
    body : str
        Name of the body.
    points : str, int, or sequence of them
        The contact nodes: named points of its basis, or numbers of contact nodes of it.
    other : str, optional
        Name of the other body; by default the ground.
    other_points : str, int, or sequence of them, optional
        Points of the other body, the feet, as many as ``points``.
    normals : (d,) or (n, d) numbers, optional
        Normal out of the other side into ``body``, of any length; by default that of the ground,
        (0, 1) in the plane and (0, 0, 1) in space.
    gaps : float or (n,) numbers
        Distance of each point from its foot along the normal, zero or above [m]; the places of the
        points do not matter.
    tributary : (n,) numbers, optional
        Length that each contact node represents [m], in space area [m^2]; by default equal, with
        sum one.

    Raises
    ------
    InputError
        For no points, arrays that do not fit them, gaps that are negative, and normals of length
        zero.
    """

    body: str
    points: str | int | Sequence[str | int]
    other: str | None = None
    other_points: str | int | Sequence[str | int] = ()
    normals: ArrayLike | None = None
    gaps: ArrayLike = 0.0
    tributary: ArrayLike | None = None

    @property
    def passes(self) -> "tuple[PointPairing, ...]":
        """The pairing itself."""
        return (self,)

    def __post_init__(self) -> None:
        require_kind("PointPairing", str, body=self.body)
        require_kind("PointPairing", (str, type(None)), other=self.other)
        for name in ("points", "other_points"):
            given = getattr(self, name)
            require_kind("PointPairing", (str, int, Sequence), **{name: given})
            object.__setattr__(self, name, (given,) if isinstance(given, str | int)
                               else tuple(given))
        points, feet = tuple(self.points), tuple(self.other_points)  # type: ignore[arg-type]
        n = len(points)
        if not n:
            raise InputError("PointPairing: points is empty; name at least one contact node.")
        wanted = 0 if self.other is None else n
        if len(feet) != wanted:
            raise InputError(f"PointPairing: other_points must be {wanted} points, "
                             f"{'none on the ground' if self.other is None else 'one a node'}, "
                             f"not {len(feet)}.")
        if self.normals is not None:
            given = _numbers("normals", self.normals, ((2,), (n, 2), (3,), (n, 3)))
            normals = np.array(np.broadcast_to(given, (n, given.shape[-1])))
            lengths = np.linalg.norm(normals, axis=1)
            if not (lengths > 0.0).all():
                raise InputError("PointPairing: normals must be longer than zero.")
            normals /= lengths[:, None]
            normals.setflags(write=False)
            object.__setattr__(self, "normals", normals)
        gaps = np.broadcast_to(_numbers("gaps", self.gaps, ((), (n,))), (n,))
        lengths_of_nodes = np.full(n, 1.0 / n) if self.tributary is None else _numbers(
            "tributary", self.tributary, ((n,),))
        if (gaps < 0.0).any() or not (lengths_of_nodes > 0.0).all():
            raise InputError("PointPairing: gaps must be zero or above, tributary above zero.")
        for name, value in (("gaps", gaps), ("tributary", lengths_of_nodes)):
            value = np.array(value)
            value.setflags(write=False)
            object.__setattr__(self, name, value)


def _numbers(name: str, given: ArrayLike, shapes: Sequence[tuple[int, ...]]) -> Array:
    values = as_floats(given, f"PointPairing: {name}")
    if values.shape not in shapes or not np.isfinite(values).all():
        raise InputError(f"PointPairing: {name} = {shown(given)} must be finite numbers of shape "
                         f"{' or '.join(map(str, shapes))}, one a node.")
    return values
