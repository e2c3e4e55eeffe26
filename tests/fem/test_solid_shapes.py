"""Generated solids: volumes and areas of their faces against closed forms, names, points."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from fecontact import ElasticBody, InputError, Study, generate, read_mesh, write_mesh
from fecontact.fem import Cylinder, LapStrip, Plate, Ring, SolidBlock, SphereSegment
from fecontact.fem.faces.surface import Surface
from fecontact.fem.solids import generate as solid_generation

ELEMENTS = ("hexahedron", "tetrahedron")


def areas(mesh):
    """Area of each boundary, integrated over its second-order faces, and its mean normal."""
    body = ElasticBody(mesh)
    found = {}
    for name, facets in mesh.boundaries.items():
        surface = Surface(body.nodes, body.facet_nodes(facets))
        found[name] = surface.areas.sum(), surface.area_vectors.sum(axis=0)
    return found


def cap(radius, base):
    """Area and volume under a segment of a sphere, from its plane."""
    rise = radius - math.sqrt(radius**2 - base**2)
    return 2.0 * math.pi * radius * rise, math.pi * rise**2 * (3.0 * radius - rise) / 3.0, rise


LAP = LapStrip(holes_along=1, holes_across=2)
HOLES = 2 * math.pi * LAP.hole_radius**2
RISE = cap(0.05, 0.02)[2]
CASES = {
    "block": (SolidBlock(contact_length=0.06, contact_width=0.02), 0.1 * 0.06 * 0.04,
              {"contact": 0.06 * 0.02, "bottom": 0.1 * 0.06 - 0.06 * 0.02, "top": 0.006,
               "left": 0.0024, "right": 0.0024, "front": 0.004, "back": 0.004}, 1e-12),
    "plate": (Plate(layers=2), 0.2 * 0.2 * 0.005,
              {"contact": 0.04, "top": 0.04, "left": 1e-3, "right": 1e-3, "front": 1e-3,
               "back": 1e-3}, 1e-12),
    "ring": (Ring(), math.pi * (0.1**2 - 0.04**2) * 0.01,
             {"contact": math.pi * 0.0084, "top": math.pi * 0.0084,
              "outer": 2 * math.pi * 0.1 * 0.01, "inner": 2 * math.pi * 0.04 * 0.01}, 3e-5),
    "disc": (Ring(inner_radius=0.0), math.pi * 1e-4,
             {"contact": math.pi * 0.01, "top": math.pi * 0.01, "outer": 2e-3 * math.pi}, 3e-5),
    "cylinder": (Cylinder(element_size=0.008), math.pi * 0.02**2 * 0.06,
                 {"contact": math.pi / 3 * 0.02 * 0.06, "outer": 5 * math.pi / 3 * 0.02 * 0.06,
                  "front": math.pi * 4e-4, "back": math.pi * 4e-4}, 3e-4),
    "tube": (Cylinder(inner_radius=0.012, element_size=0.008),
             math.pi * (0.02**2 - 0.012**2) * 0.06,
             {"contact": math.pi / 3 * 0.02 * 0.06, "inner": 2 * math.pi * 0.012 * 0.06}, 3e-4),
    "sphere": (SphereSegment(contact_radius=0.005, contact_element_size=0.003),
               math.pi * 0.02**2 * 0.02 - math.pi * 0.02**2 * RISE + cap(0.05, 0.02)[1],
               {"contact": cap(0.05, 0.005)[0],
                "bottom": cap(0.05, 0.02)[0] - cap(0.05, 0.005)[0], "top": math.pi * 4e-4,
                "outer": 2 * math.pi * 0.02 * (0.02 - RISE)}, 3e-4),
    "lap": (LAP, (0.15 * 0.04 - HOLES) * 0.005,
            {"contact": 0.06 * 0.04 - HOLES, "inner": 0.09 * 0.04, "end": 2e-4, "tip": 2e-4,
             "front": 7.5e-4, "back": 7.5e-4, "hole_1": 2 * math.pi * 0.004 * 0.005,
             "washer_2": math.pi * (0.008**2 - 0.004**2),
             "outer": 0.15 * 0.04 - 2 * math.pi * 0.008**2}, 1e-3),
}


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("name", CASES)
def test_volumes_and_faces_are_those_of_the_shape(name, element):
    shape, volume, faces, tolerance = CASES[name]
    mesh = generate(replace(shape, element=element))
    assert mesh.volume == pytest.approx(volume, rel=tolerance)
    found = areas(mesh)
    for face, area in faces.items():
        assert found[face][0] == pytest.approx(area, rel=tolerance), face
    assert sum(map(len, mesh.boundaries.values())) == len(mesh.outline)
    assert found["contact"][1][2] < 0.0
    assert {"B", "C"} <= mesh.points.keys()


def test_the_lower_strip_is_the_upper_one_turned_and_their_holes_fit():
    upper, lower = (generate(replace(LAP, layer=layer)) for layer in ("upper", "lower"))
    assert areas(lower)["contact"][1] == pytest.approx(-areas(upper)["contact"][1], abs=1e-15)
    for name in ("hole_1", "hole_2"):
        rims = [np.unique(mesh.boundary(name)) for mesh in (upper, lower)]
        upper_xy, lower_xy = (mesh.nodes[rim][:, :2].mean(axis=0)
                              for mesh, rim in zip((upper, lower), rims, strict=True))
        assert upper_xy == pytest.approx(lower_xy, abs=1e-12)
    assert upper.nodes[:, 0].max() == pytest.approx(0.12)
    assert lower.nodes[:, 0].min() == pytest.approx(-0.12)
    assert lower.nodes[:, 2].min() == pytest.approx(-0.005)


def test_points_lie_where_they_are_said_to():
    block = generate(SolidBlock(drive_height=0.013))
    assert block.nodes[block.points["B"][0]] == pytest.approx([0.0, 0.03, 0.013])
    assert block.nodes[block.points["C"][0]] == pytest.approx([0.05, 0.03, 0.04])
    plate = generate(Plate())
    edges = plate.nodes[plate.points["bottom_edges"]]
    assert len(edges) == 40
    assert (edges[:, 2] == 0.0).all()
    sphere = generate(SphereSegment())
    assert np.abs(sphere.nodes).min(axis=0).max() < 1e-15  # a node at the origin
    body = ElasticBody(plate, fixed={"bottom_edges": "z"})
    # Lines hold the middles of their edges too: 40 corners and 40 middles.
    assert len(body.fixed_dofs) == 80


@pytest.mark.parametrize("name", ["ring", "sphere", "lap"])
@pytest.mark.parametrize("element", ELEMENTS)
def test_gmsh_reads_the_same_curved_volume(name, element, tmp_path):
    gmsh = pytest.importorskip("gmsh")
    mesh = generate(replace(CASES[name][0], element=element))
    write_mesh(mesh, tmp_path / "a.msh")
    again = read_mesh(tmp_path / "a.msh")
    assert np.array_equal(again.nodes, mesh.nodes)
    assert np.array_equal(again.cells, mesh.cells)
    assert again.volume == pytest.approx(mesh.volume, rel=1e-8)
    assert {key: len(rows) for key, rows in again.boundaries.items()} == {
        key: len(rows) for key, rows in mesh.boundaries.items()}
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.msh"))
        kind = gmsh.model.mesh.getElementTypes(3)[0]
        points, weights = gmsh.model.mesh.getIntegrationPoints(kind, "Gauss6")
        _, determinants, _ = gmsh.model.mesh.getJacobians(kind, points)
        volume = (determinants.reshape(-1, len(weights)) @ weights).sum()
        worst = determinants.min() > 0.0
    finally:
        gmsh.finalize()
    assert worst
    assert volume == pytest.approx(mesh.volume, rel=1e-12)


@pytest.mark.parametrize(("cls", "given", "message"), [
    (SolidBlock, {"length": 0.0}, "length = 0.0"),
    (SolidBlock, {"contact_length": 0.2}, "contact_length = 0.2 must not be above length = 0.1"),
    (SolidBlock, {"drive_height": 0.05}, "drive_height = 0.05 must not be above height"),
    (SolidBlock, {"element": "wedge"}, "element = 'wedge' must be one of 'hexahedron'"),
    (Plate, {"layers": 0}, "layers = 0 must be a whole number of at least 1"),
    (Ring, {"inner_radius": 0.1}, "inner_radius = 0.1 must be below outer_radius = 0.1"),
    (Cylinder, {"contact_angle": 170.0}, "contact_angle = 170.0 must be from 20 to 160 degrees"),
    (SphereSegment, {"base_radius": 0.049}, "base_radius = 0.049 must not be above 0.9 radius"),
    (SphereSegment, {"height": 0.004}, "height = 0.004 must be above the rise of the sphere"),
    (LapStrip, {"overlap": 0.2}, "overlap = 0.2 must be below length"),
    (LapStrip, {"washer_radius": 0.02}, "washer_radius = 0.02 must be at most 0.01425 m"),
    (LapStrip, {"layer": "middle"}, "layer = 'middle' must be 'upper' or 'lower'"),
])
def test_impossible_dimensions_are_named(cls, given, message):
    with pytest.raises(InputError, match=f"{cls.__name__}: {message}"):
        cls(**given)


@pytest.mark.parametrize(("shape", "message"), [
    (SolidBlock(element_size=1e-5), "element_size = 1e-05 makes 2.4e+11 or more elements"),
    (SphereSegment(element_size=1e-9), "element_size = 1e-09 makes"),
    (SphereSegment(contact_element_size=1e-9), "contact_element_size = 1e-09 make"),
    (LapStrip(element_size=1e-9), "element_size = 1e-09 makes"),
    (Plate(layers=10**5), "element_size = 0.02 makes 1e+07 or more elements"),
])
def test_sizes_that_make_too_many_elements_are_refused(shape, message, monkeypatch):
    monkeypatch.setattr(solid_generation, "available_memory", lambda: 6e9)
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        generate(shape)
    enough = float(re.search("take at least (.*) m", str(caught.value))[1])
    sizes = {key: max(value, enough) for key in ("element_size", "contact_element_size")
             if (value := getattr(shape, key, None))}
    monkeypatch.setattr(solid_generation, "swept_mesh", lambda sweep, *others: sweep.count)
    assert 1e5 < generate(replace(shape, **sizes)) <= 5e5


@pytest.mark.parametrize(("shape", "message"), [
    (Plate(layers=10**7), "layers = 10000000 makes 4e+07 or more elements"),
    (Ring(layers=10**25), "makes 4e+25 or more elements"),
    (Ring(layers=10**5), "layers = 100000 makes 1.6e+06 or more elements"),
    (LapStrip(holes_along=10**7, hole_radius=1e-9, washer_radius=2e-9),
     "layers = 1, holes_along = 10000000, holes_across = 1 make 1.6e+08 or more elements"),
])
def test_layers_and_holes_that_make_too_many_elements_are_refused(shape, message, monkeypatch):
    monkeypatch.setattr(solid_generation, "available_memory", lambda: 6e9)
    with pytest.raises(InputError, match=f"{re.escape(message)}, more than 500000; take fewer"):
        generate(shape)


def test_a_study_takes_solids_their_supports_and_places():
    study = Study.from_toml("""
        [geometry]
        shape = "ring"
        inner_radius = 0.05
        [body]
        fixed = { inner = "hinge" }
        """)
    mesh = study.mesh()
    assert [*mesh.cell_counts] == ["hexahedra"]
    assert Study.from_toml(study.to_toml()).mesh().volume == mesh.volume
    with pytest.raises(InputError, match=r"must be one of .*'sphere-segment'"):
        Study.from_toml('[geometry]\nshape = "sphere"')
    with pytest.raises(InputError, match=r"thickness = 0\.1 is for plane bodies, but the"):
        Study.from_toml('[geometry]\nshape = "plate"\n[body]\nthickness = 0.1').elastic_body()
