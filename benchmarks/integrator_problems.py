"""The problems on which time integrators are compared."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fecontact import (
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    Load,
    Material,
    Mesh,
    ModalBasis,
    modal_basis,
)
from fecontact.laws import Constant, ExponentialFriction, PrescribedForce, RoughSurface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Problem:
    """A system, its start, its output times, and what is compared.

    ``observed`` (k, 2 m) gives the quantities whose errors count from the state; the error is
    the largest deviation of each over its own largest reference value, the worst of all.
    """

    name: str
    system: ContactSystem
    state: Array
    times: Array
    observed: Array

    def error(self, states: Array, reference: Array) -> float:
        """Error of states (N, 2 m)."""
        wanted = reference @ self.observed.T
        found = states @ self.observed.T
        return float((np.abs(found - wanted).max(axis=0) / np.abs(wanted).max(axis=0)).max())


FRICTION = ExponentialFriction(0.8, 0.55, 1000.0, 1e6)
_BELT_MASS, _STOP_MASS = 5.632, 0.092


def _basis(w: list[float], damping: list[float], B: list[list[float]],
           contact: list[list[float]]) -> ModalBasis:
    T = np.zeros((3, 3, len(w)))
    T[0, :2], T[1, :2], T[2, :2] = B, contact, contact
    frequencies = np.array(w)
    return ModalBasis(frequencies, np.diag(2.0 * np.array(damping) * frequencies), T,
                      np.zeros((3, 2)), np.ones(1))


def _observed(basis: ModalBasis, entries: list[tuple[int, int, int]]) -> Array:
    """Rows of (point, axis, derivative)."""
    rows = np.zeros((len(entries), 2, basis.modes))
    for row, (point, axis, derivative) in zip(rows, entries, strict=True):
        row[derivative] = basis.T[point, axis]
    return rows.reshape(len(entries), -1)


def impact_oscillator(periods: int = 50, outputs: int = 200) -> Problem:
    """(a): section 3 at 10.24 Hz (64.32 rad/s), the rigid mode alone."""
    hz, r = 64.32 / (2.0 * np.pi), 1.0 / np.sqrt(_STOP_MASS)
    basis = _basis([0.0], [0.0], [[0.0], [r]], [[0.0], [r]])
    system = ContactSystem(
        basis, normal=RoughSurface(0.3e6, 5.2e-6, 6.0),
        drive=Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3,
                    frequency_hz=hz))
    times = np.linspace(0.0, periods / hz, periods * outputs + 1)
    return Problem("a", system, np.zeros(2), times, _observed(basis, [(0, 1, 0), (0, 1, 1)]))


def diagram(values: Array) -> list[ContactSystem]:
    """(f): section 3 with two modes at many frequencies of the drive [Hz]."""
    r = 1.0 / np.sqrt(_STOP_MASS)
    shape = [[0.0, 0.0], [r, 0.6 * r]]
    basis = _basis([0.0, 2.0 * np.pi * 230.0], [0.0, 0.03], shape, shape)
    system = ContactSystem(
        basis, normal=RoughSurface(0.3e6, 5.2e-6, 6.0),
        drive=Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3,
                    frequency_hz=float(values[0])))
    return [system.with_({"drive.frequency_hz": float(hz)}) for hz in values]


def friction_oscillator(name: str, periods: int = 20, outputs: int = 500) -> Problem:
    """(b), (b2), (c): section 4 with one, two and three modes; (r): (c) on rigid ground."""
    hz, r = 13.8 / (2.0 * np.pi), 1.0 / np.sqrt(_BELT_MASS)
    elastic = 2.0 * np.pi * 30.0
    basis = {
        "b": lambda: _basis([0.0], [0.0], [[r], [0.0]], [[r], [0.0]]),
        "b2": lambda: _basis([0.0, 0.0], [0.0, 0.0], [[r, 0.0], [0.0, r]], [[r, 0.0], [0.0, r]]),
        "c": lambda: _basis([0.0, 0.0, elastic], [0.0, 0.0, 0.01],
                            [[r, 0.0, 0.5 * r], [0.0, r, 0.0]],
                            [[r, 0.0, -0.5 * r], [0.0, r, 0.0]]),
        "r": lambda: _basis([0.0, elastic], [0.0, 0.01], [[r, 0.5 * r], [0.0, 0.0]],
                            [[r, -0.5 * r], [0.0, 0.0]]),
    }[name]()
    given = name in ("b", "r")
    normal = PrescribedForce(14.0) if given else RoughSurface(10e6, 10e-6, 40.0)
    system = ContactSystem(
        basis, normal=normal, friction=FRICTION, ground=Ground(speed=1e-3),
        drive=Drive(stiffness_x=5610.0, damping_x=0.768, amplitude_x=0.5e-3, frequency_hz=hz),
        # (b) and (r) do not move in y: the load is the prescribed force.
        load=Load(0.0 if given else 14.0))
    times = np.linspace(0.0, periods / hz, periods * outputs + 1)
    entries = [(0, 0, 0), (0, 0, 1)] + ([] if given else [(0, 1, 0)])
    return Problem(name, system, np.zeros(2 * basis.modes), times, _observed(basis, entries))


def beam(name: str, nodes: int, modes: int, columns: int, speed: float = 0.01) -> Problem:
    """(d), (e): a free steel beam on a belt, pulled by a spring at its left end."""
    mesh = Mesh.grid(np.linspace(0.0, 0.2, columns + 1), np.linspace(0.0, 0.02, 5))
    body = ElasticBody(mesh, Material.named("steel"), 0.01)
    basis = modal_basis(body, modes, contact="bottom", contact_nodes=nodes, B=(0.0, 0.01),
                        C=(0.1, 0.02), points={"right": (0.2, 0.01)}, damping=0.01)
    pull = 9.5
    system = ContactSystem(
        basis, normal=RoughSurface(0.3e6, 5.2e-6, 6.0), friction=FRICTION,
        ground=Ground(speed=speed), load=Load(14.0),
        drive=Drive(stiffness_x=5610.0, damping_x=0.768, motion_x=Constant(-pull / 5610.0)))
    rigid_depth = 14.0 / 0.3e6 + 0.5 * 5.2e-6
    target = np.zeros((len(basis.T), 2))
    target[:, 1] = -rigid_depth
    used = basis.T[:, :2].reshape(-1, modes)[:, :3]
    state = np.zeros(2 * modes)
    state[:3] = np.linalg.lstsq(used, target.reshape(-1), rcond=None)[0]
    end = len(basis.T) - 1
    observed = _observed(basis, [(0, 0, 0), (0, 0, 1), (0, 1, 0), (end, 1, 0)])
    return Problem(name, system, state, np.linspace(0.0, 0.1, 2001), observed)


PROBLEMS: dict[str, Callable[[], Problem]] = {
    "a": impact_oscillator,
    "b": lambda: friction_oscillator("b"),
    "b2": lambda: friction_oscillator("b2"),
    "c": lambda: friction_oscillator("c"),
    "d": lambda: beam("d", 40, 20, 39),
    "e": lambda: beam("e", 400, 40, 200),
}


def shortened(problem: Problem, part: float) -> Problem:
    """The first part of a problem."""
    return replace(problem, times=problem.times[: 1 + int(part * (len(problem.times) - 1))])
