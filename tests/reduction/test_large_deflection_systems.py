"""Large deflections in runs by all methods, static states, modes about them, responses, studies."""

import numpy as np
import pytest
import test_large_deflections as beams
from meshes_for_tests import rectangle
from scipy.integrate import solve_bvp
from scipy.sparse.linalg import eigsh

from fecontact import (
    BoundaryLoad,
    ContactSystem,
    ElasticBody,
    InputError,
    Load,
    LoadPath,
    Mesh,
    ModelWarning,
    PointLoad,
    Study,
    equilibrium,
    load_history,
    modal_basis,
    simulate,
    sweep,
)
from fecontact.analysis import DeflectionSteps, complex_modes, deflection_path, prestressed_modes
from fecontact.analysis.summaries import largest_displacement, peak_normal_force
from fecontact.bifurcation import HarmonicBalance, frequency_response, nonlinear_mode
from fecontact.fem import Coupling, PointSpring, Rotation
from fecontact.fem.finite_strain import FiniteStrainModel
from fecontact.integrate import CVODE, EventDriven, PowerSeries, Rodas5P, Scipy, TimeStepping
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce
from fecontact.reduction import LargeDeflections, eigenfrequencies_hz

H = beams.H


@pytest.mark.parametrize("solver", [Rodas5P(), PowerSeries(), EventDriven(), CVODE(), Scipy(),
                                    TimeStepping()], ids=lambda one: type(one).__name__)
def test_runs_by_all_methods(solver):
    basis = beams.bent("hinged", 0.6 * H, damping=0.01)
    system = ContactSystem(basis)
    start = np.zeros(system.size)
    start[0] = 0.5 * basis.large_deflections[0].ranges[0, 1]
    end = 0.3 / basis.frequencies_hz[0]
    runs = [simulate(system, end, initial=start, outputs=31, rtol=1e-6, solver=one)
            for one in (solver, Rodas5P())]
    q, exact = (run.states[:, 0] for run in runs)
    assert q == pytest.approx(exact, abs=1e-5 * start[0])


def test_damping_of_stretching_leaves_the_mode_alone():
    """From a start out of balance runs need far fewer steps; the period stays."""
    found = {}
    for ratio in (0.0, 0.1):
        basis = modal_basis(beams.beam("hinged"), 1, contact=(), large_deflections=LargeDeflections(
            0.6 * H, stretching_damping=ratio))
        assert basis.damping[1, 1] == pytest.approx(2.0 * ratio * basis.angular_frequencies[1])
        assert not basis.damping[0].any()
        start = np.zeros(4)
        start[0] = 0.5 * basis.large_deflections[0].ranges[0, 1]
        run = simulate(ContactSystem(basis), 0.75 / basis.frequencies_hz[0], initial=start,
                       outputs=301)
        q = run.states[:, 0]
        at = int(np.flatnonzero(q[:-1] * q[1:] < 0.0)[1])
        zero = run.time[at] - q[at] * (run.time[at + 1] - run.time[at]) / (q[at + 1] - q[at])
        found[ratio] = zero, dict(run.summary())["steps"]
    assert found[0.1][0] == pytest.approx(found[0.0][0], rel=2e-3)
    assert int(found[0.1][1].split()[0]) < 0.2 * int(found[0.0][1].split()[0])


def test_modes_about_a_deflected_state():
    """Under pressure the frequency rises as that of the whole body with its tangent stiffness."""
    basis = beams.bent("clamped", 2.5 * H, (0, 2), 3, reduction="residual", loads=("top",))
    load = Load(boundaries=(BoundaryLoad("top", pressure=4e3),))
    system = ContactSystem(basis, load=load)
    rest = equilibrium(system)
    found = complex_modes(system, np.append(rest.modal_coordinates, 0.0 * rest.modal_coordinates))
    body = beams.beam("clamped")
    path = deflection_path(body, load, steps=DeflectionSteps(first=0.5))
    model = FiniteStrainModel(body)
    q = body.expansion.T @ path.displacements[-1].ravel()
    mass = (body.expansion.T @ body.mass @ body.expansion).tocsc()
    squares = eigsh(model.state(q).tangent, k=1, M=mass, sigma=0.0)[0]
    exact = np.sqrt(squares[0]) / (2.0 * np.pi)
    assert exact > 1.3 * basis.frequencies_hz[0]
    assert found.frequencies_hz[0] == pytest.approx(exact, rel=0.02)
    # Loading step by step ends in the same state.
    history = load_history(system, LoadPath(load_scale=(0.2, 1.0)))
    assert history.modal_coordinates[-1] == pytest.approx(
        rest.modal_coordinates, abs=1e-6 * np.abs(rest.modal_coordinates).max())


def test_branches_watch_the_range():
    """A nonlinear mode beyond the fitted deflections says so."""
    system = ContactSystem(beams.bent("hinged", 0.6 * H))
    with pytest.warns(ModelWarning, match=r"On this branch .* by 1\.\d+ times the range"):
        nonlinear_mode(system, (1e-4, 0.8 * H), observe=("middle", "y"),
                       method=HarmonicBalance(2, stability=None))


def test_statics_watch_the_range():
    """Rest states and loading beyond the fitted deflections say so."""
    system = ContactSystem(beams.bent("hinged", 0.6 * H), load=Load(
        forces=(PointLoad("middle", "y", signal=-30.0),)))
    with pytest.warns(ModelWarning, match=r"In equilibrium .* times the range in which"):
        equilibrium(system)
    with pytest.warns(ModelWarning, match=r"Along the path of loads .* times the range in which"):
        load_history(system, LoadPath(load_scale=(0.0, 1.0)))


def test_response_peaks_on_the_backbone():
    """At the peak of the forced response the amplitude is that of the nonlinear mode."""
    basis = beams.bent("hinged", 0.7 * H, damping=0.005)
    mode = nonlinear_mode(ContactSystem(basis), (1e-5, 0.6 * H), observe=("middle", "y"),
                          method=HarmonicBalance(4, 48, stability=None))
    f = basis.frequencies_hz[0]
    system = ContactSystem(basis, load=Load(forces=(
        PointLoad("middle", "y", signal=Harmonic(0.008, 0.9 * f)),)))
    response = frequency_response(
        system, (0.9 * f, 1.25 * f), "load.forces.0.signal.frequency_hz", observe=("middle", "y"),
        method=HarmonicBalance(4, 48, stability=None))
    amplitude = response.amplitude()
    frequency = response.branches[0].parameter
    peak = int(np.argmax(amplitude))
    at = np.interp(amplitude[peak], mode.amplitude, mode.frequency_hz)
    assert amplitude[peak] > 0.2 * H
    assert frequency[peak] == pytest.approx(at, rel=3e-3)
    assert at > 1.05 * f


STUDY = """
geometry = { shape = "beam", length = 1.0, height = 0.004, element_size = 0.05 }
body = { material = "steel", thickness = 0.01, fixed = { left = "xy", right = "xy" } }
simulation = { t_end = 0.01, outputs = 11 }
load = { gravity = [0.0, -9.81] }

[basis]
modes = 1
contact = []
points = { middle = [0.5, 0.002] }
large_deflections = { largest_displacement = 2e-3 }
"""


@pytest.mark.slow
def test_study(tmp_path):
    """The study has the basis that Python makes, with the same forces; sweeps run it."""
    study = Study.from_toml(STUDY)
    basis = study.modal_basis()
    made = modal_basis(study.elastic_body(), 1, contact=(), C="",
                       large_deflections=LargeDeflections(2e-3))
    for one, other in zip(basis.large_deflections, made.large_deflections, strict=True):
        assert (one.cubic == other.cubic).all()
    run = study.run()
    assert run.status.name.lower() == "finished"
    # Springs between coordinates are no places that move.
    moved = np.abs(run.displacement("middle")).max()
    assert largest_displacement(run) == pytest.approx(moved, rel=1e-9)
    assert peak_normal_force(run) == 0.0
    table = sweep(study, {"load.gravity.1": [-9.81, -30.0]}, summaries=["largest_displacement"],
                  folder=tmp_path, workers=1)
    first, second = table.values["largest_displacement"]
    assert first == pytest.approx(moved, rel=1e-9)
    # Hardening: less than in proportion.
    assert 1.2 * first < second < 0.98 * 30.0 / 9.81 * first
    with pytest.raises(InputError, match="would stress the body twice"):
        Study.from_toml(STUDY.replace("modes = 1", "modes = 1\nprestress = true"))


def rotating_elastica(speed, force):
    """Tip (x, y) of the cantilever that turns about its root and bears a dead force at its tip."""
    area, bending = beams.B * H, beams.E * beams.B * H**3 / 12.0
    spun = 7800.0 * area * speed**2

    def rates(s, z):
        x, y, angle, moment, along, across = z
        return np.array([np.cos(angle), np.sin(angle), moment / bending,
                         along * np.sin(angle) - across * np.cos(angle), -spun * x, -spun * y])

    s = np.linspace(0.0, beams.L, 101)
    start = np.zeros((6, len(s)))
    start[0], start[4] = s, 0.5 * spun * (beams.L**2 - s**2)
    found = solve_bvp(rates, lambda a, b: np.array(
        [a[0], a[1], a[2], b[3], b[4], b[5] - force]), s, start, tol=1e-6, max_nodes=20000)
    assert found.success
    return found.sol(beams.L)[:2]


def test_rotating_cantilever():
    """Extension and bending frequency in rotation, then a large deflection of the elastica.

    rho W^2 L^3 / (3 E), and sqrt(7.3604^2 - 36) / 3.5160 in the plane of rotation (Wright, Smith,
    Thresher and Wang, J. Appl. Mech. 49, 1982), which the linear basis has by the geometric
    stiffness and the one of large deflections by its stretching.
    """
    body = beams.beam("cantilever")
    w = 2.0 * np.pi * eigenfrequencies_hz(body, 1)[0]
    speed = 6.0 / 3.5160 * w
    options = {"contact": (), "points": {"tip": "last"}, "reduction": "residual",
               "loads": ("right",), "rotation": Rotation(speed, (0.0, 0.5 * H))}
    basis = modal_basis(body, 4, large_deflections=LargeDeflections(0.1 * beams.L, 3), **options)
    system = ContactSystem(basis)
    rest = equilibrium(system).modal_coordinates
    extension = 7800.0 * speed**2 * beams.L**3 / (3.0 * beams.E)
    assert basis.point_row("tip", "x") @ rest == pytest.approx(extension, rel=1e-3)
    linear = ContactSystem(modal_basis(body, 4, **options))
    for one, q, error in ((system, rest, 5e-3), (linear, np.zeros(linear.basis.modes), 1e-3)):
        found = complex_modes(one, np.append(q, 0.0 * q)).frequencies_hz[0] * 2.0 * np.pi
        assert found / w == pytest.approx(np.sqrt(7.3604**2 - 36.0) / 3.5160, rel=error)
    force = 0.45 * beams.E * beams.B * H**3 / 12.0 / beams.L**2
    loaded = ContactSystem(basis, load=Load(forces=(PointLoad("tip", "y", signal=force),)))
    q = equilibrium(loaded).modal_coordinates
    x, y = rotating_elastica(speed, force)
    assert y > 0.08 * beams.L
    assert basis.point_row("tip", "y") @ q == pytest.approx(y, rel=0.01)
    assert -(basis.point_row("tip", "x") @ q) == pytest.approx(beams.L - x, rel=0.03)


STUCK = 3e6  # tangential stiffness below the washer [N/m]


def bolted(spring):
    """A panel clamped at its left end, the other one on friction or on a spring along x."""
    mesh = rectangle(beams.L, H, 30, 2, points={"middle": (0.5 * beams.L, 0.5 * H)})
    pressed = {
        name: mesh.boundaries[side][mesh.nodes[mesh.boundaries[side], 0].min(axis=1) > 0.9]
        for name, side in (("seat", "bottom"), ("washer", "top"))}
    mean = Coupling("seat", "hub", (0.95, 0.0), "distributing")
    mesh = Mesh(mesh.nodes, mesh.cells, {**mesh.boundaries, **pressed}, mesh.points,
                constraints=(mean,) if spring else ())
    return ElasticBody(mesh, beams.STEEL, thickness=beams.B, fixed={"left": "xy", "washer": "y"},
                       attachments=(PointSpring((("hub", (1.0, 0.0)),), STUCK),) if spring else ())


@pytest.mark.slow
def test_preload_of_a_bolted_panel():
    """Pulled, or pushed below buckling, under pressure, with friction that sticks at its end.

    Statics and prestressed modes against the whole body with its tangent stiffness.
    """
    basis = modal_basis(bolted(False), 4, contact="seat", contact_nodes=1, B="", C="", points={
        "middle": "middle", "end": "right"}, reduction="residual", tolerance=0.0, loads=(
            "top", "right"), large_deflections=LargeDeflections(1.7 * H, 3))
    body = bolted(True)
    model = FiniteStrainModel(body)
    mass = (body.expansion.T @ body.mass @ body.expansion).tocsc()
    for pull in (-5e6, 2e7):
        load = Load(boundaries=(BoundaryLoad("top", pressure=2.5e3),
                                BoundaryLoad("right", pressure=-pull)))
        system = ContactSystem(basis, PrescribedForce(1.0), JenkinsFriction(STUCK, 1e4), load=load)
        history = load_history(system, LoadPath(load_scale=(0.0, 0.5, 1.0)))
        path = deflection_path(body, load)
        q = history.modal_coordinates[-1]
        for place, axis in (("middle", 1), ("end", 0)):
            exact = path.displacement("right" if place == "end" else place)[-1, axis]
            assert basis.point_row(place, "xy"[axis]) @ q == pytest.approx(exact, rel=0.01)
        held = STUCK * path.displacement("hub")[-1, 0]
        assert history.friction_force[-1, 0] == pytest.approx(held, rel=0.01)
        squares = eigsh(model.state(path.unknowns[-1]).tangent, k=2, M=mass, sigma=0.0)[0]
        exact = np.sqrt(np.sort(squares)) / (2.0 * np.pi)
        modes = prestressed_modes(system, history)
        assert modes.frequencies_hz[:2] == pytest.approx(exact, rel=5e-3)
        assert exact[0] > 1.15 * basis.frequencies_hz[0]
