"""The README and the pages of docs: code runs, tables are read, commands parse."""

import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
from report_reading import Shown

import fecontact as fc
from fecontact import Study
from fecontact.bifurcation import nonlinear_mode
from fecontact.cli import execute
from fecontact.cli.app import COMMANDS, app
from fecontact.core.errors import AnalysisError
from fecontact.laws import check_law
from fecontact.plot import rendering_problem
from fecontact.reduction import BasisReport
from fecontact.study import Span

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = {path.name: path for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md")} | {
    path.relative_to(DOCS).as_posix(): path for path in sorted(DOCS.rglob("*.md"))}
TEXTS = {name: path.read_text() for name, path in PAGES.items()}
BLOCK = re.compile(r"(?:<!-- not run: (?P<reason>[^>]+) -->\n)?```(?P<language>\w*)\n"
                   r"(?P<text>.*?)```", re.DOTALL)
# Long computations of a page in fewer cases, each given by a text that stands there once.
SHORTER = {"sweeps.md": {"12e-3, 24)": "12e-3, 2)", "t_start=30.0": "t_start=0.5",
                         "changes(17)": "changes(7)"}}
BELT = """
geometry = { shape = "block", element_size = 0.02 }
body = { thickness = 0.1 }
basis = { modes = 3, contact_nodes = 2 }
normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
ground = { speed = 2e-3 }
load = { normal = 14.0 }
drive = { stiffness_x = 5610.0, damping_x = 0.768, amplitude_x = 0.5e-3, frequency_hz = 2.196 }
simulation = { t_end = 1.0, outputs = 1001 }
"""


def blocks(page, language):
    """Texts of the code of a page that is to be run or read."""
    return [found["text"] for found in BLOCK.finditer(TEXTS[page])
            if found["language"] == language and not found["reason"]]


def laws_setup(folder):
    """Names that the page needs: modules, a basis."""
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    basis = fc.basis_from_matrices(np.eye(2), np.zeros((2, 2)),
                                   {"contact": rows[None], "B": rows, "C": rows})
    names = {"fc": fc, "basis": basis}
    exec("import math\nfrom dataclasses import dataclass\nfrom typing import ClassVar\n"
         "import numpy as np", names)
    return names


def sweeps_setup(folder):
    """A study in the folder."""
    (folder / "study.toml").write_text(BELT)
    return {"__name__": "__main__"}


def orbits_setup(folder):
    """The system of the first example of the page on bifurcations."""
    names = {}
    exec(compile(blocks("bifurcation.md", "python")[0], "bifurcation.md", "exec"), names)
    return names


def results_setup(folder):
    """The files of a run and of a sweep that the page reads."""
    (folder / "study.toml").write_text(BELT.replace('contact_nodes = 2', 'contact_nodes = 5'))
    study = Study.read(folder / "study.toml")
    (folder / "results").mkdir()
    fc.write_case(folder / "results" / "study.vtkhdf", study.with_(
        **{"simulation.t_end": 4.0}).run(), frames=3, study=study.to_toml())
    fc.sweep(study, {"ground.speed": [1e-3, 2e-3], "load.normal": [10.0, 14.0]},
             summaries=["amplitude_x"], folder=folder / "results" / "study-sweep", workers=1)
    return {}


def sensitivity(names):
    """The table of a sweep for Sobol indices, of which the page speaks by then."""
    names["table"] = fc.sweep(
        "study.toml", {"ground.speed": Span(1e-3, 4e-3, 2),
                       "load.normal": Span(10.0, 20.0, 2)},
        method="sensitivity", samples=8, summaries=["friction_power"], folder="sensitivity")


BETWEEN = {("sweeps.md", 1): sensitivity}  # before this block of the page
SETUP = {"laws.md": laws_setup, "sweeps.md": sweeps_setup, "orbits.md": orbits_setup,
         "report.md": sweeps_setup,
         "results.md": results_setup}


def check_readme(names, printed, folder):
    assert "The run reached its end." in printed
    assert "right to" in BasisReport(names["basis"]).recommendation
    assert names["run"].energies.imbalance < 2e-5
    assert set(names["run"].contact_state.ravel().tolist()) == {0, 1, 2}
    assert (folder / "contact.png").stat().st_size > 10_000


def check_analysis(names, printed, folder):
    assert "Peak(frequency_hz=10.2400" in printed
    found, impacts = names["found"], names["impacts"]
    assert (found.periods, found.settled) == (1, True)
    assert len(impacts) == 60
    assert abs(impacts.restitution - 0.945).max() < 1e-3
    assert {path.name for path in folder.iterdir()} == {
        "spectrum.png", "poincare.png", "receptance.png", "run.csv", "history.pdf"}
    # On its spring the mass alone has sqrt(c / m) = 5.22 Hz.
    response = names["response"]
    highest = response.frequency_hz[response.magnitude[:, 0, 0].argmax()]
    assert abs(highest - 5.223) < 0.06


def check_bifurcation(names, printed, folder):
    first, second = (line.split() for line in printed.splitlines())
    assert [first[0], second[0]] == ["Hopf", "Hopf"]
    told = re.search(r"at B = ([\d.]+) and\n +([\d.]+)", TEXTS["bifurcation.md"])
    assert [float(first[1]), float(second[1])] == pytest.approx(
        [float(x) for x in told.groups()], abs=5e-7)
    assert first[-1] == "subcritical"
    assert names["flow"].of_kind("Hopf")[0].parameter == pytest.approx(470.0 / 19.0, rel=1e-10)
    # The border ends on bounds of both parameters, one to each side.
    assert names["forces"].max() == pytest.approx(30.0, rel=1e-12)
    assert names["speeds"].min() == pytest.approx(0.5, rel=1e-12)
    end = names["short"].points[-1]
    assert end.kind == "first mode displaced by 1"
    assert end.values["state"][0] == pytest.approx(1.0, rel=1e-10)
    # The orbit of the second part is that of the runs.
    first = names["shown"].points[0]
    values, _ = names["runs"].observed("B", "y")
    assert first.parameter == pytest.approx(10.2, rel=1e-9)
    assert first.values["observed_section"][0] == pytest.approx(values[0, -1], rel=1e-3)
    near = min(names["orbits"].points, key=lambda at: abs(at.parameter - 10.24)).values
    decay = np.log(np.abs(near["multipliers"]).max()) / near["period"]
    assert names["pair"].mean() == pytest.approx(decay, rel=0.03)
    assert len(names["found"].attractors) == 1
    assert all((folder / name).stat().st_size > 5000 for name in ("impacts.png", "basins.png"))


def check_orbits(names, printed, folder):
    assert "period doubling 8.0921923" in printed
    assert (folder / "diagram.png").stat().st_size > 10000
    counts = [len(point.values["mesh"]) - 1 for point in names["exact"].points]
    assert min(counts) == 20
    # One orbit comes so near to the tolerance that rounding decides whether its mesh suffices.
    assert max(counts) in (200, 400)
    assert names["exact"].column("state_error").max() <= 1e-8
    second = names["doubled"].of_kind("period doubling")[0]
    assert second.parameter == pytest.approx(9.2619, abs=1e-3)
    motion = names["motion"]
    assert motion.times[-1] == pytest.approx(names["orbits"].points[40].values["period"])
    assert motion.states[0] == pytest.approx(motion.states[-1], abs=1e-12)
    assert names["long_orbits"].column("period") == pytest.approx(60.0, rel=1e-9)
    assert names["long_orbits"].column("m").min() == pytest.approx(-4.0, rel=1e-9)
    for name in ("homoclinic", "long_orbits"):
        m, c = names[name].column("m"), names[name].column("c")
        order = np.argsort(-m)
        assert np.interp(1.0, -m[order], c[order]) == pytest.approx(0.743444, rel=2e-3)
    found = {name: [round(point.parameter, 4) for point in branch.of_kind("period doubling")]
             for name, branch in names["tree"].found.items()}
    assert found["orbits 1, doubled"] == [9.2619]
    assert found["orbits 2"] == [5.3835, 7.2487]


def check_runs(names, printed, folder):
    assert names["run"].events.kind[0] == "touch-down"
    assert names["first"].status.name == "EVENT"
    assert names["found"].exponents[0] == pytest.approx(-6.254, abs=1.0)
    multipliers = abs(np.linalg.eigvals(names["one"].monodromy))
    assert np.log(multipliers.max()) / names["period"] == pytest.approx(-6.254, rel=1e-3)
    assert names["chaos"].exponents == pytest.approx([0.0714, 0.0, -5.3943], abs=0.06)
    visits = [len(np.unique(row.round(3))) for row in names["passages"]]
    assert (visits[0], visits[2], visits[-1]) == (1, 2, 16)
    assert names["same"].parameters == {"a": 0.2, "b": 0.2, "c": 5.7}
    assert (folder / "rossler.mp4").stat().st_size > 10000
    assert names["up"].shape == names["down"].shape == (9, 4)
    assert [one.kind for one in names["plane"].attractors] == ["periodic"]


def check_laws(names, printed, folder):
    law = names["LogarithmicFriction"](0.2, 0.03)
    # mu_0 + a ln(1 + v / v_0) times F = 5 N, with the sign of slip.
    force = law.kernel.python(-0.1, 5.0, law.table(np.ones(1))[0])[0]
    assert force == pytest.approx(-5.0 * (0.2 + 0.03 * np.log1p(0.1 / 1e-4)), rel=1e-9)
    check_law(law)
    assert names["system"].friction.static_coefficient == 0.6


def check_sweeps(names, printed, folder):
    assert names["amplitude"].shape == (2, 4)
    # The case once more, alone: half of its way is what the table says.
    x = names["run"].between(0.5).displacement("B")[:, 0]
    assert names["amplitude"].ravel()[7] == pytest.approx(np.ptp(x) / 2.0, rel=1e-12)


def check_integrator(names, printed, folder):
    assert printed.startswith("The run reached its end.")
    # Stick-slip: the block sticks to the belt and never overtakes it by more than round-off.
    assert names["run"].states[:, 1].max() == pytest.approx(0.5, rel=0.01)


def check_set_valued(names, printed, folder):
    *numbers, kind, border = printed.split()
    largest, end, place = (float(text) for text in numbers)
    assert kind == "grazing-sliding"
    # The next crest of slip, damped, just reaches the belt's speed.
    assert float(border) == pytest.approx(0.5490463, abs=1e-7)
    assert len(names["curve"].points) > 5
    # The spring pulls the sticking block up to the static limit before it slips.
    assert 0.97 < largest <= 1.0 + 1e-9
    # Friction mu g t takes the speed of the thrown one.
    assert end == pytest.approx(3.0, abs=1e-5)
    # Across the belt it goes v v_y / (2 mu g), v its velocity relative to the belt.
    assert place == pytest.approx(np.sqrt(1.25) / (2.0 * 0.3 * 9.81), abs=1e-7)


def check_loads(names, printed, folder):
    first, second = printed.splitlines()
    # Beam theory: q L^4 / (8 E I) and q L^2 / (2 kappa G A), with the weight.
    E, nu = 2.1e11, 0.3
    q = 0.02 * (5e5 + 7850.0 * 9.81 * 0.1)
    area, inertia = 0.1 * 0.02, 0.02 * 0.1**3 / 12.0
    wanted = q / (8.0 * E * inertia) + q / 2.0 / (5.0 / 6.0 * E / 2.0 / (1.0 + nu) * area)
    assert float(first.split()[0]) == pytest.approx(-1e3 * wanted, rel=3e-3)
    assert float(second) < 1e-6
    assert np.abs(names["resting"].displacement).max() < np.abs(names["same"].displacement).max()
    assert (folder / "stress.png").stat().st_size > 10_000
    assert (folder / "stress.vtu").exists()


def check_preload(names, printed, folder):
    # 4 mu F (X - mu F / k), where the spring of the body takes what friction does not.
    amplitude = (30.0 - 20.0) / 1e5
    assert names["history"].loop(1, 3).loss == pytest.approx(
        4.0 * 20.0 * (amplitude - 20.0 / 6e6), rel=1e-6)
    assert abs(names["run"].modal_velocities).max() < 1e-8
    assert names["stuck"].frequencies_hz[0] == pytest.approx(np.sqrt(6.1e6 / 2.0) / (2 * np.pi))
    assert all((folder / name).stat().st_size > 5000 for name in ("shear.png", "loop.png"))
    # Sliding turns by a' = k Q' cos a / (mu F), k = c / (c + K): sin a = tanh(k Q / (mu F)).
    sine = np.tanh(6.0 / 6.1 * 10.0 / 20.0)
    assert names["turned"].friction_forces[-1, 0] == pytest.approx(
        20.0 * np.array([np.sqrt(1.0 - sine**2), sine]), rel=1.5e-3)
    assert (folder / "shear-map.png").exists()


def check_rotation(names, printed, folder):
    lines = printed.splitlines()
    assert [line.endswith(" []") for line in lines[:2]] == [True, False]
    first = [float(found[1]) for line in lines[2:] if (found := re.search(r"\[ *([\d.]+)", line))]
    assert [line[-5:].strip() for line in lines if line.endswith(("True", "False"))] == [
        "False", "False", "True"]
    assert 0.1 < (names["flutter"].unstable > 0).mean() < 0.5
    # Clamped beam of 29.86 rad/s: 3.516, and sqrt(11.2023^2 - 10^2) at ten times that.
    unit = np.sqrt(2.1e11 * 0.02**2 / (12.0 * 7850.0)) / (2.0 * np.pi)
    assert first[0] == pytest.approx(3.516 * unit, rel=2e-3)
    assert first[1] == pytest.approx(5.049 * unit, rel=2e-2)
    # The stress in the modes changes little where there are enough of them.
    assert first[4] == pytest.approx(first[3], rel=1e-5)
    assert names["diagram"].frequencies_hz.shape == (61, 6)
    assert (folder / "campbell.png").stat().st_size > 10000


def check_stressed_bodies(names, printed, folder):
    first = [float(re.search(r"\[ *([\d.]+)", line).group(1)) for line in printed.splitlines()
             if "[" in line]
    assert names["limit"] == pytest.approx(109.66, rel=1e-2)
    # The square falls by the part of Euler's load, 10 MPa of 17.27.
    assert (first[2] / first[0]) ** 2 == pytest.approx(1.0 - 10.0 / 17.27, abs=0.03)
    assert first[1] > first[0]
    assert first[4] == pytest.approx(17.27, rel=1e-3)
    assert (folder / "buckling.png").stat().st_size > 10000


def check_cyclic_symmetry(names, printed, folder):
    lines = printed.splitlines()
    # A ring of 24 masses with Jenkins elements, above 6.711291 of one harmonic at 0.175 Hz.
    ring = next(line for line in lines if line.startswith("6.7"))
    assert float(ring) == pytest.approx(6.712, abs=2e-2)
    wheel = names["found"].wheel_frequencies_hz
    assert (wheel[:3] == 0.0).all()
    assert wheel[3] == pytest.approx(wheel[4], rel=1e-9)
    for name in ("diameters", "wheel"):
        assert (folder / f"{name}.png").stat().st_size > 10000


def check_bodies(names, printed, folder):
    lines = printed.splitlines()
    pressed, bolted = [float(line) for line in lines if re.fullmatch(r"[\d.]+", line)]
    assert pressed == pytest.approx(2000.0, rel=1e-6)
    ends = {line.split()[0]: float(line.split()[1]) for line in lines if line[1:3] == ".p"}
    assert ends == pytest.approx({"a.p": 1.0 / 3.0, "b.p": -2.0 / 3.0}, rel=1e-6)
    # The joint gives way a little, and takes as much from the bolt's tension.
    assert 4500.0 < bolted < 5000.0
    # A bar of 0.1 x 0.04 m in steel: the first mode bends it.
    assert names["joined"].rigid_modes == 3
    assert names["joined"].frequencies_hz[3] == pytest.approx(15067.0, rel=5e-3)
    assert names["free"].energies.imbalance < 1e-6


def check_report(names, printed, folder):
    whole, part = (Shown(folder / name) for name in ("study.html", "part.html"))
    assert whole.header["title"] == "Block on a belt"
    assert whole.array("time")[[0, -1]] == pytest.approx([0.0, 1.0])
    assert part.array("time")[[0, -1]] == pytest.approx([0.5, 0.8])


def check_start(names, printed, folder):
    assert printed.strip() == "The run reached its end."
    assert names["run"].energies.imbalance < 1e-4
    assert (folder / "history.png").stat().st_size > 5000


def check_results(names, printed, folder):
    run, frame, data = names["run"], names["frame"], names["data"]
    assert (run.time[0], names["late"].time[0]) == (0.0, 2.0)
    assert names["case"].versions["numpy"] == np.__version__
    slips = run.contact_state[:, 4] == fc.ContactState.SLIP
    assert 0 < len(names["sliding"]) == slips.sum() < len(frame)
    # Power of friction on the block is its force times the slip, at each node.
    power = (data.friction_force * data.slip_velocity).sum("node")
    assert float(power.integrate("time")) == pytest.approx(run.energies.friction[-1], rel=0.01)
    assert printed.splitlines()[0] == "(1001, 5) N"
    assert printed.splitlines()[1].endswith("'xy', 'yz', 'xz'] Pa")
    best = names["table"].to_xarray().amplitude_x
    assert best.shape == (2, 2)
    assert (best > 0.0).all()


def check_solids(names, printed, folder):
    assert names["body"].total_mass == pytest.approx(7850.0 * np.pi * 0.0075 * 0.004, rel=1e-4)
    # Leissa's annular plate, clamped inside and free outside, b / a = 0.5: 13.02, 13.29 twice.
    unit = np.sqrt(2.1e11 * 0.004**2 / (12.0 * 0.91 * 7850.0)) / (2.0 * np.pi * 0.1**2)
    assert names["basis"].frequencies_hz[:3] / unit == pytest.approx([13.02, 13.29, 13.29],
                                                                     rel=0.02)


def check_faces_in_space(names, printed, folder):
    """The areas add up to the face; a crown's lowest place lies within a patch of its centre."""
    assert names["basis"].tributary.sum() == pytest.approx(0.1 * 0.06)
    assert 0.0 <= names["lowest"] < 0.02**2 / 4.0
    assert names["pairing"].tributary.sum() == pytest.approx(0.1 * 0.06)
    assert "uniform pressure" in printed


def check_frequency_responses(names, printed, folder):
    assert (folder / "response.png").stat().st_size > 10000
    peaks = [[float(word) for word in line.split()[:3]] for line in printed.splitlines()]
    assert len(peaks) == 8
    held = [peaks.pop(2) for _ in range(2)]
    assert [force for force, *_ in peaks[:2]] == [1.0, 1.2]
    # Above the frequency at which the element slides all the time, below that of a stuck one.
    sliding, sticking = 1.0 / (2.0 * np.pi), np.sqrt(1.5) / (2.0 * np.pi)
    assert all(sliding < hz < sticking for _, hz, _ in peaks[:2])
    assert [amplitude for amplitude, *_ in held] == [2.0, 6.0]
    # An amplitude of 2 is that up to which it sticks; the point of the smallest force lies nearby.
    assert all(sliding < hz < 1.001 * sticking for _, hz, _ in held)
    # A force of 1 N moves it by 6.23 m at most.
    assert held[0][2] < held[1][2] < 1.0
    stuck, slides, ratio = peaks[2]
    assert stuck == pytest.approx(sticking, rel=1e-5)
    assert slides == pytest.approx(sliding, rel=0.01)
    assert ratio == pytest.approx(0.0738, abs=1e-3)
    assert len(fc.io.read_mode(folder / "mode.h5")) == len(names["mode"])
    for synthesised, hz, largest in peaks[3:5]:
        assert synthesised == pytest.approx(largest, rel=3e-3)
        assert sliding < hz < sticking
    assert peaks[5] == pytest.approx([0.5 * np.pi, 2.0 * np.pi], rel=1e-3)
    for name in ("mode", "resonances"):
        assert (folder / f"{name}.png").stat().st_size > 10000
    found = fc.io.read_response(folder / "response.h5")
    assert found.amplitude(1) == pytest.approx(names["response"].amplitude(1), rel=1e-12)


def check_measurements(names, printed, folder):
    decay, computed = names["decay"], names["computed"]
    frequency, ratio = decay.at(1e-3)
    assert computed.at(1e-3)[0] == pytest.approx(frequency, rel=5e-3)
    assert computed.at(1e-3)[1] == pytest.approx(ratio, rel=2e-2)
    assert printed.splitlines()[0] == "('tip',) m ()"
    assert [line.split()[:2] for line in printed.splitlines()[2:5]] == [
        ["1", "2"], ["2", "1"], ["3", "3"]]
    assert "in a unit that is 1000 times" in printed
    assert names["pairs"].errors == pytest.approx(np.full(3, 1.0 / 1.02 - 1.0))
    virtual = names["virtual"]
    assert fc.io.read_measurement(folder / "virtual.uff").values == pytest.approx(virtual.values)
    for name in ("curve", "assurance"):
        assert (folder / f"{name}.png").stat().st_size > 10000


def check_fitting(names, printed, folder):
    found = names["found"]
    for name, truth in (("friction.stiffness", 8e5), ("friction.friction_coefficient", 0.4)):
        low, high = found.intervals(0.999)[name]
        assert low < truth < high < 1.1 * low
    assert names["profile"].interval == pytest.approx(
        found.intervals()["friction.friction_coefficient"], rel=2e-3)
    for name in ("fit", "profile"):
        assert (folder / f"{name}.png").stat().st_size > 10000


def check_large_deflections(names, printed, folder):
    # Mattiasson's table, a path through two limit points, and the beam of one mode at a = h.
    assert names["path"].displacement("right")[-1] == pytest.approx([-0.38763, 0.71379], rel=4e-3)
    turns = np.diff(np.sign(np.diff(names["snap"].load_factors)))
    assert np.count_nonzero(turns) == 2
    assert names["snap"].reached
    assert names["basis"].large_deflections[0].force_error < 5e-3
    assert names["at"] / names["basis"].frequencies_hz[0] == pytest.approx([1.016, 1.237], abs=0.01)


def check_half_spaces(names, printed, folder):
    # Hertz: a = 1 mm, and the loss of Mindlin and Deresiewicz without friction across the load.
    assert names["contact"].approach == pytest.approx(1e-6 / 0.05, rel=1e-3)
    shear = 2.1e11 / 2.6
    full, part = 0.3 * 6153.8, 1500.0 / (0.3 * 6153.8)
    loop = 9.0 * 1.7 * full**2 / (10.0 * 1e-3 * shear) * (
        1.0 - (1.0 - part) ** (5.0 / 3.0)
        - 5.0 * part / 6.0 * (1.0 + (1.0 - part) ** (2.0 / 3.0)))
    printed = printed.splitlines()
    assert float(printed[-2].split()[0]) == pytest.approx(loop, rel=0.01)
    assert printed[-1] == "8 56"


def check_quasi_periodic(names, printed, folder):
    # Averaging about the forced vibration b = force / (w^2 - 1): a^2 = 4 - 2 b^2.
    b, motion = 0.3 / 0.69, names["motion"]
    sizes = {abs(motion.harmonic(*k)[0]) for k in ((0, 1), (1, 1), (-1, 1))}
    assert abs(motion.harmonic(1, 0)[0]) == pytest.approx(b, rel=0.05)
    assert max(sizes) == pytest.approx(np.sqrt(4.0 - 2.0 * b**2), abs=0.03)
    assert names["over_frequency"].points[-1].parameter == pytest.approx(3.8)


def check_bolted_joint(names, printed, folder):
    joint, mode, response = (names[name] for name in ("joint", "mode", "response"))
    # What the lap carries is the tension of both bolts.
    q = names["rest"].modal_coordinates
    tensions = [2725.0 + 1e8 * float(q @ (joint.basis.point_row(f"upper.head{k}", "z")
                                          - joint.basis.point_row(f"lower.nut{k}", "z")))
                for k in (1, 2)]
    assert tensions == pytest.approx([2000.0, 2000.0], rel=0.01)
    assert names["rest"].normal_force.sum() == pytest.approx(sum(tensions), rel=1e-6)
    assert mode.frequency_hz[0] == pytest.approx(names["stuck"].frequencies_hz[0], rel=1e-6)
    # At a resonance the work of the shaker is the loss.
    for level, force in enumerate(response.levels):
        amplitude = response.amplitude(level).max()
        assert np.pi * force * amplitude == pytest.approx(
            mode.at(joint, amplitude=amplitude).loss[0], rel=2e-3)
        assert names["estimate"].peak(level).amplitude == pytest.approx(amplitude, rel=1e-3)
    with pytest.raises(AnalysisError, match="of the 16 contact nodes 8 are at their friction lim"):
        nonlinear_mode(joint, (1e-4, 1e-3), observe=("upper.free", "z"), preload=names["tight"],
                       method=names["method"])
    assert all((folder / name).stat().st_size > 10000 for name in ("shear.png", "response.png"))


CHECKS = {"README.md": check_readme, "start.md": check_start, "analysis.md": check_analysis,
          "bolted-joint.md": check_bolted_joint,
          "laws.md": check_laws, "frequency-responses.md": check_frequency_responses,
          "bifurcation.md": check_bifurcation, "orbits.md": check_orbits, "runs.md": check_runs,
          "sweeps.md": check_sweeps, "integrator.md": check_integrator,
          "set-valued.md": check_set_valued, "loads.md": check_loads,
          "preload.md": check_preload, "rotation.md": check_rotation,
          "stressed-bodies.md": check_stressed_bodies,
          "large-deflections.md": check_large_deflections,
          "cyclic-symmetry.md": check_cyclic_symmetry, "bodies.md": check_bodies,
          "solids.md": check_solids,
          "report.md": check_report, "contact-faces-in-space.md": check_faces_in_space,
          "results.md": check_results, "measurements.md": check_measurements,
          "fitting.md": check_fitting, "half-spaces.md": check_half_spaces,
          "quasi-periodic.md": check_quasi_periodic}


def test_every_page_with_code_is_known():
    """Code of the tutorials is run by test_site.py."""
    assert {page for page in PAGES if blocks(page, "python")
            and not page.startswith("tutorials/")} == set(CHECKS)


@pytest.mark.parametrize("page", CHECKS)
def test_code_of_the_page_runs(page, tmp_path, monkeypatch, capsys):
    names = SETUP.get(page, lambda folder: {})(tmp_path)
    capsys.readouterr()
    monkeypatch.chdir(tmp_path)
    shorter = SHORTER.get(page, {})
    for old in shorter:
        assert "\n".join(blocks(page, "python")).count(old) == 1
    for number, code in enumerate(blocks(page, "python")):
        BETWEEN.get((page, number), lambda names: None)(names)
        for old, new in shorter.items():
            code = code.replace(old, new)
        if rendering_problem() is not None:
            code = re.sub(r"^render\(.*\)$", "", code, flags=re.MULTILINE)
        exec(compile(code, page, "exec"), names)
    CHECKS[page](names, capsys.readouterr().out, tmp_path)


def test_study_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(blocks("README.md", "toml")[0])
    assert execute(["modes", "study.toml"]) == 0
    assert execute(["run", "study.toml", "--set", "simulation.t_end=0.1"]) == 0
    assert (tmp_path / "results" / "study.vtkhdf").exists()
    assert "study.vtkhdf" in capsys.readouterr().out


TABLES = [(page, text) for page in PAGES for text in blocks(page, "toml")]


@pytest.mark.parametrize(("page", "text"), TABLES,
                         ids=[f"{page}-{number}" for number, (page, _) in enumerate(TABLES)])
def test_tables_of_the_pages_are_understood(page, text):
    shape = '[geometry]\nshape = "beam"\n'
    whole = "geometry]" in text or "[bodies." in text
    study = Study.from_toml(text if whole else text + shape, "study.toml")
    given = tomllib.loads(text)
    written = study.tables()
    for section, keys in given.items():
        for key, value in keys.items():
            if not isinstance(value, dict | list):
                assert written[section][key] == value
    for name, sections in given.get("bodies", {}).items():
        assert study.bodies[name].geometry is not None
        for section, keys in sections.items():
            for key, value in keys.items():
                if not isinstance(value, dict | list):
                    assert written["bodies"][name][section][key] == value


COMMAND_LINES = [(page, line) for page, text in TEXTS.items()
                 for line in re.findall(r"^    (fecontact .*)$", text, re.MULTILINE)]


@pytest.mark.parametrize(("page", "line"), COMMAND_LINES,
                         ids=[f"{page}-{line.split()[1]}" for page, line in COMMAND_LINES])
def test_command_lines_of_the_pages_are_understood(page, line):
    command, bound, _ = app.parse_args(shlex.split(line, comments=True)[1:], exit_on_error=False,
                                       print_error=False)
    assert command in COMMANDS
    assert bound.arguments


def test_commands_within_sentences_exist():
    names = {command.__name__.rstrip("_") for command in COMMANDS}
    for text in TEXTS.values():
        for name in re.findall(r"`fecontact (\w+)", text):
            assert name in names, name


def test_scripts_and_targets_of_the_pages_exist():
    makefile = (ROOT / "Makefile").read_text()
    for page, text in TEXTS.items():
        for name in re.findall(r"\b((?:examples|benchmarks)/\w+\.(?:py|toml))", text):
            assert (ROOT / name).exists(), (page, name)
        for target in re.findall(r"^    make (\w+)|`make (\w+)`", text, re.MULTILINE):
            assert re.search(rf"^{''.join(target)}:", makefile, re.MULTILINE), (page, target)


def test_links_of_the_pages_lead_somewhere():
    for page, text in TEXTS.items():
        for target in re.findall(r"\]\(([^)#:]+)\)", text):
            path = PAGES[page].parent / target
            # The gallery is made with the site: only the front page of the site links to it.
            assert path.exists() or (page, target) == ("index.md", "gallery/index.rst"), (
                page, target)


def test_what_is_not_run_has_a_reason():
    reasons = [found["reason"] for text in TEXTS.values() for found in BLOCK.finditer(text)
               if found["reason"]]
    assert sorted(reasons) == ["needs files of Nastran", "needs mpi4py and mpiexec"]
