"""Studies of solids: the same systems as in Python, keys of space, and what does not fit them."""

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact.cli.templates import template
from fecontact.fem import Ring, SolidBlock
from fecontact.fem.pairing import pair_faces
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    HarmonicSpeed,
    HeightMap,
    LinearContact,
    RoughSurface,
    SlidingRotation,
    SlidingTranslation,
)
from fecontact.reduction import Spring, reduce_bodies, with_half_space

PAD = """
[geometry]
shape = "solid-block"
length = 0.06
width = 0.04
height = 0.02
element_size = 0.02
[basis]
modes = 8
contact_nodes = [4, 2]
[normal]
law = "linear"
stiffness = 1e7
[friction]
law = "constant"
friction_coefficient = 0.3
[simulation]
t_end = 1e-3
outputs = 5
"""

PAIR = """
[bodies.disc.geometry]
shape = "solid-block"
length = 0.1
width = 0.08
height = 0.02
element_size = 0.02
[bodies.disc.placement]
shift = [-0.02, -0.02, -0.02]
[bodies.disc.body]
fixed = { contact = "xyz" }
[bodies.disc.basis]
modes = 4
damping = 0.01
[bodies.pad.geometry]
shape = "solid-block"
length = 0.06
width = 0.04
height = 0.02
element_size = 0.02
[bodies.pad.basis]
modes = 7
damping = 0.02
B = "left"
C = "top"
points = { tip = [0.06, 0.04, 0.02] }
[interfaces.seam]
face = "pad.contact"
other = "disc.top"
nodes = [3, 2]
[interfaces.seam.normal]
law = "linear"
stiffness = 2e7
damping = 50.0
[interfaces.seam.friction]
law = "constant"
friction_coefficient = 0.4
smoothing_slope = 1e3
[interfaces.seam.sliding]
speed = 0.5
direction = [1.0, 2.0, 0.0]
[links.stay]
kind = "spring"
first = "pad.tip"
stiffness = 1e5
direction = [0.0, 1.0, 0.0]
[drive]
stiffness_x = 2e5
stiffness_y = 1e5
[load]
normal = 100.0
[[load.forces]]
point = "C"
component = "phi_z"
signal = { law = "constant", value = 0.5 }
[[load.boundaries]]
boundary = "pad.right"
pressure = 1e3
shear_across = 2e3
[simulation]
t_end = 1e-3
outputs = 21
"""


def same_runs(one, other):
    for name in ("modal_coordinates", "modal_velocities", "normal_force", "friction_forces",
                 "work"):
        assert (getattr(one, name) == getattr(other, name)).all(), name


@pytest.mark.long
def test_a_solid_on_a_belt_runs_as_in_python():
    study = fc.Study.from_toml(template("solid")).with_(**{"simulation.t_end": 0.004,
                                                           "simulation.outputs": 41})
    body = fc.ElasticBody(
        fc.generate(SolidBlock(0.1, 0.06, 0.02, drive_height=0.015, element_size=0.01)),
        fc.Material(5e9, 0.25, 2500.0))
    basis = fc.modal_basis(body, 12, contact_nodes=(5, 3), damping=0.02, B="left", C="top")
    system = fc.ContactSystem(
        basis, normal=RoughSurface(40e6, 10e-6, 200.0),
        friction=ExponentialFriction(0.6, 0.35, decay=10.0, smoothing_slope=1e4),
        ground=fc.Ground(speed=0.05, motion_y=HarmonicSpeed(0.05, 47.75)),
        drive=fc.Drive(stiffness_x=2e5, damping_x=5.0, stiffness_y=2e5, damping_y=5.0),
        load=fc.Load(normal=200.0, gravity=(0.0, 0.0, -9.81)))
    run = study.run()
    same_runs(run, fc.simulate(system, 0.004, outputs=41))
    # It is pressed by its weight too, and rubs along both directions.
    weight = 9.81 * body.total_mass
    assert run.normal_force.sum(axis=1).mean() == pytest.approx(200.0 + weight, rel=0.01)
    assert (np.abs(run.friction_forces).max(axis=(0, 1)) > 0.1).all()
    # 5 x 3 equal rectangles, numbered along x.
    assert basis.tributary == pytest.approx(np.full(15, 0.02 * 0.02), rel=1e-12)
    assert basis.contact_places == pytest.approx(np.array(
        [(0.02 * i + 0.01, 0.02 * j + 0.01, 0.0) for i in range(5) for j in range(3)]), abs=1e-12)


def test_two_solids_run_as_in_python():
    study = fc.Study.from_toml(PAIR)
    bodies = {
        "disc": fc.ElasticBody(fc.generate(SolidBlock(0.1, 0.08, 0.02, element_size=0.02)).placed(
            (-0.02, -0.02, -0.02)), fixed={"contact": "xyz"}),
        "pad": fc.ElasticBody(fc.generate(SolidBlock(0.06, 0.04, 0.02, element_size=0.02)))}
    pairing = pair_faces(bodies, "pad.contact", "disc.top", nodes=(3, 2), nodes_on="face")
    links = {"stay": Spring("pad.tip", None, stiffness=1e5, direction=(0.0, 1.0, 0.0))}
    bases = reduce_bodies(bodies, [pairing], links, modes={"disc": 4, "pad": 7}, each={
        "disc": {"damping": 0.01},
        "pad": {"damping": 0.02, "B": "left", "C": "top",
                "points": {"tip": (0.06, 0.04, 0.02)}}})
    system = fc.ContactSystem(
        bodies=bases, links=links, interfaces=[fc.Interface(
            "seam", pairing, LinearContact(stiffness=2e7, damping=50.0),
            ConstantFriction(0.4, smoothing_slope=1e3),
            sliding=SlidingTranslation(0.5, (1.0, 2.0, 0.0)))],
        drive=fc.Drive(stiffness_x=2e5, stiffness_y=1e5),
        load=fc.Load(normal=100.0, forces=[
            fc.PointLoad("C", "phi_z", signal=fc.laws.Constant(0.5))], boundaries=[
                fc.BoundaryLoad("pad.right", pressure=1e3, shear_across=2e3)]))
    assert study.system().parameters() == system.parameters()
    run = study.run()
    same_runs(run, fc.simulate(system, 1e-3, outputs=21))
    # The moving ground drags the pad along its direction.
    total = run.friction_forces[1:].sum(axis=1)
    along = np.array([1.0, 2.0]) / 5.0**0.5
    assert (-total @ along > 0.9 * np.linalg.norm(total, axis=1)).all()


def test_a_study_of_solids_is_restored_from_its_toml():
    for text in (PAD, PAIR, template("solid")):
        study = fc.Study.from_toml(text)
        assert fc.Study.from_toml(study.to_toml()) == study


def test_nodes_around_and_across_a_ring():
    body = fc.ElasticBody(fc.generate(Ring(0.1, 0.06, 0.01, element_size=0.02)))
    basis = fc.modal_basis(body, 8, contact_nodes=(16, 2))
    radius = np.sort(np.hypot(*basis.contact_places[:, :2].T)).reshape(2, 16)
    assert np.ptp(radius, axis=1) == pytest.approx(0.0, abs=1e-9)
    assert radius[0, 0] < 0.08 < radius[1, 0]
    angle = np.sort(np.arctan2(*basis.contact_places[:, 1::-1].T).reshape(-1) % (np.pi / 8.0))
    assert min(np.ptp(angle), np.ptp((angle + 0.1) % (np.pi / 8.0))) < 1e-9
    # A grid of all facets are the facets.
    facets = len(body.mesh.boundaries["contact"])
    around = facets // 2
    every = fc.modal_basis(body, 8, contact_nodes=(around, 2))
    assert every.tributary.sum() == pytest.approx(np.pi * (0.1**2 - 0.06**2), rel=1e-5)
    assert every.contact_nodes == facets


def test_ground_and_sliding_keys_reach_the_system(tmp_path):
    x, y = np.meshgrid(0.01 * np.arange(6), 0.02 * np.arange(4) - 0.01, indexing="ij")
    z = 1e-5 * np.cos(40.0 * x + 3.0 * y)
    rows = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    np.savetxt(tmp_path / "map.csv", np.random.default_rng(1).permutation(rows), delimiter=",",
               header="x [m], y [m], z [m]", fmt="%.17g")
    study = fc.Study.read(_written(tmp_path, PAD + """
        [ground]
        speed_y = -0.1
        [ground.height_map]
        file = "map.csv"
    """))
    ground = study.system().ground
    assert ground.speed_y == -0.1
    assert ground.height_map == HeightMap(z, 0.01, 0.02, origin_y=-0.01)
    assert fc.Study.from_toml(study.to_toml()) == study
    turning = fc.Study.from_toml(PAD + """
        [ground]
        rotation_speed = 3.0
        centre = [0.01, 0.02]
    """).with_(**{"simulation.initial": {"displacement": [0, 0, -1e-8, 0, 0, 0]}})
    run = turning.run()
    places = run.system.basis.contact_places
    assert run.slip_velocities[0] == pytest.approx(-3.0 * np.column_stack(
        [-(places[:, 1] - 0.02), places[:, 0] - 0.01]), rel=1e-12)
    assert run.penetration[0] == pytest.approx(np.full(8, 1e-8), rel=1e-9)
    round_ = fc.Study.from_toml(PAIR).with_(**{"interfaces.seam.sliding": {
        "speed": 2.0, "centre": [0.0, 0.01, 0.0], "axis": [0.0, 0.0, 2.0]}})
    assert round_.system().sliding["seam"] == SlidingRotation(2.0, (0.0, 0.01, 0.0))


def _written(folder, text):
    path = folder / "solid.toml"
    path.write_text(text)
    return path


@pytest.mark.filterwarnings("ignore:.*no contact can close")
def test_a_solid_that_starts_rigidly_flies_freely():
    study = fc.Study.from_toml(PAD).with_(**{"gap": 1.0, "simulation.t_end": 1e-5})
    system = study.system()
    spin = np.array([3.0, -2.0, 5.0])
    run = fc.simulate(system, 1e-5, initial=fc.RigidStart(
        displacement=(1e-3, 2e-3, 3e-3, 1e-4, 2e-4, -3e-4),
        velocity=(0.1, -0.2, 0.3, *spin)), outputs=2)
    places = system.basis.contact_places
    speed, shift, turn = np.array([[0.1, -0.2, 0.3], [1e-3, 2e-3, 3e-3], [1e-4, 2e-4, -3e-4]])
    assert run.velocity(3)[0] == pytest.approx(
        np.concatenate([speed + np.cross(spin, places[3]), spin]), rel=1e-9)
    assert run.displacement("C")[0] == pytest.approx(
        np.concatenate([shift + np.cross(turn, [0.03, 0.02, 0.02]), turn]), rel=1e-6)


def test_wear_of_a_solid_is_that_of_archard():
    study = fc.Study.from_toml(PAD).with_(**{
        "simulation.initial": "sliding", "ground.speed": 0.1, "load.normal": 100.0,
        "drive": {"stiffness_x": 1e6, "stiffness_y": 1e6, "damping_x": 100.0, "damping_y": 100.0},
        "wear": {"law": "archard", "coefficient": 1e-12, "blocks": 2, "period": 0.01,
                 "acceleration": 10.0, "outputs": 11}})
    history = study.wear_history()
    # Coefficient times force times way, over ten cycles for each of two computed.
    assert history.depth[-1] @ history.tributary == pytest.approx(
        1e-12 * 100.0 * 10.0 * 0.1 * 0.02, rel=0.01)
    assert history.tributary.sum() == pytest.approx(0.06 * 0.04)
    with pytest.raises(fc.InputError, match=r"thickness = 0\.1 is for plane bodies"):
        fc.integrate.wear_history(study.system(), history.law, 0.1, acceleration=1.0, blocks=1)


@pytest.mark.filterwarnings("ignore:.*no contact can close")
def test_summaries_of_solids_see_all_directions():
    from fecontact.analysis.run_facts import run_facts
    from fecontact.analysis.summaries import largest_displacement

    run = fc.Study.from_toml(PAD).with_(**{
        "gap": 1.0, "load.gravity": [0.0, 0.0, -9.81], "simulation.t_end": 0.01,
        "simulation.initial": {"displacement": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}}).run()
    fallen = 0.5 * 9.81 * 0.01**2
    assert largest_displacement(run) == pytest.approx(fallen, rel=1e-5)
    assert dict(run_facts(run))["largest displacement"].startswith("491 µm at x = ")
    assert dict(run_facts(run))["largest displacement"].count(" m") == 3


PLANE = """
geometry = { shape = "block", element_size = 0.02 }
basis = { modes = 4, contact_nodes = 4 }
body = { thickness = 0.1 }
normal = { law = "linear", stiffness = 1e7 }
friction = { law = "constant", friction_coefficient = 0.3 }
simulation = { t_end = 1e-4, outputs = 3 }
"""


@pytest.mark.parametrize(("changes", "message"), [
    ({"ground.speed_y": 0.1}, r"\[ground\]: speed_y = 0\.1 is for solids, but the body is plane; "
                              r"leave it out, or make a solid"),
    ({"ground.motion_y": {"law": "harmonic-speed", "amplitude": 1.0, "frequency_hz": 1.0 / TURN}},
     r"\[ground\]: motion_y = .* is for solids"),
    ({"ground.rotation_speed": 1.0}, r"\[ground\]: rotation_speed = 1\.0 is for solids"),
    ({"ground.wave_direction": [0.0, 2.0]}, r"wave_direction = \[0\.0, 1\.0\] is for solids"),
    ({"drive.stiffness_z": 1.0}, r"\[drive\]: stiffness_z = 1\.0 is for solids"),
    ({"load.gravity": [0.0, 0.0, -9.81]}, r"\[load\]: gravity = \[0\.0, 0\.0, -9\.81\] is for "
                                          r"solids, .*; give the accelerations along x and y"),
    ({"load.base_acceleration_z": {"law": "constant", "value": 1.0}}, "base_acceleration_z"),
    ({"load.forces": [{"component": "z", "signal": {"law": "constant", "value": 1.0}}]},
     r"\[load\.forces\.0\]: component = \"z\" is for solids, .*; choose from 'phi', 'x', 'y'"),
    ({"load.forces": [{"component": [0.0, 0.0, 2.0], "signal": {"law": "constant", "value": 1.0}}]},
     r"\[load\.forces\.0\]: component = \[0\.0, 0\.0, 1\.0\] is for solids, .*; give a direction "),
    ({"load.boundaries": [{"boundary": "top", "shear_across": 1.0}]},
     r"\[load\.boundaries\.0\]: shear_across = 1\.0 is for solids"),
    ({"basis.contact_nodes": [2, 2]}, r"contact_nodes = \(2, 2\) must be one entry for all"),
    ({"basis.B": [0.0, 0.0, 0.0]}, r"\[basis\]: Point B"),
    ({"basis.dashpots": {"B": [1.0, 1.0, 1.0]}}, r"\[basis\]: Dashpot at 'B': damping must be two"),
    ({"gap": {"radius": 1.0, "centre": [0.0, 0.0]}}, r"\[gap\]: centre = .* is that of a solid"),
    ({"simulation.initial": {"displacement": [0, 0, 1e-6, 0, 0, 0]}},
     r"\[simulation\]: initial: displacement = .* must have 3 numbers, x, y, phi"),
    ({"body.fixed.left": "hinge_z"}, r"\[body\]: fixed\['left'\] = 'hinge_z' must be one of"),
])
def test_keys_of_space_in_a_plane_study(changes, message):
    refused(PLANE, changes, message)


@pytest.mark.parametrize(("changes", "message"), [
    ({"body.thickness": 0.01}, r"\[body\]: thickness = 0\.01 is for plane bodies, but the mesh is "
                               r"that of a solid; leave it out"),
    ({"body.plane": "strain"}, r"\[body\]: plane = \"strain\" is for plane bodies"),
    ({"load.gravity": [0.0, -9.81]}, r"\[load\]: gravity = \[0\.0, -9\.81\] is for plane bodies, "
                                     r".*; give the accelerations along x, y and z"),
    ({"load.forces": [{"component": "phi", "signal": {"law": "constant", "value": 1.0}}]},
     r"component = \"phi\" is for plane bodies"),
    ({"load.forces": [{"component": [1.0, 1.0], "signal": {"law": "constant", "value": 1.0}}]},
     r"component = \[0\.70.*\] is for plane bodies, .*; give a direction along x, y and z"),
    ({"load.forces": [{"point": [0.0, 0.0], "signal": {"law": "constant", "value": 1.0}}]},
     r"\[load\.forces\.0\]: point = \[0\.0, 0\.0\] is for plane bodies"),
    ({"basis.contact": "top"}, r"\[basis\]: Boundary 'top' does not face the ground, .* -z"),
    ({"basis.contact_nodes": [5, 2]}, r"\[basis\]: contact_nodes = \[5, 2\] must be two whole "
                                      r"numbers above zero, .* at most 8"),
    ({"basis.contact_nodes": [8, 1]}, r"contact_nodes = \[8, 1\]: the facets .* do not make so"),
    ({"basis.contact_nodes": [0, 2]}, r"contact_nodes = \(0, 2\) must be at least 1"),
    ({"basis.contact_nodes": 9}, r"contact_nodes = 9 must be 'all' or a whole number from 1 to 8"),
    ({"basis.dashpots": {"B": [1.0, 1.0]}}, r"\[basis\]: Dashpot at 'B': damping must be three"),
    ({"basis.B": [0.0, 0.0]}, r"\[basis\]: Point B"),
    ({"simulation.initial": {"velocity": [0, 0, 1]}},
     r"\[simulation\]: initial: velocity = .* must have 6 numbers, x, y, z, phi_x, phi_y, phi_z"),
    ({"ground.height_map": {"heights": [[0, 0], [0, 0]], "spacing_x": 1, "spacing_y": 1}},
     r"\[ground\.height_map\]: heights of shape \(2, 2\) must be .* at least 4 x 4"),
    ({"ground.height_map": {"heights": [[0] * 4] * 4}},
     r"\[ground\.height_map\]: spacing_x = 0\.0 must be a finite number above zero"),
    ({"ground.height_map": {"file": "none.csv"}},
     r"\[ground\.height_map\]: file = '.*none\.csv' cannot be read"),
    ({"ground.height_map": {"file": "none.csv", "spacing_x": 1.0}},
     r"file = '.*none\.csv' cannot be combined with spacing_x"),
    ({"ground.rotation_speed": 1.0, "ground.amplitude": 1e-6},
     r"\[ground\]: rotation_speed = 1\.0 needs flat and even ground"),
])
def test_keys_that_do_not_fit_a_solid(changes, message):
    refused(PAD, changes, message)


def refused(text, changes, message):
    with pytest.raises(fc.FecontactError, match=message) as raised:
        fc.Study.from_toml(text).with_(**changes).run()
    said = str(raised.value)
    assert said.startswith("The study")
    assert said.endswith(".")
    assert "\n" not in said


def test_plane_bodies_and_solids_do_not_mix():
    refused(PAIR, {"bodies.pad.geometry": {"shape": "block"}},
            r"\[bodies\.pad\.geometry\] is a plane body and \[bodies\.disc\.geometry\] a solid; "
            r"bodies of one study must be all plane or all solids")
    refused(PAIR, {"bodies.pad.placement.shift": [0.0, 0.01]},
            r"\[bodies\.pad\.placement\]: shift = .* must be three finite numbers")
    refused(PAIR, {"interfaces.seam.sliding": {"speed": 1.0, "direction": [0, 0, 0]}},
            r"\[interfaces\.seam\.sliding\]: direction")
    refused(PAIR, {"interfaces.seam.nodes": [9, 9]},
            r"\[interfaces\.seam\]: nodes = \[9, 9\] must be two whole numbers")


def test_maps_of_heights_that_are_no_grid(tmp_path):
    def said(rows):
        np.savetxt(tmp_path / "map.csv", rows, delimiter=",", fmt="%.17g")
        with pytest.raises(fc.InputError) as raised:
            HeightMap(file=str(tmp_path / "map.csv"))
        return str(raised.value)

    grid = np.array([(x, y, 0.0) for x in range(4) for y in range(5)], dtype=float)
    assert "has 19 lines, but its 4 different x and 5 different y make a grid of 20" in said(
        grid[:-1])
    uneven = grid.copy()
    uneven[uneven[:, 0] == 2.0, 0] = 2.2
    assert "uneven places in x: 2.2 is not a whole number of spacings, 1 m, from 0" in said(uneven)
    assert "has one x only" in said(grid[:5])
    assert "at least 4 x 4" in said(grid[grid[:, 1] < 3])


def test_meshes_that_are_no_solids(tmp_path):
    meshio = pytest.importorskip("meshio")
    points = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    block = np.array([[0, 4, 6, 2, 1, 5, 7, 3]])
    folded = block[:, [1, 4, 6, 2, 0, 5, 7, 3]]
    for name, cells, message in (
            ("shell", [("triangle", np.array([[0, 4, 6], [0, 6, 3]]))], "shell.vtu"),
            ("folded", [("hexahedron", folded)], "folded.vtu")):
        meshio.write(tmp_path / f"{name}.vtu", meshio.Mesh(points, cells))
        path = tmp_path / f"{name}.toml"
        path.write_text(f'[geometry]\nfile = "{name}.vtu"\n')
        with pytest.raises(fc.FecontactError, match=message) as raised:
            fc.Study.read(path).mesh()
        assert str(raised.value).startswith(f"{path}: [geometry]: ")
        print(raised.value)
    meshio.write(tmp_path / "solid.vtu", meshio.Mesh(points, [("hexahedron", block)]))
    path = tmp_path / "solid.toml"
    for boundaries, message in (
            ("{ contact = [0, 0, 1, 1] }", "must be the name of a group or a box"),
            ("{ contact = [0, 0, 0, 1, 0, 0] }", "no face of the outline lies in the box")):
        path.write_text(f'[geometry]\nfile = "solid.vtu"\nboundaries = {boundaries}\n')
        with pytest.raises(fc.FecontactError, match=message) as raised:
            fc.Study.read(path).mesh()
        assert str(raised.value).startswith(f"{path}: [geometry]")
        print(raised.value)


def test_the_solver_of_the_modes_is_that_of_the_study(monkeypatch):
    """A small body is not iterated by itself, but where the study says so, to the same numbers."""
    from fecontact.reduction.solvers.solid_solver import SolidSolver

    called = []
    modes = SolidSolver.modes
    monkeypatch.setattr(SolidSolver, "modes", lambda self, *given: (
        called.append(given[0]), modes(self, *given))[1])
    study = fc.Study.from_toml(PAD).with_(**{
        "geometry.element_size": 0.01, "basis.modes": 12})
    found = {}
    for solver in ("auto", "direct", "iterative"):
        changed = study.with_(**{"basis.eigensolver": solver})
        assert fc.Study.from_toml(changed.to_toml()).basis.eigensolver == solver
        found[solver] = changed.system().basis.frequencies_hz
        assert bool(called) == (solver == "iterative")
    assert (found["auto"] == found["direct"]).all()
    assert found["iterative"] == pytest.approx(found["direct"], rel=1e-8)
    refused(PAD, {"basis.eigensolver": "lobpcg"}, r"eigensolver = .*lobpcg.* must be .*iterative")
    refused(PLANE, {"basis.eigensolver": "iterative"},
            r"eigensolver = 'iterative' is for solids; leave it out")


def test_what_nothing_holds_is_named():
    """A belt drags a pad along it that no spring holds."""
    for changes, named in (
            ({"ground.speed": 0.1}, r"against a translation along the ground \(x\)"),
            ({"ground.speed_y": 0.1, "drive.stiffness_x": 1e5},
             r"against a translation along the ground \(y\)")):
        refused(PAD, {"simulation.initial": "sliding", "load.normal": 100.0, **changes},
                rf"There is no steady sliding: nothing holds the body {named}; give it a spring")


@pytest.mark.filterwarnings("ignore:.*no contact can close")
def test_summaries_of_one_point_see_all_directions():
    from fecontact.sweeps.summaries import functions_for, summarise

    start = {"displacement": [0.0] * 6, "velocity": [0.3, 0.2, 0, 0, 0, 0]}
    run = fc.Study.from_toml(PAD).with_(**{
        "gap": 1.0, "load.gravity": [0.0, 0.0, -9.81], "simulation.t_end": 0.01,
        "simulation.initial": start}).run()
    found = summarise(run, functions_for(["amplitude_x@C", "amplitude_y@C", "amplitude_z@C",
                                          "rms_velocity@C"]))
    fall = 9.81 * 0.01
    assert found == pytest.approx({
        "amplitude_x@C": 0.0015, "amplitude_y@C": 0.001, "amplitude_z@C": 0.25 * fall * 0.01,
        "rms_velocity@C": (0.13 + fall**2 / 3.0) ** 0.5}, rel=1e-3)
    with pytest.raises(fc.InputError, match="plane bodies do not move along z"):
        summarise(fc.Study.from_toml(PLANE).run(), functions_for(["amplitude_z@0"]))


@pytest.mark.slow
def test_sweeps_of_solids_have_the_numbers_of_single_runs(tmp_path):
    from fecontact.sweeps.summaries import functions_for, summarise

    path = tmp_path / "pad.toml"
    path.write_text(PAD)
    study = fc.Study.read(path).with_(**{"load.normal": 100.0, "ground.speed": 0.1,
                                         "drive.stiffness_x": 1e3, "drive.stiffness_y": 1e3})
    names = ("amplitude_x", "amplitude_y@0", "amplitude_z@0", "friction_power", "belt_power")
    table = fc.sweep(study, {"ground.speed_y": [0.0, 0.2]}, summaries=names, workers=1,
                     folder=tmp_path / "sweep")
    for case in range(2):
        alone = summarise(study.with_(**table.changes(case)).run(), functions_for(names))
        assert alone == {name: table.values[name][case] for name in names}
    # Friction is the same on both belts, and along them: they give mu N V.
    belt = table.values["belt_power"]
    assert belt[1] / belt[0] == pytest.approx(5.0**0.5, rel=2e-3)
    assert table.values["amplitude_y@0"][1] > 100.0 * table.values["amplitude_y@0"][0]


def measured(folder, factor=1e-6):
    """A file of heights over the face of the pad, and the heights at places x, y."""
    x, y = np.meshgrid(np.linspace(0.0, 0.06, 31), np.linspace(0.0, 0.04, 21), indexing="ij")
    z = factor * np.cos(60.0 * x) * np.sin(80.0 * y)
    np.savetxt(folder / "heights.csv", np.column_stack([x.ravel(), y.ravel(), z.ravel()]),
               delimiter=",", header="x,y,height")
    return lambda x, y: factor * np.cos(60.0 * x) * np.sin(80.0 * y)


def test_measured_heights_are_gaps(tmp_path):
    heights = measured(tmp_path)
    text = PAD.replace("[geometry]", 'gap = { file = "heights.csv" }\n[geometry]', 1)
    (tmp_path / "study.toml").write_text(text)
    system = fc.Study.read(tmp_path / "study.toml").system()
    places = system.basis.contact_places
    z = heights(places[:, 0], places[:, 1])
    assert np.array(system.gap) == pytest.approx(z.max() - z, abs=1e-9)
    python = fc.ContactSystem(system.basis, system.normal, system.friction,
                              gap=HeightMap(file=str(tmp_path / "heights.csv")))
    assert python.gap == system.gap


def test_measured_heights_must_cover_the_face(tmp_path):
    measured(tmp_path)
    text = PAD.replace("[geometry]", 'gap = { file = "heights.csv" }\n[geometry]', 1)
    (tmp_path / "study.toml").write_text(text.replace("length = 0.06", "length = 0.12"))
    with pytest.raises(fc.InputError, match=r"reaches from .* in x, but contact nodes lie"):
        fc.Study.read(tmp_path / "study.toml").system()


def test_half_space_of_a_study():
    """The key of one body, and of both bodies of an interface, as in Python."""
    study, plain = (fc.Study.from_toml(text) for text in (
        PAD.replace("modes = 8", "modes = 8\nhalf_space = true"), PAD))
    expected = with_half_space(plain.modal_basis(), plain.elastic_body())
    assert expected.modes == 8 + 3 * 8
    assert np.array(study.modal_basis().T) == pytest.approx(np.array(expected.T))
    assert fc.Study.from_toml(study.to_toml()) == study
    text = PAIR.replace("modes = 4", "modes = 4\nhalf_space = true")
    both, alone = (fc.Study.from_toml(one) for one in (text, PAIR))
    disc = with_half_space(alone.modal_bases()["disc"], alone.elastic_bodies()["disc"],
                           pairings=[alone.pairings()["seam"]], name="disc")
    assert both.modal_bases()["disc"].modes == disc.modes > alone.modal_bases()["disc"].modes
    assert both.modal_bases()["pad"].modes == alone.modal_bases()["pad"].modes


def test_half_space_of_a_plane_body_is_refused():
    study = fc.Study.from_toml(
        PAD.replace("solid-block", "block").replace("length = 0.06\n", "").replace(
            "[4, 2]", "4").replace("modes = 8", "modes = 8\nhalf_space = true") + """
[body]
thickness = 0.1
""")
    with pytest.raises(fc.InputError, match="the body is plane"):
        study.system()
