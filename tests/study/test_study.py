"""Study files: what they describe, round trips, and what is said of mistakes."""

import re
import tomllib
import warnings
from dataclasses import fields, replace

import numpy as np
import pytest
from systems import TURN

from fecontact import (
    BoundaryLoad,
    ContactSystem,
    ElasticBody,
    FecontactError,
    Ground,
    InputError,
    Load,
    Material,
    MeshError,
    Patch,
    Rayleigh,
    RigidStart,
    Study,
    equilibrium,
    generate,
    modal_basis,
    read_case,
    simulate,
    static_solution,
    write_case,
    write_mesh,
)
from fecontact.cli.templates import TEMPLATES, template
from fecontact.core.dotted_parameters import flattened
from fecontact.core.errors import ModelWarning
from fecontact.fem.shapes import Beam, Block, Pendulum
from fecontact.integrate import SetValued, TimeStepping
from fecontact.integrate.solvers import SOLVERS
from fecontact.laws import ExponentialFriction, RoughSurface
from fecontact.study.study import with_given_keys
from fecontact.system.model_limits import (
    Planned,
    implausible_faces,
    implausible_values,
)

TINY = """
gap = 1e-6

[geometry]
shape = "beam"
length = 0.1
height = 0.01
element_size = 0.01

[body]
material = "aluminium"
thickness = 0.02

[basis]
modes = 5
contact_nodes = 4
damping = 0.01
C = { at = "C", radius = 0.01 }
points = { tip = [0.1, 0.01], face = "right" }

[normal]
stiffness = 0.3e6
roughness_height = 5.2e-6
damping = 6.0

[friction]
static_coefficient = [0.5, 0.6, 0.7, 0.8]
kinetic_coefficient = 0
decay = 1000.0

[ground]
speed = 1

[load]
normal = 10.0

[simulation]
t_end = 1e-3
outputs = 11
"""


@pytest.fixture
def tiny():
    return Study.from_toml(TINY)


def test_study_is_the_system_written_by_hand(tiny):
    body = ElasticBody(generate(Beam(length=0.1, height=0.01, element_size=0.01)),
                       Material.named("aluminium"), thickness=0.02)
    basis = modal_basis(body, 5, contact_nodes=4, damping=0.01, C=Patch("C", 0.01),
                        points={"tip": (0.1, 0.01), "face": "right"})
    by_hand = ContactSystem(
        basis, RoughSurface(0.3e6, 5.2e-6, 6.0),
        friction=ExponentialFriction(static_coefficient=(0.5, 0.6, 0.7, 0.8),
                                     kinetic_coefficient=0.0, decay=1000.0),
        ground=Ground(speed=1.0), load=Load(normal=10.0), gap=1e-6)
    system = tiny.system()
    assert system.parameters() == by_hand.parameters()
    state = np.random.default_rng(1).normal(scale=1e-6, size=10)
    np.testing.assert_array_equal(system.rhs(0.3, state), by_hand.rhs(0.3, state))
    assert basis.extra == tiny.modal_basis().extra == ("tip", "face")


def test_run_covers_the_times_asked_for(tiny):
    seen = []
    trajectory = tiny.with_(**{"simulation.t_start": 5e-4}).run(seen.append)
    np.testing.assert_allclose(trajectory.time, np.linspace(5e-4, 1e-3, 11), rtol=1e-12)
    assert seen[-1] == pytest.approx(1e-3)


@pytest.mark.parametrize("text", [TINY, *(template(shape) for shape in TEMPLATES)])
def test_resolved_study_reads_back_the_same(text):
    study = Study.from_toml(text)
    resolved = study.to_toml()
    assert Study.from_toml(resolved) == study
    assert Study.from_toml(resolved).to_toml() == resolved
    edited = resolved.rpartition("\n# Keys given: ")[0] + "\n# Keys given: {none"
    assert Study.from_toml(edited) == Study.from_toml(resolved)


@pytest.mark.parametrize("shape", TEMPLATES)
def test_keys_that_a_study_gives(shape):
    """Keys that a study gives stay, also defaults; keys that it leaves out do not appear."""
    text = template(shape)
    study = Study.from_toml(text)
    short = with_given_keys(study.to_toml())
    assert Study.from_toml(short) == study
    assert flattened(tomllib.loads(short)) == flattened(study.tables(defaults=False))
    assert set(flattened(tomllib.loads(short))) == set(flattened(tomllib.loads(text)))


def test_given_keys_with_their_default_value_are_kept():
    text = template("block") + '\n[[load.forces]]\nsignal = { law = "constant" }\ncomponent = "y"\n'
    study = Study.from_toml(text)
    given = flattened(tomllib.loads(with_given_keys(study.to_toml())))
    assert given["load.forces"] == [{"component": "y", "signal": {"law": "constant"}}]
    assert "damping_y" not in study.tables(defaults=False)["drive"]
    changed = study.with_(**{"drive.damping_y": study.drive.damping_y})
    again = Study.from_toml(changed.to_toml())
    for one in (changed, again):
        assert one == study
        assert one.tables(defaults=False)["drive"]["damping_y"] == study.drive.damping_y


def test_a_study_made_in_python_gives_what_differs_from_the_defaults():
    text = template("block")
    study = replace(Study.from_toml(text), _keys={})
    short = with_given_keys(study.to_toml())
    assert Study.from_toml(short) == study
    given = flattened(tomllib.loads(text))
    kept = flattened(tomllib.loads(short))
    assert set(kept) <= set(given)
    assert {"ground.speed", "drive.stiffness_x", "load.normal"} <= set(kept)
    named = short + '\n[friction]\nlaw = "own.py:Law"\n'
    assert with_given_keys(named) == named
    assert with_given_keys("[geometry]\nshape = 3\n") == "[geometry]\nshape = 3\n"
    assert with_given_keys(None) is None



def test_resolved_study_has_every_key_that_has_a_value(tiny):
    tables = tiny.tables()
    assert set(tables["ground"]) == {entry.name for entry in fields(Ground)
                                     if getattr(Ground(), entry.name) is not None}
    assert tables["simulation"]["rtol"] == 1e-6
    assert tables["geometry"]["shape"] == "beam"
    assert "B" not in tables["basis"]


def test_templates_have_no_key_at_a_wrong_place_and_can_be_started():
    shapes = {"beam": Beam, "pendulum": Pendulum, "block": Block}
    assert set(TEMPLATES) == {*shapes, "pad", "solid", "mesh", "sweep", "response"}
    # The tests of the others are elsewhere.
    for shape, kind in shapes.items():
        study = Study.from_toml(template(shape))
        assert isinstance(study.geometry, kind)
        basis = study.modal_basis()
        assert basis.rigid_modes == {"beam": 3, "pendulum": 1, "block": 3}[shape]
        assert study.t_end > 0.0


def test_pendulum_template_is_the_impact_oscillator():
    """Mass 0.092 kg at the stop, first bending mode near 230 Hz with 0.6 times its amplitude."""
    basis = Study.from_toml(template("pendulum")).modal_basis()
    rigid, bending = basis.T[2, 1, :2]
    assert 1.0 / rigid**2 == pytest.approx(0.092, rel=0.02)
    assert basis.frequencies_hz[1] == pytest.approx(230.0, rel=0.03)
    assert abs(bending / rigid) == pytest.approx(0.6, rel=0.05)


def test_changes_by_dotted_names(tiny):
    changed = tiny.with_(**{
        "ground.speed": 2, "gap": [0, 1e-6, 0, 1e-6], "basis.damping": {"mass_factor": 1.0},
        "simulation.initial": {"velocity": [0, 1, 0]}, "body.fixed.left": "x",
        "friction.static_coefficient": np.array([0.1, 0.2, 0.3, 0.4]), "basis.C.radius": 0.02})
    assert changed.ground.speed == 2.0
    assert changed.gap == (0.0, 1e-6, 0.0, 1e-6)
    assert changed.basis.damping == Rayleigh(mass_factor=1.0)
    assert changed.basis.C.radius == 0.02
    assert changed.simulation.initial == RigidStart(velocity=(0.0, 1.0, 0.0))
    assert changed.body.fixed == {"left": "x"}
    assert changed.friction.static_coefficient == (0.1, 0.2, 0.3, 0.4)
    assert tiny.ground.speed == 1.0
    assert changed.load == tiny.load


def test_solvers_have_one_name_in_files_and_in_python(tiny):
    """Every solver can be named, and takes its own options from [simulation]."""
    assert sorted(SOLVERS) == [
        "auto", "cvode", "event-driven", "power-series", "radau", "rodas5p", "scipy-bdf",
        "scipy-lsoda", "scipy-radau", "set-valued", "time-stepping"]
    for name, solver in SOLVERS.items():
        assert tiny.with_(**{"simulation.solver": name}).simulation.chosen_solver() == solver
    told = {"simulation.solver": "time-stepping", "simulation.static_coefficient": 0.9}
    study = tiny.with_(**told)
    assert study.simulation.chosen_solver() == TimeStepping(static_coefficient=0.9)
    run = study.run()
    same = simulate(study.system(), 1e-3, outputs=11,
                    solver=TimeStepping(static_coefficient=0.9))
    assert np.array_equal(run.states, same.states)
    assert run.statistics["solver"] == "time-stepping"
    assert not np.array_equal(run.states, tiny.run().states)
    stops = tiny.with_(**{"simulation.solver": "set-valued", "simulation.restitution": 0.5,
                          "simulation.impact_law": "poisson"})
    assert stops.simulation.chosen_solver() == SetValued(restitution=0.5, impact_law="poisson")
    stops = stops.with_(**{"simulation.impact_law": "newton",
                           "simulation.tangential_restitution": 0.2})
    assert stops.simulation.chosen_solver() == SetValued(restitution=0.5,
                                                         tangential_restitution=0.2)


def test_basis_keys_reach_the_basis(tiny):
    plain = tiny.modal_basis()
    damped = tiny.with_(**{"basis.dashpots": {"B": [2.0, 0.0], "3": [0.0, 5.0]}}).modal_basis()
    rows = plain.T[0, 0], plain.T[2 + 3, 1]
    np.testing.assert_allclose(
        damped.damping, plain.damping + 2.0 * np.outer(rows[0], rows[0])
        + 5.0 * np.outer(rows[1], rows[1]), rtol=1e-12, atol=1e-12)
    assert tiny.with_(**{"basis.select": [0, 1, 3]}).modal_basis().modes == 3
    assert tiny.with_(**{"basis.reduction": "residual",
                         "basis.tolerance": 0.0}).modal_basis().modes > 5
    lossy = tiny.with_(**{"basis.damping": {"loss_factor": 0.04}}).modal_basis()
    np.testing.assert_allclose(lossy.damping_ratios[3:], 0.02)


def test_gap_of_a_crowned_face(tiny):
    crowned = tiny.with_(gap={"radius": 2.0, "centre": 0.05})
    x = crowned.modal_basis().contact_x
    np.testing.assert_allclose(crowned.system().gap, (x - 0.05) ** 2 / 4.0, rtol=1e-3)
    assert Study.from_toml(crowned.to_toml()) == crowned


def test_another_shape_when_nothing_was_said_of_the_first():
    study = Study.from_toml('geometry = { shape = "beam" }')
    assert study.with_(**{"geometry.shape": "block"}).geometry == Block()


def test_material_values_replace_those_of_the_named_one(tiny):
    material = tiny.with_(**{"body.density": 3000}).body.elastic_material
    assert (material.density, material.youngs_modulus) == (3000.0, 7.0e10)
    assert Study.from_toml('geometry = { shape = "beam" }\nbody = { thickness = 0.02 }'
                           ).elastic_body().material == Material.named("steel")


def test_mesh_file_is_found_beside_the_study(tmp_path):
    mesh = generate(Beam(length=100.0, height=10.0, element_size=10.0))
    (tmp_path / "parts").mkdir()
    write_mesh(mesh, tmp_path / "parts" / "part.msh")
    path = tmp_path / "study.toml"
    path.write_text("""
        [geometry]
        file = "parts/part.msh"
        scale = 1e-3
        boundaries = { shoe = "contact", half = [-1, 0.009, 0.051, 0.011] }
        points = { tip = [0.1, 0.01], corner = "C" }
        [body]
        thickness = 0.02
        [basis]
        contact = "shoe"
        modes = 4
    """)
    study = Study.read(path)
    assert study.mesh().area == pytest.approx(1e-3)
    assert {"shoe", "half"} <= set(study.mesh().boundaries)
    assert {"tip", "corner"} <= set(study.mesh().points)
    assert study.modal_basis().modes == 4
    assert study.mesh() is study.mesh()
    assert Study.from_toml(study.to_toml(), path) == study
    assert study.results == tmp_path / "results"


MISTAKES = [
    ({"ground.sped": 1}, r"\[ground\] has no key 'sped' \(did you mean 'speed'\?\); its keys are"),
    ({"normal.stifness": 1}, r"its keys are: 'damping', 'law', 'roughness_height', 'stiffness'\.$"),
    ({"grond.speed": 1}, r"unknown section or key 'grond' \(did you mean 'ground'\?\)"),
    ({"ground.speed": "fast"}, r'\[ground\]: speed = "fast" must be a number\.$'),
    ({"ground.speed": True}, r"\[ground\]: speed = true must be a number\.$"),
    ({"ground": 3}, r"\[ground\] must be a table of keys and values, not 3"),
    ({"ground.speed.x": 3}, r"ground\.speed\.x cannot be set, because ground\.speed = 1\.0"),
    ({"ground.wavelength": 0}, r"\[ground\]: wavelength = 0\.0 must be a finite number above"),
    ({"friction.decay": -1}, r"s.toml: \[friction\]: decay = -1\.0 must be zero or above\.$"),
    ({"friction.decay": "high"}, r'decay = "high" must be a number or a list of numbers\.$'),
    ({"friction.decay": [1, 2, 3]}, r"\[friction\]: decay has 3 values for 4 contact nodes"),
    ({"normal.roughness_height": -1}, r"\[normal\]: roughness_height = -1\.0 must be above zero"),
    ({"drive.damping_y": -1}, r"\[drive\]: damping_y = -1\.0 must be a finite number, zero"),
    ({"load.normal": float("inf")}, r"\[load\]: normal = inf must be finite"),
    ({"gap": -1}, r"s.toml: gap = -1 must be finite and zero or above"),
    ({"gap": "a"}, r's.toml: gap = "a" must be a number, a list of numbers, a table of'),
    ({"gap": [0, 0]}, r"s.toml: gap has 2 values for 4 contact nodes"),
    ({"body.material": "steal"}, r"\[body\]: There is no material 'steal' \(did you mean 'steel'"),
    ({"body.material": 7}, r"\[body\]: material = 7 must be a text in quotes"),
    ({"body.youngs_modulus": -1}, r"\[body\]: youngs_modulus = -1\.0 must be a finite number ab"),
    ({"body.density": 0}, r"\[body\]: density = 0\.0 must be a finite number above zero"),
    ({"body.poisson_ratio": 0.5}, r"\[body\]: poisson_ratio = 0\.5 must be above -1 and below"),
    ({"body.thickness": -1}, r"s.toml: \[body\]: thickness = -1\.0 must be a finite number above"),
    ({"body.plane": "stres"}, r'\[body\]: plane = "stres" must be "stress" or "strain"\.$'),
    ({"body.degree": 3}, r"\[body\]: degree = 3 must be 1 or 2\.$"),
    ({"body.fixed.left": "w"}, r"\[body\]: fixed\['left'\] = 'w' must be one of 'hinge', 'x', "),
    ({"body.fixed.left": "z"}, r"\[body\]: fixed\['left'\] = 'z' must be one of 'hinge', 'x', "),
    ({"body.fixed.lft": "x"}, r"\[body\]: The mesh has no boundary or point 'lft'.*'left'"),
    ({"basis.modes": 0}, r"\[basis\]: modes = 0 must be at least 1"),
    ({"basis.modes": 9999}, r"s.toml: \[basis\]: modes = 9999 must be .*number of unknowns"),
    ({"basis.contact_nodes": 999}, r"\[basis\]: contact_nodes = 999 must be 'all' or a whole"),
    ({"basis.contact_nodes": "some"}, r'contact_nodes = "some" must be a whole number, "all" or'),
    ({"basis.contact_nodes": 0}, r'contact_nodes = 0 must be at least 1, or "all"'),
    ({"basis.contact": "contct"}, r"\[basis\]: The mesh has no boundary named 'contct' \(did"),
    ({"basis.B": {"at": "B"}}, r"\[basis\.B\] lacks the key 'radius'"),
    ({"basis.C.radius": -1}, r"\[basis\.C\]: radius = -1\.0 must be a finite number above zero"),
    ({"basis.B": 3}, r"\[basis\]: B = 3 must be a text in quotes, a list of two numbers, a "),
    ({"basis.damping": [0.1]}, r"\[basis\]: Damping must be one ratio, 5 ratios"),
    ({"basis.damping": {"mass_facto": 1}}, r"\[basis\.damping\] has no key 'mass_facto' \(did you"),
    ({"basis.damping": {"loss_factor": -1}}, r"\[basis\.damping\]: loss_factor = -1\.0 must be"),
    ({"basis.reduction": "guyan"}, r'reduction = "guyan" must be "vibration", "residual" or "cra'),
    ({"basis.select": [7]}, r"\[basis\]: modes \[7\] must be different numbers from 0 to 4"),
    ({"basis.dashpots": {"D": [1, 1]}}, r"\[basis\]: There is no point 'D'"),
    ({"gap": {"radius": -1}}, r"s.toml: \[gap\]: radius = -1\.0 must be a finite number above"),
    ({"gap": [0, -1, 0, 0]}, r"s.toml: gap = \[0, -1, 0, 0\] must be finite and zero or above"),
    ({"basis.damping.mass_facto": 1}, r"cannot be set, because basis\.damping = 0\.01 is not a"),
    ({"basis.points.tip": [9, 9]}, r"\[basis\]: Point tip: \(9, 9\) lies outside the body"),
    ({"simulation.initial": "rst"},
     r'initial = "rst" must be "rest", "sliding", "preload", a table of'),
    ({"simulation.initial": {"displacement": [0, 1]}},
     r"\[simulation\.initial\]: displacement = \[0, 1\] must be a list of three numbers"),
    ({"simulation.outputs": 3.5}, r"\[simulation\]: outputs = 3\.5 must be a whole number"),
    ({"simulation.t_end": 0}, r"\[simulation\]: t_end = 0\.0 must be a finite time after"),
    ({"simulation.rtol": 0}, r"\[simulation\]: rtol = 0\.0 must be a finite number above zero"),
    ({"simulation.max_step": 0}, r"\[simulation\]: max_step = 0\.0 must be a finite number above"),
    ({"simulation.solver": "rodas"},
     r"\[simulation\]: solver = 'rodas' must be one of .* \(did you mean 'rodas5p'\?\)"),
    ({"simulation.restitution": 0.5},
     r"\[simulation\]: restitution = 0\.5 is only for solver = .*'event-driven'.*, not 'auto'"),
    ({"simulation.solver": "set-valued", "simulation.restitution": 1.5},
     r"\[simulation\]: restitution = 1\.5 must be a number from 0 to 1, "),
    ({"simulation.solver": "radau", "simulation.stop": ["stick"]},
     r"\[simulation\]: events and stop are for solver = 'auto', .*'set-valued'.*, not 'radau'"),
    ({"geometry.shape": "bem"}, r"\[geometry\]: shape = \"bem\" must be one of .*mean 'beam'"),
    ({"geometry.length": -1}, r"\[geometry\]: length = -1\.0 must be a finite number above zero"),
    ({"geometry.file": "x.msh"}, r"\[geometry\] must have either a shape .* or the file of a"),
    ({"render.size": [321, 240]}, r"\[render\]: size = \[321, 240\] must be an even width"),
    ({"render.colour": "red"}, r'colour = "red" must be "displacement" or "von_mises"'),
    ({"output.frames": -1}, r"\[output\]: frames = -1 must be zero or above"),
    ({"output.points": ["D"]}, r"\[output\]: There is no point 'D'"),
    ({"output.points": [4]}, r"\[output\]: Contact node 4 does not exist"),
    ({"interfaces.contact.normal": {"stiffness": [1.0, 2.0], "roughness_height": 1e-6}},
     r"\[interfaces\.contact\.normal\]: stiffness has 2 values for 4 contact nodes"),
    ({"interfaces.contct.friction": {"law": "frictionless"}},
     r"\[interfaces\.contct\]: the basis has no interface 'contct' \(did you mean 'contact'\?\)"),
    ({"load.forces": [{"point": "D", "signal": {"law": "constant"}}]},
     r"\[load\.forces\]: There is no point 'D'"),
    ({"gap": {"radius": 1e-3}}, r"s.toml: \[gap\]: radius = 0\.001 must be at least 0\.0"),
    ({"gap": [0, 0]}, r"s.toml: gap has 2 values for 4 contact nodes"),
    ({"drive.motion_x": {"law": "swept-sine", "amplitude": 1, "start_frequency_hz": 0,
                         "end_frequency_hz": 1, "duration": 1, "kind": "logarithmic"}},
     r"\[drive\.motion_x\]: start_frequency_hz = 0\.0 must be a finite number above zero"),
    ({"render.t_start": 0.2, "render.t_end": 0.1},
     r"\[render\]: t_end = 0\.1 must not be before t_start"),
    ({"output.points": [1.5]}, r"points = \[1\.5\] must be a list of texts in quotes or whole num"),
]


@pytest.mark.parametrize(("changes", "message"), MISTAKES,
                         ids=["-".join(changes) for changes, _ in MISTAKES])
def test_mistakes_are_one_sentence_with_file_and_section(changes, message, tmp_path):
    tiny = Study.from_toml(TINY, tmp_path / "s.toml")
    with pytest.raises(FecontactError, match=message) as caught:
        tiny.with_(**changes).run()
    text = str(caught.value)
    assert text.startswith(f"{tmp_path / 's.toml'}")
    assert text.count("s.toml") == 1
    assert text.endswith(".")
    assert "\n" not in text


def test_half_a_material_is_refused():
    with pytest.raises(InputError, match="'density' alone does not describe a material"):
        Study.from_toml('geometry = { shape = "beam" }\nbody = { density = 1.0 }')


def test_geometry_and_end_of_run_are_needed():
    with pytest.raises(InputError, match=r"lacks the section \[geometry\]"):
        Study.from_toml("")
    with pytest.raises(InputError, match=r"\[simulation\] lacks the key 't_end'"):
        Study.from_toml('geometry = { shape = "beam" }').run()
    with pytest.raises(InputError, match=r"\[geometry\] must have either a shape"):
        Study.from_toml("[geometry]\nlength = 1.0")
    with pytest.raises(InputError, match=r"scale = 0\.0 must be a finite number above zero"):
        Study.from_toml('[geometry]\nfile = "a.msh"\nscale = 0')


def test_files_that_are_no_studies(tmp_path):
    (tmp_path / "beam.toml").write_text("[geometry]\nshape = beam\n")
    with pytest.raises(InputError, match=r"beam\.toml is not valid TOML: .*line 2"):
        Study.read(tmp_path / "beam.toml")
    with pytest.raises(InputError, match=r"baem\.toml does not exist \(did you mean 'beam\.toml'"):
        Study.read(tmp_path / "baem.toml")
    with pytest.raises(InputError, match="cannot be read as a study"):
        Study.read(tmp_path)
    (tmp_path / "latin.toml").write_bytes("[geometry]\n# Träger\n".encode("latin-1"))
    (tmp_path / "wide.toml").write_text("[geometry]\n", encoding="utf-16")
    for name, line in (("latin", 2), ("wide", 1)):
        with pytest.raises(InputError, match=f"{name}.toml cannot be read as a study: line {line} "
                                             f"is not in UTF-8; save the file"):
            Study.read(tmp_path / f"{name}.toml")


def test_mesh_files_that_are_no_plane_meshes(tmp_path):
    (tmp_path / "text.msh").write_text("hello")
    (tmp_path / "solid.msh").write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
        "$EndNodes\n$Elements\n1\n1 2 2 1 1 1 2 4\n$EndElements\n")
    for name, message in (("text.msh", "no complete section"), ("solid.msh", "surfaces only"),
                          ("none.msh", "there is no such file")):
        study = Study.from_toml(f'[geometry]\nfile = "{name}"', tmp_path / "s.toml")
        with pytest.raises((MeshError, InputError), match=message):
            study.mesh()


LOADED = """
geometry = { shape = "beam" }
body = { thickness = 0.01, fixed = { left = "xy" } }
normal = { stiffness = 1e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { law = "constant", friction_coefficient = 0.2 }
gap = 1e-4

[basis]
modes = 3
contact_nodes = 4
damping = 0.01
reduction = "residual"
tolerance = 0.0
loads = ["gravity", "top", [0.15, 0.012]]

[load]
gravity = [0.0, -9.81]
base_acceleration_x = { law = "harmonic", amplitude = 3.0, frequency_hz = 80.0 }

[[load.boundaries]]
boundary = "top"
pressure = 2e4
shear = { law = "step", time = 1e-3, value = 1e4 }

[[load.forces]]
point = [0.15, 0.012]
signal = { law = "constant", value = -20.0 }

[simulation]
t_end = 2e-3
outputs = 41
"""


def test_loads_of_a_study(tmp_path):
    study = Study.from_toml(LOADED)
    assert Study.from_toml(study.to_toml()) == study
    system = study.system()
    load = system.load
    assert load.gravity == (0.0, -9.81)
    assert list(load.signals) == ["forces.0", "base_acceleration_x", "boundaries.0.shear"]
    run = study.run()
    assert run.energies.imbalance < 1e-4
    write_case(tmp_path / "loads.vtkhdf", run)
    again = read_case(tmp_path / "loads.vtkhdf").trajectory.system
    for name in ("constant_load", "load_shapes", "load_parameters"):
        np.testing.assert_array_equal(getattr(again.arrays, name), getattr(system.arrays, name))
    # At rest the modes and the elements agree where the beam does not touch.
    free = study.with_(gap=1.0).system()
    q = equilibrium(free).modal_coordinates
    fields = static_solution(study.elastic_body(), Load(
        gravity=(0.0, -9.81), forces=load.forces,
        boundaries=[BoundaryLoad("top", 2e4)]))
    np.testing.assert_allclose(free.basis.fields(q).displacement, fields.displacement,
                               atol=1e-8 * abs(fields.displacement).max())
    moon = study.with_(**{"load.gravity": [0.0, -1.6], "load.boundaries.0.pressure": 1e4})
    assert moon.load.gravity == (0.0, -1.6)
    assert moon.load.boundaries[0].pressure == 1e4
    unloaded = study.with_(**{"load.boundaries.0": {"boundary": "top", "pressure": 0}})
    assert Study.from_toml(with_given_keys(unloaded.to_toml())) == unloaded


@pytest.mark.parametrize(("changes", "message"), [
    ({"load.boundaries.0.boundary": "tap"},
     r"\[load.boundaries\]: The basis has no boundary 'tap' \(did you mean 'top'"),
    ({"load.forces.0.point": [9.0, 0.0]}, r"a force: \(9, 0\) lies outside the body"),
    ({"basis.reduction": "vibration"}, r"\[basis\]: loads complete the modes only with"),
])
def test_loads_of_a_study_that_do_not_fit_its_body(changes, message):
    with pytest.raises(InputError, match=message):
        Study.from_toml(LOADED).with_(**changes).system()


def test_friction_and_thickness_have_to_be_given(tiny):
    tables = tiny.tables(defaults=False)
    without = {name: table for name, table in tables.items() if name != "friction"}
    with pytest.raises(InputError, match=r"lacks the section \[friction\].*frictionless"):
        Study.from_tables(without).system()
    smooth = Study.from_tables({**without, "friction": {"law": "frictionless"}})
    assert Study.from_toml(smooth.to_toml()) == smooth
    assert not smooth.run().friction_force.any()
    thin = {**tables, "body": {"material": "steel"}}
    with pytest.raises(InputError, match=r"\[body\]: the key 'thickness' is missing"):
        Study.from_tables(thin).elastic_body()
    slab = Study.from_tables({**tables, "body": {"plane": "strain"}})
    assert slab.elastic_body().thickness == 1.0


def test_another_law_keeps_only_its_own_keys(tiny):
    changed = tiny.with_(**{"friction.law": "jenkins", "friction.stiffness": 1e6,
                            "friction.friction_coefficient": 0.4})
    assert (changed.friction.stiffness, type(changed.friction).__name__) == (1e6, "JenkinsFriction")
    kept = tiny.with_(**{"friction.static_coefficient": 0.4, "friction.kinetic_coefficient": 0.2})
    kept = kept.with_(**{"friction.law": "gaussian", "friction.stribeck_velocity": 1e-3})
    assert (kept.friction.static_coefficient, kept.friction.kinetic_coefficient) == (0.4, 0.2)


@pytest.mark.parametrize(("changes", "missing"), [
    ({"friction": {}}, "the keys 'decay', 'kinetic_coefficient', 'static_coefficient' of law = "
                       "'exponential'"),
    ({"friction": {"law": "constant"}}, "the key 'friction_coefficient' of law = 'constant'"),
    ({"friction": {"law": "jenkins", "friction_coefficient": 0.3}}, "the key 'stiffness'"),
    ({"friction.law": "lugre"}, "'bristle_stiffness', 'stribeck_exponent', 'stribeck_velocity'")])
def test_coefficients_of_friction_must_be_given(tiny, changes, missing):
    with pytest.raises(InputError, match=r"\[friction\] lacks .*fecontact laws") as caught:
        tiny.with_(**changes)
    assert missing in str(caught.value)


def test_a_decimal_comma_is_recognised(tiny):
    with pytest.raises(InputError, match=r'speed = "0,5" must be a number \(did you mean 0\.5\?'):
        tiny.with_(**{"ground.speed": "0,5"})
    with pytest.raises(InputError, match=r"not valid TOML: .*; write 2\.5e-3 with a decimal point"):
        Study.from_toml("[ground]\nspeed = 2,5e-3  # m/s\n")


@pytest.mark.parametrize(("changes", "message"), [
    ({"geometry.length": 100.0, "geometry.height": 10.0, "geometry.element_size": 10.0,
      "body.thickness": 20.0}, "extent of 100 m, not from 0.0001 to 5 m.*scale 1e-3"),
    ({"body.youngs_modulus": 2.1e5}, r"the body has youngs_modulus = 2\.1e\+05 Pa, not from"),
    ({"body.density": 0.5}, "the body has density = 0.5 kg/m3, not from 1 to 25000"),
    ({"body.thickness": 20.0}, "thickness = 20 m of the body is more than its extent of 0.1 m"),
    ({"friction.static_coefficient": 40.0}, "static_coefficient = 40 of .* is above 2"),
    ({"normal.roughness_height": 5.2e-3}, "roughness_height = 0.0052 m is more than a hundredth"),
    ({"basis.damping": 3.0}, "no mode vibrates, as all damping ratios are 3 or more"),
    ({"ground.speed": 1000.0}, r"ground\.speed = 1e\+03 m/s is above 100 m/s"),
    ({"gap": 50.0}, "no contact can close: the smallest gap is 50 m"),
    ({"gap": 50.0, "simulation.t_end": 2.0}, "smallest gap of 50 m is more than 100 times"),
    ({"simulation.t_end": 1e5}, "periods of the fastest mode"),
    ({"drive.amplitude_x": 1e-6, "drive.stiffness_x": 1.0, "drive.frequency_hz": 1e11 / TURN},
     r"duration is 1\.6e\+07 periods of the fastest of drive")])
def test_implausible_values_are_warned_of_before_a_run(tiny, changes, message):
    found, = implausible(tiny.with_(**changes))
    assert re.search(message, found)
    assert not implausible(tiny)


def test_implausible_values_are_warned_of_before_an_error_of_the_basis(tiny):
    light = tiny.with_(**{"body.density": 2.5e-9, "basis.contact": "nowhere"})
    with pytest.warns(ModelWarning, match=r"density = 2\.5e-09 kg/m3, not from"), (
            pytest.raises(FecontactError, match="nowhere")):
        light.run()


def implausible(study):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with study.warning_of_bodies():
            system = study.system()
    return (*(str(one.message) for one in caught),
            *implausible_faces(study.made_bodies(), study.contact_faces, system),
            *implausible_values(Planned(system, study.t_end, np.zeros(system.size))))


def test_a_temperature_is_a_load_of_the_body(tmp_path):
    """A free beam grows by alpha DT in all directions."""
    path = tmp_path / "warm.toml"
    path.write_text(TINY.replace("modes = 5\n", "modes = 5\nreduction = \"residual\"\n"
                                                "temperature = 80.0\n"))
    basis = Study.read(path).modal_basis()
    w, load = basis.angular_frequencies, basis.constant_load
    assert np.abs(load[w == 0.0]).max() < 1e-9 * np.abs(load).max()
    moved = basis.fields(np.divide(load, w**2, out=np.zeros_like(w), where=w > 0.0))
    assert moved.temperature == pytest.approx(80.0)
    strain = np.ptp(moved.displacement[:, 0]) / 0.1
    assert strain == pytest.approx(Material.named("aluminium").thermal_expansion * 80.0, rel=1e-6)


def test_a_basis_stays_while_drive_and_load_change(tiny):
    basis = tiny.modal_basis()
    for name, value in (("drive.frequency_hz", 7.0), ("load.normal", 3.0), ("ground.speed", 0.5)):
        assert tiny.with_(**{name: value}).modal_basis() is basis
