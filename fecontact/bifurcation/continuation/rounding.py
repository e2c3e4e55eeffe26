"""Uncertainty by rounding at the points of a branch."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from fecontact.core.types import Array

# Slope of the parameter along a branch, in widths of the diagram, below which its sign is rounding.
FLAT = 1e-8
# Slope below which the tangents of points within the tolerance of Newton's method may have any
# sign.
_NEARLY_FLAT = 1e-6


class Rounding:
    """Stability and kinds of points are certain, and the last Newton steps alone are rounding.

    Parameters
    ----------
    steps : float
        Relative size of Newton steps below which growing steps are rounding.
    """

    def __init__(self, steps: float = 1e-7) -> None:
        self.steps = steps

    def unstable(self, linearisation: Any, values: Mapping[str, Any]) -> tuple[int, int]:
        """Least and largest number of unstable directions that rounding leaves open."""
        count = int(values.get("unstable", 0))
        return count, count

    def lost(self, values: Mapping[str, Any]) -> bool:
        """Whether the stability of a point is unknown, by its stored values."""
        return False

    def kinds(
        self, tangents: tuple[Array, Array], values: tuple[Mapping[str, Any], Mapping[str, Any]],
        tests: tuple[Mapping[str, float], Mapping[str, float]],
    ) -> Iterable[str]:
        """Kinds whose tests change sign between two neighbouring points by rounding alone."""
        return ()

    def turns(
        self, tangents: tuple[Array, Array], values: tuple[Mapping[str, Any], Mapping[str, Any]]
    ) -> bool:
        """Whether the parameter may turn between two neighbouring points by rounding alone.

        A fold is then sought only where the parameter itself changes as its slopes say.
        """
        return False

    def note(self, points: Sequence[Any]) -> str:
        """Note on what is unknown of the points of a branch; empty if all is known."""
        return ""


class RestingParameter(Rounding):
    """No folds where the parameter, of this width, changes by less than rounding."""

    def __init__(self, width: float, steps: float = 1e-7) -> None:
        super().__init__(steps)
        self.width = width

    def slopes(self, tangents: tuple[Array, Array]) -> tuple[float, float]:
        """Components of tangents along the parameter, in widths of the diagram."""
        first, last = (float(tangent[-1]) / self.width for tangent in tangents)
        return first, last

    def kinds(self, tangents: Any, values: Any, tests: Any) -> set[str]:
        """A fold where the parameter rests at both points."""
        return {"fold"} if all(abs(slope) < FLAT for slope in self.slopes(tangents)) else set()

    def turns(self, tangents: Any, values: Any) -> bool:
        """Whether both slopes are so small that errors of the points may change their signs."""
        return all(abs(slope) < _NEARLY_FLAT for slope in self.slopes(tangents))


class NoFolds(Rounding):
    """All turns of the parameter are rounding."""

    def kinds(self, tangents: Any, values: Any, tests: Any) -> set[str]:
        """A fold, wherever the parameter turns."""
        return {"fold"}
