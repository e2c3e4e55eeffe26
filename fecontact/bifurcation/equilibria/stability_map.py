"""Maps of the stability of an equilibrium over two parameters."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.bifurcation.equilibria.equilibrium import Equilibrium, find_equilibrium, newton
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.progress import progress_bar, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike, ComplexArray, Integers
from fecontact.core.units import Summarised, span
from fecontact.system.complex_modes import unstable_count
from fecontact.system.fields.vector_field import VectorField, require_field
from fecontact.system.parameter_labels import parameter_label


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class StabilityMap(Summarised):
    """Eigenvalues of an equilibrium over a grid of two parameters.

    Attributes
    ----------
    names : (str, str)
        The parameters.
    first, second : (n1,), (n2,) arrays
        Their values.
    states : (n1, n2, d) array
        The equilibria; NaN where there is none.
    critical : (n1, n2) complex array
        Eigenvalue with the largest real part, of a pair the one with positive frequency [1/s].
    unstable : (n1, n2) array of int
        Number of eigenvalues with positive real part; -1 where there is no equilibrium.
    labels : (str, str)
        Labels of the parameters for axes, by default their names.
    """

    names: tuple[str, str]
    first: Array
    second: Array
    states: Array
    critical: ComplexArray
    unstable: Integers
    labels: tuple[str, str] = ("", "")

    def __post_init__(self) -> None:
        if not all(self.labels):
            object.__setattr__(self, "labels", tuple(map(parameter_label, self.names)))

    def summary(self) -> list[tuple[str, str]]:
        """The parameters, and how much of the map is unstable at which frequencies."""
        unstable = self.unstable > 0
        return [
            *((name, f"{span(values)}, {len(values)} values")
              for name, values in zip(self.names, (self.first, self.second), strict=True)),
            ("unstable", f"{100.0 * unstable.mean():.3g} %"),
            ("their frequencies", span(self.frequency_hz[unstable], "Hz")),
            ("no equilibrium", f"{100.0 * (self.unstable < 0).mean():.3g} %"),
        ]

    @property
    def growth_rate(self) -> Array:
        """Largest real part (n1, n2) [1/s]; positive where the equilibrium is unstable."""
        return self.critical.real

    @property
    def frequency_hz(self) -> Array:
        """Frequency (n1, n2) of the critical mode [Hz]."""
        return np.asarray(np.abs(self.critical.imag) / (2.0 * np.pi))


@one_blas_thread
def stability_map(
    field: VectorField, grid: Mapping[str, ArrayLike], *,
    start: Equilibrium | ArrayLike | None = None, highest_hz: float = np.inf,
    progress: bool | Callable[[float], None] | None = None,
) -> StabilityMap:
    """Stability of an equilibrium over a grid of two parameters, such as speed and friction.

    The equilibrium is followed from point to point by Newton's method; where that fails it is
    searched again (for contact systems), and where there is none the map has NaN.

    Parameters
    ----------
    field : VectorField
        Its rates must not depend on time.
    grid : mapping
        Two names of parameters, and the values of each.
    start : Equilibrium or (d,) sequence, optional
        An equilibrium near that of the first values; see
        :func:`fecontact.bifurcation.find_equilibrium`.
    highest_hz : float
        Modes of higher frequencies [Hz] are left out; of a reduced body beyond the frequency up to
        which its basis is usable, ``Study.usable_hz``, they mean nothing.
    progress : bool or callable, optional
        True for a progress bar on a terminal or in a notebook; a function receives the part of the
        map that is done, 0 to 1.

    Raises
    ------
    InputError
        If there are not two parameters, or one is unknown or out of range.
    AnalysisError
        If there is no equilibrium at the first values.
    """
    require_field(field)
    require_kind("stability_map", Mapping, grid=grid)
    if len(grid) != 2:
        raise InputError(f"A stability map is over two parameters, not {len(grid)}; give the "
                         f"values of two by name.")
    names = tuple(grid)
    indices = [field.index(name) for name in names]
    axes = [as_floats(values, f"The values of {name}").ravel() for name, values in grid.items()]
    for name, axis in zip(names, axes, strict=True):
        if not len(axis) or not np.isfinite(axis).all():
            raise InputError(f"The values of {name} for a stability map must be finite numbers, "
                             f"at least one.")
    begin = start.state if isinstance(start, Equilibrium) else start
    corner = {name: float(axis[0]) for name, axis in zip(names, axes, strict=True)}
    row_start: Array | None = find_equilibrium(field, corner, start=begin).state
    shape = (len(axes[0]), len(axes[1]))
    d = field.dimension
    states, jacobians = np.full((*shape, d), np.nan), np.zeros((*shape, d, d))
    values = field.values
    with shown(progress, lambda: progress_bar("Mapping stability", 1.0)) as tell:
        for i in range(shape[0]):
            x = row_start
            for j in range(shape[1]):
                values[indices] = axes[0][i], axes[1][j]
                found = _equilibrium(field, values, x)
                x = None if found is None else found[0]
                if found is not None:
                    states[i, j], jacobians[i, j] = found
                if j == 0 and x is not None:
                    row_start = x
            if tell is not None:
                tell((i + 1) / shape[0])
    eigenvalues = np.linalg.eigvals(jacobians).astype(complex)
    beyond = np.abs(eigenvalues.imag) > 2.0 * np.pi * highest_hz
    if beyond.all(axis=-1).any():
        raise InputError(f"highest_hz = {highest_hz:g} leaves out all modes; give a frequency "
                         f"above the lowest one.")
    eigenvalues[beyond] = -np.inf
    order = np.lexsort((-eigenvalues.imag, -eigenvalues.real), axis=-1)
    critical = np.take_along_axis(eigenvalues, order[..., :1], axis=-1)[..., 0]
    unstable = unstable_count(np.where(beyond, 0.0, eigenvalues))
    lost = np.isnan(states[..., 0])
    critical[lost], unstable[lost] = np.nan, -1
    labels = field.parameter_label(names[0]), field.parameter_label(names[1])
    return StabilityMap((names[0], names[1]), axes[0], axes[1], states, critical, unstable,
                        labels)


def _equilibrium(
    field: VectorField, values: Array, near: Array | None
) -> tuple[Array, Array] | None:
    if near is not None:
        close = newton(field, near, values, 1e-9)
        if close is not None:
            return close
    if not isinstance(field, ContactField):
        return None
    parameters = dict(zip(field.parameters, values.tolist(), strict=True))
    try:
        found = find_equilibrium(field, parameters)
        return found.state, found.jacobian
    except AnalysisError:
        return None
