"""Laws in study files: by name, from the user's own file, for interfaces, with data files."""

import pickle
import re
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest
from friction_conformance import check_friction_law
from law_values import REQUIRED

import fecontact as fc
from fecontact import Study
from fecontact.cli import execute
from fecontact.core.tables import from_table, to_table
from fecontact.laws import (
    ExponentialFriction,
    FrictionLaw,
    NormalLaw,
    Profile,
    RoughSurface,
    Signal,
    law_names,
)
from fecontact.laws.registry import law_class
from fecontact.laws.synonyms import _WORDS

# Values for parameters that have no defaults.
GIVEN = REQUIRED | {
    "stiffness": 1e6, "roughness_height": 1e-5, "restitution": 0.7,
    "reference_velocity": 0.1, "force": 14.0,
    "decay_length": 1e-6, "nominal_area": 1e-4, "coefficient": 1e-9, "asperities": 1e4,
    "asperity_radius": 1e-5, "composite_modulus": 1e11, "height_deviation": 1e-6,
    "clearance": 1e-4, "wavelength": 1e-2, "amplitude": 1e-6, "amplitudes": (1e-6, 2e-6),
    "phases": (0.1, 0.2), "frequencies_hz": (10.0, 20.0), "frequency_hz": 10.0,
    "start_frequency_hz": 1.0, "end_frequency_hz": 10.0, "duration": 2.0, "end_speed": 0.2,
    "times": (0.0, 1.0, 2.0), "values": (0.0, 1.0, 0.0), "abscissae": (0.0, 1e-3, 2e-3, 3e-3),
    "abscissa": (0.0, 1e-3, 2e-3, 3e-3), "heights": (0.0, 1e-6, -1e-6, 0.0), "value": 1.0,
    "time": 0.1,
    "rms_height": 1e-6, "length": 1e-2, "seed": 3, "hurst_exponent": 0.8,
    "start": 0.1, "cut_off_wavelength": 1e-4, "roll_off_wavelength": 5e-3, "kind": "half-sine",
    "cubic_stiffness": 1e15, "elongations": (-1e-3, 0.0, 1e-3), "forces": (-1e3, 0.0, 2e3),
    "gap_range": 1e-5, "springs": (1.0, 2.0), "limits": (1.0, 3.0),
    "normal_stiffness": 1e6, "tangential_stiffness": 8e5,
}
ALL = [(kind, name) for kind, names in law_names().items() for name in names]
SURFACE = """
[normal]
stiffness = 0.3e6
roughness_height = 5.2e-6
damping = 6.0
"""
HEAD = SURFACE + """
[geometry]
shape = "beam"
length = 0.2
height = 0.02
element_size = 0.01

[body]
thickness = 0.1

[basis]
modes = 6
contact_nodes = 5
"""
FRICTION = """
[friction]
static_coefficient = 0.8
kinetic_coefficient = 0.55
decay = 1000.0
"""


def instance(kind, name):
    cls = law_names()[kind][name]
    needed = {entry.name: GIVEN[entry.name] for entry in fields(cls)
              if entry.default is MISSING and entry.default_factory is MISSING}
    if name == "measured-surface":
        needed["roughness_height"] = GIVEN["roughness_height"]
    if name in ("measured-profile", "tabulated"):
        keys = {"measured-profile": ("abscissa", "heights"), "tabulated": ("times", "values")}[name]
        needed |= {key: GIVEN[key] for key in keys if key in {e.name for e in fields(cls)}}
    return cls(**needed)


@pytest.mark.parametrize(("kind", "name"), ALL, ids=[name for _, name in ALL])
def test_every_law_survives_toml_and_pickling(kind, name):
    law = instance(kind, name)
    assert from_table(kind, to_table(law), "study.toml: [law]") == law
    assert pickle.loads(pickle.dumps(law)) == law
    assert law.kernel.address != 0


@pytest.mark.parametrize(("kind", "name"), ALL, ids=[name for _, name in ALL])
def test_every_law_is_documented(kind, name):
    text = type(instance(kind, name)).__doc__
    for entry in fields(type(instance(kind, name))):
        assert entry.name in text, entry.name
    if kind in (NormalLaw, FrictionLaw):
        assert "Raises" in text
        assert "References" in text or name in (
            "linear", "prescribed-force", "rigid-stop", "two-sided-stop", "constant",
            "frictionless",
            "parabolic-surface", "cosine-surface", "gaussian-surface", "measured-surface",
            "hyperbolic", "cubic", "bilateral-polynomial", "bilateral-play",
            "bilateral-piecewise")


@pytest.mark.parametrize(("kind", "name"), [
    pair for pair in ALL if pair[0] in (NormalLaw, FrictionLaw)])
def test_every_law_runs_from_a_study(kind, name, tmp_path):
    """Each in a system of a real body: derivative of the whole system, rest, a short run."""
    part = {NormalLaw: "normal", FrictionLaw: "friction"}[kind]
    law = instance(kind, name)
    if name in ("prescribed-force", "rigid-stop"):
        pytest.skip("a free body has no equilibrium under a prescribed normal force or on a stop")
    lines = "\n".join(f"{key} = {value!r}".replace("(", "[").replace(")", "]").replace("'", '"')
                      for key, value in to_table(law).items())
    head = HEAD.replace(SURFACE, "") if part == "normal" else HEAD
    other = FRICTION if part == "normal" and name != "friction-contact-3d" else ""
    study = Study.from_toml(f"{head}{other}\n[{part}]\n{lines}\n[load]\nnormal = 20.0\n[ground]\n"
                            f"speed = 0.01\n[drive]\nstiffness_x = 1e4\n")
    assert getattr(study, part) == law
    assert Study.from_toml(study.to_toml()) == study
    system = study.system()
    run = fc.simulate(system, 2e-3, outputs=11, rtol=1e-5)
    assert run.status is fc.Status.FINISHED
    assert run.normal_force[0].sum() == pytest.approx(20.0, rel=1e-8)
    assert run.energies.imbalance < 1e-7


def test_a_law_of_ones_own(tmp_path):
    source = Path(__file__).parents[2] / "examples" / "own_law.py"
    (tmp_path / "mine.py").write_text(source.read_text())
    path = tmp_path / "study.toml"
    path.write_text(f'{HEAD}\n[friction]\nlaw = "mine.py:LogarithmicFriction"\n'
                    f'rate_effect = 0.03\n[load]\nnormal = 10.0\n[drive]\nstiffness_x = 1e4\n'
                    f'[simulation]\nt_end = 1e-3\noutputs = 5\n')
    study = Study.read(path)
    assert study.friction.rate_effect == 0.03
    assert Study.from_toml(study.to_toml(), path) == study
    assert execute(["run", str(path)]) == 0
    case = fc.read_case(tmp_path / "results" / "study.vtkhdf")
    assert type(case.trajectory.system.friction).__name__ == "LogarithmicFriction"


@pytest.mark.slow
def test_a_study_with_a_law_of_its_own_can_be_moved(tmp_path, capsys):
    (tmp_path / "here" / "laws").mkdir(parents=True)
    (tmp_path / "here" / "laws" / "own.py").write_text(MEMORY_LAW)
    (tmp_path / "here" / "study.toml").write_text(
        f'{HEAD}\n[friction]\nlaw = "laws/own.py:Mine"\n[load]\nnormal = 10.0\n[drive]\n'
        f'stiffness_x = 1e4\n[simulation]\nt_end = 1e-4\noutputs = 3\n')
    assert execute(["run", str(tmp_path / "here" / "study.toml")]) == 0
    moved = (tmp_path / "here").rename(tmp_path / "there")
    case = fc.read_case(moved / "results" / "study.vtkhdf", trust=True)
    assert type(case.trajectory.system.friction).__name__ == "Mine"
    assert Study.from_toml(case.study).friction == Study.read(moved / "study.toml").friction
    capsys.readouterr()
    assert execute(["export", str(moved / "study.toml"), "--frames", "2"]) == 0
    assert "other values" not in capsys.readouterr().err
    # Outside of the study's folder there is nothing to move along: the path stays absolute.
    fc.write_case(tmp_path / "elsewhere.vtkhdf", case.trajectory, root=tmp_path / "nowhere")
    import h5py

    with h5py.File(tmp_path / "elsewhere.vtkhdf") as file:
        assert f'"{moved / "laws" / "own.py"}:Mine"' in file["system"].attrs["json"]
    with h5py.File(moved / "results" / "study.vtkhdf") as file:
        assert '"../laws/own.py:Mine"' in file["system"].attrs["json"]
        assert str(tmp_path) not in file["study"].attrs["toml"]


@pytest.mark.parametrize(("law", "message"), [
    ('"coulomb"', "coulomb is 'constant'"),
    ('"lugr"', "did you mean 'lugre'"), ('"none.py:Law"', "there is no file"),
    ('"bad.py:Law"', r"cannot be loaded \(SyntaxError"), ("3", "law = 3 must be one of"),
    ('"other.py:Low"', r"has no FrictionLaw of that name \(did you mean 'Law'\?\)"),
    ('"nan.py:Law"', r"Law returns \(nan"), ('"two.py:Law"', "not one of the form"),
])
def test_mistakes_in_laws_are_one_sentence(law, message, tmp_path):
    good = """
from dataclasses import dataclass
from typing import ClassVar
from fecontact.laws import FrictionLaw, friction_law

@friction_law
def f(v, F, p):
    return 0.3 * F * v, 0.3 * F, 0.3 * v

@dataclass(frozen=True)
class Law(FrictionLaw):
    kernel: ClassVar = f
    velocity_scale: ClassVar = 1e-6
"""
    (tmp_path / "bad.py").write_text("class Law(:\n")
    (tmp_path / "other.py").write_text(good)
    (tmp_path / "nan.py").write_text(good.replace("0.3 * F * v,", "v ** 0.5 * float('nan'),"))
    (tmp_path / "two.py").write_text(good.replace("f(v, F, p)", "f(v, F)"))
    path = tmp_path / "study.toml"
    path.write_text(f"{HEAD}\n[friction]\nlaw = {law}\n[load]\nnormal = 10.0\n")
    with pytest.raises(fc.FecontactError, match=message) as caught:
        Study.read(path).system()
    assert "\n" not in str(caught.value)


def test_parts_of_ground_and_drive_by_name(tmp_path):
    (tmp_path / "trace.csv").write_text("x,y\n" + "\n".join(
        f"{1e-3 * i},{1e-6 * np.sin(0.3 * i):.9e}" for i in range(30)))
    path = tmp_path / "study.toml"
    path.write_text(f"""{HEAD + FRICTION}
[ground]
speed = 0.01
[ground.profile]
law = "measured-profile"
file = "trace.csv"
[ground.motion]
law = "speed-ramp"
end_speed = 0.02
start = 0.1
duration = 0.5
[ground.friction_variation]
law = "random-roughness"
rms_height = 0.05
length = 0.01
seed = 1
hurst_exponent = 0.8
roll_off_wavelength = 5e-3
cut_off_wavelength = 1e-3
[drive]
stiffness_x = 1e4
[drive.motion_x]
law = "swept-sine"
amplitude = 1e-5
start_frequency_hz = 10.0
end_frequency_hz = 100.0
duration = 1.0
[load]
normal = 10.0
[[load.forces]]
point = "C"
component = "x"
[load.forces.signal]
law = "harmonic"
amplitude = 2.0
frequency_hz = 5.0
""")
    study = Study.read(path)
    assert isinstance(study.ground.profile, Profile)
    assert isinstance(study.drive.motion_x, Signal)
    assert Study.from_toml(study.to_toml(), path) == study
    system = study.system()
    assert system.parameters()["load.forces.0.signal.amplitude"] == 2.0
    louder = system.with_(**{"load.forces.0.signal.amplitude": 3.0,
                             "drive.motion_x.amplitude": 2e-5})
    assert louder.load.forces[0].signal.amplitude == 3.0
    y = np.zeros(system.size)
    y[1] = -1e-6
    t, step = 0.3, 1e-6
    assert np.abs(louder.rhs(t, y) - system.rhs(t, y)).max() > 1e-6
    wanted = np.array([(system.rhs(t, y + step * unit) - system.rhs(t, y - step * unit))
                       / (2.0 * step) for unit in 1e-3 * np.eye(system.size)]).T * 1e3
    found = system.jacobian(t, y)
    assert np.abs(found - wanted).max() < 1e-4 * np.abs(wanted).max()


def test_contact_groups_in_a_study(tmp_path, capsys):
    mesh = fc.generate(fc.Beam(length=0.2, height=0.02, element_size=0.01))
    fc.write_mesh(mesh, tmp_path / "part.msh")
    path = tmp_path / "study.toml"
    path.write_text("""
[geometry]
file = "part.msh"
[geometry.boundaries]
left = [-0.11, -0.001, -0.04, 0.001]
right = [0.04, -0.001, 0.11, 0.001]
[body]
thickness = 0.1
[basis]
modes = 6
contact = ["left", "right"]
contact_nodes = [3, 4]
[normal]
stiffness = 2e6
roughness_height = 5.2e-6
damping = 6.0
[interfaces.left.friction]
law = "jenkins"
stiffness = 1e6
friction_coefficient = 0.55
[interfaces.right.friction]
static_coefficient = 0.8
kinetic_coefficient = 0.55
decay = 1000.0
[interfaces.right.normal]
law = "linear"
stiffness = 1e6
[load]
normal = 20.0
[drive]
stiffness_x = 1e4
[simulation]
t_end = 1e-3
""".replace("-0.11", f"{mesh.nodes[:, 0].min() - 1e-3:g}").replace(
        "-0.04", f"{mesh.nodes[:, 0].min() + 0.06:g}").replace(
        "[0.04", f"[{mesh.nodes[:, 0].min() + 0.14:g}").replace(
        "0.11,", f"{mesh.nodes[:, 0].max() + 1e-3:g},").replace(
        "-0.001", f"{mesh.nodes[:, 1].min() - 1e-3:g}").replace(
        "0.001]", f"{mesh.nodes[:, 1].min() + 1e-3:g}]"))
    study = Study.read(path)
    system = study.system()
    assert system.basis.groups == (("left", 3), ("right", 4))
    assert system.memory == 1
    assert Study.from_toml(study.to_toml(), path).interfaces == study.interfaces
    run = fc.simulate(system, 1e-3, outputs=3)
    fc.write_case(tmp_path / "a.vtkhdf", run)
    again = fc.read_case(tmp_path / "a.vtkhdf").trajectory
    assert (again.normal_force == run.normal_force).all()
    assert again.system.basis.groups == system.basis.groups
    path.write_text(path.read_text().replace("interfaces.left.", "interfaces.middle."))
    assert execute(["run", str(path)]) == 1
    assert "'middle'" in capsys.readouterr().err


def test_command_laws(capsys):
    assert execute(["laws"]) == 0
    assert "greenwood-williamson" in capsys.readouterr().out
    assert execute(["laws", "lugre"]) == 0
    assert "bristle_stiffness" in capsys.readouterr().out
    assert execute(["laws", "lugr"]) == 1
    assert "did you mean 'lugre'" in capsys.readouterr().err


def test_documentation_names_every_law():
    text = (Path(__file__).parents[2] / "docs" / "laws.md").read_text()
    for kind, name in ALL:
        assert f"`{name}`" in text, (kind, name)


def test_example_law_conforms():
    path = Path(__file__).parents[2] / "examples" / "own_law.py"
    law = law_class(FrictionLaw, f"{path}:LogarithmicFriction", "")
    check_friction_law(law())
    check_friction_law(law(0.2, 0.1, 1e-3, 1e5))


def test_example_in_the_documentation_is_the_example():
    root = Path(__file__).parents[2]
    example = (root / "examples" / "own_law.py").read_text()
    block = (root / "docs" / "laws.md").read_text().split("@friction_law\n")[1]
    for line in block.split("```")[0].splitlines():
        if line.strip() and not line.startswith("    def "):
            assert line in example, line


MEMORY_LAW = """
from dataclasses import dataclass
from typing import ClassVar
from fecontact.laws import FrictionLaw, memory_friction_law, normal_law

@memory_friction_law
def f(v, F, z, p, force, rates):
    force[0] = F * 1e5 * z[0]
    force[1] = 0.0
    force[2] = 1e5 * z[0]
    force[3] = F * 1e5
    rates[0, 0] = v - 2e5 * abs(v) * z[0]
    rates[0, 1] = 1.0 - 2e5 * z[0] * (1.0 if v >= 0.0 else -1.0)
    rates[0, 2] = 0.0
    rates[0, 3] = -2e5 * abs(v)

@dataclass(frozen=True)
class Mine(FrictionLaw):
    kernel: ClassVar = f
    memory: ClassVar = 1
    velocity_scale: ClassVar = 1e-5
"""


def test_own_law_with_memory_runs_is_kept_and_read(tmp_path):
    (tmp_path / "own.py").write_text(MEMORY_LAW)
    path = tmp_path / "study.toml"
    path.write_text(f'{HEAD}\n[friction]\nlaw = "own.py:Mine"\n[load]\nnormal = 10.0\n[ground]\n'
                    f'speed = 0.01\n[drive]\nstiffness_x = 1e4\n')
    system = Study.read(path).system()
    assert (system.friction.stick_velocity(5) == 1e-4).all()
    run = fc.simulate(system, 2e-3, outputs=21)
    assert run.status is fc.Status.FINISHED
    assert set(run.contact_state.ravel().tolist()) <= {0, 1, 2}
    fc.write_case(tmp_path / "a.vtkhdf", run)
    again = fc.read_case(tmp_path / "a.vtkhdf").trajectory
    assert (again.friction_force == run.friction_force).all()
    # A copy elsewhere compiles for itself, also beside the stored code of the first one.
    import shutil

    shutil.copytree(tmp_path, tmp_path / "copy")
    assert fc.simulate(Study.read(tmp_path / "copy" / "study.toml").system(), 1e-4).time[-1] == 1e-4


@pytest.mark.parametrize(("old", "new", "message"), [
    ("    force[1] = 0.0\n", "    if v > 1e9:\n        raise ValueError(v)\n",
     r"f\(v, F, z, p, force, rates\) has a raise or assert statement, which"),
    ("    force[1] = 0.0\n", "    assert F >= 0.0\n", "has a raise or assert statement, which"),
    ("@memory_friction_law\ndef f(v, F, z, p, force, rates):\n",
     "import numba\n\n@numba.njit\ndef checked(F):\n    if F < 0.0:\n        raise ValueError(F)\n"
     "\n@memory_friction_law\ndef f(v, F, z, p, force, rates):\n    checked(F)\n",
     "statement in checked, which"),
    ("    memory: ClassVar = 1\n", "", "memory = 0 must be the number of internal variables"),
    ("memory: ClassVar = 1", "memory: ClassVar = -1", "memory = -1 must be"),
    ("velocity_scale: ClassVar = 1e-5", "velocity_scale: ClassVar = 0.0", "velocity_scale = 0.0"),
    ("    velocity_scale: ClassVar = 1e-5\n", "", "velocity_scale = None must be a finite number"),
    ("@memory_friction_law\n", "", "kernel must be a class variable, a function"),
    ("@memory_friction_law", "@normal_law", r"is not one of the form f\(u, v, p\)"),
])
def test_incomplete_own_laws_are_refused(old, new, message, tmp_path):
    assert old in MEMORY_LAW
    text = MEMORY_LAW.replace(old, new).replace(
        "-> F", "") if "normal" not in new else MEMORY_LAW.replace(old, new)
    (tmp_path / "own.py").write_text(text)
    path = tmp_path / "study.toml"
    path.write_text(f'{HEAD}\n[friction]\nlaw = "own.py:Mine"\n')
    with pytest.raises(fc.FecontactError, match=message):
        Study.read(path).system()


def test_lists_per_node_are_counted_rightly():
    with pytest.raises(fc.FecontactError, match="stiffness has 3, roughness_height has 2"):
        RoughSurface((1e6,) * 3, (1e-6,) * 2).node_count()
    basis = Study.from_toml(HEAD).modal_basis()
    with pytest.raises(fc.FecontactError, match="3 values for 5 contact nodes"):
        fc.ContactSystem(basis, normal=RoughSurface((1e6,) * 3, 1e-6),
                         friction=ExponentialFriction(0.8, 0.55, 1e3))


def test_laws_are_found_by_what_others_call_them(capsys):
    for word, found in (("Stribeck", ("exponential", "gaussian", "hyperbolic", "lugre")),
                        ("coulomb friction", ("constant",)), ("Hunt-Crossley", ("power",)),
                        ("maxwell-slip", ("iwan",)), ("bearing area", ("measured-surface",)),
                        ("chirp", ("swept-sine",))):
        assert execute(["laws", word]) == 0
        said = capsys.readouterr().out
        for name in found:
            assert re.search(rf" {name} ", said), (word, name)
    assert execute(["laws", "no-such-thing"]) == 1
    with pytest.raises(fc.InputError, match=r"\(stribeck is .*'exponential' or 'gaussian'"):
        fc.Study.from_toml(f'{HEAD}\n[friction]\nlaw = "stribeck"', "x.toml")


def test_every_synonym_stands_for_a_law():
    laws = {cls.__name__ for names in law_names().values() for cls in names.values()}
    assert {cls for found in _WORDS.values() for cls in found} <= laws
