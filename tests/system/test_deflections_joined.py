"""Statics with large deflections of bodies with contact, ties and couplings."""

import numpy as np
import pytest
from meshes_for_tests import grid, joined, rectangle
from scipy.integrate import quad, solve_bvp
from scipy.optimize import brentq
from solid_blocks import block_mesh

from fecontact import (
    BoundaryLoad,
    ContactSystem,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    ModelWarning,
    PointLoad,
    equilibrium,
    modal_basis,
)
from fecontact.analysis import DeflectionSteps, deflection_path
from fecontact.fem import Coupling, Tie
from fecontact.fem.finite_strain import FiniteStrainModel
from fecontact.laws import Frictionless, LinearContact, PowerContact
from fecontact.reduction import LargeDeflections
from fecontact.system.statics.contact_forces import MovingContact
from fecontact.system.statics.contact_points import ground_points
from fecontact.system.statics.deflecting_bodies import DeflectingBodies

E, L, H, B = 2e11, 1.0, 1.0 / 250.0, 0.01
STEEL = Material(E, 0.0, 7800.0)
EI = E * B * H**3 / 12.0
STOP = 1e4 * EI / L**3  # stiffness of a contact node


def elastica_on_a_stop(line, gap):
    """Force of a smooth stop below the end of a rod under a line load, and the place of the end.

    EI theta'' = -(R - q (L - s)) cos(theta), theta(0) = theta'(L) = 0, R = STOP (-gap - y(L)).
    """
    def rates(s, y, force):
        theta, curvature, _, _ = y
        return np.array([curvature, -(force[0] - line * (L - s)) * np.cos(theta) / EI,
                         np.cos(theta), np.sin(theta)])

    def ends(start, end, force):
        return np.array([start[0], start[2], start[3], end[1],
                         force[0] - STOP * (-gap - end[3])])

    s = np.linspace(0.0, L, 101)
    guess = np.array([0.0 * s, 0.0 * s, s, -gap * s**2])
    found = solve_bvp(rates, ends, s, guess, p=[3.0 * line * L / 8.0], tol=1e-8, max_nodes=50000)
    assert found.success
    return found.p[0], found.sol(L)[2:]


def test_a_cantilever_bends_onto_a_stop():
    """The beam's end, deflected by 0.3 L, lies on smooth ground, along which it moves inwards."""
    line, gap, columns = 8.0 * EI / L**3, 0.3 * L, 48
    force, (x, y) = elastica_on_a_stop(line, gap)
    body = ElasticBody(rectangle(L, H, columns, 1), STEEL, fixed={"left": "xy"}, thickness=B)
    path = deflection_path(body, Load(boundaries=(BoundaryLoad("top", pressure=line / B),)),
                           contact="bottom", gap=gap,
                           normal=LinearContact((STOP,) * (2 * columns + 1)))
    assert path.reached
    assert "nodes in contact" in str(path)
    assert np.flatnonzero(path.normal_force[-1]).size == 1
    assert path.normal_force[-1].sum() == pytest.approx(force, rel=0.01)
    end = path.displacement("right")[-1]
    assert [L + end[0], end[1]] == pytest.approx([x, y], abs=1e-3)
    assert path.penetration[0] == pytest.approx(-gap)
    assert path.normal_force == pytest.approx(STOP * np.maximum(path.penetration, 0.0))


def test_energy_is_the_work_of_the_load_on_a_stop():
    body = ElasticBody(rectangle(L, H, 20, 1), STEEL, fixed={"left": "xy"}, thickness=B)
    line = 8.0 * EI / L**3
    path = deflection_path(body, Load(boundaries=(BoundaryLoad("top", pressure=line / B),)),
                           contact="bottom", contact_nodes=5, normal=LinearContact(50.0 * STOP),
                           gap=0.2 * L, steps=DeflectionSteps(first=0.02, largest=0.02))
    moved = -path.displacement("top")[:, 1]
    work = line * L * np.trapezoid(path.load_factors, moved)
    assert path.normal_force[-1, -1] > 0.1 * line * L
    assert path.energies[-1] == pytest.approx(work, rel=2e-3)


def test_contact_forces_are_derivatives_of_the_stored_energy():
    """Nodes on a face that a coupling turns, with a law that is not linear, by differences."""
    mesh = block_mesh((3, 2, 2), (0.1, 0.04, 0.03))
    body = ElasticBody(Mesh(mesh.nodes, mesh.cells, mesh.boundaries, constraints=(
        Coupling("contact", "hub", (0.05, 0.01, 0.0)),)), STEEL, fixed={"top": "xyz"}, degree=1)
    law, model = PowerContact(3e12, 1.5), FiniteStrainModel(body)
    rng = np.random.default_rng(4)
    q, v = rng.normal(size=(2, model.expansion.shape[1]))
    turn = body.motion_rows("hub")[3:] @ (body.expansion @ q)
    q *= 0.3 / np.linalg.norm(turn)
    def above(gap):
        points = ground_points(body, "contact", (3, 2), law, None, gap)[0]
        return MovingContact(body.nodes, points)

    moved = above(0.0).accept(model.displacement(q)).penetration
    both = DeflectingBodies({"": model}, [above(float(np.median(moved)))])
    depth = moved - np.median(moved)
    assert 0 < (depth > 0.0).sum() < len(depth)
    h = 1e-6 * np.linalg.norm(q) / np.linalg.norm(v)
    state, ahead, behind = ([one.state(at) for one in (both, model)]
                            for at in (q, q + h * v, q - h * v))
    energies = [one[0].energy - one[1].energy for one in (state, ahead, behind)]
    forces = [one[0].force - one[1].force for one in (state, ahead, behind)]
    assert energies[0] > 0.0
    assert forces[0] @ v == pytest.approx((energies[1] - energies[2]) / (2.0 * h), rel=1e-5)
    slope = (forces[1] - forces[2]) / (2.0 * h)
    found = (state[0].tangent - state[1].tangent) @ v
    assert found == pytest.approx(slope, abs=1e-4 * np.abs(slope).max())


def clamped(kind):
    """A clamped beam above ground."""
    held = {"left": "xyz", "right": "xyz"}
    if kind == "bricks":
        return ElasticBody(block_mesh((40, 1, 1), (L, B, H)), STEEL, fixed=held, degree=1,
                           bricks="incompatible")
    return ElasticBody(rectangle(L, H, 30, 1), STEEL, thickness=B,
                       fixed={"left": "xy", "right": "xy"})


@pytest.mark.parametrize("kind", ["plane", "bricks"])
def test_a_stretched_beam_is_pressed_on_the_ground(kind):
    """The reduced model of three modes with its companions has the same contact forces."""
    body = clamped(kind)
    load = Load(boundaries=(BoundaryLoad("top", pressure=5e3),))
    face, count = ("bottom", 9) if kind == "plane" else ("contact", (9, 1))
    laws = {"normal": LinearContact(2e5), "gap": 0.8 * H}
    path = deflection_path(body, load, contact=face, contact_nodes=count, **laws)
    basis = modal_basis(body, 5, contact=face, contact_nodes=count, reduction="residual",
                        loads=("top",), tolerance=0.0, B="", C="",
                        large_deflections=LargeDeflections(
                            1.2 * H, (0, 2) if kind == "plane" else (0, 3)))
    rest = equilibrium(ContactSystem(basis, friction=Frictionless(), load=load, **laws))
    forces, found = path.normal_force[-1], rest.normal_force[: path.normal_force.shape[1]]
    assert np.count_nonzero(forces) >= 1
    assert found.sum() == pytest.approx(forces.sum(), rel=0.02)
    assert found == pytest.approx(forces, abs=0.03 * forces.max())
    # Linear forces alone press far harder.
    linear = modal_basis(body, 5, contact=face, contact_nodes=count, reduction="residual",
                         loads=("top",), tolerance=0.0, B="", C="")
    soft = equilibrium(ContactSystem(linear, friction=Frictionless(), load=load, **laws))
    assert soft.normal_force.sum() > 1.1 * forces.sum()


def test_contacts_press_without_load():
    """A preloaded spring under each node lifts a beam: c (u_0 - w) = K w, before any load."""
    body = ElasticBody(rectangle(L, H, 16, 1, points={"end": (L, 0.0)}), STEEL,
                       fixed={"left": "xy"}, thickness=B)
    small = 1e-3 * EI / L**2
    path = deflection_path(body, Load(forces=(PointLoad("end", "y", signal=-small),)),
                           contact="bottom", contact_nodes=1,
                           normal=LinearContact(1e-3 * EI / L**3, preload=small))
    moved = -path.penetration[:, 0]
    # Mean deflection under a line load p: p L^4 / (20 EI); a force P at the end: P L^3 / (8 EI).
    soft = 1e-3 / 20.0
    assert moved[0] == pytest.approx(small * L**3 / (20.0 * EI) / (1.0 + soft), rel=4e-3)
    assert path.normal_force[0, 0] == pytest.approx(
        small - 1e-3 * EI / L**3 * moved[0], rel=1e-9)
    assert moved[-1] == pytest.approx(moved[0] - small * L**3 / (8.0 * EI), rel=4e-3)
    still = deflection_path(body, Load(), contact="bottom", contact_nodes=1,
                            normal=LinearContact(1e-3 * EI / L**3, preload=small))
    assert -still.penetration[:, 0] == pytest.approx([moved[0], moved[0]], rel=1e-9)


def test_contact_that_does_not_fit_is_refused():
    body = clamped("plane")
    load, law = Load(normal=0.0), LinearContact(1e5)
    for options, told in (
            ({"contact": "bottom"}, "lacks normal"),
            ({"normal": law}, "there are none"),
            ({"contact": "bottom", "normal": {"botom": law}}, "did you mean 'bottom'"),
            ({"contact": "bottom", "normal": {}}, "lacks a law for the face 'bottom'"),
            ({"contact": "bottom", "normal": Frictionless()}, "normal"),
            ({"contact": "bottom", "normal": law, "gap": (0.0, 1.0)}, "gap"),
            ({"contact": "top", "normal": law}, "does not face")):
        with pytest.raises(InputError, match=told):
            deflection_path(body, load, **options)


def ends(counts, factor, *constraints, points=None, name="two.right"):
    """Displacement of the end of a tied cantilever under the force factor EI / L^2."""
    halves = [rectangle(0.5 * L, H, *each) for each in counts]
    mesh = joined(halves[0], halves[1].placed((0.5 * L, 0.0)), constraints, points)
    body = ElasticBody(mesh, STEEL, fixed={"one.left": "xy"}, thickness=B)
    load = Load(boundaries=(BoundaryLoad(name, shear=factor * EI / L**2 / (H * B)),))
    return deflection_path(body, load).displacement(name)[-1]


@pytest.mark.parametrize("counts", [((24, 1), (24, 1)), ((24, 2), (24, 3)), ((24, 3), (24, 2))])
def test_a_tied_elastica(counts):
    """P L^2 / EI = 5 bends the seam by some 60 degrees: 0.38763 L in, 0.71379 L (Mattiasson)."""
    x, y = ends(counts, 5.0, Tie("one.right", "two.left"))
    whole = deflection_path(
        ElasticBody(rectangle(L, H, 48, 1), STEEL, fixed={"left": "xy"}, thickness=B),
        Load(boundaries=(BoundaryLoad("right", shear=5.0 * EI / L**2 / (H * B)),)))
    matching = counts[0][1] == counts[1][1] == 1
    assert [x, y] == pytest.approx(whole.displacement("right")[-1], rel=1e-6 if matching else 5e-3)
    assert [-x, y] == pytest.approx([0.38763, 0.71379], rel=8e-3)


def coupled(kind, factor, columns=48):
    """Reference point of a coupling that carries a force to the end of a cantilever."""
    mesh = rectangle(L, H, columns, 1)
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries,
                constraints=(Coupling("right", "hub", (L, 0.5 * H), kind),))
    body = ElasticBody(mesh, STEEL, fixed={"left": "xy"}, thickness=B)
    load = Load(forces=(PointLoad("hub", "y", signal=factor * EI / L**2),))
    return deflection_path(body, load).displacement("hub")[-1]


def test_a_force_on_a_distributing_coupling():
    """A distributing coupling spreads the force and adds no stiffness.

    Mattiasson's cantilever at P L^2 / EI = 2.
    """
    with pytest.warns(ModelWarning, match=r"turns by 0\.\d+ rad"):
        x, y = coupled("distributing", 2.0)
    assert [-x, y] == pytest.approx([0.16064, 0.49346], rel=4e-3)


def middle_of_a_stretched_beam(force):
    """Deflection w of a clamped beam under a force P in its middle, with its own tension N.

    w = P L / (4 N) (1 - tanh(b) / b), b = k L / 4, k^2 = N / EI.
    """
    def excess(N):
        k = np.sqrt(N / EI)
        slope = quad(lambda x: (1.0 - np.cosh(k * (x - 0.25 * L)) / np.cosh(0.25 * k * L))**2,
                     0.0, 0.5 * L)[0]
        return E * B * H / L * (0.5 * force / N)**2 * slope - N

    N = brentq(excess, 1e-3 * EI, 1e5 * EI, rtol=1e-12)
    b = 0.25 * L * np.sqrt(N / EI)
    return force * L / (4.0 * N) * (1.0 - np.tanh(b) / b)


@pytest.mark.parametrize("kind", ["kinematic", "distributing"])
def test_a_coupling_carries_the_force_of_a_stretched_beam(kind):
    """In the middle of a clamped beam, where it does not turn, deflected by 1.6 thicknesses."""
    force = 60.0
    mesh = rectangle(0.5 * L, H, 24, 1)
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries,
                constraints=(Coupling("right", "hub", (0.5 * L, 0.5 * H), kind),))
    body = ElasticBody(mesh, STEEL, thickness=B, fixed={"left": "xy", "hub": "x phi"})
    path = deflection_path(body, Load(forces=(PointLoad("hub", "y", signal=0.5 * force),)))
    exact = middle_of_a_stretched_beam(force)
    assert exact > H
    assert path.displacement("hub")[-1, 1] == pytest.approx(exact, rel=0.01)


def test_an_arch_snaps_onto_the_ground():
    """Along the arc, past both limit points of Fung and Kaplan (NACA TN 2840, 1952), to a stop.

    Of rise a it carries (a - b) + b (a^2 - b^2) / 4 in units of EI r (pi / L)^4 at the rise b,
    in radii of gyration, with limits at b^2 = (a^2 - 4) / 3, until it touches at b = a - 8.
    """
    a, h = 5.0, 0.01
    r = h / np.sqrt(12.0)

    def warp(at):
        return at + np.column_stack([0.0 * at[:, 0], a * r * np.sin(np.pi * at[:, 0] / L)])

    mesh = grid(np.linspace(0.0, 0.5 * L, 25), np.linspace(-0.5 * h, 0.5 * h, 3), warp=warp,
                points={"end": (0.0, 0.0)})
    body = ElasticBody(mesh, STEEL, fixed={"end": "xy", "right": "x"}, thickness=B)
    line = E * B * h**3 / 12.0 * r * (np.pi / L)**4
    whole = 16.0
    # A uniform load has the sinusoidal part 4 / pi.
    load = Load(boundaries=(BoundaryLoad("top", pressure=whole * line / B * np.pi / 4.0),))
    path = deflection_path(body, load, contact="bottom", contact_nodes=24, gap=8.0 * r,
                           normal=LinearContact(1e7), steps=DeflectionSteps("arc", largest=0.3))
    assert path.reached
    b = a + path.displacement("right")[:, 1] / r
    carried, touches = whole * path.load_factors, path.normal_force.sum(axis=1) > 0.0
    turning = np.sqrt((a**2 - 4.0) / 3.0)
    limits = [(a - at) + at * (a**2 - at**2) / 4.0 for at in (turning, -turning)]
    assert [carried[~touches].max(), carried[~touches].min()] == pytest.approx(limits, rel=0.06)
    assert (path.unstable[np.abs(b) < 0.9 * turning] == 1).all()
    assert (path.unstable[touches & (b < -1.1 * turning)] == 0).all()
    assert b[touches] == pytest.approx(np.full(touches.sum(), a - 8.0), abs=0.15)
    assert (np.diff(path.normal_force[touches].sum(axis=1)) > 0.0).all()
