"""Studies of several bodies: the same systems as in Python, sweeps, commands and bad input."""

import json

import numpy as np
import pytest
from scipy.optimize import brentq
from sweep_study import Serial

import fecontact as fc
from fecontact.cli import execute
from fecontact.cli.templates import template
from fecontact.fem.pairing import pair_faces
from fecontact.laws import ConstantFriction, RoughSurface, SlidingTranslation
from fecontact.reduction import (
    FaceWeld,
    PiecewiseSpring,
    PlaySpring,
    PolynomialSpring,
    Spring,
    assembled_basis,
    reduce_bodies,
)
from fecontact.sweeps.case import of_basis

SHORT = {"simulation.t_end": 2e-3, "simulation.outputs": 11, "output.frames": 2}


@pytest.fixture(scope="module")
def study():
    return fc.Study.from_toml(template("pad")).with_(**SHORT)


def in_python(points=None, links=()):
    """The system of the template, written out in Python."""
    block = fc.ElasticBody(
        fc.generate(fc.Block(width=0.12, height=0.04, element_size=0.01)),
        fc.Material.named("steel"), thickness=0.05, fixed={"contact": "xy"})
    pad = fc.ElasticBody(
        fc.generate(fc.Block(width=0.06, height=0.02, element_size=0.01)).placed((0.03, 0.04)),
        fc.Material(5e9, 0.25, 2500.0), thickness=0.05)
    bodies = {"block": block, "pad": pad}
    pairing = pair_faces(bodies, "pad.contact", "block.top", nodes=6)
    bases = reduce_bodies(bodies, [pairing], links, modes=4, each={
        "block": {"damping": 0.02},
        "pad": {"damping": 0.05, "B": "left", "C": "top", "tolerance": 0.05,
                "points": points or {}}})
    return fc.ContactSystem(
        bodies=bases,
        interfaces=[fc.Interface("lining", pairing, RoughSurface(20e6, 10e-6, 200.0),
                                 ConstantFriction(0.4, smoothing_slope=1e4))],
        links=links or None,
        drive=fc.Drive(stiffness_x=2e5, damping_x=20.0, amplitude_x=1e-3, frequency_hz=10.0),
        load=fc.Load(normal=200.0))


def test_a_study_runs_as_the_same_system_in_python(study):
    system = in_python()
    assert study.system().parameters() == system.parameters()
    run, same = study.run(), fc.simulate(system, 2e-3, outputs=11)
    assert np.abs(run.friction_force).max() > 1.0
    for name in ("modal_coordinates", "normal_force", "friction_force"):
        assert (getattr(run, name) == getattr(same, name)).all(), name
    # The pad is carried by the block alone.
    assert study.system().basis.groups == (("lining", 6),)
    assert run.normal_force[-1].sum() == pytest.approx(200.0, rel=0.02)


def test_models_go_by_the_names_of_bodies(study):
    assert list(study.meshes()) == list(study.elastic_bodies()) == ["block", "pad"]
    pad = study.meshes()["pad"]
    assert pad.nodes.min(axis=0).tolist() == [0.03, 0.04]
    assert study.modal_bases()["pad"].rigid_modes == 3
    assert study.pairings()["lining"].other == "block"
    for name in ("mesh", "elastic_body", "modal_basis"):
        with pytest.raises(fc.InputError, match="describes the bodies 'block', 'pad'; Study"):
            getattr(study, name)()
    single = fc.Study.from_toml(template("block"))
    for name in ("meshes", "elastic_bodies", "modal_bases", "pairings"):
        with pytest.raises(fc.InputError, match="describes a single body"):
            getattr(single, name)()
    assert "bodies: block, pad" in str(study)


def test_a_study_is_restored_from_its_toml(study):
    for one in (study, study.with_(**{
            "interfaces.lining.sliding": {"speed": 0.1, "direction": [1.0, 3.0]},
            "interfaces.lining.gap": {"radius": 1.0, "centre": 0.06},
            "bodies.pad.placement.mirror": "x", "bodies.pad.placement.rotation": 180})):
        assert fc.Study.from_toml(one.to_toml()) == one
    assert fc.Study.from_toml(study.to_toml()).reduced.basis.T.tobytes() == (
        study.reduced.basis.T.tobytes())


def test_changes_reuse_what_does_not_depend_on_them(study):
    study.system()
    rougher = study.with_(**{"interfaces.lining.friction.friction_coefficient": 0.5})
    assert rougher.reduced is study.reduced
    assert rougher.system().parameter("interfaces.lining.friction.friction_coefficient") == 0.5
    richer = study.with_(**{"bodies.pad.basis.modes": 5})
    assert richer.meshes()["pad"] is study.meshes()["pad"]
    assert richer.pairings()["lining"] is study.pairings()["lining"]
    assert richer.reduced is not study.reduced
    thick = study.with_(**{"bodies.block.body.thickness": 0.1})
    assert thick.meshes()["pad"] is study.meshes()["pad"]
    # Twice as thick, twice the mass: modal rows are 1 / sqrt(2) as large.
    for name, ratio in (("block", 0.5), ("pad", 1.0)):
        mass, before = (one.elastic_bodies()[name].mass.sum() for one in (thick, study))
        assert mass / before == pytest.approx(1.0 / ratio, rel=1e-12)
    wider = study.with_(**{"interfaces.lining.nodes": 3})
    assert wider.system().basis.contact_nodes == 3
    open_gap = study.with_(**{"interfaces.lining.gap": 1e-5})
    assert open_gap.reduced is study.reduced
    assert np.asarray(open_gap.system().gap) == pytest.approx(np.full(6, 1e-5), rel=1e-6)


def test_one_of_several_bodies_on_the_ground_runs_as_a_single_one():
    single = fc.Study.from_toml(template("block")).with_(**{"simulation.t_end": 0.05,
                                                            "simulation.outputs": 51})
    tables = single.tables(defaults=False)
    basis = tables.pop("basis")
    nodes = basis.pop("contact_nodes")
    tables["bodies"] = {"block": {"geometry": tables.pop("geometry"), "body": tables.pop("body"),
                                  "basis": {**basis, "reduction": "vibration"}}}
    tables["interfaces"] = {"belt": {"face": "block.contact", "nodes": nodes}}
    one, other = single.run(), fc.Study.from_tables(tables).run()
    assert np.abs(one.friction_force).max() > 1.0
    for name in ("normal_force", "friction_force"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-4, abs=1e-4), name
    assert other.modal_coordinates == pytest.approx(one.modal_coordinates, rel=1e-5, abs=1e-9)


def test_links_join_points_of_bodies(study):
    bolt = {"kind": "spring", "first": "pad.P", "direction": [0.0, 1.0], "stiffness": 1e4,
            "preload": 30.0}
    linked = study.with_(**{"bodies.pad.basis.points": {"P": [0.06, 0.06]}, "links.bolt": bolt})
    system = in_python({"P": (0.06, 0.06)}, [Spring("pad.P", direction=(0.0, 1.0), stiffness=1e4,
                                                    preload=30.0)])
    assert (linked.system().basis.T == system.basis.T).all()
    assert (linked.system().basis.constant_load == system.basis.constant_load).all()
    assert linked.reduced.basis.constant_load.any()
    assert fc.Study.from_toml(linked.to_toml()) == linked
    # The soft spring pulls the pad down: its preload and the load press on the block together.
    looser = linked.with_(**{"links.bolt.preload": 0.0})
    assert looser.pairings()["lining"] is linked.pairings()["lining"]
    forces = [one.run().normal_force[-1].sum() for one in (linked, looser)]
    assert forces[0] - forces[1] == pytest.approx(30.0, rel=0.01)


@pytest.mark.parametrize(("bolt", "message"), [
    ({"kind": "wled", "first": "pad.B"},
     r"\[links\.bolt\]: kind = \"wled\" must be one of .* \(did you mean 'weld'\?\)"),
    ({"kind": "weld", "first": "pd.B"}, r"first = \"pd\.B\": there is no body 'pd'"),
    ({"kind": "weld", "first": "B"}, r"first = \"B\" must be \"BODY\.POINT\""),
    ({"kind": "weld", "first": "pad.Q"}, "Body 'pad': Point Q: the mesh has no point or boundary"),
    ({"kind": "weld"}, r"\[links\.bolt\] lacks the key 'first'"),
    ({"kind": "spring", "first": "pad.B"}, r"\[links\.bolt\]: a spring to the base needs"),
])
def test_bad_links_are_explained(study, bolt, message):
    with pytest.raises(fc.FecontactError, match=message):
        study.with_(**{"links.bolt": bolt}).system()


def test_friction_of_all_interfaces_is_that_of_the_section(study):
    tables = study.tables(defaults=False)
    tables["friction"] = tables["interfaces"]["lining"].pop("friction")
    assert fc.Study.from_tables(tables).system().parameters() == study.system().parameters()


PARTS = """*NODE
1,0,0
2,100,0
3,100,50
4,0,50
5,20,50
6,80,50
7,80,90
8,20,90
*ELEMENT, TYPE=CPS4, ELSET=lower
1,1,2,3,4
*ELEMENT, TYPE=CPS4, ELSET=upper
2,5,6,7,8
*NSET, NSET=table
1,2
*SURFACE, NAME=rim
1,S3
*SURFACE, NAME=lining
2,S1
"""


def test_bodies_are_parts_of_one_file(tmp_path):
    (tmp_path / "two.inp").write_text(PARTS)
    path = tmp_path / "two.toml"
    path.write_text("""
[bodies.disc.geometry]
file = "two.inp"
part = "lower"
scale = 1e-3
[bodies.disc.body]
fixed = { table = "xy" }
thickness = 1.0
[bodies.pad.body]
thickness = 1.0
[bodies.pad.geometry]
file = "two.inp"
part = "upper"
scale = 1e-3
[bodies.disc.basis]
modes = 4
[bodies.pad.basis]
modes = 3
[interfaces.shoe]
face = "pad.lining"
other = "disc.rim"
[normal]
law = "linear"
stiffness = 1e8
[friction]
law = "frictionless"
[load]
gravity = [0.0, -9.81]
""")
    study = fc.Study.read(path)
    assert {name: mesh.nodes.max(axis=0).tolist() for name, mesh in study.meshes().items()} == {
        "disc": [0.1, 0.05], "pad": [0.08, 0.09]}
    system = study.system()
    pushed = fc.equilibrium(system).normal_force.sum()
    assert pushed == pytest.approx(0.06 * 0.04 * 1.0 * 7850.0 * 9.81, rel=0.02)
    # Where the study is stored with a run, files stay relative to it.
    assert fc.Study.from_toml(study.to_toml()).bodies["pad"].geometry.file == "two.inp"
    assert execute(["mesh", str(path)]) == 0
    with pytest.raises(fc.MeshError, match=r"\[bodies\.pad\.geometry\]: .*two\.inp: The file has "
                                           r"no part 'uper' \(did you mean 'upper'\?\)"):
        study.with_(**{"bodies.pad.geometry.part": "uper"}).meshes()


@pytest.mark.parametrize(("name", "depends"), [
    ("interfaces.lining.friction.friction_coefficient", False), ("interfaces.lining.gap", False),
    ("interfaces.lining.nodes", True), ("interfaces.lining", True),
    ("bodies.pad.body.thickness", True), ("basis.modes", True), ("ground.speed", False),
    ("interfaces.lining.sliding.speed", False), ("links.bolt", True)])
def test_keys_on_which_the_basis_depends(name, depends):
    assert of_basis(name) is depends


def test_a_sweep_over_friction_makes_one_basis(study, tmp_path):
    cases = [0.2, 0.4, 0.6]
    name = "interfaces.lining.friction.friction_coefficient"
    table = fc.sweep(fc.Study.from_tables({
        **study.tables(defaults=False),
        "sweep": {"axes": {name: cases}, "batch": 1, "summaries": ["peak_normal_force",
                                                                   "friction_power"]}}),
                     folder=tmp_path / "s", executor=Serial())
    assert not table.failed
    assert len(list((tmp_path / "s" / "bases").glob("*.h5"))) == 1
    power = table.values["friction_power"]
    alone = fc.Study.from_tables({
        **study.with_(**{name: 0.6}).tables(defaults=False),
        "sweep": {"axes": {name: [0.6]}, "summaries": ["friction_power"]}})
    assert power[2] == fc.sweep(alone, folder=tmp_path / "t", executor=Serial()).values[
        "friction_power"][0]
    assert len(set(power.tolist())) == 3
    # Stored bases hold the gaps too.
    again = fc.sweep(fc.Study.from_tables({
        **study.tables(defaults=False), "sweep": {"axes": {name: [0.3]}}}),
        folder=tmp_path / "s", executor=Serial(), overwrite=True)
    assert not again.failed


@pytest.mark.slow
def test_commands_name_bodies_and_interfaces(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert execute(["init", "a.toml", "--shape", "pad"]) == 0
    short = [token for name, value in SHORT.items() for token in (
        "--set", f"{name}={json.dumps(value)}")]
    assert execute(["mesh", "a.toml"]) == 0
    out = capsys.readouterr().out
    assert "\nblock:" in out
    assert "pad.contact on block.top" in out
    assert fc.read_mesh("results/a-pad.msh").nodes.max(axis=0).tolist() == [0.09, 0.06]
    assert execute(["modes", "a.toml"]) == 0
    out = capsys.readouterr().out
    assert "no contact nodes" not in out
    assert out.count("The body has contact at the interface 'lining'") == 2
    assert "Static compliance that the modes resolve [%]" in out
    assert "note:" not in out
    assert (tmp_path / "results" / "a-pad-modes.png").exists()
    assert execute(["run", "a.toml", *short]) == 0
    stored = fc.read_case("results/a.vtkhdf")
    assert [part.name for part in stored.trajectory.system.basis.parts] == ["block", "pad"]
    assert stored.trajectory.system.basis.groups == (("lining", 6),)
    study = fc.Study.from_toml(stored.study)
    assert study == fc.Study.read("a.toml").with_(**SHORT)
    assert execute(["plot", "results/a.vtkhdf", "history", "--point", "pad.C"]) == 0
    assert execute(["export", "results/a.vtkhdf", "--format", "csv"]) == 0


@pytest.mark.parametrize(("changes", "message"), [
    ({"interfaces.lining.other": "blck.top"},
     r"\[interfaces\.lining\]: other = \"blck\.top\": there is no body 'blck' "
     r"\(did you mean 'block'\?\)"),
    ({"interfaces.lining.face": "pad.contct"},
     r"\[interfaces\.lining\]: the mesh of body 'pad' has no boundary 'contct' "
     r"\(did you mean 'contact'\?\)"),
    ({"interfaces.lining.face": "pad"}, r"face = \"pad\" must be \"BODY.BOUNDARY\"; the bodies"),
    ({"interfaces.lining.other": "grund"}, r"other = \"grund\" must be .* or 'ground'"),
    ({"interfaces": {"lining": {}}}, r"\[interfaces\.lining\] lacks the key 'face'"),
    ({"interfaces.pad": {"face": "pad.top", "other": "block.left"}},
     r"\[interfaces\.pad\]: the name 'pad' is that of \[bodies\.pad\] too"),
    ({"interfaces": {"a.b": {"face": "pad.top", "other": "block.left"}}},
     r"\[interfaces\.a\.b\]: the name 'a\.b' must be a text without dots"),
    ({"bodies.third": {"geometry": {"shape": "beam"}}},
     r"no interface and no link touches the body 'third'"),
    ({"bodies.ground": {"geometry": {"shape": "beam"}}}, "'ground' is the name of the ground"),
    ({"geometry": {"shape": "beam"}}, r"has \[geometry\], which is for a single body, together "
                                      r"with \[bodies\]"),
    ({"basis.modes": 3}, r"has \[basis\], .* give \[bodies\.NAME\.basis\]"),
    ({"bodies.pad.basis.contact": "top"},
     r"\[bodies\.pad\.basis\]: contact = .* is for a single body; name the face"),
    ({"bodies.pad.basis.contact": "contact"},
     r"\[bodies\.pad\.basis\]: contact = .* is for a single body; name the face"),
    ({"bodies.pad.basis.contact_nodes": "all"},
     r"\[bodies\.pad\.basis\]: contact_nodes = .* is for a single body; name the face"),
    ({"interfaces.lining.other": "block.contact"},
     r"\[interfaces\.lining\]: no node of 'pad\.contact' has a partner on 'block\.contact'"),
    ({"bodies.pad.body.rotation": {"speed": 1.0}},
     r"Body 'pad' does not rotate as '.*' does"),
    ({"bodies.pad": {"body": {}}}, r"\[bodies\.pad\] lacks the section \[bodies\.pad\.geometry\]"),
    ({"bodies.pad.geometri": {}}, r"\[bodies\.pad\] has no key 'geometri'"),
    ({"bodies.pad.geometry.widht": 1.0}, r"\[bodies\.pad\.geometry\] has no key 'widht'"),
    ({"bodies.pad.placement.mirror": "w"}, r"\[bodies\.pad\.placement\]: mirror = \"w\" must be"),
    ({"bodies.pad.placement.mirror": "z"}, r"mirror = 'z' must be 'x' or 'y'"),
    ({"bodies.pad.placement.shift": [0.03, 0.02]}, r"\[interfaces\.lining\]: "),
    ({"bodies": {}}, r"\[bodies\] must be a table of bodies"),
    ({"bodies.pad": 3}, r"\[bodies\.pad\] must be a table of sections, not 3"),
    ({"gap": 1e-6}, r"gap = 1e-06 is for a single body; give it in \[interfaces\.NAME\]"),
    ({"contact": {"lining": {}}}, r"unknown section 'contact'; laws of single interfaces stand"),
    ({"interfaces.lining.normal.stiffness": -1.0}, r"\[interfaces\.lining\.normal\]: stiffness"),
    ({"output.points": ["pad.D"]}, r"\[output\]: There is no point 'pad\.D'"),
])
def test_bad_studies_of_several_bodies_are_explained(study, changes, message):
    with pytest.raises(fc.FecontactError, match=message) as raised:
        study.with_(**changes).run()
    assert str(raised.value).startswith("The study")


@pytest.mark.parametrize(("changes", "message"), [
    ({"interfaces.contact.face": "a.b"}, r"face = \"a\.b\" is for several bodies"),
    ({"links.bolt": {"kind": "weld", "first": "a.P"}}, r"has \[links\], which join several"),
])
def test_sections_of_several_bodies_in_a_study_of_one(changes, message):
    with pytest.raises(fc.InputError, match=message):
        fc.Study.from_toml(template("block")).with_(**changes)


def test_load_and_drive_points_are_those_of_one_body():
    mesh = fc.generate(fc.Block(width=0.1, height=0.05, element_size=0.025))
    bodies = {"a": fc.ElasticBody(mesh), "b": fc.ElasticBody(mesh.placed((0.0, 0.05)))}
    face = pair_faces(bodies, "b.contact", "a.top")

    def points(**each):
        basis = assembled_basis(reduce_bodies(bodies, [face], modes=3, each=each), {"i": face})
        return [bool(basis.T[k].any()) for k in (0, 1)], basis.extra, basis.positions[0].tolist()

    # Both meshes have points B and C, so that neither counts unless it is asked for.
    assert points()[:2] == ([False, False], ())
    assert points(b={"B": "B"})[:2] == ([True, False], ("b.B",))
    assert points(b={"B": "B"})[2] == pytest.approx([0.0, 0.075])
    assert points(a={"C": "top"}, b={"B": "left"})[:2] == ([True, True], ("a.C", "b.B"))
    alone = fc.modal_basis(bodies["a"], 3, B="", C="top")
    assert not alone.T[0].any()
    assert alone.T[1].any()


def test_what_slides_is_the_other_face_however_fine(study):
    """A block that slides to +x draws the pad along, with contact nodes on the pad."""
    fine = {"bodies.block.geometry.element_size": 0.004, "interfaces.lining.nodes": "all"}
    assert study.with_(**fine).pairings()["lining"].body == "block"
    slid = study.with_(**fine, **{"interfaces.lining.sliding": {"speed": 0.3}})
    assert slid.pairings()["lining"].body == "pad"
    q = fc.equilibrium(slid.system(), "sliding").modal_coordinates
    basis = slid.system().basis
    assert basis.T[basis.point_index("pad.B"), 0] @ q > 0.0
    with pytest.raises(fc.InputError, match="nodes_on = 'finer' the contact nodes lie on it"):
        slid.with_(**{"interfaces.lining.nodes_on": "finer"}).system()
    bodies = study.with_(**fine).elastic_bodies()
    pairing = pair_faces(bodies, "pad.contact", "block.top")
    with pytest.raises(fc.InputError, match="'lining': sliding is that of the other side, but"):
        fc.Interface("lining", pairing, RoughSurface(2e7, 1e-5), ConstantFriction(0.4),
                     SlidingTranslation(0.3))


def test_changes_of_unknown_interfaces_name_the_nearest(study):
    name = "interfaces.linng.friction.friction_coefficient"
    with pytest.raises(fc.InputError, match=r"interface 'linng' .*'lining'.*; there are: 'l"):
        study.with_(**{name: 0.5})


@pytest.mark.parametrize(("kind", "keys"), [
    ("polynomial-spring", {"stiffness": 1e4, "cubic_stiffness": 1e12, "preload": 30.0}),
    ("play-spring", {"stiffness": 1e6, "clearance": 1e-4, "preload": 30.0}),
    ("piecewise-spring", {"elongations": [-1e-3, 0.0, 1e-3], "forces": [-10.0, 0.0, 90.0],
                          "preload": 30.0})])
def test_nonlinear_springs_join_points_of_bodies(study, kind, keys):
    """The system equals the one made in Python; its preload presses the pad on the block."""
    point = {"bodies.pad.basis.points": {"P": [0.06, 0.06]}}
    bolt = {"kind": kind, "first": "pad.P", "direction": [0.0, 1.0], **keys}
    linked = study.with_(**point, **{"links.bolt": bolt})
    made = {"polynomial-spring": PolynomialSpring, "play-spring": PlaySpring,
            "piecewise-spring": PiecewiseSpring}[kind]
    system = in_python({"P": (0.06, 0.06)},
                       {"bolt": made("pad.P", direction=(0.0, 1.0), **keys)})
    assert linked.system().basis.groups == (("lining", 6), ("bolt", 1))
    assert linked.system().parameters() == system.parameters()
    assert (linked.system().basis.T == system.basis.T).all()
    assert fc.Study.from_toml(linked.to_toml()) == linked
    looser = linked.with_(**{"links.bolt.preload": 0.0})
    forces = [one.run().normal_force[-1, :6].sum() for one in (linked, looser)]
    assert forces[0] - forces[1] == pytest.approx(30.0, rel=0.01)
    with pytest.raises(fc.InputError, match=r"\[links\.bolt\]: preload = \"x\""):
        study.with_(**point, **{"links.bolt": bolt | {"preload": "x"}})


def test_a_study_of_bodies_that_only_a_nonlinear_spring_joins(study):
    tables = study.tables(defaults=False)
    del tables["interfaces"], tables["bodies"]["block"]
    tables["bodies"]["pad"]["basis"]["points"] = {"P": [0.03, 0.04], "Q": [0.09, 0.04]}
    spring = {"kind": "polynomial-spring", "first": "pad.P", "direction": [0.0, 1.0],
              "stiffness": 1e6, "cubic_stiffness": 1e14, "damping": 100.0}
    tables["links"] = {"mount": spring, "other": spring | {"first": "pad.Q"}}
    run = fc.Study.from_tables(tables).run()
    assert run.system.basis.groups == (("mount", 1), ("other", 1))
    # Each carries half of the load of 200 N: c e + c_3 e^3 = -100 N.
    e = brentq(lambda e: 1e6 * e + 1e14 * e**3 + 100.0, -1.0, 0.0, xtol=1e-16)
    assert run.normal_force[0] == pytest.approx([100.0, 100.0], rel=1e-6)
    assert run.displacement("pad.P")[0, 1] == pytest.approx(e, rel=1e-6)
    with pytest.raises(fc.InputError, match=r"\[links\.mount\]: all stiffnesses and dampings"):
        fc.Study.from_tables({**tables, "links": {
            "mount": {"kind": "polynomial-spring", "first": "pad.P", "direction": [0.0, 1.0]}}})


def welded_study(study, **weld):
    """The pad welded on the block, with a nonlinear spring at its corner."""
    tables = study.tables(defaults=False)
    del tables["interfaces"]
    tables["bodies"]["pad"]["basis"]["points"] = {"P": [0.09, 0.06]}
    tables["links"] = {
        "seam": {"kind": "face-weld", "first": "pad.contact", "second": "block.top", **weld},
        "mount": {"kind": "polynomial-spring", "first": "pad.P", "direction": [0.0, 1.0],
                  "stiffness": 1e6, "cubic_stiffness": 1e14}}
    return tables


@pytest.mark.parametrize("nodes", ["all", 6])
def test_faces_are_welded_in_a_study(study, nodes):
    described = fc.Study.from_tables(welded_study(study, nodes=nodes))
    bodies = described.elastic_bodies()
    weld = FaceWeld(pair_faces(bodies, "pad.contact", "block.top", nodes=nodes))
    mount = described.links["mount"]
    bases = reduce_bodies(bodies, links={"seam": weld, "mount": mount}, modes=4, each={
        "block": {"damping": 0.02}, "pad": {"damping": 0.05, "B": "left", "C": "top",
                                                "points": {"P": (0.09, 0.06)}}})
    basis = assembled_basis(bases, {}, {"seam": weld, "mount": mount})
    found = described.system().basis
    assert (found.angular_frequencies == basis.angular_frequencies).all()
    assert found.rigid_modes == 0
    assert found.groups == (("mount", 1),)
    assert fc.Study.from_toml(described.to_toml()) == described
    assert np.isfinite(described.run().normal_force).all()


@pytest.mark.parametrize(("weld", "message"), [
    ({"second": "block.left"}, r"\[links\.seam\]:"),
    ({"second": "blok.top"}, r"\[links\.seam\]: second = \"blok\.top\": there is no body 'blok'"),
    ({"second": "block.tp"}, "tp"),
    ({"nodes": 0}, r"\[links\.seam\]: nodes"),
    ({"reach": -1.0}, r"\[links\.seam\]: reach"),
])
def test_bad_welds_of_faces_are_explained(study, weld, message):
    with pytest.raises(fc.FecontactError, match=message):
        fc.Study.from_tables(welded_study(study, **weld)).system()
