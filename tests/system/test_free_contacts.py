"""Contact systems free in space: loads in balance press their parts, nothing holds them."""

import numpy as np
import pytest
import scipy.linalg as sl
from solid_blocks import block_mesh

import fecontact as fc
from fecontact import AnalysisError
from fecontact.analysis import prestressed_modes
from fecontact.fem import pair_faces
from fecontact.laws import ConstantFriction, JenkinsFriction, LinearContact
from fecontact.reduction import Spring, assembled_basis, linked, reduce_bodies

NO_FRICTION = ConstantFriction(0.0, smoothing_slope=1.0)
STIFFNESS, RATIO = 1e6, 0.8  # of the contact of two masses, and of friction to it
MASSES = 1.0, 2.0


def two_masses(force, turned=True, dimension=3):
    """Masses above each other, free in space, in coordinates that mix all their motions."""
    size, each = 2 * dimension, 3 * (dimension - 1)
    mix = np.eye(size)
    if turned:
        mix = np.linalg.qr(np.random.default_rng(7).standard_normal((size, size)))[0]
    lower, upper = np.zeros((2, each, size))
    lower[:dimension, :dimension] = np.eye(dimension)
    upper[:dimension, dimension:] = np.eye(dimension)
    mass = mix.T @ np.diag(np.repeat(MASSES, dimension)) @ mix
    basis = fc.basis_from_matrices(
        mass, np.zeros((size, size)), {"contact": ((upper - lower) @ mix)[None],
                                       "lower": lower @ mix, "upper": upper @ mix},
        dimension=dimension)
    load = fc.Load(forces=tuple(
        fc.PointLoad(point, component, signal=value) for point, component, value in force))
    return fc.ContactSystem(basis, LinearContact(STIFFNESS, 0.0),
                            JenkinsFriction(stiffness=RATIO * STIFFNESS, friction_coefficient=0.3),
                            load=load)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("turned", [False, True])
def test_two_masses_pressed_together(dimension, turned):
    up = "xyz"[dimension - 1]
    system = two_masses([("lower", up, 50.0), ("upper", up, -50.0)], turned, dimension)
    rest = fc.equilibrium(system)
    assert rest.stable
    assert rest.normal_force == pytest.approx([50.0], rel=1e-9)
    # Nothing carries the pair away.
    places = system.basis.T[:, :dimension] @ rest.modal_coordinates
    assert np.abs(places).max() < 1e-4
    history = fc.load_history(system, fc.LoadPath(steps=1, load_scale=(1.0, 1.0)))
    assert history.normal_force[-1] == pytest.approx([50.0], rel=1e-9)
    found = np.sort(prestressed_modes(system, history).frequencies_hz)
    reduced = sum(1.0 / mass for mass in MASSES)
    exact = np.sqrt(reduced * STIFFNESS * np.array([*[RATIO] * (dimension - 1), 1.0])) / (
        2.0 * np.pi)
    assert found[found > 1.0] == pytest.approx(exact, rel=1e-6)
    run = fc.simulate(system, 1e-3, initial="rest", outputs=3)
    assert run.normal_force == pytest.approx(50.0, rel=1e-6)


@pytest.mark.parametrize("force", [
    [("lower", "z", 50.0), ("upper", "z", -60.0)],
    [("lower", "z", 50.0), ("upper", "z", -50.0), ("upper", "x", 1e-3)]])
@pytest.mark.parametrize("turned", [False, True])
def test_loads_out_of_balance_are_said(force, turned):
    with pytest.raises(AnalysisError, match=r"the body against a translation.*balance the lo"):
        fc.equilibrium(two_masses(force, turned))


def blocks(angles):
    """Two blocks above each other, free, turned in space by angles [degrees]."""
    meshes = {"low": block_mesh((2, 2, 2), (0.1, 0.1, 0.05)),
              "high": block_mesh((2, 2, 3), (0.1, 0.1, 0.08)).placed(shift=(0.0, 0.0, 0.05))}
    return {name: fc.ElasticBody(mesh.placed(rotation=angles), degree=1)
            for name, mesh in meshes.items()}


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (40.0, 25.0, -10.0)])
def test_two_free_blocks_under_equal_pressures(angles):
    """Patch test without supports; modes with stuck contacts against those of the whole bodies."""
    bodies = blocks(angles)
    pairing = pair_faces(bodies, "high.contact", "low.top")
    basis = assembled_basis(reduce_bodies(bodies, [pairing], modes=16, tolerance=0.0),
                            {"joint": pairing})
    pressure, stiffness = 2e6, 4e9
    system = fc.ContactSystem(
        basis, LinearContact(stiffness, 0.0), JenkinsFriction(
            stiffness=RATIO * stiffness, friction_coefficient=0.5), load=fc.Load(boundaries=(
                fc.BoundaryLoad("low.contact", pressure), fc.BoundaryLoad("high.top", pressure))))
    rest = fc.equilibrium(system)
    assert rest.stable
    assert rest.normal_force.sum() == pytest.approx(pressure * 0.01, rel=1e-9)
    assert rest.normal_force / pairing.tributary == pytest.approx(pressure, rel=1e-6)
    history = fc.load_history(system, fc.LoadPath(steps=1, load_scale=(1.0, 1.0)))
    assert history.normal_force[-1] == pytest.approx(rest.normal_force, rel=1e-9)
    found = np.sort(prestressed_modes(system, history).frequencies_hz)
    K, M = (sl.block_diag(*(getattr(body, name).toarray() for body in bodies.values()))
            for name in ("stiffness", "mass"))
    n = basis.contact_nodes
    rows = basis.mode_shapes.restriction[12:12 + 6 * n].toarray().reshape(n, 6, -1)
    share = stiffness * pairing.tributary / pairing.tributary.sum()
    every = np.einsum("j,jai,jak->ik", share, rows[:, :3], rows[:, :3])
    along = np.einsum("j,ji,jk->ik", share, rows[:, 2], rows[:, 2])
    exact = sl.eigh(K + RATIO * every + (1.0 - RATIO) * along, M, eigvals_only=True,
                    subset_by_index=[0, 11])
    exact = np.sqrt(np.maximum(exact, 0.0)) / (2.0 * np.pi)
    assert (exact[:6] < 1.0).all()
    elastic = found[found > 1.0]
    assert elastic[:3] == pytest.approx(exact[6:9], rel=2e-3)


def slotted():
    """A free block with a slot of 1 um, open at one end, whose faces its loads press together."""
    x, z = np.linspace(0.0, 0.2, 9), np.array([0.0, 0.02, 0.02 + 1e-6, 0.04])
    mesh = fc.Mesh.grid(x, [0.0, 0.02], z).placed(rotation=(40.0, 25.0, -10.0))
    grid = fc.Mesh.grid(x, [0.0, 0.02], z)
    middle = grid.nodes[grid.cells].mean(axis=1)
    slot = (np.abs(middle[:, 2] - 0.02) < 1e-3) & (middle[:, 0] > 0.03)
    cells = mesh.cells[~slot]
    used, cells = np.unique(cells, return_inverse=True)
    cut = fc.Mesh(mesh.nodes[used], cells.reshape(-1, 8))
    flat = grid.nodes[used]
    faces = {}
    for name, height in (("low", 0.02), ("high", 0.02 + 1e-6)):
        at = np.abs(flat[:, 2] - height) < 1e-8
        faces[name] = cut.outline[at[cut.outline].all(axis=1)]
    ends = {name: int(np.linalg.norm(flat - place, axis=1).argmin())
            for name, place in (("below", (0.2, 0.0, 0.0)), ("above", (0.2, 0.0, 0.04)))}
    return fc.ElasticBody(fc.Mesh(cut.nodes, cut.cells, faces, ends), degree=1)


def test_a_slotted_body_closes_on_itself():
    """Six rigid modes move none of its contacts; against the body on soft springs."""
    body = slotted()
    pairing = pair_faces({"fork": body}, "fork.high", "fork.low")
    basis = assembled_basis(reduce_bodies(
        {"fork": body}, [pairing], modes=12, tolerance=0.0,
        each={"fork": {"points": {"below": "below", "above": "above"},
                       "loads": ["below", "above"]}}), {"slot": pairing})
    up = body.mesh.nodes[body.mesh.points["above"][0]] - body.mesh.nodes[
        body.mesh.points["below"][0]]
    up = 400.0 * up / np.linalg.norm(up)
    load = fc.Load(forces=tuple(
        fc.PointLoad(f"fork.{name}", axis, signal=sign * value)
        for name, sign in (("below", 1.0), ("above", -1.0))
        for axis, value in zip("xyz", up, strict=True)))
    hung = linked(basis, [Spring(f"fork.{name}", direction=axis, stiffness=10.0)
                          for name in ("below", "above") for axis in np.eye(3)])
    free, held = (fc.equilibrium(fc.ContactSystem(one, LinearContact(1e8, 0.0), NO_FRICTION,
                                                  load=load)) for one in (basis, hung))
    assert free.normal_force.sum() > 50.0
    assert free.normal_force == pytest.approx(held.normal_force, abs=1e-5 * held.normal_force.sum())
