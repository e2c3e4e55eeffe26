"""Buckling loads, and modes of bodies under static stress."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from solid_blocks import block_body, block_mesh

from fecontact import (
    AnalysisError,
    BoundaryLoad,
    ContactSystem,
    ElasticBody,
    InputError,
    Load,
    LoadPath,
    Material,
    equilibrium,
    load_history,
    modal_basis,
    static_solution,
)
from fecontact.analysis import buckling_loads, prestressed_modes
from fecontact.fem import BodyFields
from fecontact.fem.fields import stress_of
from fecontact.laws import JenkinsFriction, LinearContact
from fecontact.reduction import eigenfrequencies_hz

# Without lateral contraction a column under pressure has uniform stress at its supports too.
SOFT = Material(2.0e9, 0.0, 1000.0)
L, H = 1.0, 0.05
PRESSED = Load(boundaries=(BoundaryLoad("right", pressure=1e6),))


def column(columns, degree=2, triangles=False, rows=1):
    """Half of a column between hinges: its left end is the middle."""
    mesh = rectangle(L, H, columns, rows, triangles=triangles, points={"corner": (0.0, 0.0)})
    return ElasticBody(mesh, SOFT, fixed={"left": "x", "corner": "y"}, degree=degree)


def solid_column(columns, degree=2, bricks=None, tetrahedra=False):
    mesh = block_mesh((columns, 1, 1), (L, 0.06, H), tetrahedra=tetrahedra)
    return ElasticBody(mesh, SOFT, fixed={"left": "xyz"}, degree=degree, bricks=bricks)


EULER = np.pi**2 / 4.0 * SOFT.youngs_modulus * H**2 / 12.0 / L**2  # stress, of one half


def test_euler_column_in_the_plane():
    """Quadratic elements converge with the order four of energies to a load below Euler's.

    Timoshenko's shear lowers it by the factor 1 + 1.2 P / (G A), G = E / 2.
    """
    found = [buckling_loads(column(n), PRESSED, 1).load_factors[0] for n in (8, 16, 32, 128)]
    errors = np.array(found[:3]) / found[3] - 1.0
    assert (errors > 0.0).all()
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4.0, abs=0.3)
    stress = found[3] * 1e6
    shear = 1.0 + 1.2 * EULER / (0.5 * SOFT.youngs_modulus)
    assert stress == pytest.approx(EULER / shear, rel=5e-4)


@pytest.mark.parametrize("body", [
    lambda: solid_column(20), lambda: solid_column(80, 1, "incompatible"),
    lambda: solid_column(20, tetrahedra=True)], ids=["Q2", "incompatible", "P2"])
def test_euler_column_in_space(body):
    """Buckling is first about the weak axis, then about the strong one, 1.44 times as stiff."""
    found = buckling_loads(body(), PRESSED, 2)
    assert found.load_factors * 1e6 == pytest.approx([EULER, 1.44 * EULER], rel=3e-3)
    tip = np.abs(found.shapes[found.state.nodes[:, 0] > L - 1e-9]).max(axis=0)
    assert tip.argmax(axis=0).tolist() == [2, 1]
    assert np.abs(found.shapes).max() == 1.0


def test_tension_makes_nothing_buckle():
    pulled = Load(boundaries=(BoundaryLoad("right", pressure=-1e6),))
    for body in (column(8), column(200)):
        found = buckling_loads(body, pulled, 3)
        assert not len(found.load_factors)
        assert "none" in str(found)
    for body in (column(8), column(200)):  # by the dense and by the iterative solver
        found = buckling_loads(body, Load(boundaries=(BoundaryLoad("right", pressure=0.0),)), 3)
        assert not len(found.load_factors)
        assert not found.state.stress.any()
    free = ElasticBody(rectangle(L, H, 8, 1), SOFT)
    with pytest.raises(InputError, match="supports hold"):
        buckling_loads(free, Load())
    with pytest.raises(InputError, match="count = 0 must be a whole number, 1 or above"):
        buckling_loads(column(2), PRESSED, 0)


def stretched(body, strain):
    """A uniform strain along x as a static state."""
    u = np.zeros(body.nodes.shape)
    u[:, 0] = strain * body.nodes[:, 0]
    return BodyFields(body.nodes, body.elements, u, stress_of(body, u.reshape(-1, 1))[..., 0])


@pytest.mark.parametrize("space", [False, True])
def test_tension_of_a_beam_between_guides(space):
    """w^2 = w_0^2 + sigma k^2 / rho, exact for waves k = n pi / L of any kind of motion."""
    if space:
        body = ElasticBody(block_mesh((24, 1, 1), (L, 0.08, H)), SOFT, fixed={
            "left": "x", "right": "x", "front": "y"})
    else:
        mesh = rectangle(L, H, 24, 1)
        body = ElasticBody(mesh, SOFT, fixed={"left": "x", "right": "x"})
    basis, still = (modal_basis(body, 4, contact=(), prestress=state) for state in (
        stretched(body, 2e-3), None))
    assert basis.stiffness is None
    first = still.rigid_modes
    sigma = 2e-3 * SOFT.youngs_modulus
    n = np.arange(1, 4 - first + 1)[: 4 - first]
    expected = still.angular_frequencies[first:] ** 2 + sigma * (n * np.pi / L) ** 2 / SOFT.density
    assert basis.angular_frequencies[first:] ** 2 == pytest.approx(expected, rel=1e-5)
    assert basis.quality.residuals.max() < 1e-9
    assert 2.0 * basis.angular_frequencies[first] > 2.2 * still.angular_frequencies[first]


def test_frequency_vanishes_at_the_buckling_load():
    """The square of the lowest frequency is about linear in the load, and zero there."""
    body = column(16)
    factor = float(buckling_loads(body, PRESSED, 1).load_factors[0])
    still = eigenfrequencies_hz(body, 1)[0]
    for part in (0.5, 0.99):
        load = Load(boundaries=(BoundaryLoad("right", pressure=1e6 * part * factor),))
        basis = modal_basis(body, 2, contact=(), prestress=static_solution(body, load))
        assert (basis.frequencies_hz[0] / still) ** 2 == pytest.approx(1.0 - part, abs=2.5e-2)
    beyond = Load(boundaries=(BoundaryLoad("right", pressure=1.01e6 * factor),))
    with pytest.raises(AnalysisError, match="beyond the buckling load"):
        modal_basis(body, 2, contact=(), prestress=static_solution(body, beyond))


def test_pressed_contact_softens_by_the_stress_of_the_body():
    """A column pressed on the ground, iterated, has the modes of one that is fixed there."""
    mesh = rectangle(H, L, 1, 12)
    load = Load(boundaries=(BoundaryLoad("top", pressure=0.7 * EULER),))
    fixed = ElasticBody(mesh, SOFT, fixed={"bottom": "xy", "top": "x"})
    expected = modal_basis(fixed, 3, contact=(), prestress=static_solution(fixed, load))
    body = ElasticBody(mesh, SOFT, fixed={"top": "x"})
    options = {"contact": "bottom", "reduction": "residual", "loads": ["top"], "tolerance": 0.0}
    state, frequencies = None, []
    for _ in range(3):
        basis = modal_basis(body, 8, prestress=state, **options)
        system = ContactSystem(basis, normal=LinearContact(1e12),
                               friction=JenkinsFriction(1e12, 0.5), load=load)
        rest = equilibrium(system)
        state = basis.fields(rest.modal_coordinates)
        found = prestressed_modes(system, load_history(system, LoadPath(load_scale=(0.1, 1.0))))
        frequencies.append(found.frequencies_hz[0])
    assert frequencies[1:] == pytest.approx([expected.frequencies_hz[0]] * 2, rel=5e-4)
    assert frequencies[0] > 1.03 * frequencies[1]


def test_bodies_without_a_prestressed_state():
    body = column(4)
    state = static_solution(body, PRESSED)
    with pytest.raises(InputError, match=r"shape .* same body"):
        modal_basis(column(3), 2, contact=(), prestress=state)
    hinged = ElasticBody(rectangle(L, H, 4, 1), SOFT, fixed={"left": "hinge"})
    with pytest.raises(InputError, match="without hinges"):
        modal_basis(hinged, 2, contact=(), prestress=state)
    free = block_body((2, 1, 1), material=SOFT)
    basis = modal_basis(free, 8, contact=(), prestress=stretched(free, 1e-3))
    assert basis.stiffness is not None
    assert basis.rigid_modes == 6
