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
    size = grid.volume if space else grid.area
    assert size == pytest.approx(np.prod([np.ptp(line) for line in lines[:d]]))
    assert to_pyvista(run).field_data["time"][0] == run.time[-1]
    with pytest.raises(InputError, match=r"time = 2\.0 must be from 0 to"):
        to_pyvista(run, 2.0)
