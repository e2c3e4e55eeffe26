from dataclasses import replace

import h5py
import numpy as np
import pytest
from synthetic import YOUNGS_MODULUS, basis, run
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from fecontact import InputError, Status, Trajectory, basis_from_matrices, read_case, write_case
from fecontact.core.units import quantity, round_125, suitable_unit
from fecontact.io import export_pvd, write_basis
from fecontact.output.files import case as store
from fecontact.output.files import pvd
from fecontact.output.files.frames import frame_indices, von_mises
from fecontact.reduction import ModeShapes
from fecontact.system.columns import POWERS

OLD_VTK = (vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()) < (9, 6)

LENGTH, HEIGHT = 0.2, 0.02


def open_by_vtk(path):
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    information = reader.GetExecutive().GetOutputInformation(0)
    return reader, information.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())


def point_data(grid, name):
    return vtk_to_numpy(grid.GetPointData().GetArray(name))


def with_motion(trajectory, q):
    return replace(trajectory, modal_coordinates=q, modal_velocities=np.zeros_like(q))


@pytest.mark.parametrize("triangles", [False, True])
def test_vtk_reads_grid_times_and_rigid_motion(tmp_path, triangles):
    body = basis(LENGTH, HEIGHT, columns=8, rows=3, triangles=triangles)
    trajectory = run(body, times=11)
    t = trajectory.time
    x0, y0, phi = 1e-5 * np.sin(300 * t), 2e-5 * np.cos(200 * t), 1e-4 * np.sin(500 * t)
    write_case(tmp_path / "case.vtkhdf",
               with_motion(trajectory, np.column_stack([x0, y0, phi, 0 * t, 0 * t])))

    reader, times = open_by_vtk(tmp_path / "case.vtkhdf")
    assert np.array_equal(times, t)
    x, y = body.mode_shapes.nodes.T
    mesh_times = set()
    for k in (0, 7, 3, 10):
        reader.UpdateTimeStep(t[k])
        grid = reader.GetOutputDataObject(0)
        mesh_times.add(grid.GetMeshMTime())
        expected = np.column_stack([x0[k] - phi[k] * (y - 0.5 * HEIGHT),
                                    y0[k] + phi[k] * (x - 0.5 * LENGTH), 0 * x])
        np.testing.assert_allclose(point_data(grid, "displacement"), expected,
                                   rtol=2e-5, atol=1e-12)
        assert point_data(grid, "displacement").dtype == np.float32
        assert not point_data(grid, "von_mises").any()
    # The grid is stored once, and read once by VTK from 9.6 on.
    assert len(mesh_times) == 1 or OLD_VTK
    points = vtk_to_numpy(grid.GetPoints().GetData())
    assert np.array_equal(points, np.column_stack([body.mode_shapes.nodes, 0 * x]))
    cells = [[grid.GetCell(k).GetPointId(j) for j in range(grid.GetCell(k).GetNumberOfPoints())]
             for k in range(grid.GetNumberOfCells())]
    assert np.array_equal(cells, body.mode_shapes.cells)
    assert {grid.GetCell(k).GetClassName() for k in range(grid.GetNumberOfCells())} == \
        {"vtkTriangle" if triangles else "vtkQuad"}


def test_stretched_body_has_its_axial_stress_as_von_mises_stress(tmp_path):
    trajectory = run(basis(columns=4, rows=2), times=5)
    q = np.zeros((5, 5))
    q[:, 4] = [0.0, 1e-6, -2e-6, 3e-6, -4e-6]
    write_case(tmp_path / "case.vtkhdf", with_motion(trajectory, q))
    reader, times = open_by_vtk(tmp_path / "case.vtkhdf")
    for time, amplitude in zip(times, q[:, 4], strict=True):
        reader.UpdateTimeStep(time)
        expected = YOUNGS_MODULUS * 2.0 / LENGTH * abs(amplitude)
        stress = point_data(reader.GetOutputDataObject(0), "von_mises")
        np.testing.assert_allclose(stress, expected, rtol=2e-5)


def test_vtk_reads_velocity_contact_state_and_cell_stress(tmp_path):
    body = basis(LENGTH, HEIGHT, columns=20, rows=2)
    trajectory = run(body, times=31)
    write_case(tmp_path / "case.vtkhdf", trajectory, frames=31)
    reader, times = open_by_vtk(tmp_path / "case.vtkhdf")
    x, y = body.mode_shapes.nodes.T
    bottom = y == 0.0
    # Patches of a fifth of the face belong to each of the five contact nodes.
    owner = np.clip((x[bottom] / LENGTH * 5.0 + 1e-9).astype(int), 0, 4)
    cells = np.repeat(0.5 * (np.unique(x)[:-1] + np.unique(x)[1:])[None], 2, axis=0).ravel()
    heights = np.repeat([0.25 * HEIGHT, 0.75 * HEIGHT], 20) - 0.5 * HEIGHT
    k = np.pi / LENGTH
    assert set(trajectory.contact_state.ravel().tolist()) == {0, 1, 2}
    for number in (0, 5, 12, 30):
        reader.UpdateTimeStep(times[number])
        grid = reader.GetOutputDataObject(0)
        q, rate = trajectory.modal_coordinates[number], trajectory.modal_velocities[number]
        bend, stretch = rate[3], rate[4]
        expected = np.column_stack([
            rate[0] - rate[2] * (y - 0.5 * HEIGHT) + stretch * (2.0 * x / LENGTH - 1.0)
            - bend * (y - 0.5 * HEIGHT) * k * np.sin(k * (x - 0.5 * LENGTH)),
            rate[1] + rate[2] * (x - 0.5 * LENGTH)
            + bend * (0.5 - np.cos(k * (x - 0.5 * LENGTH))), 0 * x])
        np.testing.assert_allclose(point_data(grid, "velocity"), expected, rtol=2e-5, atol=1e-10)
        states = point_data(grid, "contact_state")
        assert states.dtype == np.int8
        assert (states[~bottom] == -1).all()
        assert np.array_equal(states[bottom], trajectory.contact_state[number][owner])
        stress = vtk_to_numpy(grid.GetCellData().GetArray("stress"))
        assert stress.shape == (40, 6)  # which ParaView calls XX, YY, ZZ, XY, YZ, XZ
        # The mean of the two corners' cosines.
        ends = np.cos(k * (cells - 0.5 * LENGTH)) * np.cos(0.5 * k * LENGTH / 20.0)
        np.testing.assert_allclose(
            stress[:, 0], YOUNGS_MODULUS * (2.0 / LENGTH * q[4] - heights * k**2 * ends * q[3]),
            rtol=2e-5, atol=1.0)
        assert not stress[:, 1:].any()
    with h5py.File(tmp_path / "case.vtkhdf") as file:
        names = file["VTKHDF/CellData/stress"].attrs["component_names"]
        assert names.tolist() == ["xx", "yy", "zz", "xy", "yz", "xz"]
        assert file["VTKHDF/PointData/velocity"].attrs["unit"] == "m/s"


@pytest.mark.parametrize(("components", "expected"), [
    ((3e6, 0.0, 0.0, 0.0), 3e6), ((0.0, -3e6, 0.0, 0.0), 3e6), ((0.0, 0.0, 3e6, 0.0), 3e6),
    ((0.0, 0.0, 0.0, 2e6), 2e6 * np.sqrt(3.0)), ((5e6, 5e6, 5e6, 0.0), 0.0),
    ((4e6, 4e6, 0.0, 0.0), 4e6), ((4e6, -4e6, 0.0, 0.0), 4e6 * np.sqrt(3.0)),
])
def test_von_mises_of_known_stress_states(components, expected):
    stress = np.array(components).reshape(1, 4, 1)
    field = ModeShapes(np.zeros((1, 2)), None, None, np.zeros((1, 2, 1)), stress, None)
    np.testing.assert_allclose(von_mises(field, np.array([[1.0], [-2.0]]))[:, 0],
                               [expected, 2.0 * expected], rtol=1e-14)


def test_nodal_contact_forces_add_up_to_the_contact_forces(tmp_path):
    trajectory = run(times=41)
    write_case(tmp_path / "case.vtkhdf", trajectory, frames=41)
    total = trajectory.normal_force.sum(axis=1)
    assert np.count_nonzero(total) > 10
    reader, times = open_by_vtk(tmp_path / "case.vtkhdf")
    y = trajectory.system.basis.mode_shapes.nodes[:, 1]
    for k in np.flatnonzero(total):
        reader.UpdateTimeStep(times[k])
        force = point_data(reader.GetOutputDataObject(0), "contact_force").astype(float)
        assert not force[y > 0.0].any()
        assert force[:, 1].sum() == pytest.approx(total[k], rel=1e-6)
        assert force[:, 0].sum() == pytest.approx(-trajectory.friction_force[k].sum(), rel=1e-6)
        assert not force[:, 2].any()


@pytest.mark.parametrize("frames", [0, 7])
def test_read_case_is_equal_to_the_last_bit(tmp_path, frames):
    thick = replace(basis(), thickness=0.01)
    written = replace(run(thick, times=31, waviness=3e-6), status=Status.INTERRUPTED,
                      work=np.random.default_rng(1).normal(size=(31, len(POWERS))),
                      statistics={"steps": 12, "seconds": 0.1 + 0.2, "solver": "radau",
                                  "factorisations": np.int64(3), "rtol": np.float64(1e-6)})
    written = replace(written, system=written.system.with_(
        **{"friction.static_coefficient": (0.1, 0.2, 0.3, 0.4, 1 / 3), "gap": (0, 1e-6, 0, 0, 0)}))
    study = '[ground]\nspeed = 0.02  # µm'
    assert write_case(tmp_path / "case.vtkhdf", written, frames=frames, study=study) \
        == tmp_path / "case.vtkhdf"
    case = read_case(tmp_path / "case.vtkhdf")
    read = case.trajectory
    for name in ("time", "modal_coordinates", "modal_velocities", "work", "normal_force",
                 "friction_force", "penetration", "slip_velocity", "contact_state"):
        assert np.array_equal(getattr(read, name), getattr(written, name)), name
    for name in ("angular_frequencies", "damping", "T", "positions", "tributary"):
        assert np.array_equal(getattr(read.system.basis, name),
                              getattr(written.system.basis, name)), name
    assert read.system.basis.thickness == written.system.basis.thickness
    for name in ("nodes", "cells", "outline", "shapes", "stress"):
        assert np.array_equal(getattr(read.system.basis.mode_shapes, name),
                              getattr(written.system.basis.mode_shapes, name)), name
    assert read.system.parameters() == written.system.parameters()
    assert read.system.gap == written.system.gap
    assert (read.status, read.statistics, case.study) == (Status.INTERRUPTED, written.statistics,
                                                          study)
    assert set(case.versions) == {"fecontact", "numpy", "scipy", "numba", "scikit-fem"}
    assert case.versions["numpy"] == np.__version__


def test_file_says_its_units_and_holds_the_histories(tmp_path):
    trajectory = run(times=11)
    write_case(tmp_path / "case.vtkhdf", trajectory, frames=4)
    with h5py.File(tmp_path / "case.vtkhdf") as file:
        assert np.array_equal(file["trajectory/normal_force"], trajectory.normal_force)
        units = {name: data.attrs["unit"] for name, data in file["trajectory"].items()}
        assert units["normal_force"] == "N"
        assert units["slip_velocity"] == "m/s"
        assert "study" not in file
        assert file["VTKHDF/PointData/displacement"].attrs["unit"] == "m"
        assert file["VTKHDF"].attrs["Type"] == b"UnstructuredGrid"
        assert file["VTKHDF/Points"].shape == (len(trajectory.system.basis.mode_shapes.nodes), 3)


def test_sweeps_and_bodies_without_shapes_leave_the_frames_out(tmp_path):
    write_case(tmp_path / "a.vtkhdf", run(times=5), frames=0)
    mass = basis_from_matrices(np.eye(2), np.diag([0.0, 1e4]),
                               {"contact": np.array([[[1, 0], [0, 1], [0, 0]]])})
    plain = run(times=5)
    system = replace(plain.system, basis=mass)
    write_case(tmp_path / "b.vtkhdf", Trajectory(
        system, plain.time, plain.modal_coordinates[:, :2], plain.modal_velocities[:, :2],
        plain.work))
    for name in ("a.vtkhdf", "b.vtkhdf"):
        with h5py.File(tmp_path / name) as file:
            assert "VTKHDF" not in file
    assert read_case(tmp_path / "b.vtkhdf").trajectory.system.basis.mode_shapes is None


def test_frames_are_the_output_times_nearest_to_even_spacing():
    time = np.linspace(0.0, 1.0, 101)
    assert np.array_equal(frame_indices(time, 11), np.arange(0, 101, 10))
    assert np.array_equal(frame_indices(time, 101), np.arange(101))
    assert np.array_equal(frame_indices(time, 500), np.arange(101))
    assert np.array_equal(frame_indices(time, 3, t_start=0.5), [50, 75, 100])
    assert np.array_equal(frame_indices(time, 1), [0])
    assert not len(frame_indices(time, 0))
    crowded = np.concatenate([np.linspace(0.0, 0.01, 1000), [0.5, 1.0]])
    chosen = frame_indices(crowded, 5)
    assert np.array_equal(crowded[chosen], [0.0, crowded[999], 0.5, 1.0])
    with pytest.raises(InputError, match="frames = -1"):
        frame_indices(time, -1)
    with pytest.raises(InputError, match=r"no output time from 2.0 s to 1 s; the"):
        frame_indices(time, 5, t_start=2.0)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_interrupted_write_leaves_what_was_there(tmp_path, monkeypatch, error):
    def fail(*args):
        raise error

    (tmp_path / "old.vtkhdf").write_bytes(b"earlier")
    monkeypatch.setattr(store, "write_vtkhdf", fail)
    for name in ("new.vtkhdf", "old.vtkhdf"):
        with pytest.raises(error):
            write_case(tmp_path / name, run(times=5))
    assert [path.name for path in tmp_path.iterdir()] == ["old.vtkhdf"]
    assert (tmp_path / "old.vtkhdf").read_bytes() == b"earlier"


def test_errors_of_reading_and_writing_say_what_is_wrong(tmp_path):
    trajectory = run(times=5)
    with pytest.raises(InputError, match="does not exist"):
        read_case(tmp_path / "missing.vtkhdf")
    (tmp_path / "text.vtkhdf").write_text("no HDF5")
    with pytest.raises(InputError, match="not an HDF5 file"):
        read_case(tmp_path / "text.vtkhdf")
    with h5py.File(tmp_path / "other.vtkhdf", "w") as file:
        file.create_group("VTKHDF")
    with pytest.raises(InputError, match="not written by fecontact"):
        read_case(tmp_path / "other.vtkhdf")
    write_basis(tmp_path / "basis.h5", trajectory.system.basis)
    with pytest.raises(InputError, match=r"no run; read it with read_basis"):
        read_case(tmp_path / "basis.h5")
    write_case(tmp_path / "cut.vtkhdf", trajectory)
    with h5py.File(tmp_path / "cut.vtkhdf", "a") as file:
        del file["trajectory/work"]
    with pytest.raises(InputError, match="damaged"):
        read_case(tmp_path / "cut.vtkhdf")
    with pytest.raises(InputError, match="does not exist"):
        write_case(tmp_path / "nowhere" / "case.vtkhdf", trajectory)
    with pytest.raises(InputError, match=r"frames = 2\.5"):
        write_case(tmp_path / "case.vtkhdf", trajectory, frames=2.5)


def test_pvd_lists_frames_that_vtk_reads(tmp_path):
    trajectory = run(basis(columns=6, rows=2), times=21)
    write_case(tmp_path / "case.vtkhdf", trajectory, frames=0)
    listed = export_pvd(tmp_path / "case.vtkhdf", tmp_path / "folder", frames=3)
    assert listed == tmp_path / "folder" / "folder.pvd"
    assert sorted(path.name for path in listed.parent.iterdir()) == [
        "folder.pvd", "folder_0000.vtu", "folder_0001.vtu", "folder_0002.vtu"]
    assert [f'timestep="{t!r}"' in listed.read_text() for t in trajectory.time[[0, 10, 20]]
            .tolist()] == [True] * 3
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "folder" / "folder_0002.vtu"))
    reader.Update()
    expected = trajectory.system.basis.mode_shapes.shapes @ trajectory.modal_coordinates[20]
    moved = point_data(reader.GetOutput(), "displacement")
    np.testing.assert_allclose(moved[:, :2], expected, rtol=2e-5, atol=1e-12)
    force = point_data(reader.GetOutput(), "contact_force").astype(float).sum(axis=0)
    assert force[1] == pytest.approx(trajectory.normal_force[20].sum(), rel=1e-5)

    beside = export_pvd(trajectory, tmp_path / "new" / "run.pvd", frames=2)
    assert beside.is_file()
    assert 'file="run/run_0001.vtu"' in beside.read_text()
    assert (tmp_path / "new" / "run" / "run_0001.vtu").is_file()


def test_pvd_frames_hold_velocity_and_contact_state(tmp_path):
    """VTK reads equal data from the VTU files and from the temporal file."""
    trajectory = run(basis(LENGTH, HEIGHT, columns=20, rows=2), times=31)
    reader, times = open_by_vtk(write_case(tmp_path / "case.vtkhdf", trajectory, frames=31))
    listed = export_pvd(trajectory, tmp_path / "frames", frames=31)
    seen = set()
    for number in (0, 5, 12, 21, 30):
        reader.UpdateTimeStep(times[number])
        expected = reader.GetOutputDataObject(0)
        frame = vtkXMLUnstructuredGridReader()
        frame.SetFileName(str(listed.with_name(f"frames_{number:04d}.vtu")))
        frame.Update()
        for name in ("displacement", "velocity", "von_mises", "contact_force", "contact_state"):
            np.testing.assert_array_equal(point_data(frame.GetOutput(), name),
                                          point_data(expected, name))
        velocity = point_data(frame.GetOutput(), "velocity")[:, :2]
        np.testing.assert_allclose(velocity, trajectory.system.basis.mode_shapes.shapes
                                   @ trajectory.modal_velocities[number], rtol=2e-5, atol=1e-10)
        seen |= set(point_data(frame.GetOutput(), "contact_state").tolist())
    assert seen == {-1, *trajectory.contact_state[[0, 5, 12, 21, 30]].ravel().tolist()}
    assert len(seen) > 2


def test_pvd_is_whole_or_not_there(tmp_path, monkeypatch):
    trajectory = run(basis(columns=4, rows=2), times=5)
    export_pvd(trajectory, tmp_path / "kept", frames=4)
    before = sorted((tmp_path / "kept").iterdir())
    calls = []

    def fail(*args):
        calls.append(args)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return original(*args)

    original = pvd.write_vtu
    monkeypatch.setattr(pvd, "write_vtu", fail)
    for place in ("kept", "fresh", "inside/run.pvd"):
        calls.clear()
        with pytest.raises(KeyboardInterrupt):
            export_pvd(trajectory, tmp_path / place, frames=3)
    assert list(tmp_path.iterdir()) == [tmp_path / "kept"]
    assert sorted((tmp_path / "kept").iterdir()) == before
    monkeypatch.undo()
    export_pvd(trajectory, tmp_path / "kept", frames=2)
    assert len(list((tmp_path / "kept").iterdir())) == 3
    (tmp_path / "kept" / "notes.txt").touch()
    with pytest.raises(InputError, match=r"other files \(notes\.txt\)"):
        export_pvd(trajectory, tmp_path / "kept")
    with pytest.raises(InputError, match="at least 1"):
        export_pvd(trajectory, tmp_path / "none", frames=0)


def test_units_suit_the_size():
    assert suitable_unit(2e-5, "m") == (1e-6, "µm")
    assert suitable_unit(1e-3, "m") == (1e-3, "mm")
    assert suitable_unit(0.0, "Pa") == (1.0, "Pa")
    assert suitable_unit(1e-15, "m") == (1e-9, "nm")
    assert suitable_unit(-3e7, "Pa") == (1e6, "MPa")
    assert quantity(0.0123, "m") == "12.3 mm"
    assert [round_125(x) for x in (1.0, 1.99, 2.0, 4.9, 5.0, 999.0, 0.03)] == \
        pytest.approx([1, 1, 2, 2, 5, 500, 0.02])
