"""Linear systems without contact nodes: closed forms of runs, responses, modes and rest."""

import numpy as np
import pytest
from systems import TURN

from fecontact import (
    ContactSystem,
    Drive,
    InputError,
    Load,
    PointLoad,
    basis_from_matrices,
    ensemble,
    equilibrium,
    read_case,
    sensitivity,
    simulate,
    write_case,
)
from fecontact.analysis import complex_modes
from fecontact.analysis.run_facts import run_facts
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    contact_field,
    equilibrium_branch,
    frequency_response,
)
from fecontact.cli import execute
from fecontact.integrate import SetValued
from fecontact.laws import ConstantFriction, Harmonic, LinearContact
from fecontact.output.files.dataset import variables
from fecontact.plot import rendering_problem
from fecontact.reduction.assembly.contact_faces import contact_faces

MASS, DAMPING = 2.0, 0.1
STIFFNESS = np.array([8.0, 18.0])


def system(damping=DAMPING, dimension=2, **parts):
    """Two masses on springs of their own, in x and y (z in space); B and C are both of them."""
    rows = np.zeros((3 * (dimension - 1), 2))
    rows[0, 0] = rows[dimension - 1, 1] = 1.0
    basis = basis_from_matrices(MASS * np.eye(2), np.diag(STIFFNESS), {"B": rows, "C": rows},
                                damping=damping * np.eye(2), dimension=dimension)
    return ContactSystem(basis, **parts)


def decayed(time, start):
    """Free motion from a displacement at rest: exp(-d t) (cos w_d t + d / w_d sin w_d t)."""
    d = DAMPING / (2.0 * MASS)
    w = np.sqrt(STIFFNESS / MASS - d * d)
    return start * np.exp(-d * time) * (np.cos(w * time) + d / w * np.sin(w * time))


@pytest.mark.parametrize(("dimension", "how"), [
    (2, {}), (3, {}), (2, {"solver": SetValued()})])
def test_free_decay(dimension, how):
    given = system(dimension=dimension)
    start = np.array([1.0, -0.5])
    run = simulate(given, 5.0, initial=np.array([*start, 0.0, 0.0]), rtol=1e-8, **how)
    exact = np.array([decayed(t, start) for t in run.time])
    assert run.states[:, :2] == pytest.approx(exact, abs=1e-6)
    assert run.penetration.shape == (len(run.time), 0)
    # The energy lost is what the dampers took.
    energy = 0.5 * (run.states[:, 2:] ** 2).sum(axis=1) + 0.5 * (
        run.states[:, :2] ** 2 @ (STIFFNESS / MASS))
    assert energy[-1] < energy[0]
    assert run.energies.stored == pytest.approx(energy, rel=1e-9)


def test_steady_forced_motion_of_a_run():
    w = 1.3
    given = system(damping=1.0, load=Load(forces=(
        PointLoad("C", "x", signal=Harmonic(amplitude=3.0, frequency_hz=w / TURN)),)))
    run = simulate(given, 60.0, rtol=1e-8)
    x = run.states[:, 0] / np.sqrt(MASS)
    last = run.time > 60.0 - 2.0 * np.pi / w
    exact = 3.0 / abs(STIFFNESS[0] - MASS * w * w + 1j * w)
    assert np.abs(x[last]).max() == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("dimension", [2, 3])
def test_response_is_the_resonance_of_one_mode(dimension):
    given = system(dimension=dimension, drive=Drive(stiffness_x=1.0, amplitude_x=0.1,
                                                    frequency_hz=1.0 / TURN))
    response = frequency_response(given, (0.5 / TURN, 5.0 / TURN))
    w = TURN * response.branches[0].parameter
    exact = 0.1 / np.abs(STIFFNESS[0] + 1.0 - MASS * w**2 + 1j * w * DAMPING)
    assert response.amplitude() == pytest.approx(exact, rel=1e-6)
    assert all(point.values["stable"] for point in response.branches[0].points)
    assert not response.branches[0].special


@pytest.mark.slow
@pytest.mark.parametrize("method", [Collocation(), Shooting(segments=1)])
def test_steps_grow_with_a_resonance_by_any_method(method):
    """From 0.012 to 4.7 at the peak: scales that stay would make it a way of some hundred steps."""
    given = system(damping=0.01, drive=Drive(stiffness_x=1.0, amplitude_x=0.1,
                                             frequency_hz=1.0 / TURN))
    far = ContinuationOptions(step=0.03, largest_step=0.3, points=400)
    balanced, found = (frequency_response(given, (0.5 / TURN, 5.0 / TURN), method=how, options=far)
                       for how in (HarmonicBalance(), method))
    w = TURN * found.branches[0].parameter
    assert w[-1] == 5.0
    exact = 0.1 / np.abs(STIFFNESS[0] + 1.0 - MASS * w**2 + 0.01j * w)
    assert found.amplitude() == pytest.approx(exact, rel=1e-5)
    assert found.amplitude().max() == pytest.approx(0.1 / 0.01 / np.sqrt(4.5), rel=0.01)
    assert len(w) < 2 * len(balanced.branches[0])


def test_modes_are_those_of_the_matrices():
    found = complex_modes(system())
    d = DAMPING / (2.0 * MASS)
    exact = np.sqrt(STIFFNESS / MASS - d * d)
    assert np.sort(np.abs(found.eigenvalues.imag)) == pytest.approx(np.sort(exact))
    assert found.eigenvalues.real == pytest.approx(np.full(2, -d))


def test_rest_and_branches_of_it_under_a_load():
    given = system(load=Load(normal=3.0))
    q = equilibrium(given).modal_coordinates
    assert q == pytest.approx(np.array([0.0, -3.0 / STIFFNESS[1] * np.sqrt(MASS)]), rel=1e-9)
    branch = equilibrium_branch(contact_field(given, ["load.normal"]), parameter="load.normal",
                                bounds=(0.0, 6.0))
    assert branch.points[-1].values["state"][1] == pytest.approx(
        -branch.points[-1].parameter / STIFFNESS[1] * np.sqrt(MASS), rel=1e-9)


def test_derivatives_and_many_runs_are_those_of_the_closed_form():
    found = sensitivity(system(), 2.0, initial=np.array([1.0, 0.0, 0.0, 0.0]))
    assert found.transitions[0][0, 0] == pytest.approx(decayed(2.0, 1.0)[0], abs=1e-6)
    runs = ensemble(system(), np.linspace(0.0, 2.0, 5),
                    initial=np.array([[1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0]]), rtol=1e-8)
    assert runs.states[:, -1, 0] == pytest.approx(
        decayed(2.0, 1.0)[0] * np.array([1.0, 2.0]), abs=1e-6)


def test_runs_are_stored_and_read(tmp_path):
    run = simulate(system(), 1.0, initial=np.array([1.0, 0.0, 0.0, 0.0]))
    stored = read_case(write_case(tmp_path / "linear.vtkhdf", run)).trajectory
    assert stored.system.basis.contact_nodes == 0
    assert stored.states.tolist() == run.states.tolist()


def test_laws_without_contact_nodes_are_refused():
    with pytest.raises(InputError, match=r"normal = .* but there are no contact nodes"):
        system(normal=LinearContact(1e5))
    with pytest.raises(InputError, match=r"friction = .* but there are no contact nodes"):
        system(friction=ConstantFriction(0.3))


LINEAR = """
[geometry]
shape = "block"
width = 0.12
height = 0.06
element_size = 0.03
[body]
material = "steel"
thickness = 0.1
fixed = { right = "xy" }
[basis]
modes = 2
contact = []
damping = 0.02
[drive]
stiffness_x = 1e6
amplitude_x = 1e-4
frequency_hz = 4775.0
[simulation]
t_end = 2e-3
outputs = 501
[response]
bounds = [2e4, 4e4]
"""


@pytest.mark.long
def test_commands_take_a_study_without_contact(tmp_path, capsys):
    file = tmp_path / "linear.toml"
    file.write_text(LINEAR)
    for command in ("modes", "run", "response"):
        assert execute([command, str(file)]) == 0
    assert "B x" in capsys.readouterr().out
    written = {one.name for one in (tmp_path / "results").iterdir()}
    assert {"linear.vtkhdf", "linear-history.png", "linear-response.csv"} <= written
    assert "linear-contact_map.png" not in written
    assert execute(["plot", str(file), "contact_map"]) == 1
    assert "no contact nodes" in capsys.readouterr().err
    file.write_text(LINEAR + "\n[friction]\nlaw = \"constant\"\nfriction_coefficient = 0.3\n")
    assert execute(["run", str(file)]) == 1
    assert "[friction] is a law of contact nodes" in " ".join(capsys.readouterr().err.split())


TWO_BODIES = """
[bodies.left.geometry]
shape = "block"
width = 0.12
height = 0.06
element_size = 0.03
[bodies.left.body]
material = "steel"
thickness = 0.1
fixed = { left = "xy" }
[bodies.left.basis]
modes = 2
B = "right"
damping = 0.02
[bodies.right.geometry]
shape = "block"
width = 0.12
height = 0.06
element_size = 0.03
[bodies.right.placement]
shift = [0.2, 0.0]
[bodies.right.body]
material = "steel"
thickness = 0.1
fixed = { right = "xy" }
[bodies.right.basis]
modes = 2
C = "left"
damping = 0.02
[links.spring]
kind = "spring"
first = "left.B"
second = "right.C"
direction = [1.0, 0.0]
stiffness = 1e6
[drive]
stiffness_x = 1e6
amplitude_x = 1e-4
frequency_hz = 4775.0
[simulation]
t_end = 2e-3
outputs = 101
[output]
frames = 2
[render]
frames = 2
size = [320, 240]
"""


@pytest.mark.long
def test_commands_take_a_study_of_two_bodies_without_contact(tmp_path, capsys):
    file = tmp_path / "linked.toml"
    file.write_text(TWO_BODIES)
    results = tmp_path / "results"
    assert execute(["run", str(file)]) == 0
    assert "left, right" in capsys.readouterr().out
    assert execute(["plot", str(file), "history"]) == 0
    assert execute(["report", str(results / "linked.vtkhdf")]) == 0
    if rendering_problem() is None:
        assert execute(["render", str(results / "linked.vtkhdf")]) == 0
    run = read_case(results / "linked.vtkhdf").trajectory
    assert contact_faces(run.system.basis)[0].nodes == slice(0, 0)
    assert ("bodies", "left, right") in run_facts(run)
    assert not [name for name, _ in run_facts(run) if name.startswith("contact")]
    assert "displacement" in variables(run)
