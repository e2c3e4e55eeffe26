"""Runs in other formats, read back by other libraries."""

import csv
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.io import loadmat
from synthetic import basis, run

from fecontact import InputError, MissingLibraryError, read_case, write_case
from fecontact.cli import execute
from fecontact.io import to_pandas, to_xarray
from fecontact.output.files import export


@pytest.fixture(scope="module")
def trajectory():
    return run(basis(contact_nodes=3), times=1501)


def test_csv_reads_back_to_the_last_bit(trajectory, tmp_path):
    path = export.export_csv(trajectory, tmp_path / "run.csv")
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    names, table = rows[0], np.array(rows[1:], dtype=float)
    assert table.shape == (1501, len(names))
    assert len(set(names)) == len(names)
    expected = {
        "time [s]": trajectory.time,
        "B displacement x [m]": trajectory.displacement("B")[:, 0],
        "C velocity phi [rad/s]": trajectory.velocity("C")[:, 2],
        "node 2 displacement y [m]": trajectory.displacement(2)[:, 1],
        "node 1 normal force [N]": trajectory.normal_force[:, 1],
        "node 1 friction force on the body in -x [N]": trajectory.friction_force[:, 1],
        "node 0 contact state [0 open, 1 stick, 2 slip]": trajectory.contact_state[:, 0],
        "energy kinetic [J]": trajectory.energies.kinetic,
    }
    for name, values in expected.items():
        np.testing.assert_allclose(table[:, names.index(name)], values, rtol=1e-12, atol=1e-22)
    np.testing.assert_array_equal(table[:, 0], trajectory.time)


def test_mat_holds_arrays_names_and_units(trajectory, tmp_path):
    content = loadmat(export.export_mat(trajectory, tmp_path / "run.mat"), simplify_cells=True)
    np.testing.assert_array_equal(content["time"], trajectory.time)
    np.testing.assert_array_equal(content["normal_force"], trajectory.normal_force)
    np.testing.assert_array_equal(content["contact_state"], trajectory.contact_state)
    np.testing.assert_array_equal(content["modal_velocities"], trajectory.modal_velocities)
    np.testing.assert_allclose(content["displacement"][:, 1], trajectory.displacement("C"),
                               atol=1e-20)
    assert list(content["point"]) == ["B", "C"]
    assert content["units"]["slip_velocity"] == "m/s"
    np.testing.assert_array_equal(content["line_load"], trajectory.line_load)
    assert content["units"]["line_load"] == "N/m"
    assert "pressure" not in content
    thick = run(replace(trajectory.system.basis, thickness=0.01), times=3)
    content = loadmat(export.export_mat(thick, tmp_path / "thick.mat"), simplify_cells=True)
    np.testing.assert_allclose(content["pressure"], 100.0 * thick.line_load)
    assert content["units"]["pressure"] == "Pa"
    assert content["status"] == "The run reached its end."


def test_xarray_has_named_dimensions(trajectory, tmp_path):
    import xarray

    path = export.export_netcdf(trajectory, tmp_path / "run.nc")
    with xarray.open_dataset(path, engine="scipy") as stored:
        for dataset in (to_xarray(trajectory), stored):
            x = dataset.displacement.sel(point="B", component="x")
            np.testing.assert_allclose(x, trajectory.displacement("B")[:, 0], atol=1e-20)
            assert dataset.friction_force.dims == ("time", "node")
            np.testing.assert_array_equal(dataset.friction_force, trajectory.friction_force)
            np.testing.assert_array_equal(dataset.node_x, trajectory.system.basis.contact_x)
            assert dataset.friction_force.attrs == {
                "units": "N", "long_name": "friction force on the body in -x"}
            late = dataset.sel(time=slice(0.01, None))
            assert late.sizes["time"] == np.count_nonzero(trajectory.time >= 0.01)


def test_pandas_has_the_columns_of_the_csv_file(trajectory, tmp_path):
    frame = to_pandas(trajectory)
    export.export_csv(trajectory, tmp_path / "run.csv")
    # Python's numbers are exact; those of older versions of pandas are not.
    with (tmp_path / "run.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["time [s]", *frame.columns]
    table = np.array([[float(word) for word in row] for row in rows])
    assert (table[:, 0] == frame.index).all()
    assert (table[:, 1:] == frame.to_numpy(float)).all()
    # The highest speed of B: by the frame's own means.
    assert frame["B velocity x [m/s]"].abs().idxmax() == trajectory.time[
        np.abs(trajectory.velocity("B")[:, 0]).argmax()]


def test_a_case_is_one_call_away_from_xarray_and_pandas(trajectory, tmp_path):
    case = read_case(write_case(tmp_path / "beam.vtkhdf", trajectory, frames=0))
    assert case.to_xarray().identical(to_xarray(trajectory))
    assert case.to_pandas().equals(to_pandas(trajectory))


@pytest.mark.parametrize("library", ["pandas", "xarray"])
def test_missing_libraries_are_named(trajectory, monkeypatch, library):
    monkeypatch.setitem(sys.modules, library, None)
    convert = {"pandas": to_pandas, "xarray": to_xarray}[library]
    with pytest.raises(MissingLibraryError, match=f"{library} is not installed; install it with"):
        convert(trajectory)


def test_files_are_whole_or_not_there(trajectory, tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"folder .*nowhere does not exist"):
        export.export_csv(trajectory, tmp_path / "nowhere" / "run.csv")

    def stop(part, *args, **options):
        part.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr("scipy.io.savemat", stop)
    with pytest.raises(KeyboardInterrupt):
        export.export_mat(trajectory, tmp_path / "run.mat")
    assert not list(tmp_path.iterdir())


def test_command_line(trajectory, tmp_path, capsys):
    case = write_case(tmp_path / "beam.vtkhdf", trajectory, frames=0)
    assert execute(["export", str(case), "--format", "csv"]) == 0
    assert execute(["export", str(case), "--format", "netcdf", "-o",
                    str(tmp_path / "new" / "b.nc")]) == 0
    assert f"wrote {tmp_path / 'beam.csv'}" in capsys.readouterr().out
    assert (tmp_path / "new" / "b.nc").is_file()
    assert execute(["export", str(case), "--format", "mat", "-o", str(tmp_path / "b.csv")]) == 1
    assert "b.csv must end in .mat for the format mat." in capsys.readouterr().err
