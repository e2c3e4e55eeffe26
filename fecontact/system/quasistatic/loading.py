"""Quasi-static loading along a path."""

import warnings
from collections.abc import Sequence

import numpy as np

from fecontact.core.checks import require_kind, require_rtol
from fecontact.core.errors import AnalysisError, ModelWarning
from fecontact.core.records import allocate
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array
from fecontact.core.units import count
from fecontact.system.contact_system import ContactSystem
from fecontact.system.loads import under_constant
from fecontact.system.model_limits import limits_exceeded, warn_of_limits
from fecontact.system.nodes import SystemArrays
from fecontact.system.quasistatic.given import given_rows, travelled, travelling, with_named_forces
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.march import CUT, JUMPS, ROWS, SOLVED, WORKS, Kept, march
from fecontact.system.quasistatic.path import LoadPath
from fecontact.system.quasistatic.pose import (
    PENETRATION,
    Pose,
    Sliders,
    Workspace,
    sizes_of,
)
from fecontact.system.quasistatic.rest_state import RestState
from fecontact.system.quasistatic.sliders import components, sliders_of, springs_of
from fecontact.system.statics.balance import Balance
from fecontact.system.statics.equilibrium import resting


def load_history(
    system: ContactSystem,
    path: LoadPath,
    *,
    start: LoadHistory | RestState | None = None,
    tangential_ratio: float = 0.82,
    tangential_stiffness: float | Sequence[float] | None = None,
    rtol: float = 1e-6,
) -> LoadHistory:
    """Load a system quasi-statically along a path, with friction that keeps its history.

    At each point the equilibrium of body, drive springs, normal law at rest and friction is solved;
    :class:`~fecontact.system.LoadHistory` says with which friction.

    Parameters
    ----------
    system : ContactSystem
        Motions of its ground, drive and loads in time do not count: they come from the path.
    path : LoadPath
        Loads and motions.
    start : LoadHistory or RestState, optional
        Go on from there, with its friction springs. By default the path begins at the equilibrium
        without friction at its first vertex; one that begins at a small load presses with friction.
    tangential_ratio : float
        c_T / c_N of stuck contacts, above zero; infinite for rigid sticking.
    tangential_stiffness : float or (n,) sequence, optional
        c_T of the whole face, or of each node [N/m], instead of the ratio.
    rtol : float
        Error of work and loss of an increment, relative to the work of the forces.

    Returns
    -------
    LoadHistory
        Also if the path goes to where there is no equilibrium; see its ``status``.

    Raises
    ------
    InputError
        For bristle laws, which have no quasi-static limit of springs; values out of range; a travel
        where several sides move; motions in space of a plane body.
    AnalysisError
        If the first vertex has no equilibrium.

    Warns
    -----
    ModelWarning
        If the path ends early or the body jumps, and as for static equilibria.
    """
    require_kind("load_history", ContactSystem, system=system)
    require_kind("load_history", LoadPath, path=path)
    require_rtol(rtol, "load_history: rtol")
    system.require_compliance("load_history")
    for _, share, law in system.law_groups("friction"):
        if law.memory:
            springs_of(law, share)
    system, path = with_named_forces(system, path)
    given, arrays = given_rows(system, path), travelling(system)
    if start is None:
        loads, ends, travel = np.split(given[0], [system.basis.modes, 1 - system.basis.dimension])
        balance, q = resting(system, arrays, loads, ends, travel)
        slope = _slope_under_preload(system, arrays, path, given, balance, q, rtol)
        sliders = sliders_of(system, tangential_ratio, tangential_stiffness, slope)
        pose = _begin(system, q, given[0], sliders)
        marched = _marched(arrays, given, pose, sliders, balance.scale, rtol)
        return _loaded(system, path, given, sliders, marched, 0)
    require_kind("load_history", (LoadHistory, RestState), start=start)
    state = start.state() if isinstance(start, LoadHistory) else start
    state.check(system)
    # Tuples for kernels hold no read-only arrays.
    sliders = Sliders(*map(np.array, state.sliders))
    pose = _pose(state.modal_coordinates, sliders, state.slider_place, state.slider_force)
    scale = Balance(under_constant(arrays, given[0, : system.basis.modes].copy()), 0.0,
                    system.penetration_scale).scale
    given = np.vstack([state.given, given])
    return _loaded(system, path, given, sliders,
                   _marched(arrays, given, pose, sliders, scale, rtol), 1)


def _loaded(
    system: ContactSystem, path: LoadPath, given: Array, sliders: Sliders,
    marched: tuple[int, Kept], skipped: int,
) -> LoadHistory:
    """Result of a march, without its first ``skipped`` rows; issues the warnings."""
    reached, found = marched
    counts = found.counts
    if reached <= skipped:
        raise AnalysisError("There is no equilibrium with friction at the first vertex of the "
                            "path; begin at loads that the state before can carry.")
    kept = slice(skipped, reached)
    complete = reached == len(given)
    # Vectors of sliders in space.
    shape = (reached - skipped, *sliders.limit.shape, *([2] if system.basis.dimension == 3 else []))
    history = LoadHistory(
        found.q[kept], given[kept], found.node[kept], found.force[kept].reshape(shape),
        found.left[kept].reshape(shape), sliders, system, path,
        found.work[kept, : len(WORKS)], found.work[kept, len(WORKS) :],
        "finished" if complete else "no-equilibrium",
        {"solved": int(counts[SOLVED]), "cut": int(counts[CUT]), "jumps": int(counts[JUMPS])})
    if not complete:
        warnings.warn(
            f"The path of loads ends at point {len(history) - 1} of {len(given) - 1 - skipped}: "
            f"no equilibrium beyond was found; where friction or supports do not hold the body, "
            f"lower the loads, or add a support, else give other steps or another "
            f"tangential_ratio.", ModelWarning, stacklevel=3)
    if counts[JUMPS]:
        warnings.warn(
            f"Along the path of loads the body jumps {count(int(counts[JUMPS]), 'time')} to "
            f"another equilibrium; the energy that this sets free is in imbalance, and what really "
            f"happens then needs a run in time.", ModelWarning, stacklevel=3)
    states = np.zeros((len(history), system.size))
    states[:, : system.basis.modes] = history.modal_coordinates
    warn_of_limits(limits_exceeded(system, np.zeros(len(history)), states),
                   "Along the path of loads")
    return history


@one_blas_thread
def _marched(
    arrays: SystemArrays, given: Array, pose: Pose, sliders: Sliders, scale: Array, rtol: float
) -> tuple[int, Kept]:
    """Number of rows reached, and results."""
    n, _, m = arrays.rows.shape
    e = sliders.limit.shape[1]
    sizes = sizes_of(m, n, e, pose.force.shape[1] // e) | {ROWS: len(given)}
    kept = allocate(Kept, sizes)
    reached = march(
        arrays, sliders, np.ascontiguousarray(given), rtol, pose, allocate(Pose, sizes),
        allocate(Workspace, sizes, scale=np.ascontiguousarray(scale, dtype=float)), kept)
    return int(reached), kept


def _begin(system: ContactSystem, q: Array, given: Array, sliders: Sliders) -> Pose:
    """The pose at a row of given loads and motions, with sliders where the nodes are."""
    d = system.basis.dimension
    rows = system.basis.contact_T[:, : d - 1]
    place = rows @ q - travelled(system, given[1 - d :]).reshape(-1, d - 1)
    return _pose(q, sliders, np.repeat(place[:, None], sliders.limit.shape[1], axis=1))


def _pose(q: Array, sliders: Sliders, left: Array, force: Array | None = None) -> Pose:
    """A pose with places of the sliders (n, e), in space (n, e, 2), and forces likewise."""
    n, e = sliders.limit.shape
    tangents = components(left).shape[-1]
    pose = allocate(Pose, sizes_of(len(q), n, e, tangents))
    pose.q[:], pose.left[:] = q, left.reshape(n, e * tangents)
    if force is not None:
        pose.force[:] = force.reshape(n, e * tangents)
    return pose


def _slope_under_preload(
    system: ContactSystem, arrays: SystemArrays, path: LoadPath, given: Array, balance: Balance,
    q: Array, rtol: float,
) -> Array:
    """Slope dF/du (n,) under the largest load of the path, with nodes that stick without limit."""
    scale = np.abs(path.at_points(path.load_scale))
    preload = int(np.argmax(scale >= scale.max() * (1.0 - 1e-12)))
    slope = balance.normal(balance.penetration(q))[1]
    if preload == 0 or not len(slope):
        return slope
    stuck = np.full((len(arrays.gap), 1), max(float(np.max(slope)), float(np.mean(
        balance.face_stiffness)), 1.0))
    sliders = Sliders(stuck, np.full_like(stuck, 1e30), np.zeros_like(stuck))
    reached, found = _marched(arrays, given[[0, preload]], _begin(system, q, given[0], sliders),
                              sliders, balance.scale, max(rtol, 1e-4))
    if reached < 2:
        raise AnalysisError("There is no equilibrium under the largest load of the path, even if "
                            "all nodes stuck; check the sign and place of the loads.")
    return balance.normal(found.node[1, :, PENETRATION].copy())[1]
