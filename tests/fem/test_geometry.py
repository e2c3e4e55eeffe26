import importlib.util
import signal
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fecontact import (
    Beam,
    Block,
    InputError,
    Mesh,
    MeshError,
    MissingLibraryError,
    Pendulum,
    generate,
    read_mesh,
    write_mesh,
)
from fecontact.fem import generate as generation
from fecontact.fem.shapes import grid_of

try:
    import gmsh
except (ImportError, OSError) as error:
    pytest.skip(f"Gmsh does not load: {error}", allow_module_level=True)

MESHES = Path(__file__).parents[2] / "meshes"
# Gmsh meshes around holes alone.
HOLED = Pendulum(hinge_radius=0.002)

SHAPES = [
    Beam(),
    Beam(element="triangle"),
    Beam(length=0.11, height=0.017, element_size=0.004),
    Block(),
    Block(contact_length=0.04, drive_height=0.0, element="triangle"),
    Pendulum(contact_length=0.006),
    Block(width=0.1, height=0.3, contact_length=0.031, drive_height=0.3, element_size=0.02),
    Pendulum(),
    Pendulum(element="triangle", drive_distance=0.1),
    Pendulum(bob_width=0.02, bob_height=0.06, drive_distance=0.31, element_size=0.003),
]


def lengths(mesh: Mesh, edges: np.ndarray) -> np.ndarray:
    return np.linalg.norm(mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]], axis=1)


def place(mesh: Mesh, point: str) -> list[float]:
    (node,) = mesh.points[point]
    return mesh.nodes[node].tolist()


def all_edges(mesh: Mesh) -> np.ndarray:
    sides = np.stack([mesh.cells, np.roll(mesh.cells, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.unique(np.sort(sides, axis=1), axis=0)


def test_beam() -> None:
    mesh = generate(Beam(length=0.2, height=0.02, element_size=0.005))
    assert mesh.cells.shape == (40 * 4, 4)
    assert mesh.area == pytest.approx(0.2 * 0.02, rel=1e-12)
    sides = {name: lengths(mesh, edges).sum() for name, edges in mesh.boundaries.items()}
    assert sides == pytest.approx({"contact": 0.2, "left": 0.02, "right": 0.02, "top": 0.2},
                                  rel=1e-12)
    assert (mesh.nodes[mesh.boundary("contact")][..., 1] == 0).all()
    assert (mesh.nodes[mesh.boundary("top")][..., 1] == 0.02).all()
    assert (mesh.nodes[mesh.boundary("right")][..., 0] == 0.2).all()
    assert place(mesh, "B") == [0.0, 0.01]
    assert place(mesh, "C") == [0.1, 0.02]


def test_block_touches_with_the_middle_of_its_bottom() -> None:
    mesh = generate(Block(width=0.12, height=0.06, contact_length=0.05, drive_height=0.013))
    assert mesh.area == pytest.approx(0.12 * 0.06, rel=1e-12)
    contact = mesh.nodes[mesh.boundary("contact")]
    assert contact[..., 0].min() == pytest.approx(0.035, abs=1e-15)
    assert contact[..., 0].max() == pytest.approx(0.085, abs=1e-15)
    assert (contact[..., 1] == 0).all()
    assert lengths(mesh, mesh.boundary("bottom")).sum() == pytest.approx(0.07, rel=1e-12)
    assert place(mesh, "B") == [0.0, 0.013]
    assert place(mesh, "C") == [0.06, 0.06]


def test_whole_bottom_of_a_block_leaves_no_other_bottom() -> None:
    for contact_length in (None, 0.12, 0.12 * (1 + 1e-12)):
        mesh = generate(Block(width=0.12, height=0.06, contact_length=contact_length))
        assert sorted(mesh.boundaries) == ["contact", "left", "right", "top"]
        assert lengths(mesh, mesh.boundary("contact")).sum() == pytest.approx(0.12, rel=1e-12)


def test_pendulum() -> None:
    shape = Pendulum(arm_length=0.3, arm_height=0.0077, bob_width=0.032, bob_height=0.04)
    mesh = generate(shape)
    assert mesh.area == pytest.approx(0.284 * 0.0077 + 0.032 * 0.04, rel=1e-12)
    sides = {name: lengths(mesh, edges).sum() for name, edges in mesh.boundaries.items()}
    assert sides == pytest.approx({
        "contact": 0.032, "bob_top": 0.032, "bob_right": 0.04, "bob_left": 0.04 - 0.0077,
        "arm_top": 0.284, "arm_bottom": 0.284, "arm_left": 0.0077}, rel=1e-12)
    contact = mesh.nodes[mesh.boundary("contact")]
    assert (contact[..., 1] == 0).all()
    assert contact[..., 0].mean() == pytest.approx(0.3, abs=1e-12)
    assert mesh.nodes[mesh.boundary("arm_bottom")][..., 1] == pytest.approx(0.02 - 0.00385)
    assert place(mesh, "pivot") == [0.0, 0.02]
    assert place(mesh, "B") == [0.3, 0.02]
    assert place(mesh, "C") == [0.3, 0.04]
    assert place(generate(Pendulum(drive_distance=0.123)), "B") == [0.123, 0.0165]


def test_contact_of_a_pendulum_on_part_of_its_bob() -> None:
    mesh = generate(Pendulum(bob_width=0.032, contact_length=0.006))
    contact = mesh.nodes[mesh.boundary("contact")]
    assert lengths(mesh, mesh.boundary("contact")).sum() == pytest.approx(0.006, rel=1e-12)
    assert contact[..., 0].mean() == pytest.approx(0.3, abs=1e-12)
    assert (contact[..., 1] == 0.0).all()
    assert lengths(mesh, mesh.boundary("bob_bottom")).sum() == pytest.approx(0.026, rel=1e-12)


def test_default_pendulum_has_the_masses_of_the_impact_oscillator() -> None:
    shape = Pendulum()
    of_area = 2700 * 0.0196
    arm = of_area * shape.arm_length * shape.arm_height
    bob = of_area * generate(shape).area - arm
    assert arm == pytest.approx(0.122, abs=5e-4)
    assert bob == pytest.approx(0.051, abs=5e-4)


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_mesh_is_one_simply_connected_body_without_hanging_nodes(shape) -> None:
    mesh = generate(shape)
    edges = all_edges(mesh)
    assert len(mesh.nodes) - len(edges) + len(mesh.cells) == 1
    # A hanging node would lie within an edge of the outline that its neighbour has in one piece.
    named = np.concatenate(list(mesh.boundaries.values()))
    assert len(named) == len(mesh.outline)
    assert len(np.unique(np.sort(named, axis=1), axis=0)) == len(named)
    assert (np.unique(mesh.outline, return_counts=True)[1] == 2).all()
    assert len(np.unique(np.round(mesh.nodes / 1e-9), axis=0)) == len(mesh.nodes)


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_cells_are_well_shaped_and_no_larger_than_asked_for(shape) -> None:
    mesh = generate(shape)
    assert mesh.cells.shape[1] == (4 if shape.element == "quadrilateral" else 3)
    longest = lengths(mesh, all_edges(mesh)).max()
    limit = shape.element_size * (1 if shape.element == "quadrilateral" else np.sqrt(2))
    assert 0.4 * limit < longest < limit * (1 + 1e-5)
    corners = mesh.nodes[mesh.cells]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cosine = (ahead * back).sum(axis=2) / (
        np.linalg.norm(ahead, axis=2) * np.linalg.norm(back, axis=2))
    angle = np.degrees(np.arccos(cosine))
    if shape.element == "quadrilateral":
        assert angle == pytest.approx(90, abs=1e-6)
    else:
        assert angle.min() > 20
        assert angle.max() < 90 + 1e-6


@pytest.mark.parametrize("element", ["quadrilateral", "triangle"])
def test_elements_larger_than_the_body_still_mesh_it(element) -> None:
    for shape in (Beam(element_size=1.0, element=element), Block(element_size=9, element=element),
                  Pendulum(element_size=1.0, element=element)):
        mesh = generate(shape)
        assert len(mesh.cells) < 60
        assert len(mesh.nodes) - len(all_edges(mesh)) + len(mesh.cells) == 1
        assert place(mesh, "C")[1] == mesh.nodes[:, 1].max()


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_shape_does_not_depend_on_the_unit_of_length(unit: float) -> None:
    mesh = generate(Beam(length=0.2 * unit, height=0.02 * unit, element_size=0.005 * unit))
    assert mesh.cells.shape == (160, 4)
    assert mesh.area == pytest.approx(0.004 * unit**2, rel=1e-12)


def test_too_many_elements_name_an_element_size_that_works() -> None:
    shape = Beam(length=1.0, height=1e-6, element_size=1e-8)
    with pytest.raises(InputError, match=r"element_size = 1e-08 makes 1e\+10 elements") as caught:
        generate(shape)
    enough = float(str(caught.value).split("at least ")[1].split()[0])
    from fecontact.fem.generate import MAX_CELLS, _count_cells
    from fecontact.fem.shapes import grid_of

    assert 0.2 * MAX_CELLS < _count_cells(shape, grid_of(shape), enough) <= MAX_CELLS
    with pytest.raises(InputError, match="more than 2000000"):
        generate(Beam(element_size=1e-59))


@pytest.mark.parametrize(
    ("shape", "values", "message"),
    [
        (Beam, {"length": 0.0}, "Beam: length = 0.0 must be a finite number above zero"),
        (Beam, {"height": float("nan")}, "Beam: height = nan"),
        (Beam, {"element_size": -1.0}, "Beam: element_size = -1.0"),
        (Beam, {"element": "quad"}, "element = 'quad' must be one of 'quadrilateral', 'triangle'"),
        (Block, {"width": float("inf")}, "Block: width = inf"),
        (Block, {"contact_length": 0.0}, "Block: contact_length = 0.0"),
        (Block, {"contact_length": 0.13}, "contact_length = 0.13 must not be above width = 0.12"),
        (Pendulum, {"contact_length": 0.0}, "Pendulum: contact_length = 0.0"),
        (Pendulum, {"contact_length": 0.04},
         "contact_length = 0.04 must not be above bob_width = 0.033"),
        (Block, {"drive_height": -0.1}, "Block: drive_height = -0.1 .* zero or above"),
        (Block, {"drive_height": 0.07}, "drive_height = 0.07 must not be above height = 0.06"),
        (Block, {"element": 3}, "Block: element = 3"),
        (Pendulum, {"arm_height": 0.0}, "Pendulum: arm_height = 0.0"),
        (Pendulum, {"bob_height": 0.0077}, "bob_height = 0.0077 must be above arm_height = 0.0077"),
        (Pendulum, {"bob_width": 0.6}, "bob_width = 0.6 must be below twice arm_length"),
        (Pendulum, {"drive_distance": 0.0}, "Pendulum: drive_distance = 0.0"),
        (Pendulum, {"drive_distance": 0.32},
         r"drive_distance = 0.32 must not be above arm_length \+ bob_width / 2 = 0.3165"),
        (Pendulum, {"element": "hexagon"}, "Pendulum: element = 'hexagon'"),
    ],
)
def test_dimensions_out_of_range_are_refused(shape, values: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        shape(**values)


def test_something_else_is_not_a_shape() -> None:
    with pytest.raises(InputError, match="'beam' is not a shape; give a Beam"):
        generate("beam")  # type: ignore[arg-type]


def test_generation_is_quiet_and_leaves_gmsh_closed(capfd: pytest.CaptureFixture[str]) -> None:
    handler = signal.getsignal(signal.SIGINT)
    generate(HOLED)
    assert capfd.readouterr() == ("", "")
    assert signal.getsignal(signal.SIGINT) is handler
    assert not gmsh.isInitialized()


def test_generation_from_threads() -> None:
    areas: list[float] = []
    threads = [threading.Thread(target=lambda: areas.append(generate(HOLED).area))
               for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert areas == [generate(HOLED).area] * 4


def test_gmsh_in_use_by_the_caller_is_left_as_it_was() -> None:
    alone = generate(HOLED)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        mine = {"Mesh.ElementOrder": 2, "Mesh.RecombineAll": 1, "Mesh.SubdivisionAlgorithm": 1}
        for option, value in mine.items():
            gmsh.option.setNumber(option, value)
        gmsh.model.add("mine")
        gmsh.model.geo.addPoint(1, 2, 3)
        gmsh.model.add("another")
        gmsh.model.setCurrent("mine")
        models = gmsh.model.list()
        mesh = generate(HOLED)
        assert gmsh.isInitialized()
        assert gmsh.model.list() == models
        assert gmsh.model.getCurrent() == "mine"
        assert {option: gmsh.option.getNumber(option) for option in mine} == mine
        gmsh.model.geo.synchronize()
        assert gmsh.model.getEntities() == [(0, 1)]
    finally:
        gmsh.finalize()
    assert np.array_equal(mesh.cells, alone.cells)


def test_gmsh_is_closed_after_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(dimension: int) -> None:
        raise RuntimeError("no mesh today")

    monkeypatch.setattr(gmsh.model.mesh, "generate", fail)
    with pytest.raises(RuntimeError, match="no mesh today"):
        generate(HOLED)
    assert not gmsh.isInitialized()


@pytest.mark.parametrize(
    ("failure", "message"),
    [
        ("raise OSError('libGLU.so.1: cannot open shared object file')",
         r"lacks a library of the system \(libGLU.so.1: .*\); .* apt-get install -y libegl1 libgl1 "
         "libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"),
        ("raise ImportError('no gmsh')",
         r"A mesh around a hole needs gmsh, .* not installed; .* pip install .fecontact\[mesh\]"),
    ],
)
def test_missing_libraries_are_named(
    failure: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "gmsh.py").write_text(failure)
    monkeypatch.delitem(sys.modules, "gmsh")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingLibraryError, match=message):
        generate(HOLED)


@pytest.mark.parametrize("shape", [
    Beam(length=0.11, height=0.017, element_size=0.004), Beam(element="triangle"),
    Block(contact_length=0.03), Block(element="triangle", drive_height=0.013),
    Pendulum(), Pendulum(element="triangle"),
], ids=lambda shape: f"{type(shape).__name__} {shape.element}")
def test_rectangles_are_meshed_as_by_gmsh(shape) -> None:
    own, grid = generate(shape), grid_of(shape)
    with generation._gmsh_session(gmsh):
        other = generation._mesh(gmsh, grid, shape)
    distance, node = cKDTree(other.nodes).query(own.nodes)
    assert len(own.nodes) == len(other.nodes)
    assert distance.max() < 1e-11

    def cyclic(cells):
        return {tuple(np.roll(cell, -np.argmin(cell)).tolist()) for cell in cells}

    assert cyclic(node[own.cells]) == cyclic(other.cells)
    assert own.boundaries.keys() == other.boundaries.keys()
    for name, edges in own.boundaries.items():
        assert set(map(tuple, node[edges].tolist())) == set(map(tuple,
                                                               other.boundaries[name].tolist()))
    for name, place in own.points.items():
        assert (node[place] == other.points[name]).all()


def test_rectangles_need_no_gmsh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gmsh", None)
    assert generate(Beam()).area == pytest.approx(Beam().length * Beam().height, rel=1e-14)
    with pytest.raises(MissingLibraryError, match="A mesh around a hole needs gmsh"):
        generate(HOLED)


def committed_shapes() -> dict:
    spec = importlib.util.spec_from_file_location("generate_meshes", MESHES / "generate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.SHAPES


@pytest.mark.parametrize("name", ["beam.msh", "block.msh", "pendulum.msh",
                                  "impact_pendulum.msh"])
def test_committed_meshes_are_those_of_the_generator(name: str) -> None:
    mesh, again = read_mesh(MESHES / name), generate(committed_shapes()[name])
    assert (MESHES / name).stat().st_size < 200_000
    assert f"`{name}`" in (MESHES / "README.md").read_text()
    assert mesh.cells.shape == again.cells.shape
    assert mesh.area == pytest.approx(again.area, rel=1e-12)
    assert {key: len(edges) for key, edges in mesh.boundaries.items()} == \
        {key: len(edges) for key, edges in again.boundaries.items()}
    assert {key: place(mesh, key) for key in mesh.points} == \
        {key: place(again, key) for key in again.points}


def test_committed_pendulum_has_the_modes_of_the_impact_oscillator() -> None:
    """Assembled here by hand: rigid mode of 0.092 kg, bending at 230 Hz with 0.6 of its swing."""
    import scipy.sparse.linalg as linalg
    import skfem
    from skfem.helpers import ddot, div, dot, sym_grad

    mesh = read_mesh(MESHES / "pendulum.msh")
    young, poisson, density, thickness = 70e9, 0.33, 2700.0, 0.0196
    shear, lame = young / 2 / (1 + poisson), young * poisson / (1 - poisson**2)
    body = skfem.MeshQuad(mesh.nodes.T.copy(), mesh.cells.T.copy())
    basis = skfem.Basis(body, skfem.ElementVector(skfem.ElementQuad2()))
    stiffness = skfem.BilinearForm(lambda u, v, w: thickness * (
        2 * shear * ddot(sym_grad(u), sym_grad(v)) + lame * div(u) * div(v))).assemble(basis)
    mass = skfem.BilinearForm(lambda u, v, w: thickness * density * dot(u, v)).assemble(basis)
    face = skfem.FacetBasis(body, basis.elem,
                            facets=body.facets_satisfying(lambda x: x[1] < 1e-9))
    mean_height = skfem.LinearForm(lambda v, w: v[1] / 0.0324).assemble(face)
    free = np.setdiff1d(np.arange(basis.N), basis.nodal_dofs[:, mesh.points["pivot"]])
    squares, shapes = linalg.eigsh(stiffness[free][:, free].tocsc(), 2,
                                   mass[free][:, free].tocsc(), sigma=-1e4)
    at_contact = mean_height[free] @ shapes
    assert 1 / at_contact[0] ** 2 == pytest.approx(0.092, rel=1e-3)
    assert np.sqrt(squares[1]) / 2 / np.pi == pytest.approx(230.0, rel=1e-3)
    assert abs(at_contact[1] / at_contact[0]) == pytest.approx(0.600, rel=1e-3)


@pytest.fixture
def gmsh_model():
    """A rectangle of 2 m x 1 m with groups ``contact``, ``sides`` (contact in it too) and ``B``."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
        gmsh.model.add("rectangle")
        gmsh.model.occ.addRectangle(0, 0, 0, 2, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(1, [1], name="contact")
        gmsh.model.addPhysicalGroup(1, [1, 2, -4], name="sides")
        gmsh.model.addPhysicalGroup(0, [4], name="B")
        gmsh.model.addPhysicalGroup(2, [1], name="body")
        yield gmsh.model
    finally:
        gmsh.finalize()


def check_rectangle(path: Path) -> None:
    mesh = read_mesh(path)
    assert mesh.area == pytest.approx(2.0, rel=1e-6)
    assert lengths(mesh, mesh.boundary("contact")).sum() == pytest.approx(2.0, rel=1e-6)
    assert lengths(mesh, mesh.boundary("sides")).sum() == pytest.approx(4.0, rel=1e-6)
    if "B" in mesh.points:
        assert place(mesh, "B") == [0.0, 1.0]


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize(
    ("version", "options"),
    [(2.2, {}), (4.1, {}), (4.1, {"Mesh.SaveAll": 1}), (4.1, {"Mesh.SaveParametric": 1}),
     (2.2, {"Mesh.ElementOrder": 2}), (4.1, {"Mesh.ElementOrder": 2, "Mesh.SaveAll": 1}),
     (4.1, {"Mesh.RecombineAll": 1, "Mesh.SubdivisionAlgorithm": 1}),
     (4.1, {"Mesh.RecombineAll": 1, "Mesh.SubdivisionAlgorithm": 1, "Mesh.ElementOrder": 2,
            "Mesh.SecondOrderIncomplete": 1})],
)
def test_meshes_saved_by_gmsh(
    gmsh_model, tmp_path: Path, version: float, binary: int, options: dict
) -> None:
    for option, value in options.items():
        gmsh.option.setNumber(option, value)
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh_model.mesh.generate(2)
    gmsh.write(str(tmp_path / "a.msh"))
    check_rectangle(tmp_path / "a.msh")
    assert place(read_mesh(tmp_path / "a.msh"), "B") == [0.0, 1.0]


@pytest.mark.parametrize("name", ["a.inp", "a.med"])
def test_other_formats_saved_by_gmsh(gmsh_model, tmp_path: Path, name: str) -> None:
    gmsh_model.mesh.generate(2)
    gmsh_model.removePhysicalGroups([(1, 2)])
    gmsh_model.addPhysicalGroup(1, [1, 2, 4], name="sides")
    gmsh.write(str(tmp_path / name))
    check_rectangle(tmp_path / name)


def test_nastran_and_vtk_saved_by_gmsh(gmsh_model, tmp_path: Path) -> None:
    gmsh_model.mesh.generate(2)
    for name in ("a.bdf", "a.vtk"):
        gmsh.write(str(tmp_path / name))
        mesh = read_mesh(tmp_path / name, boundaries={"contact": (0, 0, 2, 0)})
        assert mesh.area == pytest.approx(2.0, rel=1e-6)
        assert lengths(mesh, mesh.boundary("contact")).sum() == pytest.approx(2.0, rel=1e-6)


def test_solid_saved_by_gmsh_is_read_and_its_surfaces_alone_are_refused(tmp_path: Path) -> None:
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(3)
        gmsh.write(str(tmp_path / "a.msh"))
        gmsh.write(str(tmp_path / "a.inp"))
        gmsh.model.mesh.clear()
        gmsh.model.mesh.generate(2)
        gmsh.write(str(tmp_path / "b.msh"))
    finally:
        gmsh.finalize()
    for name in ("a.msh", "a.inp"):
        assert read_mesh(tmp_path / name).volume == pytest.approx(1.0, rel=1e-12)
    with pytest.raises(MeshError, match="holds surfaces only, in space"):
        read_mesh(tmp_path / "b.msh")


def test_written_mesh_can_be_read_by_gmsh(tmp_path: Path) -> None:
    mesh = generate(Pendulum())
    mesh = Mesh(mesh.nodes, mesh.cells, {**mesh.boundaries, "B": mesh.boundary("contact")[:3]},
                {**mesh.points, "patch": mesh.boundary("bob_top")})
    write_mesh(mesh, tmp_path / "a.msh")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.msh"))
        nodes = {}
        for dimension, tag in gmsh.model.getPhysicalGroups():
            name = gmsh.model.getPhysicalName(dimension, tag)
            tags, coordinates = gmsh.model.mesh.getNodesForPhysicalGroup(dimension, tag)
            nodes[dimension, name] = set(zip(tags - 1, *coordinates.reshape(-1, 3).T, strict=True))
        _, quads = gmsh.model.mesh.getElementsByType(3)
        gmsh.write(str(tmp_path / "b.msh"))
    finally:
        gmsh.finalize()
    assert np.array_equal(quads.reshape(-1, 4) - 1, mesh.cells)
    expected = {(2, "body"): np.arange(len(mesh.nodes))}
    expected |= {(1, name): np.unique(edges) for name, edges in mesh.boundaries.items()}
    expected |= {(0, name): group for name, group in mesh.points.items()}
    assert nodes == {key: {(node, *mesh.nodes[node], 0.0) for node in group}
                     for key, group in expected.items()}
    again = read_mesh(tmp_path / "b.msh")
    assert {name: len(edges) for name, edges in again.boundaries.items()} == \
        {name: len(edges) for name, edges in mesh.boundaries.items()}
    assert {name: group.tolist() for name, group in again.points.items()} == \
        {name: group.tolist() for name, group in mesh.points.items()}
