"""Contact nodes with the compliance of half-spaces: patches, Hertz, shear, responses, pairs."""

from dataclasses import replace

import numpy as np
import pytest

import fecontact as fc
from fecontact.core.errors import InputError
from fecontact.fem import Coupling, SolidBlock, pair_faces
from fecontact.fem.elements.cell_kinds import padded, widths
from fecontact.half_space import half_space_contact, half_space_friction
from fecontact.laws import ConstantFriction, HeightMap, LinearContact
from fecontact.reduction import reduce_bodies, with_half_space

RADIUS, WIDTH, MU = 0.05, 1e-3, 0.3
# Mean displacement of the square of 4 mm under 1 N along x, y, z [nm]: extrapolated from elements
# of second order of 2, 1 and 2/3 mm, with the rate 2.2.
SQUARE = np.array([1.907, 1.907, 0.8447])


def block(nx, nz, shift=0.0):
    """A block of 12 x 12 x 8 mm, with a square of 4 mm in the middle of its bottom as contact."""
    x, z = np.linspace(-6e-3, 6e-3, nx + 1), np.linspace(0.0, 8e-3, nz + 1) + shift
    mesh = fc.Mesh.grid(x, x, z)
    bottom = mesh.boundaries["bottom"]
    inside = (np.abs(mesh.nodes[bottom].mean(axis=1)[:, :2]) < 2e-3).all(axis=1)
    return replace(mesh, boundaries={"contact": bottom[inside], "top": mesh.boundaries["top"]})


def held(nx, nz, degree, **how):
    return fc.ElasticBody(block(nx, nz), degree=degree, fixed={"top": "xyz"}, **how)


def uniform(basis):
    """Mean displacement along x, y, z of the contact under 1 N along each [nm]."""
    share = basis.tributary / basis.tributary.sum()
    w = basis.angular_frequencies
    T = np.einsum("n,nam->am", share, basis.contact_T[:, :3])
    elastic = w > 0.0
    return 1e9 * ((T[:, elastic] / w[elastic]) ** 2).sum(axis=1)


@pytest.mark.parametrize(("nx", "nz", "degree", "error", "before"), [
    (6, 4, 1, [0.013, 0.013, 0.007], 0.12), (12, 8, 1, [0.006, 0.006, 0.003], 0.04),
    (6, 4, 2, [0.003, 0.003, 0.002], 0.014), (9, 6, 2, [0.002, 0.002, 0.002], 0.005),
    (6, 4, "serendipity", [0.004, 0.004, 0.002], 0.014)])
def test_even_load_on_a_patch(nx, nz, degree, error, before):
    """To 1.3 % with two linear elements along the patch, which alone are 13 and 17 % too stiff."""
    body = (held(nx, nz, 2, bricks=degree) if degree == "serendipity" else held(nx, nz, degree))
    basis = fc.modal_basis(body, 8)
    found = uniform(with_half_space(basis, body))
    assert (np.abs(found / SQUARE - 1.0) < error).all()
    alone = uniform(fc.modal_basis(body, 8, reduction="residual", tolerance=0.0))
    assert (alone / SQUARE - 1.0 < -before).all()


@pytest.mark.parametrize(("degree", "error", "before"), [
    (1, [0.012, 0.012, 0.005], 0.09), (2, [0.002, 0.002, 0.002], 0.008)])
def test_even_load_on_tetrahedra(degree, error, before):
    """Patches of triangles; linear tetrahedra alone are 9 and 13 % too stiff."""
    mesh = fc.generate(SolidBlock(0.012, 0.012, 0.008, element_size=1e-3, element="tetrahedron"))
    bottom = mesh.boundaries["contact"]
    inside = (np.abs(mesh.nodes[bottom].mean(axis=1)[:, :2] - 6e-3) < 2e-3).all(axis=1)
    mesh = replace(mesh, boundaries={"contact": bottom[inside], "top": mesh.boundaries["top"]})
    body = fc.ElasticBody(mesh, degree=degree, fixed={"top": "xyz"})
    basis, alone = (fc.modal_basis(body, 8, contact_nodes=(2, 2), **how) for how in (
        {}, {"reduction": "residual", "tolerance": 0.0}))
    found = uniform(with_half_space(basis, body))
    assert (np.abs(found / SQUARE - 1.0) < error).all()
    assert (uniform(alone) / SQUARE - 1.0 < -before).all()


@pytest.mark.parametrize(("nx", "nz", "degree", "error", "before"), [
    (6, 4, 1, [0.015, 0.015, 0.01], 0.1), (6, 4, 2, [0.004, 0.004, 0.003], 0.01)])
def test_even_load_on_triangles_and_quadrilaterals(nx, nz, degree, error, before):
    """Hexahedra beside wedges: half of the patch are triangles."""
    whole = block(nx, nz)
    left = whole.nodes[whole.cells].mean(axis=1)[:, 1] < 0.0
    cells = padded([whole.cells[left], *(whole.cells[~left][:, list(part)] for part in (
        (0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)))])
    outline = fc.Mesh(whole.nodes, cells).outline
    at = np.array([whole.nodes[np.unique(row)].mean(axis=0) for row in outline])
    bottom = (at[:, 2] < 1e-9) & (np.abs(at[:, :2]) < 2e-3).all(axis=1)
    mesh = fc.Mesh(whole.nodes, cells, {"contact": outline[bottom], "top": outline[
        at[:, 2] > 8e-3 - 1e-9]})
    assert sorted({*widths(mesh.boundaries["contact"]).tolist()}) == [3, 4]
    body = fc.ElasticBody(mesh, degree=degree, fixed={"top": "xyz"})
    found = uniform(with_half_space(fc.modal_basis(body, 8), body))
    assert (np.abs(found / SQUARE - 1.0) < error).all()
    alone = uniform(fc.modal_basis(body, 8, reduction="residual", tolerance=0.0))
    assert (alone / SQUARE - 1.0 < -before).all()


def test_nothing_is_counted_twice():
    """A second time there is nothing left to add; from residual vectors the result is the same."""
    body = held(6, 4, 1)
    once = with_half_space(fc.modal_basis(body, 8), body)
    richer = fc.modal_basis(body, 8, reduction="residual", tolerance=0.0)
    assert uniform(with_half_space(richer, body)) == pytest.approx(uniform(once), rel=1e-9)
    assert uniform(with_half_space(once, body)) == pytest.approx(uniform(once), rel=1e-7)


def test_patches_of_several_facets():
    """Patches of four facets have the same mean displacement under the even load."""
    body = held(12, 8, 1)
    found = uniform(with_half_space(fc.modal_basis(body, 8, contact_nodes=(2, 2)), body))
    assert found == pytest.approx(SQUARE, rel=7e-3)


def test_tolerance_leaves_coordinates_out():
    body = held(12, 8, 1)
    basis = fc.modal_basis(body, 8)
    counts = [with_half_space(basis, body, tolerance=part).modes for part in (0.0, 0.05, 0.3)]
    assert counts[0] == 8 + 3 * 16
    assert counts[0] > counts[1] > counts[2]
    found = uniform(with_half_space(basis, body, tolerance=0.05))
    assert found == pytest.approx(SQUARE, rel=0.02)
    with pytest.raises(fc.InputError, match="zero or above, and below one"):
        with_half_space(basis, body, tolerance=1.0)


def test_rows_are_those_of_the_shapes():
    body = held(6, 4, 1)
    basis = with_half_space(fc.modal_basis(body, 8), body, frequency=5e6)
    field = basis.mode_shapes
    rows = (field.restriction @ field.shapes.reshape(-1, basis.modes)).reshape(basis.T.shape)
    assert rows == pytest.approx(basis.T, abs=1e-9 * np.abs(basis.T).max())
    assert basis.frequencies_hz[-1] == pytest.approx(5e6)
    assert basis.damping_ratios[-1] == pytest.approx(0.1)


def pressed(ratio, pixels=8):
    """A block with linear elements of a third of the contact radius, and the half-space beside."""
    half = 1.25 * WIDTH
    side = 2.0 * half / pixels
    beyond = half + side * np.cumsum(1.9 ** np.arange(1, 6))
    x = np.concatenate([-beyond[::-1], np.linspace(-half, half, pixels + 1), beyond])
    mesh = fc.Mesh.grid(x, x, np.concatenate([[0.0], side * np.cumsum(1.5 ** np.arange(8))]))
    bottom = mesh.boundaries["bottom"]
    inside = (np.abs(mesh.nodes[bottom].mean(axis=1)[:, :2]) < half).all(axis=1)
    mesh = replace(mesh, boundaries={"contact": bottom[inside], "top": mesh.boundaries["top"]})
    tool = Coupling("top", "tool", place=(0.0, 0.0, mesh.nodes[:, 2].max()), kind="distributing")
    material = fc.Material(2.1e11, ratio)
    body = fc.ElasticBody(mesh, material, degree=1, constraints=[tool],
                          fixed={"tool": "phi_x phi_y phi_z"})
    basis = fc.modal_basis(body, 6, C="tool", reduction="residual", tolerance=0.5)
    load = 4.0 * 2.1e11 * WIDTH**3 / (3.0 * (1.0 - ratio**2) * RADIUS)
    place = (np.arange(pixels) + 0.5) * side - half
    exact = half_space_contact((place[:, None] ** 2 + place**2) / (2.0 * RADIUS), side, material,
                               force=load)
    return body, basis, exact


def system_of(basis, load):
    peak = 1.5 * load / (np.pi * WIDTH**2)
    gap = (basis.contact_places[:, :2] ** 2).sum(axis=1) / (2.0 * RADIUS)
    return fc.ContactSystem(basis, LinearContact(1e5 * peak / WIDTH * basis.tributary.sum()),
                            ConstantFriction(MU), load=fc.Load(load), gap=gap)


def test_hertz_and_cattaneo_on_linear_elements():
    """Pressures to 3 % and the loss of a cycle to 3 %, of elements that lock at nu = 0.49."""
    body, basis, exact = pressed(0.49)
    side = exact.sides[0]
    full = with_half_space(basis, body)
    index = np.rint(basis.contact_places[:, :2] / side + 3.5).astype(int)
    expected = exact.pressure[index[:, 0], index[:, 1]] * side**2
    errors = []
    for one in (basis, full):
        forces = fc.equilibrium(system_of(one, exact.force)).normal_force
        errors.append(np.abs(forces - expected).sum() / expected.sum())
    assert errors[0] > 0.2
    assert errors[1] < 0.03
    parts = np.array([0.9, 0.45, 0.0, -0.45, -0.9, -0.45, 0.0, 0.45, 0.9]) * MU * exact.force
    shear = half_space_friction(exact, MU, forces=np.outer(parts, [1.0, 0.0]))
    path = fc.LoadPath(forces={"C.x": (0.0, parts[0], -parts[0], parts[0])}, steps=4)
    history = fc.load_history(system_of(full, exact.force), path, rtol=1e-3)
    assert history.loop(1, 3).loss == pytest.approx(shear.loss[-1] - shear.loss[0], rel=0.03)


def test_measured_heights():
    """Forces on a rough crown to 2 %, and the same nodes in contact as between half-spaces."""
    body, basis, exact = pressed(0.3)
    side, load = exact.sides[0], exact.force
    place = (np.arange(8) - 3.5) * side
    z = 1e-6 * np.random.default_rng(4).standard_normal((8, 8)) - np.add.outer(
        place**2, place**2) / (2.0 * RADIUS)
    heights = HeightMap(z.tolist(), side, side, place[0], place[0])
    between = half_space_contact(-z, side, body.material, force=load)
    index = np.rint(basis.contact_places[:, :2] / side + 3.5).astype(int)
    expected = between.pressure[index[:, 0], index[:, 1]] * side**2
    system = replace(system_of(with_half_space(basis, body), load), gap=heights)
    forces = fc.equilibrium(system).normal_force
    assert np.abs(forces - expected).sum() < 0.02 * load
    assert (forces > 0.0).tolist() == (expected > 0.0).tolist()
    assert 0.2 < (expected > 0.0).mean() < 0.8


def test_responses_and_runs_have_the_static_limit():
    """Amplitude of the top on a closed contact, by harmonic balance and a run far below modes."""
    body = fc.ElasticBody(block(6, 4), degree=1, fixed={"top": "xy"})
    plain = fc.modal_basis(body, 6, B=(0.0, 0.0, 8e-3), C=(0.0, 0.0, 8e-3), damping=0.05)
    stiffness, spring, amplitude = 2e9, 1e8, 1e-6
    found = []
    for basis in (plain, with_half_space(plain, body)):
        system = fc.ContactSystem(
            basis, LinearContact(stiffness), ConstantFriction(0.0), load=fc.Load(1000.0),
            drive=fc.Drive(stiffness_z=spring, amplitude_z=amplitude, frequency_hz=500.0))
        share, row = basis.tributary / basis.tributary.sum(), basis.T[0, 2]
        normal = basis.contact_T[:, 2]
        K = basis.stiffness_matrix + spring * np.outer(row, row) + stiffness * (
            normal.T * share) @ normal
        static = float(row @ np.linalg.solve(K, spring * amplitude * row))
        branch = fc.bifurcation.frequency_response(
            system, (500.0, 520.0), observe=("B", "z"),
            method=fc.bifurcation.HarmonicBalance(2)).branches[0]
        assert branch.column("observed_amplitude")[0] == pytest.approx(static, rel=1e-3)
        run = fc.simulate(system, 0.006, outputs=601)
        late = run.displacement("B")[400:, 2]
        assert 0.5 * np.ptp(late) == pytest.approx(static, rel=5e-3)
        found.append(static)
    assert found[1] > 1.01 * found[0]


def test_two_equal_blocks_are_twice_as_soft():
    """Each body is completed by itself; relative motions of the nodes add them up."""
    lower = block(6, 4)
    turned = fc.Mesh.grid(np.linspace(-6e-3, 6e-3, 7), np.linspace(-6e-3, 6e-3, 7),
                          np.linspace(-8e-3, 0.0, 5))
    top = turned.boundaries["top"]
    inside = (np.abs(turned.nodes[top].mean(axis=1)[:, :2]) < 2e-3).all(axis=1)
    turned = replace(turned, boundaries={"seam": top[inside],
                                         "base": turned.boundaries["bottom"]})
    bodies = {"upper": fc.ElasticBody(lower, degree=2, fixed={"top": "xyz"}),
              "lower": fc.ElasticBody(turned, degree=2, fixed={"base": "xyz"})}
    pairing = pair_faces(bodies, "upper.contact", "lower.seam", nodes_on="face")
    bases = reduce_bodies(bodies, [pairing], modes=6)
    full = {name: with_half_space(bases[name], bodies[name], pairings=[pairing], name=name)
            for name in bodies}
    joined = fc.reduction.assembled_basis(full, {"seam": pairing})
    single = uniform(with_half_space(fc.modal_basis(bodies["upper"], 6), bodies["upper"]))
    assert uniform(joined) == pytest.approx(2.0 * single, rel=1e-3)
    # Normal and tangential motions of equal bodies do not know of each other.
    w = joined.angular_frequencies
    T = joined.contact_T[:, :3].reshape(-1, joined.modes) / w
    C = (T @ T.T).reshape(4, 3, 4, 3)
    assert np.abs(C[:, 2, :, :2]).max() < 1e-3 * np.abs(C).max()


@pytest.mark.parametrize(("call", "words"), [
    (lambda: with_half_space(fc.modal_basis(body := fc.ElasticBody(fc.generate(fc.Block())), 4,
                                            contact_nodes=4), body), "the body is plane"),
    (lambda: with_half_space(fc.modal_basis(held(6, 4, 1), 8, contact=()), held(6, 4, 1)),
     "no contact nodes"),
    (lambda: with_half_space(fc.modal_basis(held(6, 4, 1), 8), held(6, 4, 2)),
     "not that of this body"),
    (lambda: with_half_space(fc.modal_basis(held(6, 4, 1), 8), held(6, 4, 1), frequency=1.0),
     "above that of the last mode"),
])
def test_errors(call, words):
    with pytest.raises(InputError, match=words):
        call()
