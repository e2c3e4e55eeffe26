"""Systems whose forces are polynomials of the state between switches, and their tables."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError
from fecontact.core.records import ANY, Matrix, Vector, allocate
from fecontact.core.types import Array, Integers
from fecontact.integrate.events import AnyEvent, ContactEvents
from fecontact.integrate.series.polynomials import COEFFICIENTS, WORKSPACE
from fecontact.laws.friction.stribeck import ConstantFriction
from fecontact.laws.pieces import PIECE, UPPER
from fecontact.laws.signals.base import Signal
from fecontact.laws.signals.harmonic import Constant, Harmonic, Harmonics
from fecontact.system.contact_system import ContactSystem
from fecontact.system.nodes import COMBINATIONS, MODES, NODES, PRODUCTS

# Sizes up to which series are taken unasked; their cost grows with the square of the modes.
MOST_MODES, MOST_NODES = 4, 4
# Modes so much faster than the slowest motion are left to implicit steps, which need not resolve
# them once they have decayed; less fast ones if their damping ratio is larger.
_FASTEST, _FAST, _DAMPED = 500.0, 100.0, 0.3
# Errors of a step, in parts of the tolerance of the run, and at least.
_PART, _ROUNDING = 1e-4, 2e-16

# Columns of `Series.states`: piece of the law that acts, whether its force does, and which limit
# of it has just been met.
PLACE, ACTS, MET = range(3)
MET_NOTHING, MET_LOWER, MET_UPPER, MET_RELEASE = range(4)
# Powers that are integrated: columns of `Series.powers`.
SERIES_POWERS = 5


class Series(NamedTuple):
    """A system whose motion is expanded in time, and the state of its contacts.

    Attributes
    ----------
    pieces : (n, p, 11) array
        Pieces of the normal laws, see :mod:`fecontact.laws.pieces`.
    constants : (g,) array
        Constant parts of the signals: motions of the drive, then loads.
    sines : (h, 4) array
        Number of the signal, amplitude, angular frequency and phase of each sine.
    constant_force, sine_force, cosine_force : (m,), (h, m), (h, m) arrays
        Modal forces of all that is constant, and of each sine and its cosine.
    longest, tolerance : float
        Longest step [s]; error of a step as a part of the scales of the run.
    states : (n, 3) integer array
        State of each node.
    q, v : (m, n + 1) arrays
        Coefficients of modal displacements and velocities over the step.
    forcing : (m, n + 1) array
        Coefficients of the modal forces that are prescribed in time.
    signal : (g, n + 1) array
        Coefficients of the signals; (0, n + 1) where no powers are integrated.
    u, F, square, cube : (n, n + 1) arrays
        Coefficients of the penetrations, forces, and of u^2 and u^3.
    combined, products, slopes, pull : (D, n + 1), (P, n + 1), (P, n + 1), (m, n + 1) arrays
        Coefficients of c, p, ``Q p + L x`` of :mod:`fecontact.system.polynomial_forces` and of
        these forces.
    powers : (5, n + 1) array
        Coefficients of the powers, then of their integrals.
    line, workspace : (3, l), (d, n + 1) arrays
        Work arrays; l is n + 1, or the number of nodes where that is more.
    """

    pieces: Annotated[Array, NODES, ANY, PIECE]
    constants: Vector
    sines: Annotated[Array, ANY, 4]
    constant_force: Annotated[Array, MODES]
    sine_force: Annotated[Array, ANY, MODES]
    cosine_force: Annotated[Array, ANY, MODES]
    longest: float
    tolerance: float
    states: Annotated[Integers, NODES, 3]
    q: Annotated[Array, MODES, COEFFICIENTS]
    v: Annotated[Array, MODES, COEFFICIENTS]
    forcing: Annotated[Array, MODES, COEFFICIENTS]
    signal: Annotated[Array, ANY, COEFFICIENTS]
    u: Annotated[Array, NODES, COEFFICIENTS]
    F: Annotated[Array, NODES, COEFFICIENTS]
    square: Annotated[Array, NODES, COEFFICIENTS]
    cube: Annotated[Array, NODES, COEFFICIENTS]
    combined: Annotated[Array, COMBINATIONS, COEFFICIENTS]
    products: Annotated[Array, PRODUCTS, COEFFICIENTS]
    slopes: Annotated[Array, PRODUCTS, COEFFICIENTS]
    polynomial: Annotated[Array, MODES, COEFFICIENTS]
    powers: Annotated[Array, SERIES_POWERS, COEFFICIENTS]
    line: Matrix
    workspace: Matrix


def chosen_series(
    system: ContactSystem, state: Array, times: Array, rtol: float, max_step: float | None,
    events: Sequence[AnyEvent], work: bool, asked: bool,
) -> Series | None:
    """Tables of a system for which series are used; InputError where they are asked for in vain."""
    found = obstacle(system, events, float(times[0]), float(times[-1]))
    if found is not None:
        if asked:
            raise InputError(f"PowerSeries() is for systems whose forces are polynomials between "
                             f"switches of contacts, but {found}; take Auto().")
        return None
    pieces = law_pieces(system)
    if not asked and not worthwhile(system, pieces):
        return None
    return _tables(system, pieces, state, rtol, max_step, work)


def _tables(
    system: ContactSystem, pieces: Array, state: Array, rtol: float, max_step: float | None,
    work: bool,
) -> Series:
    """Tables of a system at the start of a run."""
    parts = [sines_of(signal) or (0.0, []) for signal in _signals(system)]
    sines = np.array([(g, *row) for g, (_, rows) in enumerate(parts) for row in rows
                      if row[0] != 0.0]).reshape(-1, 4)
    constants = np.array([constant for constant, _ in parts])
    arrays = system.arrays
    # Modal forces (g, m) of a signal and of its rate.
    of_value = np.vstack([arrays.drive_stiffness[:, None] * arrays.drive_shapes,
                          arrays.load_shapes])
    of_rate = np.vstack([arrays.drive_damping[:, None] * arrays.drive_shapes,
                         0.0 * arrays.load_shapes])
    number, amplitude, w = sines[:, 0].astype(int), sines[:, 1:2], sines[:, 2:3]
    m, n = system.basis.modes, system.basis.contact_nodes
    return allocate(
        Series, {MODES: m, NODES: n, COMBINATIONS: len(arrays.polynomial_rows),
                 PRODUCTS: len(arrays.polynomial_pairs)},
        pieces=pieces, constants=constants, sines=sines,
        constant_force=arrays.constant_load + constants @ of_value,
        sine_force=amplitude * of_value[number],
        cosine_force=amplitude * w * of_rate[number],
        longest=np.inf if max_step is None else float(max_step),
        tolerance=max(_PART * rtol, _ROUNDING), states=_first_states(system, pieces, state),
        signal=np.zeros((len(parts) if work else 0, COEFFICIENTS)),
        line=np.zeros((3, max(COEFFICIENTS, n))), workspace=np.zeros(WORKSPACE))


def from_state(series: Series, system: ContactSystem, state: Array) -> Series:
    """The tables at the start of a run of the same system from another state."""
    return series._replace(states=_first_states(system, series.pieces, state))


def law_pieces(system: ContactSystem) -> Array:
    """Pieces (n, p, 11) of the normal laws of all nodes, which must have some."""
    found = [law.pieces(share) for _, share, law in system.law_groups("normal") if len(share)]
    most = max((table.shape[1] for table in found), default=1)
    rows = [np.zeros((0, most, PIECE))]
    for table in found:
        # Pieces that a law lacks begin and end at infinity.
        full = np.zeros((len(table), most, PIECE))
        full[..., : UPPER + 1] = np.inf
        full[:, : table.shape[1]] = table
        rows.append(full)
    return np.concatenate(rows)


def _signals(system: ContactSystem) -> list[Signal]:
    """Motions of the drive, then loads."""
    return [*system.drive.motions[:2], *system.load.signals.values()]


def sines_of(signal: Signal) -> tuple[float, list[tuple[float, float, float]]] | None:
    """Constant part of a signal, and amplitude, angular frequency and phase of its sines."""
    if type(signal) is Constant:
        return float(signal.value), []
    if type(signal) is Harmonic:
        return 0.0, [(signal.amplitude, 2.0 * np.pi * signal.frequency_hz, signal.phase)]
    if type(signal) is Harmonics:
        rows = signal.parameters()[1:].reshape(-1, 3)
        return 0.0, [(float(a), float(w), float(phase)) for a, w, phase in rows]
    return None


def _first_states(system: ContactSystem, pieces: Array, state: Array) -> Integers:
    """States (n, 3) of the nodes at the start."""
    m, n = system.basis.modes, system.basis.contact_nodes
    rows = system.arrays.rows[:, 1]
    states = np.zeros((n, 3), dtype=np.int64)
    for j in range(n):
        u, v = -float(rows[j] @ state[:m]) - system.arrays.gap[j], -float(rows[j] @ state[m:])
        place = int(np.searchsorted(pieces[j, :, UPPER], u))
        states[j] = place, acts(pieces[j, place], u, v), MET_NOTHING
    return states


def acts(piece: Array, u: float, v: float) -> bool:
    """Whether the force of a piece is not cut off."""
    release = piece[-3:]
    if not release.any():
        return False
    return bool(release[2] == 0.0 or release @ [1.0, u, v] > 0.0)


def obstacle(
    system: ContactSystem, events: Sequence[AnyEvent], begin: float, end: float
) -> str | None:
    """Why series cannot be used for a system and such events from begin to end, or None."""
    basis, arrays, ground = system.basis, system.arrays, system.ground
    if basis.dimension == 3:
        return "bodies in space are not among them"
    if ground.wavy and basis.ground_nodes.any():
        return "the ground is wavy"
    for _, _, law in system.law_groups("friction"):
        if not (isinstance(law, ConstantFriction) and not np.any(law.friction_coefficient)
                and not np.any(law.viscous_coefficient)):
            return "there is friction"
    for _, share, law in system.law_groups("normal"):
        if len(share) and law.pieces(share) is None:
            return f"{type(law).__name__} is not piecewise polynomial"
    for signal in _signals(system):
        if sines_of(signal) is None:
            return f"{type(signal).__name__} is neither constant nor harmonic"
    if not np.array_equal(arrays.stiffness, arrays.stiffness.T):
        return "the stiffness is not symmetric"
    if not all(isinstance(one, ContactEvents) for one in events):
        return "events other than ContactEvents are not located in them"
    if events and (arrays.rows[:, 0].any() or any(motion.largest_speed(begin, end) for motion
                                          in system.prescribed_motion.motions)):
        return "ContactEvents are located in them only where contact nodes do not slide"
    return None


def series_pay(system: ContactSystem, begin: float, end: float) -> bool:
    """Whether a run without events is expanded in series where that is left to the package."""
    return obstacle(system, (), begin, end) is None and worthwhile(system, law_pieces(system))


def worthwhile(system: ContactSystem, pieces: Array) -> bool:
    """Whether series are the faster way: few modes, none of them fast and much damped."""
    m, n = system.basis.modes, system.basis.contact_nodes
    if m > MOST_MODES or n > MOST_NODES or not (n or system.basis.large_deflections):
        return False
    slow = [w for signal in _signals(system) for _, w, _ in (sines_of(signal) or (0.0, []))[1]
            if w > 0.0]
    for closed in (False, True):
        stiffness, damping = system.arrays.stiffness, system.arrays.damping
        if closed:
            piece = np.abs(pieces)
            rows = system.arrays.rows[:, 1]
            stiffness = stiffness + rows.T @ (piece[:, :, 3].max(axis=1)[:, None] * rows)
            damping = damping + rows.T @ (piece[:, :, 5].max(axis=1)[:, None] * rows)
        rates = _rates(m, stiffness.tobytes(), damping.tobytes())
        size = np.abs(rates)
        if not closed:
            slow += size[size > 0.0].tolist()
        if not slow:
            continue
        fast = size > _FAST * min(slow)
        if (-rates.real[fast] > _DAMPED * size[fast]).any():
            return False
        if not closed and size.max() > _FASTEST * min(slow):
            return False
    return True


@lru_cache(maxsize=64)
def _rates(m: int, stiffness: bytes, damping: bytes) -> NDArray[np.complex128]:
    """Eigenvalues (2 m,) of m modes; a diagram asks for the same ones at each value."""
    K, D = (np.frombuffer(matrix).reshape(m, m) for matrix in (stiffness, damping))
    rates = np.linalg.eigvals(np.block([[np.zeros((m, m)), np.eye(m)], [-K, -D]]))
    rates.setflags(write=False)
    return rates
