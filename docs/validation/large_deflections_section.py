"""Large deflections: rods, stretched beams, arches and plates against theory."""

import warnings

import numpy as np
from comparison import Comparison, comparisons
from scipy.special import ellipk

from fecontact import (
    BoundaryLoad,
    ContactSystem,
    ElasticBody,
    Load,
    Material,
    Mesh,
    ModalBasis,
    ModelWarning,
    PointLoad,
    equilibrium,
    modal_basis,
    static_solution,
)
from fecontact.analysis import DeflectionSteps, deflection_path
from fecontact.bifurcation import (
    HarmonicBalance,
    contact_field,
    equilibrium_branch,
    nonlinear_mode,
)
from fecontact.fem import Coupling
from fecontact.laws import LinearContact
from fecontact.reduction import LargeDeflections

E, L, H, B = 2e11, 1.0, 0.004, 0.01
STEEL = Material(E, 0.0, 7800.0)
EI = E * B * H**3 / 12.0
RADIUS = H / np.sqrt(12.0)
PRESSED = 0.25329185  # of the load, see tests/system/test_deflections_joined.py


def section() -> str:
    """Table of statics of the whole body, and of reduced models."""
    rows = [*rods(), *stressed_beams(), *arch(), *plate()]
    return TEXT.format(rows=comparisons(rows))


def strip(columns: int, rows: int, *constraints: Coupling, **fixed: str) -> ElasticBody:
    """A strip of steel."""
    mesh = Mesh.grid(np.linspace(0.0, L, columns + 1), np.linspace(0.0, H, rows + 1))
    places = {"first": (0.0, 0.5 * H), "last": (L, 0.5 * H)} if rows == 2 else {}
    points = {name: int(np.argmin(np.linalg.norm(mesh.nodes - place, axis=1)))
              for name, place in places.items()}
    return ElasticBody(Mesh(mesh.nodes, mesh.cells, mesh.boundaries, points,
                            constraints=constraints), STEEL, fixed=fixed, thickness=B)


def rods() -> list[Comparison]:
    """Cantilevers by their finite elements."""
    rows = []
    for factor, (inwards, down) in {1.0: (0.05643, 0.30172), 10.0: (0.55500, 0.81061)}.items():
        load = Load(boundaries=(BoundaryLoad("right", shear=factor * EI / L**2 / (H * B)),))
        path = deflection_path(strip(48, 1, left="xy"), load)
        x, y = path.displacement("right")[-1]
        rows += [Comparison(f"cantilever, P L^2 / EI = {factor:g}: down / L", down, y),
                 Comparison(f"cantilever, P L^2 / EI = {factor:g}: in / L", inwards, -x)]
    hub = Coupling("right", "hub", (L, 0.5 * H))
    path = deflection_path(strip(64, 1, hub, left="xy"), Load(
        forces=(PointLoad("hub", "phi", signal=np.pi * EI / L),)))
    rows.append(Comparison("cantilever rolled up by M = pi EI / L: height of the end / L",
                           2.0 / np.pi, path.displacement("hub")[-1, 1]))
    line = 8.0 * EI / L**3
    path = deflection_path(
        strip(48, 1, left="xy"), Load(boundaries=(BoundaryLoad("top", pressure=line / B),)),
        contact="bottom", gap=0.3 * L, normal=LinearContact((1e4 * EI / L**3,) * 97))
    rows.append(Comparison("cantilever bent onto a stop at 0.3 L: force / load", PRESSED,
                           path.normal_force[-1].sum() / (line * L)))
    return rows


def frequency_ratio(basis: ModalBasis, amplitude: float) -> float:
    """Frequency of the first nonlinear mode at an amplitude of the middle over the linear one."""
    mode = nonlinear_mode(ContactSystem(basis), (1e-3 * amplitude, 1.05 * amplitude), 1,
                          observe=("middle", "y"), method=HarmonicBalance(4, stability=None))
    return float(np.interp(amplitude, mode.amplitude, mode.frequency_hz) / mode.frequency_hz[0])


def stressed_beams() -> list[Comparison]:
    """Duffing's oscillator of beams with immovable ends, without and with a tension."""
    middle = {"middle": (0.5 * L, 0.5 * H)}
    hinged = {"first": "xy", "last": "xy"}
    rows = []
    for what, exact, fixed, modes in (
            ("hinged beam", 1.317776, hinged, (0,)),
            ("clamped beam, one mode", 1.085671, {"left": "xy", "right": "xy"}, (0,)),
            ("clamped beam, modes 0 and 2", 1.085671, {"left": "xy", "right": "xy"}, (0, 2))):
        basis = modal_basis(strip(30, 2, **fixed), 3, contact=(), points=middle,
                            large_deflections=LargeDeflections(0.63 * H, modes))
        rows.append(Comparison(f"{what}: frequency ratio at 2 radii of gyration", exact,
                               frequency_ratio(basis, 2.0 * RADIUS)))
    pull = 2.0 * np.pi**2 * EI / L**2 / (B * H)
    state = static_solution(strip(30, 2, first="xy", last="y"), Load(
        boundaries=(BoundaryLoad("right", pressure=-pull),)))
    basis = modal_basis(strip(30, 2, **hinged), 1, contact=(), points=middle, prestress=state,
                        large_deflections=LargeDeflections(0.63 * H))
    hard = 1.0 / 3.0  # (a / r)^2 / 4 / (1 + N / N_E)
    exact = np.pi / 2.0 * np.sqrt(1.0 + hard) / ellipk(hard / 2.0 / (1.0 + hard))
    rows.append(Comparison("hinged beam pulled by twice Euler's load: the same", exact,
                           frequency_ratio(basis, 2.0 * RADIUS)))
    return rows


def arch() -> list[Comparison]:
    """Both limit loads of a shallow arch, reduced to one mode."""
    a, h = 5.0, 0.01
    radius = h / np.sqrt(12.0)
    mesh = Mesh.grid(np.linspace(0.0, 0.5 * L, 17), np.linspace(-0.5 * h, 0.5 * h, 3))
    nodes = mesh.nodes.copy()
    end = int(np.argmin(np.linalg.norm(nodes, axis=1)))
    nodes[:, 1] += a * radius * np.sin(np.pi * nodes[:, 0] / L)
    body = ElasticBody(Mesh(nodes, mesh.cells, mesh.boundaries, {"end": end}), STEEL, thickness=B,
                       fixed={"end": "xy", "right": "x"})
    basis = modal_basis(body, 1, contact=(), damping=0.2,
                        large_deflections=LargeDeflections(2.4 * a * radius))
    per_gravity = 4.0 / np.pi * 7800.0 * B * h / (
        E * B * h**3 / 12.0 * radius * (np.pi / L)**4)
    system = ContactSystem(basis, load=Load(gravity=(0.0, -1.0)))
    field = contact_field(system, {"g": (0.0, lambda given, value: given.with_(
        load=Load(gravity=(0.0, -value / per_gravity))))})
    folds = equilibrium_branch(field, np.zeros(system.size), "g", bounds=(-8.0, 25.0)).of_kind(
        "fold")
    b = np.sqrt((a**2 - 4.0) / 3.0)
    return [Comparison(f"arch, rise of 5 radii of gyration: {what} limit load",
                       (a - at) + at * (a**2 - at**2) / 4.0, fold.parameter)
            for what, at, fold in zip(("upper", "lower"), (b, -b), folds, strict=True)]


def plate() -> list[Comparison]:
    """A quarter of a clamped square plate under pressure, whole and reduced to one mode."""
    a, h = 1.0, 0.016
    x = 0.5 * a * np.linspace(0.0, 1.0, 9) ** 1.8
    body = ElasticBody(Mesh.grid(x, x, [0.0, h]), Material(E, 0.316, 7800.0), fixed={
        "left": "xyz", "front": "xyz", "right": "x", "back": "y"})
    middle = (0.5 * a, 0.5 * a, 0.5 * h)
    load = Load(boundaries=(BoundaryLoad("top", pressure=184.0 * E * (h / a) ** 4),))
    path = deflection_path(body, load, steps=DeflectionSteps(first=0.5))
    basis = modal_basis(body, 4, contact=(), points={"middle": middle}, reduction="residual",
                        loads=["top"], large_deflections=LargeDeflections(1.7 * h))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        rest = equilibrium(ContactSystem(basis, load=load))
    return [Comparison("clamped plate, p a^4 / (E h^4) = 184, whole: w / h", 1.323,
                       -path.displacement(middle)[-1, 2] / h),
            Comparison("clamped plate, p a^4 / (E h^4) = 184, one mode: w / h", 1.323,
                       -float(basis.point_row("middle", "z") @ rest.modal_coordinates) / h)]


TEXT = """## Large deflections

Statics of the whole body: the cantilever under a force at its end by Mattiasson (1981), rolled up
to half a circle by a moment on a kinematic coupling, and bent by a line load onto smooth ground,
against the equations of the inextensible rod. Reduced models: x'' + x + c (a x)^3 = 0 with c = 1/4
and 0.0599411, which a tension N divides by 1 + N / N_E; the limit loads of a sinusoidal arch by
Fung and Kaplan (NACA TN 2840, 1952); Levy's clamped plate (NACA TN 847, 1942).
[Large deflections](large-deflections.md) has more, against whole bodies.

{rows}
"""
