"""Checks of a law: derivatives, signs and energy over its relevant range."""

import threading
from collections.abc import Callable
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from fecontact.core.compiled import CompiledLaw as CompiledLaw
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.sampling import cycle_work, law_values, memory_values
from fecontact.laws.signatures import FRICTION_FORM, MEMORY_FORM, NORMAL_FORM

_NORMAL_PLACES = np.array([(u, v) for u in (-1e-3, 0.0, 1e-9, 1e-6, 1e-4)
                           for v in (-1.0, -1e-3, 0.0, 1e-6, 1e-3, 1.0)]).T
_FRICTION_PLACES = np.array([(v, F) for v in (-1.0, -1e-3, 0.0, 1e-6, 1e-3, 1.0)
                             for F in (0.0, 1e-3, 1.0, 100.0)]).T

_PATIENCE = 10.0  # seconds for a law to return, which takes a microsecond

# Distances to the other side, in penetration scales.
_DISTANCES = np.concatenate([[0.0], np.geomspace(1e-6, 1e4, 21)])


@lru_cache(maxsize=256)
def require_sound(law: NormalLaw | FrictionLaw) -> None:
    """Raise :class:`InputError` unless a law returns the required number of finite values.

    A normal law must be zero where its ``untouched`` says so.

    The message gives the returned values and the arguments.
    """
    name = type(law).__name__
    normal = isinstance(law, NormalLaw)
    forms = {"normal_law": NORMAL_FORM} if normal else {
        "friction_law": FRICTION_FORM, "memory_friction_law": MEMORY_FORM}
    function = getattr(type(law), "kernel", None)
    if not isinstance(function, CompiledLaw) or function.form not in forms.values():
        raise InputError(f"{name}: kernel must be a class variable, a function "
                         f"{' or '.join(forms.values())} decorated with {' or '.join(forms)}.")
    if isinstance(law, FrictionLaw):
        count = law.memory
        if isinstance(count, bool) or not isinstance(count, int) or (
                count < 0) or (count > 0) != (function.form == MEMORY_FORM):
            raise InputError(f"{name}: memory = {count!r} must be the number of internal "
                             f"variables, a whole number, above zero exactly for kernels of "
                             f"memory_friction_law.")
    what = "penetration_scale" if normal else "velocity_scale"
    try:
        scale = getattr(law, what)
    except NotImplementedError:
        scale = None
    if not isinstance(scale, float | int) or not 0.0 < scale < np.inf:
        raise InputError(f"{name}: {what} = {scale!r} must be a finite number above zero; define "
                         f"it as a property of the law.")
    if isinstance(law, NormalLaw) and law.rigid:
        return
    nodes = law.node_count() or 1
    row = law.table(np.full(nodes, 1.0 / nodes))[0]
    if isinstance(law, NormalLaw):
        names, (first, second) = "u, v", _NORMAL_PLACES
    else:
        names, (first, second) = "v, F", _FRICTION_PLACES
    out = _evaluated(law, row, names, first, second)
    wrong = np.flatnonzero(~np.isfinite(out).all(axis=1))
    if len(wrong):
        place = f"{first[wrong[0]]:g}, {second[wrong[0]]:g}"
        shown = ", ".join(f"{value:g}" for value in out[wrong[0], :3])
        raise InputError(f"{name} returns ({shown}{', ...' * (out.shape[1] > 3)}) at ({names}) = "
                         f"({place}); a law must return finite numbers everywhere.")
    if isinstance(law, NormalLaw):
        _require_untouched(law, law.table(np.full(nodes, 1.0 / nodes)))


def _evaluated(
    law: NormalLaw | FrictionLaw, row: Array, names: str, first: Array, second: Array
) -> Array:
    """Values (k, m) of a law at pairs of arguments (k,), without memory or at z = 0.

    They are evaluated in another thread; InputError if the law does not return there.
    """
    address = law.kernel.address

    def values(places: slice) -> Array:
        x, y = first[places], second[places]
        if isinstance(law, NormalLaw) or not law.memory:
            return law_values(address, row, x, y)
        size = (1 + law.memory) * (3 + law.memory)
        return memory_values(address, row, x, y, np.zeros((len(x), law.memory))).reshape(-1, size)

    def evaluate() -> None:
        found.extend(values(slice(place, place + 1)) for place in range(len(first)))

    found = [values(slice(0))]  # compiles, which may take longer
    thread = threading.Thread(target=evaluate, daemon=True)
    thread.start()
    thread.join(_PATIENCE)
    if thread.is_alive():
        place = len(found) - 1
        raise InputError(f"{type(law).__name__} has not returned after {_PATIENCE:g} s at "
                         f"({names}) = ({first[place]:g}, {second[place]:g}); end its loops for "
                         f"all arguments.")
    return np.concatenate(found)


def _require_untouched(law: NormalLaw, table: Array) -> None:
    """Raise unless a law is zero where it says that nodes are untouched."""
    limits = law.untouched(len(table))
    known = ~np.isneginf(limits)
    for limit, *row in np.unique(np.column_stack([limits, table])[known], axis=0):
        u, v = (grid.ravel() for grid in np.meshgrid(
            limit - law.penetration_scale * _DISTANCES, (-1.0, -1e-3, 0.0, 1e-3, 1.0)))
        values = law_values(law.kernel.address, np.array(row), u, v)
        _require(law, "(u, v)", np.column_stack([u, v]), (values == 0.0).all(axis=1), values,
                 f"must be zero, as untouched = {limit:g} m says")


Values = Callable[[Array], Array]

_SIZES = np.geomspace(1e-4, 1e4, 97)
_SIGNED = np.concatenate([-_SIZES[::-1], [0.0], _SIZES])
_FORCES = np.array([0.3, 14.0])
_STEP, _SIDE = 1e-3, 1e-6
_LOSS = 1e-4  # relative error allowed in the integrated work of a cycle


def check_law(law: NormalLaw | FrictionLaw) -> None:
    """Check the derivatives, signs and energy of a user-defined law.

    For the parameters of each contact node, at penetrations up to ten penetration scales, slip
    velocities up to 1e4 velocity scales and internal variables up to three times their scales:

    - values are finite;
    - derivatives agree with finite differences, at a kink with either side or a value between;
    - normal laws do not pull at u > 0 (unless their class says ``bilateral = True``), their
      elastic force F(u, 0) does not decrease, their damping dissipates energy, and the stored
      energy is the integral of F(u, 0) and not negative;
    - friction is zero without normal force; without memory it opposes the slip velocity, with
      memory every cycle of slip dissipates energy.

    Parameters
    ----------
    law : NormalLaw or FrictionLaw
        A law with its parameters.

    Raises
    ------
    InputError
        For the first check that fails, with arguments and values.
    """
    require_sound(law)
    nodes = law.node_count() or 1
    share = np.full(nodes, 1.0 / nodes)
    rows = np.unique(law.table(share), axis=0)
    for p in np.ascontiguousarray(rows):
        if isinstance(law, NormalLaw):
            _check_normal(law, p)
        elif law.memory:
            _check_memory(law, p, 1.0 / nodes)
        else:
            _check_friction(law, p)
    if isinstance(law, NormalLaw):
        _check_energy(law, share)


def _forces(law: NormalLaw | FrictionLaw, p: Array) -> Values:
    """Force (k, 1) of a law without memory as a function of its two arguments (k, 2)."""
    return lambda points: law_values(law.kernel.address, p, points[:, 0], points[:, 1])[:, :1]


def _check_normal(law: NormalLaw, p: Array) -> None:
    scale = law.penetration_scale
    u, v = (grid.ravel() for grid in np.meshgrid(
        scale * np.concatenate([_SIGNED[np.abs(_SIGNED) <= 1.0], np.linspace(-3.0, 10.0, 131)]),
        np.concatenate([-np.geomspace(1.0, 1e-4, 5), [0.0], np.geomspace(1e-4, 1.0, 5)])))

    values = law_values(law.kernel.address, p, u, v)
    still = law_values(law.kernel.address, p, u, np.zeros_like(u))
    points, force = np.column_stack([u, v]), values[:, 0]
    _require(law, "(u, v)", points, np.isfinite(values).all(axis=1), values, "must be finite")
    pushes = law.bilateral | (u <= 0.0) | (force >= 0.0)
    _require(law, "(u, v)", points, pushes, force, "must not pull at u > 0")
    _require(law, "(u, v)", points, still[:, 1] >= 0.0, still[:, :2],
             "must not fall as u grows: dF/du < 0 at v = 0")
    damping = (force - still[:, 0]) * v
    _require(law, "(u, v)", points, damping >= -1e-12 * np.abs(force * v), damping,
             "must not give energy off by damping: (F(u, v) - F(u, 0)) v < 0")
    # Sizes for difference quotients dF/du and dF/dv; near zero a lower bound replaces |u|, |v|.
    sizes = np.column_stack([np.maximum(np.abs(u), 1e-3 * scale), np.maximum(np.abs(v), 1e-5)])
    _check_derivatives(law, "(u, v)", points, sizes, _forces(law, p), values[:, None, 1:],
                       ("F",), ("u", "v"))


def _check_energy(law: NormalLaw, share: Array) -> None:
    scale = law.penetration_scale
    edges = scale * np.unique(np.concatenate([np.linspace(-3.0, 10.0, 2601),
                                              _SIGNED[np.abs(_SIGNED) <= 1.0]]))
    nodes, weights = np.polynomial.legendre.leggauss(4)
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    u = (middle[:, None] + half[:, None] * nodes).ravel()
    stored = law.stored_energy(np.tile(edges[:, None], (1, len(share))), share)
    for node, p in enumerate(law.table(share)):
        force = law_values(law.kernel.address, p, u, np.zeros_like(u))[:, 0]
        force = force.reshape(-1, len(nodes))
        work = np.concatenate([[0.0], np.cumsum(half * (force @ weights))])
        work -= np.interp(0.0, edges, work)
        energy = stored[:, node]
        error = np.abs(energy - work) <= 1e-4 * np.abs(work) + 1e-6 * np.abs(work).max()
        _require(law, "u", edges[:, None], error, np.column_stack([energy, work]),
                 "must be equal: stored_energy and the integral of F(u, 0)")
        falls = energy >= -1e-9 * np.abs(energy).max()
        # A constant force, or one that extends to u < 0, stores less there than at u = 0.
        _require(law, "u", edges[:, None], (edges < 0.0) | falls, energy,
                 "must not be negative: stored_energy")


def _check_friction(law: FrictionLaw, p: Array) -> None:
    scale = law.velocity_scale
    v, F = (grid.ravel() for grid in np.meshgrid(scale * _SIGNED, _FORCES))

    values = law_values(law.kernel.address, p, v, F)
    points, force = np.column_stack([v, F]), values[:, 0]
    _require(law, "(v, F)", points, np.isfinite(values).all(axis=1), values, "must be finite")
    _require(law, "(v, F)", points, force * v >= 0.0, force,
             "must have the sign of v, or zero: friction would give energy off")
    open_ = law_values(law.kernel.address, p, v, np.zeros_like(F))[:, 0]
    _require(law, "(v, F)", points * [1.0, 0.0], open_ == 0.0, open_,
             "must be zero without normal force")
    sizes = np.column_stack([np.maximum(np.abs(v), scale), F])
    _check_derivatives(law, "(v, F)", points, sizes, _forces(law, p), values[:, None, 1:],
                       ("R",), ("v", "F"))


def _check_memory(law: FrictionLaw, p: Array, share: float) -> None:
    s, rng = law.memory, np.random.default_rng(1)
    count = 400
    F = share * rng.choice([0.2, 1.0, 14.0], count)
    v = law.velocity_scale * rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-4.0, 2.0, count)
    v[::10] = 0.0
    # Internal variables of springs scale with F, those of bristles do not.
    grown = np.where(rng.random(count) < 0.5, 1.0, F / share)
    z = law.state_scale * rng.uniform(-3.0, 3.0, (count, s)) * grown[:, None]
    names = tuple(f"z[{i}]" for i in range(s))
    where = f"({', '.join(('v', 'F', *names))})"

    def outputs(points: Array) -> Array:
        found = memory_values(law.kernel.address, p, points[:, 0], points[:, 1], points[:, 2:])
        return found[:, :, 0]

    values, points = memory_values(law.kernel.address, p, v, F, z), np.column_stack([v, F, z])
    _require(law, where, points, np.isfinite(values).all(axis=(1, 2)), values[:, :, 0],
             "must be finite")
    open_ = memory_values(law.kernel.address, p, v, np.zeros(count), z)[:, 0, 0]
    _require(law, where, points * np.where(np.arange(2 + s) == 1, 0.0, 1.0), open_ == 0.0, open_,
             "must be zero without normal force")
    sizes = np.column_stack([np.maximum(np.abs(v), law.velocity_scale), F, np.abs(z)])
    _check_derivatives(law, where, points, sizes, outputs, values[:, :, 1:],
                       ("R", *(f"{name}'" for name in names)), ("v", "F", *names))
    for speed, reach in product(law.velocity_scale * np.array([0.1, 1.0, 10.0]),
                                law.velocity_scale * np.array([0.03, 0.3, 3.0])):
        work, size = cycle_work(law.kernel.address, law.memory, p, share, speed, reach)
        if (given := -np.cumsum(work).min()) > _LOSS * size.sum():
            raise InputError(f"{type(law).__name__}: cycles of slip by {reach:.3g} m to and fro, "
                             f"at most {speed:.3g} m/s fast, give off {given:.3g} J at F = "
                             f"{share:.3g} N; friction must take energy out of all motion.")


def _check_derivatives(
    law: NormalLaw | FrictionLaw, where: str, points: Array, sizes: Array, outputs: Values,
    given: Array, results: tuple[str, ...], arguments: tuple[str, ...],
) -> None:
    """Compare derivatives (k, r, a) of outputs (k, r) at points (k, a) with differences."""
    here = outputs(points)
    for a, argument in enumerate(arguments):
        step = _STEP * sizes[:, a]
        shift = np.zeros_like(points)
        shift[:, a] = step
        far = {k: outputs(points + k * shift) for k in (-2, -1, 1, 2)}
        central = (8.0 * (far[1] - far[-1]) - (far[2] - far[-2])) / (12.0 * step[:, None])
        near = {k: (outputs(points + k * _SIDE / _STEP * shift) - here) / (k * _SIDE / _STEP
                                                                           * step[:, None])
                for k in (-1, 1)}
        size = np.max([np.abs(value) for value in far.values()], axis=0)
        rounding = 50.0 * np.finfo(float).eps * size
        slope = given[:, :, a]
        slack = 1e-5 * np.abs(slope) + 1e-6 * size / sizes[:, a, None]
        smooth = np.abs(central - slope) <= slack + rounding / step[:, None]
        slack = (1e-3 * np.maximum(np.abs(near[-1]), np.abs(near[1])) + slack
                 + rounding / (_SIDE / _STEP * step[:, None]))
        low, high = np.minimum(near[-1], near[1]), np.maximum(near[-1], near[1])
        kink = (low - slack <= slope) & (slope <= high + slack)
        for r, result in enumerate(results):
            shown = np.column_stack([slope[:, r], central[:, r]])
            _require(law, where, points, smooth[:, r] | kink[:, r], shown,
                     f"must be equal: d{result}/d{argument} as returned and by differences")


def _require(law: NormalLaw | FrictionLaw, where: str, points: Array, holds: Any, values: Array,
             demand: str) -> None:
    wrong = np.flatnonzero(~holds)
    if len(wrong):
        place = ", ".join(f"{value:.6g}" for value in points[wrong[0]])
        shown = ", ".join(f"{value:.6g}" for value in np.ravel(values[wrong[0]])[:4])
        place = f"({place})" if where.startswith("(") else place
        raise InputError(f"{type(law).__name__}: at {where} = {place} the values {shown} {demand}.")
