"""Refinement of meshes and the study of convergence that it serves."""

import numpy as np
import pytest
from meshes_for_tests import rectangle

from fecontact import ElasticBody, modal_basis
from fecontact.plot import plot_convergence
from fecontact.reduction import BasisReport, mode_convergence


def test_residual_vectors_are_counted_beside_the_modes():
    """They leave less than the tolerance missing with any modes, and the table says so."""
    body = ElasticBody(rectangle(0.2, 0.02, 10, 2), thickness=0.01)
    result = mode_convergence(body, lambda part, count: modal_basis(
        part, count, contact="bottom", contact_nodes=5, reduction="residual", tolerance=0.1), 8,
        levels=2)
    own = modal_basis(body, 8, contact="bottom", contact_nodes=5, reduction="residual",
                      tolerance=0.1)
    assert result.residual_vectors[1] == own.modes - 8 > 0
    assert (result.missing <= 0.1).all()
    text = str(result)
    assert f"{8:9d} {own.modes - 8:16d}" in text
    assert "does not tell whether modes are enough" in text


@pytest.mark.parametrize("triangles", [False, True])
def test_refined_mesh_covers_the_same_body(triangles):
    mesh = rectangle(0.2, 0.02, 5, 2, triangles=triangles, points={"C": (0.1, 0.02)},
                     warp=lambda nodes: nodes + 0.003 * np.sin(40.0 * nodes[:, ::-1]))
    fine = mesh.refined()
    assert len(fine.cells) == 4 * len(mesh.cells)
    assert fine.area == pytest.approx(mesh.area, rel=1e-13)
    np.testing.assert_array_equal(fine.nodes[: len(mesh.nodes)], mesh.nodes)
    assert len(fine.outline) == 2 * len(mesh.outline)
    for name, edges in mesh.boundaries.items():
        halves = fine.boundaries[name]
        assert len(halves) == 2 * len(edges)
        lengths = [np.linalg.norm(np.diff(m.nodes[e], axis=1), axis=2).sum()
                   for m, e in ((mesh, edges), (fine, halves))]
        assert lengths[1] == pytest.approx(lengths[0], rel=1e-13)
    assert fine.points == mesh.points


def test_study_of_a_beam():
    body = ElasticBody(rectangle(0.2, 0.02, 10, 2), thickness=0.01)
    calls = []
    result = mode_convergence(
        body, lambda part, count: modal_basis(part, count, contact="bottom", contact_nodes=5), 8,
        progress=lambda done, steps: calls.append((done, steps)))
    # Each mesh has the cells of the last cut into four: 21 x 5 nodes, then 41 x 9 and 81 x 17.
    np.testing.assert_array_equal(result.unknowns, [2 * 21 * 5, 2 * 41 * 9, 2 * 81 * 17])
    np.testing.assert_array_equal(result.modes, [4, 8, 16, 32])
    assert np.all(np.diff(result.frequencies_hz, axis=0) < 0.0)
    change = np.abs(np.diff(result.frequencies_hz, axis=0))
    assert np.all(change[1] < 0.2 * change[0])
    assert np.all(np.diff(result.compliance, axis=0) > 0.0)
    assert np.all(np.diff(result.missing, axis=0) < 0.0)
    np.testing.assert_allclose(
        result.missing[1],
        BasisReport(modal_basis(body, 8, contact="bottom",
                                contact_nodes=5)).contact_error.max(axis=0))
    assert calls[-1] == (6, 6)
    text = str(result)
    assert f"{result.frequencies_hz[0, 0]:.6g}" in text
    assert f"{result.missing[1, 0]:.2%}" in text
    assert not result.residual_vectors.any()
    assert "esidual" not in text
    axes = plot_convergence(result).axes
    assert axes[0].get_xlabel() == "unknowns of the mesh"
    assert axes[1].get_ylabel() == "missing contact compliance, worst node [%]"
