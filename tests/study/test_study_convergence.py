"""Convergence of the bodies of a study with their meshes and modes."""

import numpy as np
import pytest
from scipy.linalg import block_diag, eigh

import fecontact as fc
from fecontact.analysis import prestressed_modes
from fecontact.cli import execute
from fecontact.cli.templates import template
from fecontact.plot import plot_convergence
from fecontact.reduction import (
    assembled_basis,
    bodies_convergence,
    interface_compliance,
)
from fecontact.study import study_convergence

BOLT = {"links.bolt": {"kind": "spring", "first": "pad.C", "second": "block.foot",
                       "stiffness": 5e7},
        "bodies.block.basis.points": {"foot": [0.03, 0.02]},
        "bodies.pad.basis.tolerance": 0.0, "bodies.block.basis.tolerance": 0.0}


@pytest.fixture(scope="module")
def study():
    return fc.Study.from_toml(template("pad")).with_(
        **{"bodies.pad.basis.reduction": "vibration", "bodies.pad.basis.modes": 8})


@pytest.fixture(scope="module")
def found(study):
    calls = []
    result = study_convergence(study, progress=lambda done, steps: calls.append((done, steps)))
    assert calls == [(done, 6) for done in range(1, 7)]
    return result


def test_meshes_of_all_bodies_are_refined(study, found):
    """Cells are cut into four: 12 x 4 and 6 x 2 cells of nine nodes, the block's lowest held."""
    assert found.unknowns["pad"].tolist() == [2 * 13 * 5, 2 * 25 * 9, 2 * 49 * 17]
    assert found.unknowns["block"].tolist() == [2 * 25 * 8, 2 * 49 * 16, 2 * 97 * 32]
    for frequencies in found.frequencies_hz.values():
        assert frequencies.shape == (3, 6)
        assert (np.diff(frequencies, axis=0) < 0.0).all()
    # A mesh of displacements is too stiff; the given one to some per cent.
    compliance = found.compliance["lining"]
    assert (np.diff(compliance, axis=0) > 0.0).all()
    np.testing.assert_allclose(compliance[0], compliance[-1], rtol=0.02)


def test_more_modes_resolve_more(study, found):
    assert found.modes["pad"].tolist() == [4, 8, 16, 32]
    missing = found.missing["lining"]
    assert (np.diff(missing, axis=0) < 0.0).all()
    basis = assembled_basis(study.modal_bases(), study.pairings())
    one = interface_compliance(basis, study.elastic_bodies())["lining"]
    assert missing[1].max() == pytest.approx(1.0 - one.worst, rel=1e-12)
    text = str(found)
    assert f"{missing[1, 0]:.2%}" in text
    assert "body 'pad':" in text
    assert "interface 'lining', missing compliance" in text
    assert found.joined_hz is None
    axes = plot_convergence(found).axes
    assert axes[0].get_xlabel() == "unknowns of the meshes"
    assert [line.get_label() for line in axes[1].lines] == ["lining, tangential", "lining, normal"]


def test_linked_bodies_have_frequencies_of_their_own(study):
    """Close above those of both finite-element models with the spring, computed densely."""
    bolted = study.with_(**BOLT, **{"bodies.pad.basis.reduction": "residual"})
    found = study_convergence(bolted, levels=2)
    assert found.joined == "linked bodies"
    bodies, bases = bolted.elastic_bodies(), bolted.modal_bases()
    K, M, rows = [], [], []
    for name, point, sign in (("block", "foot", 1.0), ("pad", "C", -1.0)):
        E = bodies[name].expansion.toarray()
        K.append(E.T @ bodies[name].stiffness @ E)
        M.append(E.T @ bodies[name].mass @ E)
        basis = bases[name]
        index = basis.point_index(point)
        rows.append(sign * basis.mode_shapes.restriction.toarray()[3 * index : 3 * index + 2] @ E)
    # From the block's foot at (0.03, 0.02) to the middle of the pad's top.
    along = np.array([0.06, 0.06]) - [0.03, 0.02]
    row = along / np.linalg.norm(along) @ np.hstack(rows)
    squares = eigh(block_diag(*K) + 5e7 * np.outer(row, row), block_diag(*M), eigvals_only=True)
    exact = np.sqrt(squares[squares > 1e-9 * squares[-1]]) / (2.0 * np.pi)
    ratio = found.joined_hz[0] / exact[:6]
    assert (ratio > 1.0 - 1e-6).all()
    # The lowest is that of the pad on the spring, within one per mille.
    assert ratio[0] < 1.001
    assert found.joined_hz[0, 0] < 0.9 * found.frequencies_hz["pad"][0, 0]
    assert "linked bodies:\n" in str(found)


def test_stuck_bodies_are_those_of_the_preload(study):
    pressed = study.with_(**{"preload": {"load_scale": [0.0, 1.0], "steps": 5}})
    found = study_convergence(pressed, levels=2)
    modes = prestressed_modes(pressed.system(), pressed.load_history())
    np.testing.assert_allclose(found.joined_hz[0], modes.frequencies_hz[:6], rtol=1e-12)
    assert "about the end of the preload:" in str(found)


def test_a_refined_study_is_the_same_on_finer_meshes(study):
    fine = study.refined()
    assert fine == study
    assert len(fine.meshes()["pad"].cells) == 4 * len(study.meshes()["pad"].cells)
    assert fine.pairings()["lining"].tributary.sum() == pytest.approx(0.06)
    assert fine.with_(**{"load.normal": 3.0}).meshes()["pad"] is fine.meshes()["pad"]
    beam = fc.Study.from_toml(template("beam"))
    assert len(beam.refined().mesh().cells) == 4 * len(beam.mesh().cells)


def test_few_modes_and_what_is_refused(study, found):
    few = study.with_(**{"bodies.pad.basis.reduction": "residual", "bodies.pad.basis.modes": 4,
                         "bodies.pad.basis.select": [0, 1, 2, 3]})
    assert study_convergence(few, levels=2).missing["lining"].shape == (4, 2)
    for levels in (1, 2.5, "a"):
        with pytest.raises(fc.InputError, match=r"levels = .* must be a whole number, 2 or above"):
            study_convergence(study, levels=levels)
    with pytest.raises(fc.InputError, match="study must be a Study"):
        study_convergence("study.toml")
    basis = assembled_basis(study.modal_bases(), study.pairings())
    given = (study.elastic_bodies(), basis)
    alone = assembled_basis({"pad": study.modal_bases()["pad"]}, {})
    for meshes, modes, options, told in (
            ([given], [basis], {}, "at least two"), ([given] * 2, [], {}, "modes is empty"),
            ([given] * 2, [basis], {"joined_hz": [[1.0]]}, "must have 2 rows"),
            ([given] * 2, [alone], {}, "the same bodies"), ([given] * 2, [3], {}, "ModalBasis"),
            ([3, 4], [basis], {}, "meshes must hold pairs"),
            (None, [basis], {}, "meshes must be a sequence")):
        with pytest.raises(fc.InputError, match=f"bodies_convergence.*{told}"):
            bodies_convergence(meshes, modes, **options)


@pytest.mark.slow
def test_the_command_prints_and_draws_it(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert execute(["init", "a.toml", "--shape", "pad"]) == 0
    assert execute(["modes", "a.toml", "--converge",
                    "--set", "bodies.pad.basis.reduction=vibration"]) == 0
    out = capsys.readouterr().out
    assert "note: Interface 'lining' is too stiff: only" in out
    assert "interface 'lining', missing compliance" in out
    assert (tmp_path / "results" / "a-convergence.png").exists()


def test_the_command_names_bodies_that_only_links_hold(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tables = fc.Study.from_toml(template("pad")).with_(**BOLT).tables(defaults=False)
    del tables["interfaces"]
    (tmp_path / "a.toml").write_text(fc.Study.from_tables(tables).to_toml())
    assert execute(["modes", "a.toml"]) == 0
    out = capsys.readouterr().out
    assert out.count("The body touches nothing at an interface.") == 2
    assert "Static compliance that the modes resolve" not in out
