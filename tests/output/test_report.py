"""The page of a run: what it shows agrees with the run, and no text of a study becomes markup."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from joined_bodies import stack_run
from report_reading import Shown, stored_array, unpacked
from synthetic import basis, run
from tiny_study import TINY

from fecontact import InputError, ModelWarning, Study, read_case
from fecontact.cli import execute
from fecontact.cli.templates import template
from fecontact.io import report
from fecontact.laws import HeightMap
from fecontact.output.files.frames import contact_forces
from fecontact.output.report import page
from fecontact.output.report.contact import _height_map
from fecontact.output.report.payload import Payload

EVIL = "</script><img src=x onerror=\"document.title='broken'\"><script>alert(1)</script>"


def close(shown, true, tolerance=1e-4):
    """Whether all errors are below a part of the largest value."""
    assert shown.shape == true.shape
    largest = np.abs(true).max()
    assert largest > 0.0
    assert np.abs(shown - true).max() <= tolerance * largest


def close_forces(shown, trajectory):
    """Whether the forces are right to 1e-4 of the largest, as vectors."""
    true = contact_forces(trajectory)
    assert shown.forces.shape == true.shape
    largest = np.linalg.norm(true, axis=2).max()
    assert largest > 0.0
    assert np.linalg.norm(shown.forces - true, axis=2).max() <= 1e-4 * largest


def true_fields(trajectory):
    """Displacements and von Mises stress by the definition of the latter, mode by mode."""
    field, q = trajectory.system.basis.mode_shapes, trajectory.modal_coordinates
    motion = sum(field.shapes[None, :, :, k] * q[:, None, None, k] for k in range(q.shape[1]))
    s = sum(field.stress[None, :, :, k] * q[:, None, None, k] for k in range(q.shape[1]))
    tensor = np.zeros((*s.shape[:2], 3, 3))
    tensor[..., 0, 0], tensor[..., 1, 1], tensor[..., 2, 2] = s[..., 0], s[..., 1], s[..., 2]
    tensor[..., 0, 1] = tensor[..., 1, 0] = s[..., 3]
    deviator = tensor - np.trace(tensor, axis1=2, axis2=3)[..., None, None] / 3.0 * np.eye(3)
    return motion, np.sqrt(1.5 * (deviator**2).sum(axis=(2, 3)))


@pytest.mark.parametrize("make", [run, lambda: run(waviness=2e-4), stack_run,
                                  lambda: stack_run(angle=0.7)],
                         ids=["flat", "wavy", "two bodies", "inclined"])
def test_displacements_stresses_and_forces_are_those_of_the_run(make, tmp_path):
    trajectory = make()
    shown = Shown(report(trajectory, tmp_path / "run.html"))
    motion, stress = true_fields(trajectory)
    close(shown.displacement, motion)
    close(shown.stress, stress)
    close_forces(shown, trajectory)
    np.testing.assert_array_equal(shown.array("contact", "state"),
                                  np.minimum(trajectory.contact_state, 2))
    np.testing.assert_allclose(shown.array("time"), trajectory.time, rtol=0, atol=1e-11)
    np.testing.assert_allclose(shown.array("bodies", "points"),
                               trajectory.system.basis.mode_shapes.nodes, atol=1e-7)


def test_modes_that_cancel_are_as_exact(tmp_path):
    """Large coordinates whose sum is small: a step of each coordinate's range would not do."""
    trajectory = run()
    field = trajectory.system.basis.mode_shapes
    rng = np.random.default_rng(7)
    twin = np.concatenate([field.shapes, field.shapes + 1e-4 * rng.normal(size=field.shapes.shape)],
                          axis=2)
    stress = np.concatenate([field.stress, field.stress], axis=2)
    body = trajectory.system.basis
    T = np.concatenate([body.T, body.T], axis=2)
    doubled = replace(
        body, angular_frequencies=np.tile(body.angular_frequencies, 2),
        damping=np.zeros((10, 10)), T=T,
        mode_shapes=replace(field, shapes=twin, stress=stress))
    q = trajectory.modal_coordinates
    large = 1e3 * np.abs(q).max() * rng.normal(size=q.shape)
    cancelling = replace(
        trajectory, system=replace(trajectory.system, basis=doubled),
        modal_coordinates=np.hstack([q + large, -large]),
        modal_velocities=np.hstack([trajectory.modal_velocities] * 2))
    motion, true_stress = true_fields(cancelling)
    # The parts of the sum are a thousand times larger than what is left of it.
    parts = np.abs(twin).max(axis=(0, 1)) * np.abs(cancelling.modal_coordinates).max(axis=0)
    assert parts.max() > 300.0 * np.abs(motion).max()
    shown = Shown(report(cancelling, tmp_path / "run.html"))
    close(shown.displacement, motion)
    close(shown.stress, true_stress)


def test_contact_nodes_and_ground_stand_where_they_are(tmp_path):
    trajectory = run(waviness=2e-4)
    shown, system = Shown(report(trajectory, tmp_path / "run.html")), trajectory.system
    moved = np.einsum("ncm,tm->tnc", shown.array("contact", "rows"), shown.array("coordinates"))
    for node in range(5):
        close(moved[:, node], trajectory.displacement(node)[:, :2], 2e-4)
    ground, header = system.ground, shown.header["ground"]
    profile, travel = shown.array("ground", "profile"), shown.array("ground", "travel")
    x = np.linspace(0.0, 0.2, 333)
    for frame in (0, 50, 100):
        time = trajectory.time[frame]
        places = x - travel[frame]
        drawn = np.interp(places, header["first"] + header["spacing"] * np.arange(len(profile)),
                          profile)
        # Straight lines between 24 points of a wave miss its crest by 0.9 %.
        np.testing.assert_allclose(drawn, ground.height(x, time), atol=0.01 * 2e-4)
    assert header["wavy"]
    drift = trajectory.modal_coordinates @ np.array(header["drift"])
    mean = np.mean([trajectory.displacement(node)[:, 0] for node in range(5)], axis=0)
    np.testing.assert_allclose(drift, mean, rtol=1e-12, atol=1e-18)


def test_a_large_map_of_heights_is_stored_where_bodies_come():
    """With .6 of the bodies' width beside them, wherever the ground has travelled."""
    heights = HeightMap(np.random.default_rng(0).standard_normal((400, 300)), 0.01, 0.01)
    box, way = np.array([[0.0, 0.0, 0.0], [0.2, 0.1, 0.1]]), np.array([[0.0, 0.0], [0.5, -0.3]])
    found = _height_map(heights, box, way)
    first, steps = np.array(found["origin"]), np.array(found["steps"])
    assert first == pytest.approx([-0.12 - 0.5, -0.12])
    assert first + steps * found["heights"].shape == pytest.approx([0.32, 0.22 + 0.3])
    assert found["heights"][3, 5] == pytest.approx(
        float(heights.shape(*(first + steps * [3, 5]))[0]))


def test_curves_are_those_of_the_run(tmp_path):
    trajectory = run()
    shown = Shown(report(trajectory, tmp_path / "run.html", points=["C", 2]))
    charts = {chart["title"]: (number, chart) for number, chart in enumerate(
        shown.header["charts"])}
    number, chart = charts["velocity y"]
    assert [line["name"] for line in chart["lines"]] == ["C", "contact node 2"]
    values = [chart["factor"] * shown.array("charts", number, "lines", line, "y")
              for line in (0, 1)]
    for column, point in enumerate(("C", 2)):
        close(values[column], trajectory.velocity(point)[:, 1], 2e-4)
    number, chart = charts["total friction on the body, +x"]
    close(chart["factor"] * shown.array("charts", number, "lines", 0, "y"),
          -trajectory.friction_force.sum(axis=1))
    energies = {chart["title"]: (number, chart) for number, chart in enumerate(
        shown.header["energies"])}
    number, chart = energies["stored energy"]
    assert chart["lines"][-1]["name"] == "total"
    close(chart["factor"] * shown.array("energies", number, "lines", -1, "y"),
          trajectory.energies.stored)
    # Frequencies are shown in Hz.
    modes = shown.header["bodies"]["modes"]
    assert [mode[1] for mode in modes] == ["0", "0", "0", "2000", "9000"]
    assert [mode[3] for mode in modes[:4]] == ["rigid", "rigid", "rigid", "vibration"]


def test_each_face_of_several_bodies_has_its_map_and_its_curve(tmp_path):
    shown = Shown(report(stack_run(), tmp_path / "run.html"))
    assert [face["title"] for face in shown.header["contact"]["faces"]] == [
        "shoe: block and beam", "foot: beam and ground"]
    assert [part["name"] for part in shown.header["bodies"]["parts"]] == ["block", "beam"]
    forces = next(chart for chart in shown.header["charts"]
                  if chart["title"] == "total normal force")
    assert [line["name"] for line in forces["lines"]] == ["shoe", "foot"]
    # Feet on the other body follow the contact nodes; those on the ground have none.
    assert shown.header["contact"]["feet"] == list(range(8))
    assert shown.array("contact", "places").shape == (29 + 8, 2)


@pytest.mark.parametrize(("values", "step"), [
    (np.array([[0.0], [-3.0], [200.0], [-70000.0]]), 1.0),
    (np.random.default_rng(1).normal(size=(40, 3, 2)), 1e-6),
    (np.random.default_rng(2).normal(size=(7, 5)), [1e-1, 1e-3, 1e-5, 1e-7, 1e-9]),
    (np.zeros((0, 4)), 1.0), (np.zeros((3, 0)), 1.0), (np.arange(5.0), 0.5),
    (np.sin(np.linspace(0.0, 9.0, 400))[:, None] * [1.0, -2.0], 1e-6),
])
@pytest.mark.parametrize("later", [False, True])
def test_arrays_come_back_to_within_half_a_step(values, step, later):
    block = Payload()
    block.add(np.arange(3), 1.0, later)
    described = block.add(values, step, later)
    header, content = unpacked(block.block({"found": described}))
    found = stored_array(header["found"], content)
    assert found.shape == values.shape
    error = np.abs(found - values).reshape(len(values), int(np.prod(values.shape[1:])))
    assert (error <= 0.5000001 * np.broadcast_to(step, error.shape)).all()


def test_a_page_asks_nothing_of_a_network_and_is_the_same_each_time(tmp_path):
    first = report(run(), tmp_path / "a.html", title="a").read_bytes()
    text = first.decode()
    assert not re.search(r"https?:|//\w+\.|@import|url\(|<link|<iframe|fetch\(|XMLHttp|import\(",
                         text)
    assert "default-src 'none'" in text
    assert first == report(run(), tmp_path / "b.html", title="a").read_bytes()


def test_texts_of_a_study_stay_texts(tmp_path):
    trajectory = stack_run()
    parts = tuple(replace(part, name=EVIL + part.name) for part in trajectory.system.basis.parts)
    body = replace(trajectory.system.basis, parts=parts)
    evil = replace(trajectory, system=replace(trajectory.system, basis=body),
                   statistics={"message": EVIL})
    study = f'["{EVIL.replace(chr(34), chr(92) + chr(34))}"]\nname = \'\'\'{EVIL}\'\'\'\n'
    path = report(evil, tmp_path / "run.html", title=EVIL, study=study, versions={EVIL: EVIL})
    shown = Shown(path)
    assert shown.text.count("<script") == shown.text.count("</script") == 2
    assert "<img" not in shown.text
    assert "onerror" not in re.sub(r"<title>.*?</title>", "", shown.text)
    # It is shown all the same.
    assert shown.header["title"] == EVIL
    assert shown.header["bodies"]["parts"][0]["name"] == f"{EVIL}block"
    assert shown.header["study"][0] == {"name": EVIL, "rows": [["name", EVIL]]}


def test_warnings_and_status_are_told(tmp_path):
    trajectory = run(size=20.0)
    assert trajectory.limits_exceeded
    shown = Shown(report(trajectory, tmp_path / "run.html"))
    assert list(trajectory.limits_exceeded) == shown.header["notes"][-len(
        trajectory.limits_exceeded):]
    assert shown.header["good"]
    q = trajectory.modal_coordinates.copy()
    q[60:] = np.nan
    status = type(trajectory.status).NOT_FINITE
    shown = Shown(report(replace(run(), modal_coordinates=q, status=status),
                         tmp_path / "run.html"))
    assert not shown.header["good"]
    assert shown.header["status"] == status.value
    assert any("first 60 of 101 output times" in note for note in shown.header["notes"])
    assert len(shown.array("time")) == 60


def test_a_run_without_shapes_has_charts_and_contact(tmp_path):
    trajectory = run(replace(basis(), mode_shapes=None))
    shown = Shown(report(trajectory, tmp_path / "run.html"))
    assert "bodies" not in shown.header
    assert any("no shapes over the body" in note for note in shown.header["notes"])
    close_forces(shown, trajectory)
    assert shown.header["charts"]


def test_a_body_at_rest_can_be_reported(tmp_path):
    still = run()
    still = replace(still, modal_coordinates=np.zeros_like(still.modal_coordinates),
                    modal_velocities=np.zeros_like(still.modal_velocities))
    shown = Shown(report(still, tmp_path / "run.html"))
    assert not shown.displacement.any()
    assert shown.array("bodies", "shapes").any()


def test_a_large_page_is_warned_of(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "LARGE", 1e4)
    with pytest.warns(ModelWarning, match="fewer outputs of the run"):
        report(run(), tmp_path / "run.html")
    assert (tmp_path / "run.html").exists()


@pytest.mark.parametrize(("options", "message"), [
    ({"path": "run.pdf"}, r"must end in \.html"), ({"points": "B"}, "several points"),
    ({"points": ["Q"]}, "Q"), ({"scale": -1.0}, "scale"),
    ({"run": 3}, "run"),
])
def test_wrong_arguments_are_told(options, message, tmp_path):
    given = {"run": run(times=11), "path": "run.html"} | options
    given["path"] = tmp_path / given["path"]
    with pytest.raises(InputError, match=message):
        report(**given)
    assert not list(tmp_path.iterdir())


def test_the_command_takes_the_stored_run_or_computes_one(tmp_path, capsys):
    study = tmp_path / "tiny.toml"
    study.write_text(TINY)
    assert execute(["report", str(study)]) == 0
    target = tmp_path / "results" / "tiny.html"
    assert [path.name for path in target.parent.iterdir()] == ["tiny.html"]
    fresh = Shown(target)
    assert execute(["run", str(study)]) == 0
    stored = read_case(tmp_path / "results" / "tiny.vtkhdf").trajectory
    assert execute(["report", str(study)]) == 0
    close(Shown(target).displacement, true_fields(stored)[0])
    close(fresh.displacement, true_fields(stored)[0])
    other = tmp_path / "other.html"
    assert execute(["report", str(study), "--set", "load.normal=20", "-o", str(other)]) == 0
    totals = [Shown(path).array("contact", "forces")[:, :, 1].sum(axis=1).max()
              for path in (target, other)]
    assert totals[1] > 1.2 * totals[0]
    assert ["normal", "20"] in next(section["rows"] for section in Shown(other).header["study"]
                                    if section["name"] == "load")
    capsys.readouterr()
    assert execute(["report", str(tmp_path / "results" / "tiny.vtkhdf"), "--set", "a=1"]) != 0
    assert "name the study instead" in capsys.readouterr().err


def test_the_beam_of_the_demonstration_is_small(tmp_path):
    study = Study.from_toml(template("beam"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        trajectory = study.run()
    path = report(trajectory, tmp_path / "beam.html", study=study.to_toml(), points=["B", 20])
    assert path.stat().st_size < 0.6e6
    shown = Shown(path)
    motion, stress = true_fields(trajectory.between(0.1, 0.12))
    chosen = (trajectory.time >= 0.1 - 1e-9) & (trajectory.time <= 0.12 + 1e-9)
    assert np.abs(shown.displacement[chosen] - motion).max() < 1e-4 * 3.44e-3
    assert np.abs(shown.stress[chosen] - stress).max() < 1e-4 * stress.max()
    close_forces(shown, trajectory)
