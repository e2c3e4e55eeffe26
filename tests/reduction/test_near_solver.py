"""Residual vectors of many rows of large solids, among few displacements, to their tolerance."""

from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from solid_blocks import block_mesh

import fecontact.reduction.static_modes.iterated_flexibility as iterated
import fecontact.reduction.static_modes.residual_vectors as residual_vectors
from fecontact import ElasticBody, Material, modal_basis
from fecontact.fem.contact_face import contact_nodes
from fecontact.reduction.eigenmodes import FreeSystem, free_modes
from fecontact.reduction.reduce_body import displacement_rows
from fecontact.reduction.solvers.near_solver import NearSolver
from fecontact.reduction.static_modes.flexibility import Flexibility
from fecontact.reduction.static_modes.iterated_flexibility import (
    IteratedFlexibility,
    StaticResponses,
    TrialSpace,
)

STEEL = Material(2.1e11, 0.3, 7850.0)


def column(fixed=None, cells="tetrahedra", count=9):
    """Loaded at its lower end."""
    mesh = block_mesh((4, 4, count), (0.8, 0.8, 0.2 * count), tetrahedra=cells == "tetrahedra")
    return ElasticBody(mesh, STEEL, fixed=fixed or {},
                       bricks="serendipity" if cells == "serendipity" else "full")


def loaded_rows(body, nodes=9):
    rows = displacement_rows(contact_nodes(body, "contact", nodes).matrix, 3)
    return sp.csr_array(rows @ body.expansion)


def residual_compliance(body, rows, modes):
    whole = Flexibility(FreeSystem.of(body, "direct"), rows).compliance
    w, shapes = modes
    at_rows = np.asarray(rows @ shapes[:, w > 0.0]) / w[w > 0.0]
    return whole - at_rows @ at_rows.T


@pytest.mark.parametrize(("fixed", "cells"), [
    ({}, "tetrahedra"), ({"top": "xyz"}, "tetrahedra"), ({"left": "x"}, "tetrahedra"),
    ({}, "hexahedra"), ({}, "serendipity")])
def test_what_linear_elements_lack_is_estimated(fixed, cells):
    """Linear elements lack less with each layer, and no more than the estimate, mostly less."""
    body = column(fixed, cells)
    system, rows = FreeSystem.of(body, "iterative"), loaded_rows(body)
    modes = free_modes(FreeSystem.of(body, "direct"), 12)
    exact = np.diag(residual_compliance(body, rows, modes))
    nodes = np.unique((rows @ body.expansion.T).tocsr().indices // 3)
    before = np.inf
    for layers in (1, 2, 3):
        near = NearSolver.of(body, system.iterative, nodes, layers)
        assert len(near.followers) > 0
        answers = StaticResponses.of(TrialSpace(system, near.solver, near), rows, modes, 1e-6)
        lacking = exact - np.diag(answers.compliance)
        assert (lacking > 0.0).all()
        most = 3.5 if cells == "serendipity" else 2.4
        assert ((answers.missing > 0.95 * lacking) & (answers.missing < most * lacking)).all()
        assert lacking.max() < 0.6 * before
        before = lacking.max()
    everywhere = NearSolver.of(body, system.iterative, nodes, 40)
    assert len(everywhere.followers) == 0
    answers = StaticResponses.of(TrialSpace(system, everywhere.solver, everywhere), rows, modes,
                                 1e-6)
    assert answers.compliance == pytest.approx(residual_compliance(body, rows, modes),
                                               abs=1e-6 * exact.max())


@cache
def high_column(held):
    return column({held: "xyz"} if held else {}, count=14)


@cache
def reduced(held, tolerance, eigensolver="direct"):
    """Modal basis with residual vectors."""
    options = {"contact": "contact", "contact_nodes": 25, "points": {"side": (0.8, 0.4, 0.9)},
               "loads": ["gravity", "left"], "reduction": "residual"}
    if not held:
        options["B"] = (0.8, 0.8, 2.8)
    return modal_basis(high_column(held), 10, tolerance=tolerance, eigensolver=eigensolver,
                       **options)


@pytest.mark.parametrize(("room", "layers"), [(3e9, (2, 4, 6)), (0.0, (2, 4, 6)), (3e9, ())])
@pytest.mark.parametrize("held", ["", "top"])
def test_no_row_lacks_more_than_the_tolerance(room, layers, held, monkeypatch):
    """Compliance against that by factors, with few vectors more; with few displacements or all."""
    monkeypatch.setattr(residual_vectors, "_LARGE", 0)
    monkeypatch.setattr(iterated, "_ROOM", room)
    monkeypatch.setattr(iterated, "_LAYERS", layers)
    monkeypatch.setattr(iterated, "_WORTH", 0.9)
    body = high_column(held)
    used = []
    suited = TrialSpace.suited
    monkeypatch.setattr(TrialSpace, "suited", lambda *given: used.append(suited(*given))
                        or used[-1])
    for tolerance in (0.3, 0.1):
        one, other = reduced(held, tolerance), reduced.__wrapped__(held, tolerance, "iterative")
        assert (used[-1].near is not None) == bool(layers)
        # Without C, and perhaps B.
        there = np.arange(len(one.T)) >= 2
        there[0] = not held
        found, exact = (basis.quality.compliance[there].ravel() for basis in (other, one))
        # The iterations approach the whole from below.
        assert (found < exact * (1.0 + 1e-9)).all()
        assert found == pytest.approx(exact, rel=0.15 * tolerance)
        assert 1.0 <= other.modes / one.modes < 1.1
        elastic = other.angular_frequencies > 0.0
        w = other.angular_frequencies[elastic]
        rows = other.T[there, :3].reshape(len(exact), -1)[:, elastic] / w
        missing = 1.0 - (rows**2).sum(axis=1)[:-3] / exact[:-3]
        assert 0.5 * tolerance < missing.max() <= tolerance
        assert missing.min() > -1e-9
        # The same loads are answered, and added shapes are shapes of the body.
        assert other.quality.orthogonality < 1e-9
        shapes = other.mode_shapes.shapes.reshape(-1, other.modes)[:, elastic]
        stiffness = shapes.T @ (body.stiffness @ shapes) / np.outer(w, w)
        assert np.abs(stiffness - np.eye(len(w))).max() < 1e-7
        answered = (other.inertia_rows[:, elastic] / w**2) @ other.inertia_rows[:, elastic].T
        assert np.diag(answered) == pytest.approx(
            other.quality.load_compliance[0], rel=tolerance, abs=1e-20)


def test_rows_that_lack_too_much_are_answered_by_all_displacements(monkeypatch):
    """A sample of the rows is satisfied with fewer displacements than all rows need."""
    body = column()
    system, rows = FreeSystem.of(body, "iterative"), loaded_rows(body)
    modes = free_modes(FreeSystem.of(body, "direct"), 12)
    nodes = np.unique((rows @ body.expansion.T).tocsr().indices // 3)
    near = NearSolver.of(body, system.iterative, nodes, 1)
    monkeypatch.setattr(TrialSpace, "suited",
                        lambda *given: TrialSpace(system, near.solver, near))
    found = [IteratedFlexibility(system, rows, modes, 1e-3, tolerance)
             for tolerance in (0.9, 0.1)]
    assert [one.space.near is near for one in found] == [True, False]
    exact = residual_compliance(body, rows, modes) + found[1].compliance - found[1]._solved[
        1].compliance
    assert np.diag(found[1].compliance) == pytest.approx(np.diag(exact), rel=1e-5)
    assert (found[1].missing == 1e-6).all()
    # Few displacements say how much they may lack.
    lacking = 1.0 - np.diag(found[0].compliance) / np.diag(exact)
    assert (lacking < found[0].missing).all()
    assert lacking.max() > 0.03
