"""The section ``[branch]`` of a study file."""

from dataclasses import dataclass
from typing import Annotated, Literal

from fecontact.bifurcation.range_settings import RangeSettings
from fecontact.core.checks import as_count
from fecontact.core.errors import InputError, choices, require_positive
from fecontact.core.tables import convert_fields
from fecontact.core.units import Unit

# Limits of the mesh intervals or segments and of the runs beneath a diagram, against typing errors.
_MOST_PIECES, _MOST_RUNS = 10_000, 100_000
# Kinds of special points at which other branches begin.
SWITCHES = ("Hopf", "period doubling", "branch point", "Neimark-Sacker")


@dataclass(frozen=True)
class BranchSettings(RangeSettings):
    """``[branch]``: solutions over a parameter.

    See :func:`fecontact.bifurcation.equilibrium_branch`.

    Parameters
    ----------
    parameter : str, optional
        Dotted name of a number of the study that changes: 'ground.speed'; needed for
        ``fecontact branch`` only.
    bounds : (float, float), optional
        Its least and largest value.
    start : float, optional
        Value at which the first branch begins; the first of the bounds by default.
    kind : 'equilibria', 'orbits' or 'both'
        Solutions followed first: steady sliding, the periodic orbit on which a run at ``start``
        settles, or both.
    switch : list of 'Hopf', 'period doubling', 'branch point', 'Neimark-Sacker'
        Special points at which the branches that begin there are followed too: the orbits born at
        Hopf points, those of twice the period, the other branch, tori by harmonic balance.
    depth : int
        How often to go over from a branch to others that begin on it.
    step, largest_step : float
        First and largest step, in parts of the diagram.
    points : int
        Most points of a branch.
    method : 'collocation', 'shooting' or 'harmonic balance'
        For orbits: collocation on an adaptive mesh, the compiled integrator, for steep friction,
        impacts and many modes, or Fourier series, for smooth vibration with few harmonics.
    intervals : int
        For collocation: mesh intervals of an orbit.
    tolerance : float
        For collocation: largest error of the parameter of special points, in parts of the bounds;
        they get more intervals until it is met.
    state_tolerance : float
        For collocation: largest error of the states of an orbit, in their ranges over it; orbits
        get more intervals than ``intervals`` where they need them for it.
    segments : int
        For shooting: pieces of an orbit that are run for themselves; more for unstable orbits.
    harmonics : int
        For harmonic balance: harmonics of the period of an orbit.
    torus_harmonics : (int, int)
        For tori: harmonics of their two frequencies, that of the orbits on which they begin first.
    transient : float, optional
        For orbits from a run: time before the motion counts as settled [s]; 200 periods of the
        excitation by default.
    longest_period : float, optional
        For orbits from a run: time that the orbit takes at most [s]; 16 periods of the excitation
        by default.
    point : str or int, optional
        Observed point: 'B', 'C', a further named point, or a contact node by its number;
        B by default, or the middle of the contact where there is no B.
    component : 'x' or 'y', of solids also 'z'
        Its displacement along the ground or away from it.
    show : 'maximum', 'minimum', 'amplitude' or 'section'
        Of that displacement over the orbit; the amplitude is half of what lies between them, the
        section what excited systems have once per period.
    poincare_scan : int
        For excited systems: number of values of the parameter, at least 2, at which runs are drawn
        beneath the branches once per period, up and down; the diagram then shows sections. Zero
        for none.
    """

    section = "branch"

    parameter: str | None = None
    bounds: tuple[float, float] | None = None
    start: float | None = None
    kind: Literal["equilibria", "orbits", "both"] = "equilibria"
    switch: tuple[str, ...] = ()
    depth: int = 1
    step: float = 0.01
    largest_step: float = 0.05
    points: int = 200
    method: Literal["collocation", "shooting", "harmonic balance"] = "collocation"
    intervals: int = 50
    tolerance: float = 1e-7
    state_tolerance: float = 1e-5
    segments: int = 4
    harmonics: int = 9
    torus_harmonics: tuple[int, int] = (7, 7)
    transient: Annotated[float | None, Unit("s")] = None
    longest_period: Annotated[float | None, Unit("s")] = None
    point: str | int | None = None
    component: Literal["x", "y", "z"] = "x"
    show: Literal["maximum", "minimum", "amplitude", "section"] = "maximum"
    poincare_scan: int = 0

    def __post_init__(self) -> None:
        convert_fields(self)
        require_positive("BranchSettings", step=self.step, largest_step=self.largest_step,
                         tolerance=self.tolerance, state_tolerance=self.state_tolerance)
        for name in ("transient", "longest_period"):
            if getattr(self, name) is not None:
                require_positive("BranchSettings", **{name: getattr(self, name)})
        as_count(self.depth, "BranchSettings: depth", 0)
        for name in ("points", "intervals", "segments", "harmonics"):
            as_count(getattr(self, name), f"BranchSettings: {name}")
        for count in self.torus_harmonics:
            as_count(count, "BranchSettings: torus_harmonics")
        if self.poincare_scan < 0 or self.poincare_scan == 1:
            raise InputError(f"BranchSettings: poincare_scan = {self.poincare_scan} must be zero, "
                             f"for none, or at least 2.")
        self.require_range()
        for kind in self.switch:
            if kind not in SWITCHES:
                raise InputError(f"BranchSettings: switch = '{kind}' is not known; choose from "
                                 f"{choices(SWITCHES)}.")
        for name, most in (("intervals", _MOST_PIECES), ("segments", _MOST_PIECES),
                           ("harmonics", _MOST_PIECES), ("poincare_scan", _MOST_RUNS)):
            if getattr(self, name) > most:
                raise InputError(f"BranchSettings: {name} = {getattr(self, name)} must be at most "
                                 f"{most}.")

    @property
    def checked_parameter(self) -> str:
        """The parameter; InputError where there is none."""
        if self.parameter is None:
            raise InputError("[branch] lacks the key 'parameter', the dotted name of the number "
                             "that changes, such as 'ground.speed'.")
        return self.parameter
