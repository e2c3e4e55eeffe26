"""Range and steps of a parameter, which the sections ``[branch]`` and ``[response]`` share."""

from typing import TYPE_CHECKING

from fecontact.core.errors import InputError, require_finite

if TYPE_CHECKING:
    from fecontact.bifurcation.continuation.problem import ContinuationOptions


class RangeSettings:
    """Checks and options of settings in which a parameter goes through a range in steps."""

    section = ""  # of a study file
    parameter: str | None
    bounds: tuple[float, float] | None
    start: float | None
    step: float
    largest_step: float
    points: int

    def require_range(self) -> None:
        """Raise InputError unless the steps, the bounds and the start go together."""
        owner = type(self).__name__
        if self.step > self.largest_step:
            raise InputError(f"{owner}: step = {self.step:g} must not be above largest_step = "
                             f"{self.largest_step:g}.")
        if self.start is not None:
            require_finite(owner, start=self.start)
        if self.bounds is None:
            return
        low, high = self.bounds
        require_finite(f"{owner}: bounds", low=low, high=high)
        if not low < high:
            raise InputError(f"{owner}: bounds = {list(self.bounds)} must be two values, the "
                             f"smaller one first.")
        if self.start is not None and not low <= self.start <= high:
            raise InputError(f"{owner}: start = {self.start:g} must lie in the bounds, {low:g} to "
                             f"{high:g}.")

    @property
    def checked_bounds(self) -> tuple[float, float]:
        """The bounds; InputError where there are none."""
        if self.bounds is None:
            raise InputError(f"[{self.section}] lacks the key 'bounds', the least and largest "
                             f"value of {self.parameter or 'the parameter'}; give it, or --bounds "
                             f"LOW HIGH.")
        return self.bounds

    @property
    def first(self) -> float:
        """Value of the parameter at which the first branch begins."""
        return self.checked_bounds[0] if self.start is None else self.start

    def options(self) -> "ContinuationOptions":
        """Options of the continuation."""
        from fecontact.bifurcation.continuation.problem import ContinuationOptions

        return ContinuationOptions(step=self.step, largest_step=self.largest_step,
                                   points=self.points, bounds=self.checked_bounds)
