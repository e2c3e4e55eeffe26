"""Bodies that turn, are tight, are warm, or repeat: closed forms and published numbers."""

import numpy as np
from comparison import Comparison, comparisons

from fecontact import (
    BoundaryLoad,
    ContactSystem,
    ElasticBody,
    Load,
    Material,
    Mesh,
    PointLoad,
    basis_from_matrices,
    equilibrium,
    generate,
    modal_basis,
)
from fecontact.analysis import amplification, buckling_loads, whitehead_bound
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    contact_field,
    frequency_response,
)
from fecontact.fem import CyclicSymmetry, Ring, Rotation
from fecontact.laws import (
    Frictionless,
    Harmonic,
    JenkinsFriction,
    LinearContact,
    PrescribedForce,
)
from fecontact.reduction import (
    PointPairing,
    WholeWheel,
    cyclic_basis,
    cyclic_basis_from_bases,
    sector_modes,
)

TURN = 2.0 * np.pi
STEEL = Material(2.1e11, 0.3, 7850.0, thermal_expansion=1.2e-5)
# Deviations of stiffness near an adverse pattern.
START = (-0.0023, -0.0127, -0.0061, -0.0061, -0.0124)
SLIM = Material(2.1e11, 0.0, 7850.0)


def section() -> str:
    """Table of rotation, buckling, heat, sectors and friction between sectors."""
    rows = [*buckling(), *heat(), *rotating_beam(), *disc(), *rings(), *friction_ring(),
            *mistuned_wheel()]
    return TEXT.format(rows=comparisons(rows))


def buckling() -> list[Comparison]:
    """Euler's stress of half a column between hinges, with Timoshenko's shear."""
    length, height, soft = 1.0, 0.05, Material(2e9, 0.0, 1000.0)
    mesh = Mesh.grid(np.linspace(0.0, length, 65), [0.0, height])
    body = ElasticBody(mesh, soft, fixed={"left": "x", "bottom left": "y"})
    found = buckling_loads(body, Load(boundaries=(BoundaryLoad("right", pressure=1e6),)), 1)
    euler = np.pi**2 / 48.0 * soft.youngs_modulus * (height / length) ** 2
    wanted = euler / (1.0 + 2.4 * euler / soft.youngs_modulus)
    return [Comparison("column between hinges buckles at [Pa]", wanted,
                       found.load_factors[0] * 1e6)]


def heat() -> list[Comparison]:
    """Force of a column that grows warm and closes its gap."""
    width, height, depth, stiffness, gap, change = 0.02, 0.1, 0.05, 4e8, 3e-5, 60.0
    body = ElasticBody(Mesh.grid(np.linspace(0.0, width, 5), np.linspace(0.0, height, 13)), STEEL,
                       thickness=depth, degree=1, fixed={"top": "y", "top left": "x"})
    basis = modal_basis(body, 6, contact="bottom", reduction="residual", tolerance=0.0,
                        temperature=change)
    system = ContactSystem(basis, normal=LinearContact(stiffness), friction=Frictionless(),
                           gap=gap)
    compliance = 1.0 / stiffness + height / (STEEL.youngs_modulus * width * depth)
    return [Comparison("warm column closes its gap, force [N]",
                       (1.2e-5 * change * height - gap) / compliance,
                       equilibrium(system, "rest").normal_force.sum())]


def rotating_beam() -> list[Comparison]:
    """Flapping of a solid cantilever at two speeds, by the published coefficients."""
    height, width = 0.02, 0.03
    mesh = Mesh.grid(np.linspace(0.0, 1.0, 21), [0.0, width], [0.0, height])
    body = ElasticBody(mesh, SLIM, fixed={"left": "xyz"})
    unit = np.sqrt(SLIM.youngs_modulus * height**2 / (12.0 * SLIM.density))
    rows = []
    for speed, flap in ((2.0, 4.1373), (10.0, 11.2023)):
        rotation = Rotation(speed * unit, (0.0, 0.5 * width, 0.5 * height), coriolis=False)
        basis = modal_basis(body, 24, contact=(), rotation=rotation)
        found = np.sqrt(np.linalg.eigvalsh(basis.stiffness_matrix)) / unit
        rows.append(Comparison(f"rotating cantilever flaps, speed {speed:g} (Wright 1982)", flap,
                               nearest(found, flap)))
    return rows


def disc() -> list[Comparison]:
    """A free thin disc at high speed, two and three nodal diameters, with Southwell's bound."""
    nu = STEEL.poisson_ratio
    body = ElasticBody(generate(Ring(0.2, 0.0, 0.0005, element_size=0.05, layers=1)), STEEL)
    still = modal_basis(body, 14, contact=())
    shapes = np.abs(still.mode_shapes.shapes)
    flat = shapes[:, 2].max(axis=0) > 10.0 * shapes[:, :2].max(axis=(0, 1))
    rest = still.angular_frequencies[flat & (still.angular_frequencies > 0.0)]
    W = 6.0 * rest[0]
    basis = modal_basis(body, 40, contact=(), rotation=Rotation(W, coriolis=False))
    found = np.linalg.eigvalsh(basis.stiffness_matrix) / W**2
    rows = []
    for n, at_rest in ((2, rest[0]), (3, rest[3])):
        membrane = (n * (n + 2) * (3.0 + nu) - n**2 * (1.0 + 3.0 * nu)) / 8.0
        bound = membrane + (at_rest / W) ** 2
        rows.append(Comparison(f"thin disc, n = {n}: w^2 / W^2 above (Lamb and Southwell 1921)",
                               bound, nearest(found, bound)))
    return rows


def rings() -> list[Comparison]:
    """Thin ring from one of eight sectors, at rest and turning."""
    sectors, height = 8, 0.02
    flat = Mesh.grid([1.0 - 0.5 * height, 1.0 + 0.5 * height],
                     np.linspace(0.0, TURN / sectors, 13))
    radius, angle = flat.nodes.T
    nodes = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    body = ElasticBody(Mesh(nodes, flat.cells, boundaries=flat.boundaries), STEEL)
    found = sector_modes(body, CyclicSymmetry("bottom", "top", sectors), 3,
                         rotation=Rotation(0.0))
    unit = np.sqrt(STEEL.youngs_modulus * height**2 / (12.0 * STEEL.density)) / TURN
    rows = [Comparison(f"thin ring from a sector, n = {n} [Hz]",
                       unit * n * (n**2 - 1) / np.sqrt(n**2 + 1),
                       found.frequencies_hz[found.row(n), 0]) for n in (2, 3, 4)]
    at_rest = unit * 6.0 / np.sqrt(5.0)
    speed = 0.6 * at_rest  # turns per second
    both = found.rotation.frequencies_hz(TURN * speed)
    for sign, name, waves in ((-1.0, "forwards", both[0]), (1.0, "backwards", both[1])):
        wanted = np.sqrt(at_rest**2 + (1.2 * speed) ** 2) + sign * 0.8 * speed
        rows.append(Comparison(f"the ring turns, n = 2, wave {name} [Hz]", wanted, waves[2, 0]))
    return rows


def friction_ring() -> list[Comparison]:
    """One of 24 masses with Jenkins elements to its neighbours, engine order 6, one harmonic."""
    row = np.array([[1.0], [0.0], [0.0]])
    mass = basis_from_matrices([[1.0]], [[1.0]], {"P": row}, damping=[[0.02]])
    wheel = cyclic_basis_from_bases({"own": mass}, 24, {
        "damper": PointPairing("own", "P", "next_own", "P")})
    signal = Harmonic(1.0, 1.1 / TURN, 0.5 * np.pi)
    system = ContactSystem(wheel.basis, normal=PrescribedForce(2.0),
                           friction=JenkinsFriction(0.2, 0.5),
                           load=Load(forces=(PointLoad("own.P", "x", signal=signal),)))
    field = contact_field(system, {"w": (1.1, lambda system, w: system.with_(
        {"load.forces.0.signal.frequency_hz": w / TURN}))})
    found = frequency_response(
        field, (1.1, 1.2), "w", observe=("own.P", "x"), options=ContinuationOptions(points=1),
        method=HarmonicBalance(1, 4096, stability=None, sampling_tolerance=1e-3,
                               repeats=EngineOrder(wheel, 6)))
    return [Comparison("friction ring, engine order 6, W = 1.1: amplitude", 6.711291,
                       found.amplitude()[0])]


def mistuned_wheel() -> list[Comparison]:
    """Largest amplification of five blades, one mode each, over patterns of deviations."""
    from scipy.optimize import minimize

    sectors, half = 5, np.pi / 5
    angles, radii = np.linspace(-half, half, 5), (0.20, 0.24, 0.30, 0.36, 0.39)
    number, nodes = {}, []
    for i, radius in enumerate(radii):
        for j in range(1, 4) if i == 2 else range(5):
            number[i, j] = len(nodes)
            nodes.append((radius * np.cos(angles[j]), radius * np.sin(angles[j])))
    cells = [[number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]]
             for i in range(4) for j in ((1, 2) if i in (1, 2) else range(4))]
    mesh = Mesh(np.array(nodes), cells, {
        "low": [[number[0, 0], number[1, 0]]], "high": [[number[0, 4], number[1, 4]]],
        "bore": [[number[0, j], number[0, j + 1]] for j in range(4)]},
        {"tip": number[4, 2]}, cell_groups={"blade": [4, 5, 6, 7]})
    body = ElasticBody(mesh, STEEL, thickness=0.02, degree=1, fixed={"bore": "xy"})
    wheel = cyclic_basis({"s": body}, CyclicSymmetry("low", "high", sectors), modes=1,
                         points={"s.tip": "tip"}, damping=2e-5)
    hertz = np.array([np.sqrt(np.linalg.eigvalsh(one.stiffness)[0]) / TURN
                      for one in wheel.diameters])
    band = (0.9 * hertz.min(), 1.1 * hertz.max())
    found = minimize(lambda deviations: -amplification(
        WholeWheel(wheel, deviations, "s.blade"), 0, band, ("s.tip", "y")),
        START, method="Nelder-Mead", options={"maxfev": 60})
    return [Comparison("mistuned wheel, largest amplification (Whitehead 1966)",
                       whitehead_bound(sectors), -found.fun)]


def nearest(found: np.ndarray, wanted: float) -> float:
    """The found number that is nearest to the wanted one."""
    return float(found[np.argmin(np.abs(found - wanted))])


TEXT = """## Bodies that turn, are tight, or repeat

A column between hinges with Timoshenko's shear, and a warm one that touches a spring, force
(alpha DT h - gap) / (1 / k + h / (E A)). The frequencies of the cantilever are over
sqrt(E I / (m L^4)), as is its speed. The disc's number is a bound from below. The ring of sectors
is inextensional: w_n^2 = E I n^2 (n^2 - 1)^2 / (rho A R^4 (n^2 + 1)). The friction ring has 24
masses with Jenkins elements between them, of which one is computed. Deviations of the stiffness of
five blades are searched for the largest amplification; residual vectors add to the one mode of each
blade, for which the bound (1 + sqrt(N)) / 2 holds. More cases stand at the ends
of [rotation](rotation.md), [stressed bodies](stressed-bodies.md) and
[cyclic symmetry](cyclic-symmetry.md).

{rows}
"""
