"""One sector of a wheel as a study: responses, waves, mistuning by their commands, messages."""

import shutil
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import platform_damper as example
import pytest

import fecontact as fc
from fecontact import InputError, Study
from fecontact.analysis import mistuned_response
from fecontact.cli import execute, mistuning_results
from fecontact.output.files.branches import read_mode, read_response
from fecontact.output.plots.figure import new_figure
from fecontact.reduction import WholeWheel

EXAMPLES = Path(__file__).parents[2] / "examples"
WHEEL = EXAMPLES / "wheel.toml"
STICKS = "normal.force=1e7"
TIP = ("sector.tip", "y")


def stuck(wheel, order, stiffness):
    """Stiffness, damping and row of the tip of a wave whose contacts are springs."""
    one = wheel.of(-order)
    n = wheel.basis.contact_nodes
    shares = wheel.basis.tributary / wheel.basis.tributary.sum()
    K = one.stiffness + sum(stiffness * share * np.outer(row.conj(), row)
                            for share, row in zip(shares, one.T[2 : 2 + n, 0], strict=True))
    return K, one.damping, one.T[wheel.basis.point_index(TIP[0]), 1]


@pytest.fixture(scope="module")
def responded(tmp_path_factory):
    """Folder of the response of a wheel whose shrouds stick."""
    folder = tmp_path_factory.mktemp("wheel")
    assert execute(["response", str(WHEEL), "--set", STICKS, "--set",
                    "response.bounds=[1850.0, 1865.0]", "--set", "response.largest_step=0.2",
                    "--set", "response.also=['sector.tip x']", "-o", str(folder)]) == 0
    return folder


def test_response_of_a_wheel_that_sticks_is_linear(responded):
    """Springs in place of the contacts, of the nodal diameter of the engine order."""
    found = read_response(responded / "wheel-response.h5")
    K, C, row = stuck(Study.read(WHEEL).cyclic_basis(), 2, 2e7)
    for hertz, amplitude in zip(found.branches[0].parameter, found.amplitude(), strict=True):
        w = 2.0 * np.pi * hertz
        exact = 20.0 * abs(row @ np.linalg.solve(K - w**2 * np.eye(len(K)) + 1j * w * C,
                                                 row.conj()))
        assert amplitude == pytest.approx(exact, rel=1e-5)
    assert found.branches[0].attributes["engine_order"] == 2
    table = np.genfromtxt(responded / "wheel-response.csv", delimiter=",", names=True)
    assert (table["amplitude_sectortip_x"] > 0.0).all()
    assert not (responded / "wheel-response.html").exists()


def test_files_of_waves_say_what_draws_them(responded, capsys):
    file = str(responded / "wheel-response.h5")
    assert execute(["plot", file, "response", "-o", str(responded / "drawn.png")]) == 0
    for command in ("report", "render"):
        assert execute([command, file, "-o", str(responded)]) != 0
        assert "fecontact response --movie" in capsys.readouterr().err


@pytest.mark.slow
def test_mode_of_a_travelling_wave(tmp_path):
    """From the frequency with springs to that without contact, and most damping between."""
    assert execute(["modes", str(WHEEL), "--nonlinear", "1", "--amplitudes", "1e-8", "1e-3",
                    "-o", str(tmp_path)]) == 0
    mode = read_mode(tmp_path / "wheel-mode-1.h5")
    wheel = Study.read(WHEEL).cyclic_basis()
    ends = [np.sqrt(np.linalg.eigvalsh(K)[0]) / (2.0 * np.pi)
            for K in (stuck(wheel, 2, 2e7)[0], wheel.of(2).stiffness)]
    assert mode.frequency_hz[[0, -1]] == pytest.approx(ends, rel=2e-5)
    assert mode.damping_ratio.max() > 3.0 * mode.damping_ratio[[0, -1]].max()


def test_movie_of_a_wheel(tmp_path, monkeypatch):
    from fecontact.output.render import wheel_movie

    seen = []
    monkeypatch.setattr(wheel_movie, "write_motion",
                        lambda motion, path, *_, **__: seen.append(motion) or path)
    assert execute(["response", str(WHEEL), "--movie", "-o", str(tmp_path), "--set", STICKS,
                    "--bounds", "1855", "1860", "--set", "response.points=5"]) == 0
    assert len(seen) == 1


def test_measured_deviations(tmp_path, capsys):
    deviations = [0.02, -0.01, 0.0, 0.015, -0.03, 0.005]
    text = WHEEL.read_text().replace("spread = 0.01", f"deviations = {deviations}").replace(
        'file = "', f'file = "{EXAMPLES}/')
    file = tmp_path / "measured.toml"
    file.write_text(text)
    assert execute(["mistuning", str(file), "-o", str(tmp_path)]) == 0
    assert "Whitehead's bound 1.725" in capsys.readouterr().out
    table = np.loadtxt(tmp_path / "measured-mistuning.csv", delimiter=",", skiprows=1)
    whole = WholeWheel(Study.read(file).cyclic_basis(), deviations, "sector.blade")
    at = table[100, 0]
    assert table[100, 1:] == pytest.approx(np.abs(mistuned_response(whole, 2, at, TIP)[0]))
    assert execute(["mistuning", str(file), "-o", str(tmp_path), "--set",
                    f"mistuning.deviations={[0.01] * 6}"]) == 0
    # Blades that deviate alike are no mistuning: all sectors move as much.
    table = np.loadtxt(tmp_path / "measured-mistuning.csv", delimiter=",", skiprows=1)
    assert table[:, 2:] == pytest.approx(table[:, [1] * 5], rel=1e-8)


def test_random_wheels_are_kept(tmp_path, capsys):
    command = ["mistuning", str(WHEEL), "-o", str(tmp_path), "--workers", "1", "--set",
               "mistuning.samples=10"]
    assert execute(command) == 0
    first = (tmp_path / "wheel-mistuning.csv").read_text()
    table = np.genfromtxt(tmp_path / "wheel-mistuning.csv", delimiter=",", names=True)
    assert len(table) == 10
    assert ((table["amplification"] > 0.99) & (table["amplification"] < 1.7247)).all()
    assert execute(command) != 0
    assert "--resume" in capsys.readouterr().err
    assert execute([*command, "--resume"]) == 0
    assert (tmp_path / "wheel-mistuning.csv").read_text() == first


def test_a_bound_far_off_leaves_space_for_the_histogram(tmp_path, monkeypatch):
    seen = []

    @contextmanager
    def kept(*given):
        with new_figure(*given) as figure:
            yield figure
        seen.append(figure.axes[0])

    monkeypatch.setattr(mistuning_results, "new_figure", kept)
    for largest, lines in ((1.02, 0), (1.5, 1)):
        wheels = SimpleNamespace(amplifications=np.linspace(1.0, largest, 50), bound=1.725)
        mistuning_results._draw_random(wheels, tmp_path / "wheels.png")
        axes = seen[-1]
        assert len(axes.lines) == lines
        low, high = axes.get_xlim()
        assert largest - 1.0 > 0.3 * (high - low)
        said = axes.get_title("right") if not lines else axes.get_legend().texts[0].get_text()
        assert said == "Whitehead's bound 1.725"


def test_dampers_of_a_study_are_those_of_the_example(tmp_path):
    """The wheel of the example with rigid dampers, described by a file, and its preload."""
    for name, mesh in (("blade", "blade_sector"), ("damper", "platform_damper")):
        shutil.copy2(EXAMPLES.parent / "meshes" / f"{mesh}.msh", tmp_path / f"{name}.msh")
    study = Study.from_toml(f"""
symmetry = {{ low = "low", high = "high", sectors = 12 }}
[bodies.blade]
geometry = {{ file = "blade.msh" }}
body = {{ thickness = 0.03, fixed = {{ bore = "xy" }} }}
basis = {{ modes = 8, damping = 1e-3, points = {{ tip = "tip" }} }}
[bodies.damper]
geometry = {{ file = "damper.msh" }}
body = {{ thickness = 0.03 }}
basis = {{ modes = 3, damping = 1e-3, rigid = true, points = {{ middle = "middle" }} }}
[interfaces.own]
face = "damper.left"
other = "blade.under_right"
nodes = 2
nodes_on = "face"
[interfaces.next]
face = "damper.right"
other = "next_blade.under_left"
nodes = 2
nodes_on = "face"
[normal]
law = "linear"
stiffness = 4e7
damping = 50.0
[friction]
law = "jenkins"
stiffness = 2e7
friction_coefficient = 0.3
[[load.forces]]
point = "blade.tip"
signal = {{ law = "harmonic", amplitude = 2.0, frequency_hz = 900.0 }}
[[load.forces]]
point = "damper.middle"
component = {example.polar(1.0, 0.5 * example.ALPHA).tolist()}
signal = 300.0
[response]
engine_order = 3
harmonics = [0, 1, 3]
""", tmp_path / "dampers.toml")
    found, made = study.cyclic_basis(), example.wheel()
    assert [one.diameter for one in found.diameters] == [0, 3, 6]
    for one in found.diameters[:2]:
        assert np.linalg.eigvalsh(one.stiffness) == pytest.approx(
            np.linalg.eigvalsh(made.of(one.diameter).stiffness), rel=1e-8, abs=1e-4)
    forces = fc.equilibrium(study.system()).normal_force.sum()
    normal = made.basis.contact_normals[0] @ example.polar(1.0, 0.5 * example.ALPHA)
    assert forces == pytest.approx(300.0 / abs(normal), rel=1e-4)


@pytest.mark.parametrize(("change", "message"), [
    ({"response.engine_order": 8}, r"engine_order: order = 8 must .* 6; it acts as order 2"),
    ({"response.engine_order": None}, "lacks the key 'engine_order'"),
    ({"symmetry.sectors": 5}, r"\[symmetry\]: 'low' turned by .* give sectors = 6"),
    ({"symmetry.low": "lo"}, r"\[symmetry\]: none of the bodies has both boundaries 'high', 'lo'"),
    ({"symmetry": None}, "no body 'next_sector'"),
    ({"response.method": "shooting"}, "method = 'shooting' and engine_order do not go together"),
    ({"response.stability": "Koopman-Hill"}, "is not known from one sector"),
    ({"response.engine_order": 0}, "engine_order = 0 must be from 1"),
    ({"drive.frequency_hz": 3.0}, r"\[drive\].* is not for one sector of a wheel"),
    ({"bodies.sector.basis.reduction": "vibration"}, "the keys of a sector are"),
    ({"bodies.sector.basis.damping": "materials"}, "give one ratio"),
    ({"bodies.sector.basis.loads": ["gravity"]}, "name boundaries whose loads vary"),
    ({"bodies.sector.basis.rigid": True}, "is rigid, but goes on into its neighbours"),
    ({"interfaces.shroud.passes": 2}, "passes = 2 is not for one sector"),
    ({"mistuning.spread": 0.3}, "spread = 0.3 must lie between 0 and 0.2"),
    ({"mistuning.deviations": [0.1]}, "give either spread"),
    ({"mistuning.samples": 2}, "must be three or more"),
])
def test_what_does_not_fit_is_said(change, message):
    tables = Study.read(WHEEL).tables(defaults=False)
    for name, value in change.items():
        *sections, key = name.split(".")
        table = tables
        for section in sections:
            table = table.setdefault(section, {})
        if value is None:
            del table[key]
        else:
            table[key] = value
    with pytest.raises((InputError, fc.FecontactError), match=message):
        Study.from_tables(tables, WHEEL).wave()


def test_what_is_not_for_sectors_is_said():
    study = Study.read(WHEEL)
    with pytest.raises(InputError, match="`fecontact response` computes its waves"):
        study.with_({"simulation.t_end": 1.0}).run()
    with pytest.raises(InputError, match=r"Study\.cyclic_basis"):
        study.modal_bases()
    without = study.tables(defaults=False)
    del without["symmetry"]
    without["interfaces"]["shroud"]["other"] = "ground"
    with pytest.raises(InputError, match=r"engine_order = 2 is for one sector of a wheel"):
        Study.from_tables(without, WHEEL).wave()
    without["bodies"]["sector"]["basis"]["rigid"] = True
    with pytest.raises(InputError, match=r"rigid = true is for one sector"):
        Study.from_tables(without, WHEEL)
