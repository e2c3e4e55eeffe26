"""Eight-node bricks with incompatible modes: patch test, bending, stress, decks."""

import numpy as np
import pytest
from solid_blocks import block_mesh

from fecontact import (
    BoundaryLoad,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    Study,
    modal_basis,
    read_mesh,
    static_solution,
)
from fecontact.fem import stress_of
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.eigenmodes import strain_energies

LENGTH, HEIGHT = 0.2, 0.01
STEEL = Material.named("steel")


def distorted(counts, size, part=0.15):
    """A block whose inner nodes are moved by a part of the cells' sides."""
    mesh = block_mesh(counts, size)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.outline)
    nodes = mesh.nodes.copy()
    nodes[inner] += part * np.random.default_rng(2).uniform(-1.0, 1.0, (len(inner), 3)) * (
        np.array(size) / counts)
    return Mesh(nodes, mesh.cells, mesh.boundaries)


def bricks(mesh, kind="incompatible", **options):
    return ElasticBody(mesh, options.pop("material", STEEL), degree=1, bricks=kind, **options)


def beam(columns, kind="incompatible", poisson=0.0, **options):
    mesh = block_mesh((columns, 1, 1), (LENGTH, HEIGHT, HEIGHT))
    return bricks(mesh, kind, material=Material(2.1e11, poisson, 7850.0), **options)


def test_patch_test():
    """Displacements linear in space are exact in distorted cells: no bubble is used."""
    body = bricks(distorted((3, 3, 3), (0.2, 0.1, 0.05)))
    gradient = 1e-3 * np.random.default_rng(4).standard_normal((3, 3))
    moved = (body.nodes @ gradient.T).ravel()
    force = (body.stiffness @ moved).reshape(-1, 3)
    inner = np.setdiff1d(np.arange(len(body.nodes)), body.mesh.outline)
    assert len(inner) == 8
    assert np.abs(force[inner]).max() < 1e-12 * np.abs(force).max()
    plain = bricks(body.mesh, "full")
    assert stress_of(body, moved[:, None]) == pytest.approx(
        stress_of(plain, moved[:, None]), rel=1e-9, abs=1e-9 * 2.1e8)
    energy = strain_energies(body, moved[:, None])
    assert energy == pytest.approx(strain_energies(plain, moved[:, None]), rel=1e-12)


def test_six_rigid_motions_and_no_others():
    body = bricks(distorted((3, 3, 3), (0.2, 0.1, 0.05)))
    values = np.linalg.eigvalsh(body.stiffness.toarray())
    assert np.abs(values[:6]).max() < 1e-11 * values[-1]
    assert values[6] > 1e-5 * values[-1]
    assert abs(body.stiffness - body.stiffness.T).max() < 1e-15 * values[-1]
    moved = np.random.default_rng(1).standard_normal((body.nodes.size, 4))
    assert strain_energies(body, moved) == pytest.approx(
        0.5 * np.einsum("im,im->m", moved, body.stiffness @ moved), rel=1e-10)


@pytest.mark.parametrize("poisson", [0.0, 0.3])
def test_pure_bending_is_exact(poisson):
    """Moments M at both ends: curvature M / (E I), stress M z / I, in one layer of cells."""
    body = beam(4, poisson=poisson)
    force = np.zeros((len(body.nodes), 3))
    x, _, z = body.nodes.T
    # Nodal forces of the stress 1e6 z / (h / 2) at both ends.
    for at, sign in ((0.0, -1.0), (LENGTH, 1.0)):
        ends = np.flatnonzero(np.abs(x - at) < 1e-9)
        force[ends, 0] = sign * 1e6 * HEIGHT**2 / 12.0 * np.sign(z[ends] - 0.5 * HEIGHT)
    moved = np.linalg.lstsq(body.stiffness.toarray(), force.ravel(), rcond=1e-10)[0]
    curvature = 1e6 / (2.1e11 * 0.5 * HEIGHT)
    assert moved @ force.ravel() == pytest.approx(
        curvature * (1e6 * HEIGHT**3 / 6.0) * LENGTH, rel=1e-9)
    stress = stress_of(body, moved[:, None])[:, :, 0]
    assert stress[:, 0] == pytest.approx(1e6 * np.sign(z - 0.5 * HEIGHT), rel=1e-7)
    assert np.abs(stress[:, 1:]).max() < 10.0


def test_a_slender_cantilever_bends_as_timoshenkos():
    """``w = P L^3 / (3 E I) + P L / (k G A)``; trilinear displacements alone lock."""
    E, nu, force = 2.1e11, 0.0, 10.0
    exact = force * LENGTH**3 / (3.0 * E * HEIGHT**4 / 12.0) + force * LENGTH / (
        5.0 / 6.0 * E / 2.0 * HEIGHT**2)
    found = {}
    for kind in ("incompatible", "full"):
        body = beam(10, kind, nu, fixed={"left": "xyz"})
        load = Load(boundaries=(BoundaryLoad("right", shear=force / HEIGHT**2),))
        moved = static_solution(body, load).displacement
        found[kind] = np.abs(moved[body.group_nodes("right")]).max()
    assert found["incompatible"] / exact == pytest.approx(1.0, abs=3e-3)
    assert found["full"] / exact < 0.4


def test_frequencies_of_a_free_beam():
    """Second-order cells and incompatible modes agree; Euler and Bernoulli lie above by shear."""
    second = eigenfrequencies_hz(ElasticBody(
        block_mesh((20, 1, 1), (LENGTH, HEIGHT, HEIGHT)), STEEL), 8)[6]
    found = [eigenfrequencies_hz(beam(columns, poisson=0.3), 8)[6] for columns in (10, 20)]
    assert found[0] / second - 1.0 == pytest.approx(0.0, abs=2e-2)
    assert found[1] / second - 1.0 == pytest.approx(0.0, abs=6e-3)
    assert eigenfrequencies_hz(beam(20, "full", 0.3), 8)[6] > 1.2 * second


def test_stresses_of_modes():
    """Stress in bending includes that of the incompatible modes."""
    size = (LENGTH, 2.0 * HEIGHT, HEIGHT)
    found = [np.abs(modal_basis(body, 8, contact=()).mode_shapes.stress[:, 0, 6]).max()
             for body in (bricks(block_mesh((10, 1, 1), size)),
                          ElasticBody(block_mesh((20, 1, 2), size), STEEL))]
    assert found[0] == pytest.approx(found[1], rel=0.03)


def deck(name, mesh):
    nodes = "".join(f"{k}, {x!r}, {y!r}, {z!r}\n"
                    for k, (x, y, z) in enumerate(mesh.nodes.tolist(), start=1))
    cells = "".join(f"{k}, {', '.join(map(str, row))}\n"
                    for k, row in enumerate((mesh.cells + 1).tolist(), start=1))
    left = ", ".join(str(k + 1) for k in np.unique(mesh.boundaries["left"]))
    return (f"*NODE\n{nodes}*ELEMENT, TYPE={name}, ELSET=ALL\n{cells}*NSET, NSET=LEFT\n{left}\n"
            "*SOLID SECTION, ELSET=ALL, MATERIAL=M\n*MATERIAL, NAME=M\n*ELASTIC\n2.1e11, 0.3\n"
            "*DENSITY\n7850.\n")


@pytest.mark.parametrize(("name", "kind"), [
    ("C3D8I", "incompatible"), ("C3D8R", "full"), ("C3D8", "full")])
def test_bricks_of_decks(tmp_path, name, kind):
    (tmp_path / "a.inp").write_text(deck(name, block_mesh((3, 2, 2))))
    mesh = read_mesh(tmp_path / "a.inp")
    assert mesh.bricks == kind
    assert mesh.refined().placed((1.0, 0.0, 0.0)).bricks == kind
    assert ElasticBody(mesh, degree=1).has_incompatible_modes == (kind == "incompatible")
    assert not ElasticBody(mesh).has_incompatible_modes
    study = ("[geometry]\nfile = 'a.inp'\n[body]\ndegree = 1\n{}[basis]\nmodes = 8\ncontact = []\n")
    for text, wanted in (("", kind), ("bricks = 'full'\n", "full"),
                         ("bricks = 'incompatible'\n", "incompatible")):
        body = Study.from_toml(study.format(text), tmp_path / "study.toml").elastic_body()
        assert body.bricks == wanted


def test_fully_integrated_bricks_against_calculix():
    """ccx 2.20 with *FREQUENCY for C3D8; its C3D8I gives 848.07, 1656.6, 5202.6 and 6555.1 Hz."""
    mesh = block_mesh((8, 2, 2), (0.1, 0.02, 0.01))
    full, bubbles = (eigenfrequencies_hz(bricks(mesh, kind, fixed={"left": "xyz"}), 4)
                     for kind in ("full", "incompatible"))
    assert full == pytest.approx((1081.558, 1794.541, 6603.152, 6614.373), rel=1e-6)
    assert bubbles == pytest.approx((848.07, 1656.6, 5202.6, 6555.1), rel=0.02)


def test_unknown_bricks_are_refused():
    with pytest.raises(InputError, match=r"ElasticBody: bricks = 'reduced' must be one of 'full'"):
        bricks(block_mesh((1, 1, 1)), "reduced")
    with pytest.raises(InputError, match=r"Mesh: bricks = 'reduced' must be one of 'full', "):
        Mesh(block_mesh((1, 1, 1)).nodes, block_mesh((1, 1, 1)).cells, bricks="reduced")
