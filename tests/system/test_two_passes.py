"""Interfaces with contact nodes on both faces: one interface, totals shared by both passes."""

import sys
from pathlib import Path

import numpy as np
import pytest

import fecontact as fc
from fecontact import plot
from fecontact.cli import execute
from fecontact.cli.templates import template
from fecontact.fem import pair_both_faces, pair_faces
from fecontact.io import read_basis, write_basis
from fecontact.laws import ConstantFriction, EnergyWear, LinearContact, SlidingTranslation
from fecontact.reduction import reduce_bodies

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs" / "validation" / "cases"))
import stacked_blocks

STIFFNESS, AREA = 1e12, stacked_blocks.WIDTH * 0.02


def blocks(above=(8, 3), below=(8, 4)):
    return {"upper": stacked_blocks.block(stacked_blocks.HEIGHT, *above),
            "lower": stacked_blocks.block(0.0, *below, bottom="y")}


def pressed(bodies, passes, interfaces, shear=0.0):
    bases = reduce_bodies(bodies, passes, modes=4, tolerance=0.0, damping=0.02,
                          each={"upper": {"loads": ["top"]}})
    return fc.ContactSystem(bodies=bases, interfaces=interfaces, load=fc.Load(
        boundaries=(fc.BoundaryLoad("upper.top", pressure=stacked_blocks.PRESSURE, shear=shear),)))


def two_passes(above=(8, 3), below=(8, 4), nodes="all"):
    bodies = blocks(above, below)
    both = pair_both_faces(bodies, "upper.bottom", "lower.top", nodes=nodes)
    return pressed(bodies, [both], [
        fc.Interface("joint", both, LinearContact(STIFFNESS, 1e3), ConstantFriction(0.3))])


def at_rest(system):
    q = fc.equilibrium(system).modal_coordinates
    state = np.concatenate([q, np.zeros(system.size - len(q))])
    return q, system.contact_history(np.zeros(1), state[None])[0]


@pytest.mark.parametrize(("above", "below", "nodes", "error"), [
    ((8, 3), (8, 4), "all", 1e-11), ((9, 3), (6, 3), 5, 1e-11), ((8, 3), (6, 3), "all", 0.14)])
def test_uniform_pressure_passes_by_two_passes(above, below, nodes, error):
    """The patch test: uniaxial stress in both blocks, and the load as the sum of all forces.

    At nodes of meshes that do not match the pass with nodes on the coarser face loads the finer one
    unevenly; half of that remains.
    """
    system = two_passes(above, below, nodes)
    q, contact = at_rest(system)
    stress = system.basis.fields(q).stress / stacked_blocks.PRESSURE
    assert np.abs(stress - [0.0, -1.0, 0.0, 0.0]).max() < error
    assert contact[:, 0].sum() == pytest.approx(stacked_blocks.PRESSURE * AREA, rel=1e-12)
    # The stiffness is that of both passes together.
    if error < 1e-6:
        depth = stacked_blocks.PRESSURE * AREA / STIFFNESS
        assert contact[:, 2] == pytest.approx(np.full(len(contact), depth), rel=1e-9)
        assert contact[:, 0] / system.basis.tributary == pytest.approx(
            np.full(len(contact), stacked_blocks.PRESSURE * 0.02), rel=1e-9)
    # Action equals reaction at both bodies.
    basis = system.basis
    rows = basis.mode_shapes.restriction.tocsr()[3 * (2 + np.arange(len(contact))) + 1]
    on_nodes = (rows.T @ contact[:, 0]).reshape(-1, 2)
    upper, lower = (on_nodes[part.nodes[0] : sum(part.nodes)].sum(axis=0) for part in basis.parts)
    assert upper == pytest.approx((0.0, stacked_blocks.PRESSURE * AREA), abs=1e-6)
    assert lower == pytest.approx(-upper, abs=1e-6)


def test_two_passes_equal_two_interfaces_of_half_the_stiffness():
    """Runs with friction, step by step."""
    bodies = blocks((6, 2), (4, 2))
    both = pair_both_faces(bodies, "upper.bottom", "lower.top")
    law = LinearContact(STIFFNESS, 1e3)
    one = pressed(bodies, [both], [fc.Interface("joint", both, law, ConstantFriction(0.3))],
                  1e6)
    half = LinearContact(0.5 * STIFFNESS, 0.5e3)
    two = pressed(bodies, [both.first, both.second], [
        fc.Interface(name, part, half, ConstantFriction(0.3))
        for name, part in (("first", both.first), ("second", both.second))], 1e6)
    assert one.basis.groups == (("joint", 22),)
    assert one.basis.first_passes == (("joint", 13),)
    assert one.arrays.normal_parameters == pytest.approx(two.arrays.normal_parameters, rel=1e-14)
    runs = [fc.simulate(system, 1e-5, outputs=4, initial=np.zeros(system.size), rtol=1e-7)
            for system in (one, two)]
    assert np.abs(runs[0].normal_force).max() > 10.0
    assert np.abs(runs[0].friction_force).max() > 1e-2
    for name in ("modal_coordinates", "normal_force", "friction_force"):
        value = getattr(runs[1], name)
        assert getattr(runs[0], name) == pytest.approx(value, abs=3e-4 * np.abs(value).max()), name
    assert one.with_(**{"interfaces.joint.normal.stiffness": 2e12}).parameter(
        "interfaces.joint.normal.stiffness") == 2e12


def test_what_is_shown_of_two_passes(tmp_path):
    """One interface; along the face one panel a pass, as both have nodes at the same places."""
    system = two_passes()
    run = fc.simulate(system, 1e-5, outputs=5)
    figure = plot.plot_contact_map(run)
    titles = [axis.get_title(loc="left") for axis in figure.axes]
    assert [title for title in titles if title] == [
        "joint: upper and lower, nodes on upper", "joint: upper and lower, nodes on lower"]
    assert dict(system.basis.summary())["contact nodes"] == "34 (34 joint)"
    figure = plot.plot_history(run, path=tmp_path / "history.png")
    legends = [axis.get_legend() for axis in figure.axes if axis.get_legend()]
    assert [text.get_text() for text in legends[0].get_texts()] == ["joint"]
    write_basis(tmp_path / "basis.h5", system.basis)
    assert read_basis(tmp_path / "basis.h5").first_passes == (("joint", 17),)
    # The depth that wears off is that of the power over the area, on either face.
    depth = run.wear_depth(EnergyWear(1e-12), 0.02)
    assert depth.shape == run.normal_force.shape


def study(**interface):
    """The template's pad on a block, held by a spring too."""
    described = fc.Study.from_toml(template("pad"))
    return described.with_(**{"simulation.t_end": 1e-3, "simulation.outputs": 6, "links.soft": {
        "kind": "spring", "first": "block.top", "direction": [1.0, 0.0], "stiffness": 1.0},
                              **{f"interfaces.lining.{key}": value
                                 for key, value in interface.items()}})


def test_two_passes_in_a_study(tmp_path, capsys):
    described = study(passes=2)
    pairing = described.pairings()["lining"]
    assert [one.body for one in pairing.passes] == ["pad", "block"]
    system = described.system()
    bodies = described.elastic_bodies()
    both = pair_both_faces(bodies, "pad.contact", "block.top", nodes=6)
    assert (pairing.gaps == both.gaps).all()
    assert system.basis.groups == (("lining", 12),)
    rest = described.run().normal_force[-1]
    assert rest.sum() == pytest.approx(200.0, rel=0.02)
    once = study()
    assert (system.parameter("interfaces.lining.normal.stiffness")
            == once.system().parameter("interfaces.lining.normal.stiffness"))
    table = system.arrays.normal_parameters[:, 0].sum()
    assert table == pytest.approx(once.system().arrays.normal_parameters[:, 0].sum(), rel=1e-12)
    assert fc.Study.from_toml(described.to_toml()) == described
    (tmp_path / "pad.toml").write_text(described.to_toml())
    assert execute(["mesh", str(tmp_path / "pad.toml"), "--output", str(tmp_path)]) == 0
    assert "faces, pass 2" in capsys.readouterr().out


@pytest.mark.parametrize(("keys", "message"), [
    ({"passes": 3}, r"\[interfaces\.lining\]: passes = 3 must be"),
    ({"passes": 2, "other": "ground"}, "passes = 2 .* which other = \"ground\" does not allow"),
    ({"passes": 2, "nodes_on": "face"}, "which nodes_on = \"face\" does not allow; set passes"),
    ({"passes": 2, "sliding": {"speed": 1.0}}, "which sliding = .* does not allow"),
])
def test_two_passes_that_cannot_be_are_explained(keys, message):
    with pytest.raises(fc.InputError, match=message):
        study(**keys).system()


def test_two_passes_do_not_slide():
    bodies = blocks()
    both = pair_both_faces(bodies, "upper.bottom", "lower.top")
    with pytest.raises(fc.InputError, match="with two passes contact nodes lie on it too"):
        fc.Interface("joint", both, LinearContact(1e9), ConstantFriction(0.3),
                     sliding=SlidingTranslation(1.0))
    with pytest.raises(fc.InputError, match="pairing"):
        fc.Interface("joint", both.passes, LinearContact(1e9), ConstantFriction(0.3))
    assert pair_faces(bodies, "upper.bottom", "lower.top").passes[0].body == "upper"
