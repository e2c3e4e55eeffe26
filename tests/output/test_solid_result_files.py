"""Files of runs in space: what VTK reads, what goes to tables, and what comes back to the bit."""

from dataclasses import fields, replace

import h5py
import numpy as np
import pytest
from solid_blocks import block_body, mixed_mesh
from systems import TURN
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

import fecontact as fc
from fecontact.fem import pair_faces
from fecontact.integrate import RecordedContact
from fecontact.io import export_csv, export_fields, export_pvd, to_xarray
from fecontact.laws import (
    BoucWenFriction,
    ConstantFriction,
    HarmonicSpeed,
    HeightMap,
    LinearContact,
    Sine,
    SlidingRotation,
    SlidingTranslation,
    Tabulated,
)
from fecontact.output.files.contact_facets import contact_facets, facet_vectors
from fecontact.output.files.frames import contact_forces
from fecontact.output.files.recorded_laws import recorded_system
from fecontact.reduction import reduce_bodies
from fecontact.system.columns import POWERS
from fecontact.system.tables import system_tables

SIZE = (0.2, 0.1, 0.05)
# Kinds of solids, and those of their cells in VTK.
CELLS = {"hexahedra": {"vtkHexahedron"}, "tetrahedra": {"vtkTetra"},
         "mixed": {"vtkTetra", "vtkPyramid", "vtkWedge", "vtkHexahedron"},
         "serendipity": {"vtkQuadraticTetra", "vtkQuadraticPyramid", "vtkQuadraticWedge",
                         "vtkQuadraticHexahedron"}}
KINDS = pytest.mark.parametrize("kind", list(CELLS))


def solid(kind="hexahedra", counts=(4, 2, 1)):
    body = (fc.ElasticBody(mixed_mesh((1, 2, 1), SIZE), bricks=(
        "full" if kind == "mixed" else kind)) if kind in ("mixed", "serendipity")
            else block_body(counts, SIZE, tetrahedra=kind == "tetrahedra"))
    return fc.modal_basis(body, 8, contact_nodes=4, B=(0.0, 0.05, 0.05),
                          C=(0.1, 0.05, 0.05))


def system(basis, **parts):
    return fc.ContactSystem(basis, **{
        "normal": LinearContact(stiffness=2e7, damping=50.0),
        "friction": ConstantFriction(0.4, smoothing_slope=200.0),
        "ground": fc.Ground(speed=0.02, speed_y=0.05)} | parts)


def moved(one, times=9, seed=1):
    """A run of given motion: tilted and pressed, in slip at some nodes and open at others."""
    basis, rng = one.basis, np.random.default_rng(seed)
    t = np.linspace(0.0, 0.01, times)
    q, rate = np.zeros((2, times, basis.modes))
    for k in range(basis.modes):
        size = 2e-5 if k < 6 else 2e-7
        q[:, k] = size * np.sin(2000.0 * t * (1 + 0.3 * k) + k)
        rate[:, k] = 600.0 * size * np.cos(900.0 * t * (1 + 0.3 * k))
    memory = None
    if one.memory:
        memory = 1e-6 * rng.standard_normal((times, basis.contact_nodes * one.memory))
    return fc.Trajectory(one, t, q, rate, rng.standard_normal((times, len(POWERS))),
                         memory=memory)


def opened(path, time=None):
    """The grid of a file at a time."""
    reader = vtkHDFReader() if path.suffix == ".vtkhdf" else vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    reader.Update() if time is None else reader.UpdateTimeStep(time)
    return reader.GetOutputDataObject(0)


def of(grid, kind, name):
    data = grid.GetPointData() if kind == "Point" else grid.GetCellData()
    return vtk_to_numpy(data.GetArray(name))


def stacked():
    """A block that stands on a larger one, both free, pressed together at given coordinates."""
    upper = block_body((4, 2, 1), SIZE)
    lower = block_body((3, 3, 1), (0.3, 0.3, 0.05), tetrahedra=True)
    lower = fc.ElasticBody(lower.mesh.placed(shift=(-0.05, -0.1, -0.05)))
    bodies = {"upper": upper, "lower": lower}
    pairing = pair_faces(bodies, "upper.contact", "lower.top", nodes=4, nodes_on="face")
    bases = reduce_bodies(bodies, [pairing], modes=8, reduction="vibration",
                          each={"upper": {"C": (0.1, 0.05, 0.05), "B": (0.0, 0.05, 0.05)}})
    return fc.ContactSystem(bodies=bases, interfaces=[fc.Interface(
        "seam", pairing, normal=LinearContact(stiffness=2e7),
        friction=ConstantFriction(0.3, smoothing_slope=100.0),
        sliding=SlidingRotation(speed=2.0, centre=(0.1, 0.05, 0.0)))])


@KINDS
def test_vtk_reads_volume_motion_and_stress_of_solids(tmp_path, kind):
    basis = solid(kind)
    run = moved(system(basis))
    path = fc.write_case(tmp_path / "solid.vtkhdf", run, frames=9)
    field = basis.mode_shapes
    grid = opened(path, run.time[4])
    sizes = vtkCellSizeFilter()
    sizes.SetInputData(grid)
    sizes.Update()
    volumes = of(sizes.GetOutput(), "Cell", "Volume")
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(np.prod(SIZE), rel=1e-12)
    names = {grid.GetCell(k).GetClassName() for k in range(grid.GetNumberOfCells())}
    assert names == CELLS[kind]
    for name, q in (("displacement", run.modal_coordinates), ("velocity", run.modal_velocities)):
        expected = field.shapes @ q[4]
        assert of(grid, "Point", name) == pytest.approx(expected,
                                                        abs=2e-5 * np.abs(expected).max())
    # Against the tensor's deviator.
    s = (field.stress @ run.modal_coordinates[4])[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    deviator = s - np.trace(s, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    expected = np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))
    assert of(grid, "Point", "von_mises") == pytest.approx(expected, rel=2e-5)
    assert of(grid, "Cell", "stress").shape == (
        len(field.elements if kind == "serendipity" else field.cells), 6)


def facet_areas(grid, chosen):
    """Areas of the facets at z = 0 of some cells of a grid."""
    points = vtk_to_numpy(grid.GetPoints().GetData())
    found = []
    for k in np.flatnonzero(chosen):
        cell = grid.GetCell(int(k))
        # Faces of a cell are one object that changes.
        ids = [[face.GetPointId(i) for i in range(face.GetNumberOfPoints())]
               for face in map(cell.GetFace, range(cell.GetNumberOfFaces()))]
        (low,) = [one for one in ids if (np.abs(points[one, 2]) < 1e-12).all()]
        corners = {6: 3, 8: 4}.get(len(low), len(low))
        found.append(np.linalg.norm(facet_vectors(points, np.array([low[:corners]]))[0]))
    return np.array(found)


@KINDS
def test_pressures_on_cells_and_forces_on_nodes_carry_the_contact_forces(tmp_path, kind):
    run = moved(system(solid(kind)))
    path = fc.write_case(tmp_path / "solid.vtkhdf", run, frames=9)
    forces = contact_forces(run)
    places = run.system.basis.contact_places
    assert set(run.contact_state.ravel().tolist()) == {0, 2}
    for k in (2, 5, 8):
        grid = opened(path, run.time[k])
        states = of(grid, "Cell", "contact_state")
        areas = facet_areas(grid, states >= 0)
        assert areas.sum() == pytest.approx(SIZE[0] * SIZE[1], rel=1e-12)
        pressure = of(grid, "Cell", "contact_pressure")
        largest = np.abs(forces[k]).sum()
        assert areas @ pressure[states >= 0] == pytest.approx(run.normal_force[k].sum(),
                                                              rel=1e-5)
        assert areas @ of(grid, "Cell", "contact_traction")[states >= 0] == pytest.approx(
            forces[k].sum(axis=0), abs=1e-5 * largest)
        assert not pressure[states < 0].any()
        assert sorted(np.unique(states[states >= 0])) == sorted(np.unique(run.contact_state[k]))
        at_nodes = of(grid, "Point", "contact_force").astype(float)
        assert at_nodes.sum(axis=0) == pytest.approx(forces[k].sum(axis=0), abs=1e-5 * largest)
        points = vtk_to_numpy(grid.GetPoints().GetData())
        assert np.cross(points, at_nodes).sum(axis=0) == pytest.approx(
            np.cross(places, forces[k]).sum(axis=0), abs=1e-5 * largest)
        bottom = points[:, 2] == 0.0
        assert ((of(grid, "Point", "contact_state") >= 0) == bottom).all()


def test_forces_on_two_solids_are_opposite(tmp_path):
    run = moved(stacked())
    path = fc.write_case(tmp_path / "two.vtkhdf", run, frames=9)
    facets = contact_facets(run.system.basis)
    field = run.system.basis.mode_shapes
    area = np.linalg.norm(facet_vectors(field.nodes, facets.facets), axis=1)
    assert np.bincount(facets.owner[facets.own], area[facets.own]) == pytest.approx(
        run.system.basis.contact_areas, rel=1e-12)
    assert (~facets.own).any()
    pressed = int(run.normal_force.sum(axis=1).argmax())
    grid = opened(path, run.time[pressed])
    force, body = of(grid, "Point", "contact_force").astype(float), of(grid, "Point", "body")
    upper, lower = force[body == 0].sum(axis=0), force[body == 1].sum(axis=0)
    assert upper == pytest.approx(contact_forces(run)[pressed].sum(axis=0),
                                  abs=1e-5 * np.abs(upper).max())
    assert lower == pytest.approx(-upper, abs=1e-5 * np.abs(upper).max())
    traction, cells = of(grid, "Cell", "contact_traction"), of(grid, "Cell", "body")
    assert traction[cells == 0][:, 2].max() > 0.0 >= traction[cells == 0][:, 2].min()
    assert traction[cells == 1][:, 2].min() < 0.0 >= traction[cells == 1][:, 2].max()
    with h5py.File(path) as file:
        assert file["VTKHDF/PointData/body"].attrs["names"].tolist() == ["upper", "lower"]


def test_ground_that_leans_pushes_off_its_slopes():
    """f_x = -F z_x and f_y = -F z_y of a map of heights that travels with the ground."""
    grid = HeightMap(2e-5 * np.random.default_rng(2).standard_normal((6, 5)), 0.05, 0.04)
    run = moved(system(solid(), friction=ConstantFriction(0.0),
                       ground=fc.Ground(speed=3.0, speed_y=-2.0, height_map=grid)))
    forces, places = contact_forces(run), run.system.basis.contact_places
    for k, t in enumerate(run.time):
        at = places[:, :2] - t * np.array([3.0, -2.0])
        at = at + (run.system.basis.contact_T @ run.modal_coordinates[k])[:, :2]
        slopes = grid.shape(*at.T)[:, 1:3]
        assert forces[k, :, :2] == pytest.approx(-run.normal_force[k][:, None] * slopes, rel=1e-9,
                                                 abs=1e-12)
    assert np.abs(forces[..., :2]).max() > 1e-4 * forces[..., 2].max() > 0.0
    waves = fc.Ground(speed_y=1.0, profile=Sine(2e-5, 0.03), wave_direction=(3.0, 4.0))
    run = moved(system(solid(), friction=ConstantFriction(0.0), ground=waves))
    forces = contact_forces(run)
    pressed = forces[..., 2] > 1.0
    assert forces[..., 0][pressed] == pytest.approx(0.75 * forces[..., 1][pressed], rel=1e-9)


def test_frames_for_other_programs_hold_the_same_arrays(tmp_path):
    run = moved(system(solid()))
    case = fc.write_case(tmp_path / "solid.vtkhdf", run, frames=3)
    export_pvd(run, tmp_path / "frames", frames=3)
    times = run.time[[0, 4, 8]]
    for number, time in enumerate(times):
        stored, frame = opened(case, time), opened(tmp_path / "frames"
                                                   / f"frames_{number:04d}.vtu")
        assert frame.GetFieldData().GetArray("TimeValue").GetValue(0) == time
        for kind, data in (("Point", stored.GetPointData()), ("Cell", stored.GetCellData())):
            names = [data.GetArrayName(k) for k in range(data.GetNumberOfArrays())]
            assert len(names) == {"Point": 6, "Cell": 4}[kind]
            for name in names:
                assert np.array_equal(of(stored, kind, name), of(frame, kind, name)), name
    stress = frame.GetCellData().GetArray("stress")
    assert [stress.GetComponentName(k) for k in range(6)] == ["xx", "yy", "zz", "xy", "yz", "xz"]


def test_fields_of_a_static_solid_go_to_paraview(tmp_path):
    """Load by its own weight: the stress zz at the support is -rho g h, by linear interpolation."""
    body = block_body((2, 2, 2), (0.1, 0.1, 0.1), fixed={"top": "z", "left": "x", "front": "y"},
                      material=fc.Material(youngs_modulus=2e11, poisson_ratio=0.0, density=8000.0))
    found = fc.static_solution(body, fc.Load(gravity=(0.0, 0.0, -10.0)))
    grid = opened(export_fields(found, tmp_path / "weight.vtu"))
    z = vtk_to_numpy(grid.GetPoints().GetData())[:, 2]
    top = np.abs(z - 0.1) < 1e-12
    assert of(grid, "Point", "stress_zz")[top] == pytest.approx(np.full(top.sum(), 8000.0),
                                                                rel=1e-6)
    assert of(grid, "Point", "displacement")[z == 0.0, 2] == pytest.approx(
        np.full((z == 0.0).sum(), -8000.0 * 10.0 * 0.1**2 / 2.0 / 2e11), rel=1e-9)
    assert of(grid, "Point", "stress_yz") == pytest.approx(0.0, abs=1e-3)


SYSTEMS = {
    "map": {"ground": fc.Ground(speed=0.1, speed_y=-0.3, motion_y=HarmonicSpeed(0.05, 900.0 / TURN),
                                height_map=HeightMap(np.random.default_rng(4).standard_normal(
                                    (5, 7)) * 1e-5 / 3.0, 0.011, 0.013, 0.001, -0.007)),
            "drive": fc.Drive(stiffness_z=1e5 / 3.0, damping_z=7.0, motion_z=Tabulated(
                (0.0, 1.0), (0.0, 1e-5))),
            "gap": (1e-6 / 3.0, 0.0, 2e-6, 1e-7)},
    "turning": {"ground": fc.Ground(rotation_speed=1.0 / 3.0, centre=(0.01, -0.02))},
    "waves": {"ground": fc.Ground(profile=Sine(1e-5 / 3.0, 0.03), wave_direction=(1.0, 3.0),
                                  friction_variation=Sine(0.1, 0.02), normal="vertical"),
              "drive": fc.Drive(stiffness_x=1e5, stiffness_y=2e5, stiffness_z=3e5,
                                amplitude_z=1e-6, amplitude_y=2e-6, frequency_hz=300.0 / TURN,
                                dashpots="relative", damping_y=3.0),
              "load": fc.Load(
                  gravity=(0.1, 0.2, -9.81), base_acceleration_z=fc.laws.Harmonic(1.0, 70.0 / TURN),
                  forces=(fc.PointLoad((0.1, 0.05, 0.05), "phi_x",
                                       signal=fc.laws.Harmonic(2.0, 30.0 / TURN)),
                          fc.PointLoad(2, "z", signal=fc.laws.Harmonic(1.0, 30.0 / TURN))),
                  boundaries=(fc.BoundaryLoad("top", pressure=1e5, shear=1e3, shear_across=7e3),
                              fc.BoundaryLoad("right", shear_across=fc.laws.Harmonic(
                                  1e3 / 3.0, 50.0 / TURN)))),
              "friction": BoucWenFriction(friction_coefficient=0.5, exponent=1.7, beta=0.7,
                                          yield_displacement=5e-6)},
    "sliding": {"sliding": {"contact": SlidingTranslation(0.1, (1.0, 2.0, 0.0))}},
    "sliding in time": {"sliding": {"contact": SlidingRotation(
        2.0, (0.1, 0.05, 0.3), HarmonicSpeed(0.5, 100.0 / TURN), axis=(0.0, 0.1, 1.0))}},
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_systems_in_space_come_back_to_the_last_bit(tmp_path, name):
    one = system(solid(), **SYSTEMS[name])
    run = moved(one)
    case = fc.read_case(fc.write_case(tmp_path / "solid.vtkhdf", run, frames=2))
    back = case.trajectory
    for part in ("normal", "friction", "ground", "drive", "load", "gap"):
        assert getattr(back.system, part) == getattr(one, part), part
    assert dict(back.system.sliding) == dict(one.sliding)
    assert system_tables(back.system) == system_tables(one)
    for entry in fields(one.basis):
        given, found = getattr(one.basis, entry.name), getattr(back.system.basis, entry.name)
        if isinstance(given, np.ndarray):
            assert np.array_equal(given, found), entry.name
    for entry in ("nodes", "cells", "outline", "shapes", "stress", "elements", "outline_nodes"):
        assert np.array_equal(getattr(one.basis.mode_shapes, entry),
                              getattr(back.system.basis.mode_shapes, entry)), entry
    assert np.array_equal(back.states, run.states)
    for quantity in ("normal_force", "friction_forces", "slip_velocities", "contact_state",
                     "pressure", "penetration_rate"):
        assert np.array_equal(getattr(back, quantity), getattr(run, quantity)), quantity
    assert np.array_equal(one.rhs(0.004, run.states[4]), back.system.rhs(0.004, run.states[4]))
    # The second time nothing changes either.
    again = fc.read_case(fc.write_case(tmp_path / "again.vtkhdf", back, frames=2)).trajectory
    assert again.system.ground == one.ground
    with h5py.File(tmp_path / "solid.vtkhdf") as file:
        stored = file["trajectory"]
        assert np.array_equal(stored["friction_forces"], run.friction_forces)
        assert stored["slip_velocities"].attrs["component_names"].tolist() == ["t", "t2"]
        assert "friction_force" not in stored


def test_two_solids_come_back_to_the_last_bit(tmp_path):
    run = moved(stacked())
    back = fc.read_case(fc.write_case(tmp_path / "two.vtkhdf", run, frames=0)).trajectory
    assert dict(back.system.sliding) == dict(run.system.sliding)
    assert np.array_equal(back.system.basis.contact_normals, run.system.basis.contact_normals)
    for quantity in ("normal_force", "friction_forces", "slip_velocities", "contact_state"):
        assert np.array_equal(getattr(back, quantity), getattr(run, quantity))
    assert np.array_equal(contact_forces(back), contact_forces(run))


def test_recorded_laws_give_what_the_laws_gave():
    """Laws whose code is not run: contact in two directions, to the last bit."""
    run = moved(system(solid()))
    history = run.system.contact_history(run.time, run.states)
    recorded = RecordedContact(dict(enumerate(np.moveaxis(history, -1, 0))), run.contact_state,
                               run.energies.contact)
    safe = replace(run, recorded=recorded, system=recorded_system(
        run.system.basis, system_tables(run.system), "a file", 0, "needs code"))
    with pytest.raises(fc.InputError, match="needs code"):
        _ = safe.modal_accelerations
    for quantity in ("normal_force", "friction_forces", "slip_velocities", "contact_state",
                     "penetration_rate"):
        assert np.array_equal(getattr(safe, quantity), getattr(run, quantity)), quantity


def test_tables_have_both_directions(tmp_path):
    run = moved(system(solid()))
    data = to_xarray(run)
    assert data.displacement.sel(point="B", component="z").values == pytest.approx(
        run.displacement("B")[:, 2], abs=1e-20)
    assert np.array_equal(data.friction_forces.sel(tangent="y"), run.friction_forces[..., 1])
    assert np.array_equal(data.pressure, run.normal_force / run.system.basis.contact_areas)
    assert data.node_area.sum() == pytest.approx(SIZE[0] * SIZE[1])
    assert data.displacement.attrs["units"] == "m, m, m, rad, rad, rad"
    lines = export_csv(run, tmp_path / "run.csv").read_text().splitlines()
    header = lines[0].split(",")
    assert {"node 3 friction force on the body in -y [N]", "node 0 slip velocity x [m/s]",
            "B displacement phi_z [rad]", "node 2 pressure [Pa]"} <= set(header)
    column = header.index("node 3 friction force on the body in -y [N]")
    assert [float(line.split(",")[column]) for line in lines[1:]] == (
        run.friction_forces[:, 3, 1].tolist())
    both = to_xarray(moved(stacked()))
    assert both.tangent.values.tolist() == ["t", "t2"]
    assert {"contact_force_z", "node_normal_z", "node_relative_displacement"} <= set(both)\
        | set(both.coords)


def test_frames_of_solids_are_compressed(tmp_path):
    run = moved(system(solid(counts=(12, 6, 5))), times=21)
    path = fc.write_case(tmp_path / "run.vtkhdf", run, frames=20)
    with h5py.File(path) as file:
        frames = [data for kind in ("PointData", "CellData")
                  for data in file[f"VTKHDF/{kind}"].values()]
        stored = sum(data.id.get_storage_size() for data in frames)
        assert stored < 0.4 * sum(data.nbytes for data in frames)
