"""Statics with large deflections against beam theory: elastica, stretching, arches, pressure."""

import numpy as np
import pytest
from meshes_for_tests import grid, rectangle
from scipy.integrate import quad
from scipy.optimize import brentq
from solid_blocks import block_mesh

from fecontact import (
    BoundaryLoad,
    ElasticBody,
    InputError,
    Load,
    Material,
    ModelWarning,
    PointLoad,
)
from fecontact.analysis import DeflectionSteps, deflection_path
from fecontact.fem.fields import BodyFields
from fecontact.fem.finite_strain import FiniteStrainModel
from fecontact.fem.load_steps import follow

E, L, H, B = 2e11, 1.0, 1.0 / 250.0, 0.01
STEEL = Material(E, 0.0, 7800.0)
EI = E * B * H**3 / 12.0
# Mattiasson, Int. J. Numer. Meth. Eng. 17 (1981): P L^2 / EI, and shortening and deflection of the
# end by L.
MATTIASSON = {1.0: (0.05643, 0.30172), 2.0: (0.16064, 0.49346), 5.0: (0.38763, 0.71379),
              10.0: (0.55500, 0.81061)}


def cantilever(columns):
    return ElasticBody(rectangle(L, H, columns, 1), STEEL, fixed={"left": "xy"}, thickness=B)


def end_load(factor):
    return Load(boundaries=(BoundaryLoad("right", shear=factor * EI / L**2 / (H * B)),))


def test_elastica():
    """A cantilever under a force at its end, which keeps its direction, in steps of one path."""
    path = deflection_path(cantilever(48), end_load(10.0), steps=DeflectionSteps(largest=0.1))
    assert path.reached
    assert not path.unstable.any()
    assert "reached" in str(path)
    for factor, exact in MATTIASSON.items():
        end = (path if factor == 10.0 else deflection_path(cantilever(48), end_load(factor))
               ).displacement("right")[-1]
        assert [-end[0], end[1]] == pytest.approx(exact, rel=4e-3)
    # The work of the load is the strain energy.
    moved = path.displacement("right")[:, 1]
    force = 10.0 * EI / L**2 * path.load_factors
    assert path.energies[-1] == pytest.approx(np.trapezoid(force, moved), rel=0.01)


def test_true_stress_of_a_uniform_deformation():
    """F S F^T / det F of a stretched, sheared and turned plate, at every node."""
    body = ElasticBody(grid(np.linspace(0.0, 2.0, 4), np.linspace(0.0, 1.0, 3)), thickness=0.1)
    F = np.array([[0.3, -1.2], [1.1, 0.4]])
    S = np.array([[3.0, 0.5], [0.5, -1.0]])
    fields = BodyFields(body.nodes, body.elements, body.nodes @ (F - np.eye(2)).T,
                        np.tile([3.0, -1.0, 2.0, 0.5], (len(body.nodes), 1)))
    J = np.linalg.det(F)
    (xx, xy), (_, yy) = F @ S @ F.T / J
    expected = np.tile([xx, yy, 2.0 / J, xy], (len(body.nodes), 1))
    assert fields.cauchy_stress == pytest.approx(expected, rel=1e-12)


def test_stress_of_a_deflected_cantilever():
    """The outer fibres carry the moment of the force about them, in axes that turn with the rod."""
    path = deflection_path(cantilever(96), end_load(2.0))
    fields, end = path.fields(), path.displacement("right")[-1]
    force = 2.0 * EI / L**2
    for x in (0.25, 0.5):
        node = int(np.argmin(np.linalg.norm(fields.nodes - [x, H], axis=1)))
        arm = L + end[0] - x - fields.displacement[node, 0]
        exact = -6.0 * force * arm / (B * H**2)
        assert fields.stress[node, 0] == pytest.approx(exact, rel=0.01)
        assert np.abs(fields.stress[node, 1:]).max() < 0.01 * abs(exact)
        # The true stress acts along the rod, which is at the angle of its nodes.
        xx, yy, _, xy = fields.cauchy_stress[node]
        assert xx + yy == pytest.approx(exact, rel=0.015)
        ahead = int(np.argmin(np.linalg.norm(fields.nodes - [x + 1.0 / 48.0, H], axis=1)))
        along = (fields.nodes + fields.displacement)[[node, ahead]]
        slope = np.arctan2(*np.diff(along, axis=0)[0, ::-1])
        assert slope > 0.3
        assert 0.5 * np.arctan2(-2.0 * xy, yy - xx) == pytest.approx(slope, abs=0.05)
    with pytest.raises(InputError, match="state = 99"):
        path.fields(99)


def test_quadratic_elements_converge_to_the_elastica():
    """With the order four of energies, from the stiff side."""
    ends = [deflection_path(cantilever(n), end_load(1.0)).displacement("right")[-1, 1]
            for n in (16, 32, 128)]
    errors = 1.0 - np.array(ends[:2]) / ends[2]
    assert (errors > 0.0).all()
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)


def stretched_shape(load, N):
    """Wave number and factor of the shape of a clamped beam under a line load and a tension."""
    k = np.sqrt(N / EI)
    return k, load * L / (2.0 * N * k * np.sinh(0.5 * k * L))


def stretched_tension(load):
    """Tension [N] of a clamped beam under a line load [N/m]."""
    def excess(N):
        k, C = stretched_shape(load, N)
        stretch = quad(lambda x: (C * k * np.sinh(k * x) - load * x / N)**2, 0.0, 0.5 * L)[0] / L
        return E * B * H * stretch - N

    return brentq(excess, 1e-3 * EI, 1e5 * EI, rtol=1e-12)


def stretched_beam(load):
    """Deflection in the middle of a clamped beam under a line load [N/m]."""
    N = stretched_tension(load)
    k, C = stretched_shape(load, N)
    return C * (1.0 - np.cosh(0.5 * k * L)) + load * L**2 / (8.0 * N)


def halves(kind):
    """Half a clamped beam, the middle at the right."""
    if kind == "plane":
        return ElasticBody(rectangle(0.5 * L, H, 32, 1), STEEL, thickness=B,
                           fixed={"left": "xy", "right": "x"})
    size, fixed = (0.5 * L, B, H), {"left": "xyz", "right": "x"}
    mesh = block_mesh({"bricks": (64, 1, 1), "Q2": (24, 1, 1)}[kind], size)
    return ElasticBody(mesh, STEEL, fixed=fixed, **(
        {"degree": 1, "bricks": "incompatible"} if kind == "bricks" else {}))


@pytest.mark.parametrize("kind", ["plane", "bricks", "Q2"])
def test_clamped_beam_stretches(kind):
    """Von Karman's beam in closed form, up to deflections of 1.8 thicknesses."""
    for thick in (0.5, 1.8):
        line = brentq(lambda q, thick=thick: stretched_beam(q) - thick * H, 1.0, 1e4)
        loads = Load(boundaries=(BoundaryLoad("top", pressure=-line / B),))
        path = deflection_path(halves(kind), loads, steps=DeflectionSteps(first=0.5))
        assert path.displacement("right")[-1, -1] == pytest.approx(thick * H, rel=0.01)
    # The mean of the stress over the height in the middle is that of the tension.
    fields = path.fields()
    end = fields.nodes[:, 0] > 0.5 * L - 1e-9
    stress, tension = fields.stress[end, 0], stretched_tension(line) / (B * H)
    assert 0.5 * (stress.max() + stress.min()) == pytest.approx(tension, rel=0.03)


def arch(rise):
    """Half of a shallow sinusoidal arch between hinges, the middle at the right."""
    def warp(at):
        return at + np.column_stack([0.0 * at[:, 0], rise * np.sin(np.pi * at[:, 0] / L)])

    h = 0.01
    mesh = grid(np.linspace(0.0, 0.5 * L, 25), np.linspace(-0.5 * h, 0.5 * h, 3), warp=warp,
                points={"end": (0.0, 0.0)})
    return ElasticBody(mesh, STEEL, fixed={"end": "xy", "right": "x"}, thickness=B), h


def test_snap_through_of_a_shallow_arch():
    """Both limit points, with the rises a, without load, and b in radii of gyration r.

    Fung and Kaplan (NACA TN 2840, 1952): under a sinusoidal load the rise b sin(pi x / L) carries
    p = (a - b) + b (a^2 - b^2) / 4 in units of EI r (pi / L)^4, with limits at b^2 = (a^2 - 4) / 3.
    """
    a = 5.0
    body, h = arch(a * 0.01 / np.sqrt(12.0))
    r, bending = h / np.sqrt(12.0), E * B * h**3 / 12.0
    model = FiniteStrainModel(body)
    unit = bending * r * (np.pi / L)**4
    forces = np.zeros(body.nodes.shape)
    top = body.group_nodes("top")
    order = top[np.argsort(body.nodes[top, 0])]
    x = body.nodes[order, 0]
    forces[order, 1] = -np.sin(np.pi * x / L) * np.gradient(x) * unit
    forces[order[[0, -1]], 1] *= 0.5
    largest = 20.0
    dead = largest * model.free(forces.ravel())
    path = follow(model, lambda q: (dead, None), DeflectionSteps("arc", largest=0.2))
    assert path.reached
    load = largest * np.array([one.factor for one in path.points])
    middle = body.group_nodes("right")
    b = a + np.array([model.displacement(one.q)[middle, 1].mean() for one in path.points]) / r
    expected = (a - b) + b * (a**2 - b**2) / 4.0
    assert load == pytest.approx(expected, abs=0.02 * expected.max())
    turning = np.sqrt((a**2 - 4.0) / 3.0)
    inside = np.abs(b) < 0.9 * turning
    assert inside.sum() > 5
    unstable = np.array([one.unstable for one in path.points])
    assert (unstable[inside] == 1).all()
    assert (unstable[np.abs(b) > 1.1 * turning] == 0).all()
    # Load steps stop at the limit point and say so.
    stopped = follow(model, lambda q: (dead, None), DeflectionSteps(smallest=1e-3, most=60))
    if stopped.reached:
        assert stopped.points[-1].q @ dead == pytest.approx(path.points[-1].q @ dead, rel=1e-3)
    else:
        assert "arc" in stopped.message


def test_follower_pressure_turns_with_a_cantilever():
    """Against the equations of the inextensible rod under pressure normal to it.

    EI theta'' = f_x sin(theta) - f_y cos(theta) with the force f of the part beyond s.
    """
    from scipy.integrate import solve_bvp

    p = 4.0 * EI / L**3  # [N/m]

    def rates(s, y):
        theta, curvature, fx, fy = y
        return np.array([curvature, (fx * np.sin(theta) - fy * np.cos(theta)) / EI,
                         p * np.sin(theta), -p * np.cos(theta)])

    def ends(start, end):
        return np.array([start[0], end[1], end[2], end[3]])

    s = np.linspace(0.0, L, 201)
    found = solve_bvp(rates, ends, s, np.zeros((4, 201)), tol=1e-8)
    assert found.success
    theta = found.sol(s)[0]
    place = [np.trapezoid(f(theta), s) for f in (np.cos, np.sin)]
    load = Load(boundaries=(BoundaryLoad("bottom", pressure=p / B),))
    path = deflection_path(cantilever(48), load, follower=True)
    end = path.displacement("right")[-1]
    assert [L + end[0], end[1]] == pytest.approx(place, abs=3e-3)
    dead = deflection_path(cantilever(48), load).displacement("right")[-1]
    assert abs(dead[1] - end[1]) > 0.02


def test_limits_are_said():
    body = cantilever(8)
    with pytest.warns(ModelWarning, match="strain reaches"):
        deflection_path(ElasticBody(rectangle(L, 0.2, 8, 2), STEEL, fixed={"left": "xy"}),
                        Load(boundaries=(BoundaryLoad("right", shear=2e8),)))
    with pytest.warns(ModelWarning, match="in 2 steps"):
        deflection_path(body, end_load(5.0), steps=DeflectionSteps(most=2))
    free = ElasticBody(rectangle(L, H, 8, 1), STEEL)
    with pytest.raises(InputError, match="rigid motions"):
        deflection_path(free, end_load(1.0))
    with pytest.raises(InputError, match="first = 2"):
        DeflectionSteps(first=2.0)
    with pytest.raises(InputError, match="by = 'riks'"):
        DeflectionSteps(by="riks")
    still = deflection_path(body, Load())
    assert still.reached
    assert not still.displacements.any()


def test_forces_at_points():
    """A force at a point of the mesh acts as the same shear over the end, but nearby."""
    mesh = rectangle(L, H, 40, 1, points={"end": (L, 0.0)})
    body = ElasticBody(mesh, STEEL, fixed={"left": "xy"}, thickness=B)
    found = deflection_path(body, Load(forces=(PointLoad("end", "y", signal=2.0 * EI / L**2),)))
    assert found.displacement("end")[-1, 1] == pytest.approx(0.49346, rel=3e-3)
