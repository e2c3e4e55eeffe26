"""Files of runs name files of Python: none of them is run without being asked."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import h5py
import numpy as np
import pytest
import response_study
import tomli_w

import fecontact as fc
from fecontact import Study
from fecontact.cli import execute
from fecontact.core.user_code import module_name, user_module
from fecontact.integrate import PointStart
from fecontact.laws import (
    ConstantFriction,
    LinearContact,
    SlidingRotation,
    SlidingTranslation,
)
from fecontact.reduction import PointPairing, point_masses

LAW = """
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from fecontact.laws import NormalLaw, normal_law

with Path(__file__).with_name("ran").open("a") as file:
    file.write("x")


@normal_law
def stiff(u, v, p):
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    return p[0] * u, p[0], 0.0


@dataclass(frozen=True)
class Stiff(NormalLaw):
    stiffness: float = 2e6
    kernel: ClassVar = stiff
    penetration_scale: ClassVar = 1e-6
"""
STUDY = """
geometry = { shape = "beam", length = 0.1, height = 0.01, element_size = 0.01 }
body = { material = "steel", thickness = 0.02 }
basis = { modes = 5, contact_nodes = 4 }
load = { normal = 10.0 }
ground = { speed = 0.1, amplitude = 1e-5 }
simulation = { t_end = 2e-3, outputs = 101 }
output = { frames = 3 }
render = { frames = 2, size = [320, 180] }
normal = { law = "own.py:Stiff" }
friction = { law = "frictionless" }
"""
RESPONSE = ["--bounds", "10", "10.5", "--harmonics", "1", "--samples", "64"]
MODE = ["--nonlinear", "1", "--amplitudes", "1e-5", "2e-5"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run with a law of the user's own, made by another process."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "own.py").write_text(LAW)
    (folder / "s.toml").write_text(STUDY)
    subprocess.run([sys.executable, "-m", "fecontact", "run", str(folder / "s.toml")], check=True,
                   capture_output=True, timeout=120)
    assert (folder / "ran").read_text() == "x"
    return folder


@pytest.fixture
def stored(made, tmp_path):
    """A copy of it, whose law was never loaded here."""
    for name in ("own.py", "s.toml", "results/s.vtkhdf"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes((made / name).read_bytes())
    return tmp_path / "results" / "s.vtkhdf"


def ran(stored):
    return (stored.parent.parent / "ran").exists()


def test_what_is_stored_needs_no_code(stored):
    """Pictures and tables show the run to the last bit."""
    safe = fc.read_case(stored).trajectory
    assert not ran(stored)
    energies, contact = safe.energies, safe.contact_state
    part = safe.between(5e-4, 1e-3)
    assert not ran(stored)
    whole = fc.read_case(stored, trust=True).trajectory
    assert ran(stored)
    assert (whole.normal_force > 0.0).any()
    for name in ("normal_force", "friction_force", "penetration", "penetration_rate",
                 "slip_velocity", "friction_work", "states"):
        assert np.array_equal(getattr(safe, name), getattr(whole, name)), name
    assert np.array_equal(contact, whole.contact_state)
    assert np.array_equal(energies.contact, whole.energies.contact)
    assert energies.imbalance == whole.energies.imbalance
    assert np.array_equal(part.contact_state, whole.between(5e-4, 1e-3).contact_state)


def test_what_needs_the_law_says_so(stored):
    system = fc.read_case(stored).trajectory.system
    state = np.zeros(system.size)
    for ask in (lambda: system.rhs(0.0, state), lambda: system.penetration_scale,
                lambda: system.with_(gap=1e-6), lambda: system.parameters(),
                lambda: fc.simulate(system, 1e-3),
                lambda: system.stored_energy(np.full((1, 4), 1e-9)),
                lambda: system.contact_history(np.zeros(1), state[None])):
        with pytest.raises(fc.InputError, match=r"own\.py.*if you trust .*own\.py, say --trust"):
            ask()
    assert not ran(stored)


def test_the_command_line_runs_nothing_unasked(stored, capsys, monkeypatch):
    out = stored.parent / "out"
    for kind in ("contact_map", "energies", "friction_work", "receptance"):
        code = execute(["plot", str(stored), kind, "-o", str(out / f"{kind}.png")])
        said = capsys.readouterr().err
        assert (code, said) == (0, "") or (
            kind == "receptance" and code == 1 and said.count("\n") == 1 and "--trust" in said)
    for form in ("pvd", "csv"):
        assert execute(["export", str(stored), "--format", form, "--frames", "2"]) == 0
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    assert execute(["open", str(stored), "--with", "browser"]) == 0
    assert opened == [stored.with_suffix(".html").as_uri()]
    assert execute(["render", str(stored), "-o", str(out / "a.mp4")]) == 0 or (
        "apt-get" in capsys.readouterr().err)
    assert not ran(stored)
    assert execute(["plot", str(stored), "receptance", "--trust", "-o", str(out / "r.png")]) == 0
    assert ran(stored)


def test_a_study_of_ones_own_names_its_law(stored, capsys):
    """Whoever gives the study gives its law; but not one that the run alone names."""
    study = stored.parent.parent / "s.toml"
    assert execute(["plot", str(study), "energies"]) == 0
    assert "other values" not in capsys.readouterr().err
    assert ran(stored)
    (stored.parent.parent / "ran").unlink()
    hostile = stored.parent / "hostile.py"
    hostile.write_text("from pathlib import Path\nPath(__file__).with_name('harm').touch()\n")
    with h5py.File(stored, "a") as file:
        tables = json.loads(file["system"].attrs["json"])
        tables["friction"] = {"law": "hostile.py:Harm"}
        file["system"].attrs["json"] = json.dumps(tables)
        file["study"].attrs["toml"] = STUDY.replace(
                "frictionless", "hostile.py:Harm")
    assert execute(["plot", str(study), "history"]) == 0
    assert "other values" in capsys.readouterr().err
    assert not (stored.parent / "harm").exists()


@pytest.mark.parametrize("place", [
    {"normal": {"law": "hostile.py:Harm"}}, {"friction": {"law": "hostile.py:Harm"}},
    {"ground": {"profile": {"law": "hostile.py:Harm"}}},
    {"ground": {"motion": {"law": "hostile.py:Harm"}}},
    {"drive": {"motion_x": {"law": "hostile.py:Harm"}}},
    {"load": {"forces": [{"point": "C", "component": "x",
                          "signal": {"law": "hostile.py:Harm"}}]}},
    {"interfaces": {"contact": {"normal": {"law": "hostile.py:Harm"}}}},
])
def test_a_hostile_file_runs_nothing(stored, place, capsys):
    hostile = stored.parent / "hostile.py"
    hostile.write_text("from pathlib import Path\nPath(__file__).with_name('harm').touch()\n")
    with h5py.File(stored, "a") as file:
        tables = json.loads(file["system"].attrs["json"])
        file["system"].attrs["json"] = json.dumps({
            key: {**table, **place.get(key, {})} if isinstance(table, dict) else table
            for key, table in tables.items()} | {
                key: table for key, table in place.items() if key not in tables})
    for tokens in (["plot", str(stored), "history", "-o", str(stored.parent / "a.png")],
                   ["export", str(stored), "--format", "csv"]):
        code = execute(tokens)
        said = capsys.readouterr().err
        assert code in (0, 1)
        assert said.count("\n") == code
        assert "Traceback" not in said
        assert "should not happen" not in said
    assert not (stored.parent / "harm").exists()
    assert not ran(stored)


@pytest.fixture(scope="module")
def orbits(tmp_path_factory):
    """A study with a response and a nonlinear mode, by laws of the package."""
    folder = tmp_path_factory.mktemp("orbits")
    (folder / "b.toml").write_text(response_study.STUDY)
    file, out = str(folder / "b.toml"), str(folder / "results")
    assert execute(["response", file, *RESPONSE]) == 0
    assert execute(["modes", file, *MODE, "-o", out]) == 0
    return folder


@pytest.mark.parametrize("named", ["hostile.py:Harm", r"hostile\u002epy:Harm", "{}/hostile.py:Harm",
                                   r"{}/hostile\u002epy:Harm"])
def test_no_command_runs_what_a_stored_study_names(named, orbits, stored, capsys, monkeypatch):
    """The study that is stored with results names a law, the model beside it does not."""
    folder = stored.parent
    for file in ("results/b-response.h5", "results/b-mode-1.h5", "b.toml"):
        (stored.parent.parent / file).write_bytes((orbits / file).read_bytes())
    response, mode = folder / "b-response.h5", folder / "b-mode-1.h5"
    study = folder.parent / "b.toml"
    (folder / "hostile.py").write_text(
        "from pathlib import Path\nPath(__file__).with_name('harm').touch()\n")
    for file in (response, mode, stored):
        with h5py.File(file, "a") as content:
            tables = tomllib.loads(content["study"].attrs["toml"]) | {"friction": {"law": "NAME"}}
            content["study"].attrs["toml"] = tomli_w.dumps(tables).replace(
                "NAME", named.format(folder))
    monkeypatch.setattr("webbrowser.open", lambda address: True)
    page, picture = (str(folder / f"out.{ending}") for ending in ("html", "png"))
    commands = [
        *(["response", study, *RESPONSE, "--resume"], ["modes", study, *MODE, "--resume"]),
        *(["report", file, "-o", page] for file in (response, mode, stored)),
        *(["open", file, "--with", "browser"] for file in (response, mode, stored)),
        *(["plot", file, "phase", "--branch", "0", "-o", picture] for file in (response, mode)),
        ["plot", response, "response", "-o", picture], ["plot", mode, "mode", "-o", picture],
        ["plot", stored, "history", "-o", picture], ["export", stored, "--format", "csv"],
        ["compare", response, response, "-o", page], ["compare", stored, stored, "-o", page],
        ["render", stored, "--frames", "1", "-o", picture]]
    for tokens in commands:
        code = execute(list(map(str, tokens)))
        said = capsys.readouterr().err
        refused = "--resume" in tokens
        assert code == refused, (tokens, said)
        assert not refused or "was computed with other values" in said
        assert not (folder / "harm").exists(), tokens
    assert not ran(stored)


def test_open_runs_no_law_of_a_study(stored, capsys, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    study = stored.parent.parent / "s.toml"
    assert execute(["open", str(study), "--with", "browser"]) == 1
    said = capsys.readouterr().err
    assert "say --trust" in said
    assert said.count("\n") == 1
    assert not ran(stored)
    assert opened == []
    assert execute(["open", str(study), "--with", "browser", "--trust"]) == 0
    assert ran(stored)
    assert opened == [stored.with_suffix(".html").as_uri()]


def test_a_law_that_is_loaded_needs_no_trust(tmp_path, monkeypatch):
    """A script that defines its law, runs and reads the run again."""
    (tmp_path / "mylaws.py").write_text(LAW)
    monkeypatch.syspath_prepend(tmp_path)
    import mylaws  # type: ignore[import-not-found]

    (tmp_path / "s.toml").write_text(STUDY.replace("own.py", "mylaws.py"))
    system = Study.read(tmp_path / "s.toml").with_(
        **{"simulation.outputs": 3}).system().with_(normal=mylaws.Stiff())
    written = fc.write_case(tmp_path / "a.vtkhdf", fc.simulate(system, 1e-5, outputs=3))
    assert type(fc.read_case(written).trajectory.system.normal) is mylaws.Stiff
    assert Path(tmp_path / "ran").read_text() == "xx"  # by import, and by the study


def test_sliding_of_interfaces_is_read_without_the_laws(tmp_path):
    """The motion of the other sides is no code: slip, states and work are those of the run."""
    file = tmp_path / "own.py"
    file.write_text(LAW)
    own = user_module(file)
    bodies = {name: point_masses({"p": mass, "r": mass}, components="xy")
              for name, mass in (("pad", 1.0), ("disc", 2.0))}
    sliding = {"lining": SlidingTranslation(0.3, (1, 1)), "rim": SlidingRotation(2.0, (0, -0.1))}
    system = fc.ContactSystem(bodies=bodies, interfaces=[
        fc.Interface(name, PointPairing("pad", point, "disc", point), normal,
                     ConstantFriction(0.4, smoothing_slope=1e3), sliding[name])
        for name, point, normal in (("lining", "p", own.Stiff()), ("rim", "r", LinearContact(1e5)))
    ])
    run = fc.simulate(system, 5e-3, outputs=21, initial=PointStart(
        velocities={"pad.p": (0.0, -0.1), "pad.r": (0.1, -0.2)}))
    assert np.ptp(run.contact_state) == 2
    fc.write_case(tmp_path / "run.h5", run)
    del sys.modules[module_name(file)]
    file.unlink()
    read = fc.read_case(tmp_path / "run.h5").trajectory
    for name in ("slip_velocity", "contact_state", "friction_force", "friction_work"):
        assert np.array_equal(getattr(read, name), getattr(run, name)), name
    assert dict(read.system.sliding) == sliding
    motion = read.system.prescribed_motion
    assert np.array_equal(motion.factors, system.prescribed_motion.factors)
    # Slip is the motion of the pad along the disc less that of the disc's surface.
    moved = run.modal_velocities @ system.basis.contact_T[:, 0].T
    # The rim is 0.1 m above the centre: it moves in -x at 0.2 m/s.
    np.testing.assert_allclose(moved - read.slip_velocity, np.tile(
        (0.3 / np.sqrt(2.0), -0.2), (len(moved), 1)), rtol=0.0, atol=1e-14)
    assert list(dict(read.system.summary())) == list(dict(system.summary()))
    assert read.system.friction["rim"] == system.friction["rim"]
    with pytest.raises(fc.InputError, match=r"own\.py.*if you trust"):
        _ = read.system.normal["lining"].stiffness


def test_sliding_that_is_damaged_in_a_file_is_told(tmp_path):
    """Also for a run whose laws are not read."""
    (tmp_path / "own.py").write_text(LAW)
    own = user_module(tmp_path / "own.py")
    system = fc.ContactSystem(
        bodies={"a": point_masses({"p": 1.0}), "b": point_masses({"p": 2.0})},
        interfaces=[fc.Interface("touch", PointPairing("a", "p", "b", "p"), own.Stiff(),
                                 ConstantFriction(0.1), SlidingTranslation(0.3))])
    run = fc.simulate(system, 1e-4, outputs=2, initial=PointStart())
    fc.write_case(tmp_path / "run.h5", run)
    del sys.modules[module_name(tmp_path / "own.py")]
    with h5py.File(tmp_path / "run.h5", "r+") as stored:
        text = stored["system"].attrs["json"].replace('"speed": 0.3', '"speed": "fast"')
        stored["system"].attrs["json"] = text
    with pytest.raises(fc.InputError, match=r"run\.h5.*\[interfaces\.touch\.sliding\].*fast"):
        fc.read_case(tmp_path / "run.h5")
