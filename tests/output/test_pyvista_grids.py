"""A run at one time as a grid of PyVista."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from solid_blocks import mixed_mesh

import fecontact as fc
from fecontact.core.errors import InputError
from fecontact.io import to_pyvista
from fecontact.laws import ConstantFriction, LinearContact

pytest.importorskip("pyvista")


@pytest.mark.parametrize("kind", [
    "plane", "mixed plane", "serendipity plane", "bricks", "mixed", "serendipity mixed"])
def test_a_grid_has_the_fields_of_the_run(kind):
    space = "plane" not in kind
    lines = [np.linspace(0.0, 0.1, 4), np.linspace(0.0, 0.02, 3), np.linspace(0.0, 0.02, 3)]
    mesh = (mixed_mesh((1, 2, 2), (0.1, 0.02, 0.02)) if "mixed" in kind and space
            else rectangle(0.1, 0.02, 3, 2, triangles=lambda at: at[:, 0] > 0.05)
            if "mixed" in kind else fc.Mesh.grid(*lines[: 3 if space else 2]))
    body = fc.ElasticBody(mesh, bricks="serendipity" if "serendipity" in kind else "full")
    basis = fc.modal_basis(body, 8, contact="contact" if "mixed" in kind and space else "bottom")
    system = fc.ContactSystem(basis, LinearContact(1e8), ConstantFriction(0.3),
                              load=fc.Load(gravity=(0.0, 0.0, -9.81)[3 - mesh.nodes.shape[1] :]))
    run = fc.simulate(system, 1e-3, outputs=11)
    grid = to_pyvista(run, 0.48e-3)
    d, shapes = mesh.nodes.shape[1], basis.mode_shapes
    assert grid.field_data["time"][0] == run.time[5]
    np.testing.assert_allclose(grid.points[:, :d], shapes.nodes, rtol=1e-6)
    moved = np.einsum("ndm,m->nd", shapes.shapes, run.modal_coordinates[5])
    np.testing.assert_allclose(grid.point_data["displacement"][:, :d], moved, rtol=1e-4,
                               atol=1e-6 * np.abs(moved).max())
    force = grid.point_data["contact_force"][:, d - 1].sum()
    assert force == pytest.approx(run.normal_force[5].sum(), rel=1e-5)
    if "serendipity" in kind:
        assert set(grid.celltypes.tolist()) == ({25, 26, 27, 24} if space else {23})
    size = grid.volume if space else grid.area
    assert size == pytest.approx(np.prod([np.ptp(line) for line in lines[:d]]))
    assert to_pyvista(run).field_data["time"][0] == run.time[-1]
    with pytest.raises(InputError, match=r"time = 2\.0 must be from 0 to"):
        to_pyvista(run, 2.0)


@pytest.mark.parametrize("kind", ["plane", "bricks", "mixed"])
def test_files_interpolate_serendipity_elements_as_they_are(tmp_path, kind):
    """VTK's own functions give a quadratic field inside of elements, which cut cells do not."""
    import pyvista
    import vtk

    mesh = (mixed_mesh((1, 2, 2), (0.1, 0.02, 0.02)) if kind == "mixed" else fc.Mesh.grid(
        *[np.linspace(0.0, 0.1, 4), np.linspace(0.0, 0.02, 3),
          np.linspace(0.0, 0.02, 3)][: 2 if kind == "plane" else 3]))
    body = fc.ElasticBody(mesh, bricks="serendipity")
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)

    def quadratic(places):
        x, y = places[:, 0], places[:, 1]
        return np.stack([x**2, x * y, y**2][: places.shape[1]], axis=1)

    fields = fc.fem.BodyFields(body.nodes, body.elements, quadratic(body.nodes),
                               np.zeros((len(body.nodes), 4 if kind == "plane" else 6)))
    grid = pyvista.read(fc.io.export_fields(fields, tmp_path / "a.vtu"))
    assert grid.n_cells == len(mesh.cells)
    for number in range(grid.n_cells):
        cell = grid.GetCell(number)
        for local in np.random.default_rng(number).uniform(0.1, 0.3, (3, 3)):
            place, weights = np.zeros(3), np.zeros(cell.GetNumberOfPoints())
            cell.EvaluateLocation(vtk.reference(0), local, place, weights)
            points = [cell.GetPointId(k) for k in range(len(weights))]
            if grid.celltypes[number] == 27:
                # VTK's quadratic pyramids hold no squares; their nodes lie where VTK has them.
                local = np.reshape(cell.GetParametricCoords(), (-1, 3))[len(points) - 1]
                cell.EvaluateLocation(vtk.reference(0), local, place, weights)
                assert place == pytest.approx(grid.points[points[-1]], abs=1e-12)
            assert weights @ grid["displacement"][points] == pytest.approx(
                np.pad(quadratic(place[None, : len(low)])[0], (0, 3 - len(low))), abs=1e-12)
            assert ((place[: len(low)] >= low) & (place[: len(low)] <= high)).all()
