"""Gravity, base acceleration, loads on boundaries and at places, in runs and at rest."""

from dataclasses import replace

import numpy as np
import pytest
from meshes_for_tests import rectangle
from systems import TURN

import fecontact as fc
from fecontact import BoundaryLoad, Load, PointLoad
from fecontact.core.errors import InputError
from fecontact.core.tables import from_table, to_table
from fecontact.integrate import SetValued
from fecontact.laws import (
    Constant,
    ConstantFriction,
    ExponentialFriction,
    Harmonic,
    LinearContact,
    PrescribedForce,
    Pulse,
    RoughSurface,
    Step,
)
from fecontact.reduction import BasisReport

G = 9.81
MASS, STIFFNESS, DASHPOT = 2.0, 800.0, 3.0
W0 = np.sqrt(STIFFNESS / MASS)
LENGTH, HEIGHT, THICKNESS = 0.2, 0.02, 0.01
WEIGHT = fc.Material().density * LENGTH * HEIGHT * THICKNESS * G


def oscillator(load, damping=DASHPOT):
    """A mass on a spring and a dashpot that its base carries, moving along x alone."""
    basis = fc.basis_from_matrices(
        [[MASS]], [[STIFFNESS]], {"contact": [[[1.0], [0.0], [0.0]]]}, damping=[[damping]],
        translations=[[1.0], [0.0]])
    return fc.ContactSystem(basis, normal=PrescribedForce(1e-12),
                            friction=ConstantFriction(0.0), load=load)


def body(fixed=None, **options):
    mesh = rectangle(LENGTH, HEIGHT, 16, 2, **options)
    return fc.ElasticBody(mesh, fc.Material(), THICKNESS, fixed=fixed or {})


def beam(load, fixed=None, modes=8, normal=None, **options):
    basis = fc.modal_basis(body(fixed), modes, contact="bottom", contact_nodes=4, C=(0.1, 0.02),
                           **{"damping": 0.01, **options})
    return fc.ContactSystem(basis, normal=normal or RoughSurface(10e6, 10e-6, 40.0),
                            friction=ExponentialFriction(0.8, 0.55, 1e3), load=load)


def x_of(system, times, initial=None, **options):
    found = fc.simulate(system, times[-1], initial=np.zeros(2) if initial is None else initial,
                        outputs=times, rtol=1e-9, **options)
    assert found.energies.imbalance < 1e-6
    return found.displacement(0)[:, 0]


# Base acceleration --------------------------------------------------------------------------------


def test_a_step_of_base_acceleration_deflects_twice_as_far_as_a_constant_one():
    a, start = 2.0, 0.05
    system = oscillator(Load(base_acceleration_x=Step(start, a)), damping=0.0)
    assert system.breakpoints(0.0, 1.0) == (start,)
    times = np.linspace(0.0, 1.0, 401)
    found = x_of(system, times)
    wanted = np.where(times < start, 0.0, -a / W0**2 * (1.0 - np.cos(W0 * (times - start))))
    np.testing.assert_allclose(found, wanted, atol=2e-6 * a / W0**2)
    assert -found.min() == pytest.approx(2.0 * a / W0**2, rel=1e-4)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_a_harmonic_base_is_transmitted_as_by_the_closed_form(ratio):
    """Absolute motion over that of the base: sqrt((1 + z^2) / ((1 - r^2)^2 + z^2)), z = 2 D r."""
    w, base = ratio * W0, 1e-3
    z = DASHPOT * w / STIFFNESS
    # Relative motion in the steady state, of base motion base sin(w t).
    relative = base * ratio**2 / (1.0 - ratio**2 + 1j * z)
    times = np.linspace(0.0, 4.0 * np.pi / w, 201)
    system = oscillator(Load(base_acceleration_x=Harmonic(-base * w**2, w / TURN)))
    assert fc.system.forcing_period(system) == pytest.approx(2.0 * np.pi / w, rel=1e-14)
    start = np.array([relative.imag, (1j * w * relative).imag]) * np.sqrt(MASS)
    found = x_of(system, times, start) + base * np.sin(w * times)
    gain = np.sqrt((1.0 + z**2) / ((1.0 - ratio**2) ** 2 + z**2))
    np.testing.assert_allclose(found, (np.exp(1j * w * times) * (relative + base)).imag,
                               atol=2e-6 * base)
    assert np.abs(found).max() == pytest.approx(base * gain, rel=1e-3)


# Gravity ------------------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore:.*no contact can close")
def test_a_body_in_the_air_falls():
    system = beam(Load(gravity=(1.5, -G)), modes=5, damping=0.0)
    system = system.with_(gap=1.0)
    times = np.linspace(0.0, 0.2, 11)
    run = fc.simulate(system, 0.2, initial=np.zeros(10), outputs=times, rtol=1e-9)
    place = run.displacement("C")
    np.testing.assert_allclose(place[:, 0], 0.75 * times**2, atol=1e-9)
    np.testing.assert_allclose(place[:, 1], -0.5 * G * times**2, atol=1e-9)
    assert np.abs(place[:, 2]).max() < 1e-9
    work = run.energies.load_work[-1]
    assert work == pytest.approx(WEIGHT / G * (G**2 + 1.5**2) * 0.5 * 0.2**2, rel=1e-8)


def test_the_ground_carries_all_loads():
    pressure, force = 2e4, 30.0
    system = beam(Load(5.0, gravity=(0.0, -G), boundaries=[BoundaryLoad("top", pressure)],
                       forces=[PointLoad((0.11, 0.012), signal=Constant(-force))]))
    q = fc.equilibrium(system).modal_coordinates
    forces = system.at(np.append(q, 0.0 * q)).normal_force
    total = 5.0 + WEIGHT + pressure * LENGTH * THICKNESS + force
    assert forces.sum() == pytest.approx(total, rel=1e-9)
    # Moments about the middle: the force alone acts beside it.
    assert forces @ (system.basis.contact_x - 0.1) == pytest.approx(force * 0.01, rel=1e-4)


def test_gravity_needs_the_inertia_of_the_body():
    rows = {"contact": [[[1.0], [1.0], [0.0]]]}
    bare = fc.basis_from_matrices([[MASS]], [[STIFFNESS]], rows)
    assert bare.inertia_rows is None
    for load, named in ((Load(gravity=(0.0, -G)), "gravity"),
                        (Load(base_acceleration_y=Constant(1.0)), "base_acceleration_y")):
        with pytest.raises(fc.InputError, match=rf"Load: {named}.* no inertia_rows; make it"):
            fc.ContactSystem(bare, normal=LinearContact(1e3), friction=ConstantFriction(0.0),
                             load=load)
    known = replace(bare, inertia_rows=[[0.0], [np.sqrt(MASS)]])
    fc.ContactSystem(known, normal=LinearContact(1e3), friction=ConstantFriction(0.0),
                     load=Load(gravity=(0.0, -G)))
    with pytest.raises(fc.InputError, match="no effect, as the body moves along x in no mode"):
        fc.ContactSystem(known, normal=LinearContact(1e3), friction=ConstantFriction(0.0),
                         load=Load(gravity=(1.0, 0.0)))


def test_inertia_of_matrices_counts_the_mass_shared_with_fixed_degrees_of_freedom():
    """A hanging chain of two, consistent mass: the second is fixed and takes its part."""
    mass, stiffness = np.array([[2.0, 1.0], [1.0, 2.0]]), np.diag([STIFFNESS, 1e36])
    rows = {"contact": [[[0.0, 0.0], [1.0, 0.0]]]}
    basis = fc.basis_from_matrices(mass, stiffness, rows, translations=[[0, 0], [1, 1]])
    np.testing.assert_allclose(basis.inertia_rows, [[0.0], [3.0 / np.sqrt(2.0)]], rtol=1e-14)
    modes = fc.basis_from_modes([[1.0], [0.0]], rows, frequencies_hz=[1.0], mass=mass,
                                translations=[[0, 0], [1, 1]])
    np.testing.assert_allclose(modes.inertia_rows, basis.inertia_rows, rtol=1e-14)
    with pytest.raises(fc.InputError, match=r"translations must be \(2, 2\) finite numbers"):
        fc.basis_from_matrices(mass, stiffness, rows, translations=[0, 1])
    with pytest.raises(fc.InputError, match="translations need mass, the mass matrix"):
        fc.basis_from_modes([[1.0], [0.0]], rows, frequencies_hz=[1.0], modal_mass=1.0,
                            translations=[[0, 0], [1, 1]])


def test_the_squares_of_inertia_rows_are_effective_masses():
    basis = fc.modal_basis(body(), 6, contact="bottom")
    mass = WEIGHT / G
    np.testing.assert_allclose((basis.inertia_rows**2).sum(axis=1), mass, rtol=1e-12)
    np.testing.assert_allclose(BasisReport(basis).effective_mass.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(basis.select([0, 3]).inertia_rows, basis.inertia_rows[:, [0, 3]])
    np.testing.assert_array_equal(basis.select([0, 3]).boundary_rows,
                                  basis.boundary_rows[..., [0, 3]])


# Places, boundaries, time -------------------------------------------------------------------------


def skewed(nodes):
    return nodes + 0.15 * nodes[:, ::-1] * (nodes - 0.03)


@pytest.mark.parametrize("triangles", [True, False])
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("place", [(0.0513, 0.0071), (0.2, 0.0103)])
def test_a_force_at_a_place_is_one_at_a_named_point_there(triangles, degree, place, tmp_path):
    mesh = rectangle(LENGTH, HEIGHT, 8, 3, triangles=triangles, warp=skewed)
    place = tuple(skewed(np.array([place]))[0])
    part = fc.ElasticBody(mesh, fc.Material(), THICKNESS, degree=degree)
    basis = fc.modal_basis(part, 8, contact="bottom", contact_nodes=2, points={"P": place})
    fc.io.write_basis(tmp_path / "basis.h5", basis)
    for one in (basis, fc.io.read_basis(tmp_path / "basis.h5")):
        for component, row in zip(("x", "y", "phi"), basis.T[-1], strict=True):
            system = fc.ContactSystem(
                one, normal=LinearContact(1e6), friction=ConstantFriction(0.1),
                load=Load(forces=[PointLoad(place, component, signal=Constant(1.0))]))
            np.testing.assert_allclose(system.arrays.load_shapes[0], row, rtol=1e-9,
                                       atol=1e-12 * np.abs(row).max())
    # Linear fields are interpolated exactly.
    rows = basis.mode_shapes.rows_at(place, "test")
    rigid = rows[:, :3] @ np.linalg.inv(basis.T[2, :, :3])
    arm = np.array(place) - basis.positions[2]
    np.testing.assert_allclose(rigid, [[1, 0, -arm[1]], [0, 1, arm[0]], [0, 0, 1]], atol=1e-9)
    with pytest.raises(fc.InputError, match=r"Load: a force: \(1, 1\) lies outside the body"):
        fc.ContactSystem(basis, normal=LinearContact(1e6), friction=ConstantFriction(0.1),
                         load=Load(forces=[PointLoad((1, 1), signal=Constant(1.0))]))


def test_a_basis_without_shapes_refuses_a_force_at_a_place():
    basis = replace(fc.modal_basis(body(), 5, contact="bottom"), mode_shapes=None)
    with pytest.raises(fc.InputError, match=r"\(0\.1, 0\.01\) needs shapes over the body"):
        fc.ContactSystem(basis, normal=LinearContact(1e6), friction=ConstantFriction(0.1),
                         load=Load(forces=[PointLoad((0.1, 0.01), signal=Constant(1.0))]))


def test_boundary_loads_push_into_the_body_and_run_round_it():
    basis = fc.modal_basis(body(), 3, contact="bottom")
    rigid = np.linalg.inv(basis.T[2, :, :3])
    reference = basis.positions[2]  # moments about it
    area = {"bottom": LENGTH, "top": LENGTH, "left": HEIGHT, "right": HEIGHT}
    ways = {"bottom": ((0, 1), (1, 0)), "right": ((-1, 0), (0, 1)), "top": ((0, -1), (-1, 0)),
            "left": ((1, 0), (0, -1))}
    centres = {"bottom": (0.1, 0.0), "right": (0.2, 0.01), "top": (0.1, 0.02), "left": (0, 0.01)}
    assert basis.boundaries == ("bottom", "right", "top", "left")
    for name in basis.boundaries:
        arm = np.array(centres[name]) - reference
        for found, way in zip(basis.boundary_row(name) @ rigid, ways[name], strict=True):
            size = THICKNESS * area[name]
            moment = arm[0] * way[1] - arm[1] * way[0]
            np.testing.assert_allclose(found, size * np.array([*way, moment]),
                                       atol=1e-12 * size)
    with pytest.raises(fc.InputError, match=r"no boundary 'tops' \(did you mean 'top'"):
        beam(Load(boundaries=[BoundaryLoad("tops", 1.0)]))


@pytest.mark.parametrize("load", [
    Load(gravity=(0.4, -G), boundaries=[BoundaryLoad("top", Pulse("half-sine", 3e5, 1e-3))]),
    Load(gravity=(0.0, -G), base_acceleration_x=Harmonic(20.0, 900.0 / TURN),
         base_acceleration_y=Step(2e-3, -30.0)),
    Load(20.0, boundaries=[BoundaryLoad("left", 1e5, Harmonic(1e5, 2000.0 / TURN))],
         forces=[PointLoad((0.03, 0.004), "x", signal=Harmonic(30.0, 3000.0 / TURN))]),
])
def test_energy_balances_in_contact(load):
    system = beam(load)
    start = np.zeros(2 * system.basis.modes)
    run = fc.simulate(system, 6e-3, initial=start, rtol=1e-8)
    assert run.energies.imbalance < 1e-5
    # The work of the loads by themselves, from the motion and the forces.
    q, rate = run.modal_coordinates, run.modal_velocities
    values = np.array([signal.history(run.time)[:, 0] for signal in load.signals.values()])
    forces = system.arrays.constant_load + values.T @ system.arrays.load_shapes
    power = (forces * rate).sum(axis=1)
    work = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(run.time) * (power[1:] + power[:-1]))])
    largest = np.abs(work).max()
    assert np.abs(q).max() > 0.0
    np.testing.assert_allclose(run.energies.load_work, work, atol=0.02 * largest)


def test_loads_are_parameters_of_the_system():
    system = beam(Load(boundaries=[BoundaryLoad("top", 2e4, Harmonic(1.0, 3.0 / TURN))]))
    values = system.parameters()
    assert values["load.boundaries.0.pressure"] == 2e4
    assert values["load.boundaries.0.shear.amplitude"] == 1.0
    changed = system.with_(**{"load.boundaries.0.pressure": 4e4, "load.gravity": (0.0, -1.6)})
    np.testing.assert_allclose(
        changed.arrays.constant_load,
        4e4 * system.basis.boundary_row("top")[0] - 1.6 * system.basis.inertia_rows[1])
    assert "gravity (0, -1.6) m/s²" in repr(changed)


def driven_mass():
    """A mass that moves along x and y, on springs whose ends move, pressed."""
    rows = np.zeros((3, 2))
    rows[:2] = np.eye(2)
    basis = fc.basis_from_matrices(MASS * np.eye(2), np.diag([STIFFNESS, 300.0]),
                                   {"contact": rows[None], "B": rows, "C": rows},
                                   damping=DASHPOT * np.eye(2))
    return fc.ContactSystem(
        basis, normal=LinearContact(1e3, 0.0), friction=ConstantFriction(0.2, smoothing_slope=9.0),
        load=Load(2.0), drive=fc.Drive(stiffness_x=2.0, amplitude_x=0.1, frequency_hz=5.0 / TURN))


@pytest.mark.parametrize("changes", [
    {"drive.frequency_hz": 31.0 / TURN}, {"drive.stiffness_x": 7.0, "drive.amplitude_x": 0.2},
    {"drive": fc.Drive(stiffness_y=3.0, damping_x=2.0, dashpots="relative", amplitude_x=0.1,
                       frequency_hz=4.0 / TURN)},
    {"load.normal": 12.0}, {"load": Load(5.0), "drive.damping_y": 0.3}])
def test_a_system_under_another_excitation_is_that_made_anew(changes):
    """Checked parts are shared; the arrays equal those of a new system."""
    system = driven_mass()
    found = system.with_(**changes)
    parts = {"drive": system.drive, "load": system.load}
    for name, value in changes.items():
        part, _, inner = name.partition(".")
        parts[part] = replace(parts[part], **{inner: value}) if inner else value
    anew = replace(system, **parts)
    assert (found.drive, found.load) == (anew.drive, anew.load)
    for name, mine, theirs in zip(found.arrays._fields, found.arrays, anew.arrays, strict=True):
        np.testing.assert_array_equal(mine, theirs, err_msg=name)
    y = np.linspace(-1e-3, 1e-3, system.size)
    np.testing.assert_array_equal(found.rhs(0.3, y), anew.rhs(0.3, y))
    assert np.abs(found.rhs(0.3, y) - system.rhs(0.3, y)).max() > 0.0


def test_another_excitation_is_checked():
    system = driven_mass()
    with pytest.raises(InputError, match="drive = 3 must be a Drive"):
        system.with_(drive=3)
    with pytest.raises(InputError, match="body is plane"):
        system.with_(**{"drive.stiffness_z": 1.0})
    with pytest.raises(InputError, match=r"no parameter 'drive\.mass'"):
        system.with_(**{"drive.mass": 1.0})


def test_a_block_slides_as_coulomb_says_on_a_base_that_shakes():
    """Set-valued friction on an accelerated base: stick below mu g, then a - mu g."""
    rows = np.zeros((1, 3, 2))
    rows[0, 0, 0] = rows[0, 1, 1] = 1.0
    basis = fc.basis_from_matrices(MASS * np.eye(2), np.diag([0.0, 1e6]), {"contact": rows},
                                   translations=np.eye(2))
    system = fc.ContactSystem(
        basis, normal=PrescribedForce(MASS * G), friction=ConstantFriction(0.3),
        load=Load(base_acceleration_x=Step(0.1, -5.0)))
    times = np.linspace(0.0, 0.5, 26)
    run = fc.simulate(system, 0.5, initial=np.zeros(4), outputs=times, solver=SetValued())
    wanted = 0.5 * (5.0 - 0.3 * G) * np.maximum(times - 0.1, 0.0) ** 2
    np.testing.assert_allclose(run.displacement(0)[:, 0], wanted, atol=1e-5 * wanted.max())
    assert run.energies.load_work[-1] == pytest.approx(MASS * 5.0 * wanted[-1], rel=1e-4)


# Residual vectors ---------------------------------------------------------------------------------


@pytest.mark.parametrize("reduction", ["residual", "craig-bampton"])
def test_completed_modes_deflect_as_the_whole_body(reduction):
    clamped = body({"left": "xy"})
    load = Load(gravity=(3.0, -G), boundaries=[BoundaryLoad("top", 2e4, 1e4)],
                forces=[PointLoad((0.15, 0.013), "x", signal=Constant(50.0))])
    names = ["gravity", "top", (0.15, 0.013)]
    basis = fc.modal_basis(clamped, 3, contact="bottom", contact_nodes=2, reduction=reduction,
                           loads=names, tolerance=0.0)
    system = fc.ContactSystem(basis, normal=LinearContact(1e6), friction=ConstantFriction(0.1),
                              load=load, gap=1.0)
    found = basis.fields(fc.equilibrium(system).modal_coordinates)
    wanted = fc.static_solution(clamped, load)
    scale = np.abs(wanted.displacement).max()
    np.testing.assert_allclose(found.displacement, wanted.displacement, atol=1e-8 * scale)
    np.testing.assert_allclose(found.stress, wanted.stress, atol=1e-6 * np.abs(wanted.stress).max())
    errors = BasisReport(basis).load_error
    assert errors[0].max() < 1e-9
    assert errors[1 + basis.boundaries.index("top")].max() < 1e-9
    assert "loads on 'left'" not in str(BasisReport(basis))


def test_missing_response_to_a_load_is_reported():
    """The axial modes of a clamped bar hold 8 / pi^2 / (2 k - 1)^2 of the work of an end force."""
    long = fc.ElasticBody(rectangle(1.0, 0.01, 60, 1), fc.Material(poisson_ratio=0.0), 0.01,
                          fixed={"left": "xy", "bottom": "y"})
    basis = fc.modal_basis(long, 2, contact="bottom")
    error = BasisReport(basis).load_error[1 + basis.boundaries.index("right")]
    assert error[0] == pytest.approx(1.0 - 8.0 / np.pi**2 * (1.0 + 1.0 / 9.0), rel=1e-3)
    assert "loads on 'right': pressure 9.9" in str(BasisReport(basis))
    # Gravity: the work of mode k goes with 96 / pi^4 / (2 k - 1)^4.
    gravity = 1.0 - 96.0 / np.pi**4 * (1.0 + 1.0 / 81.0)
    assert BasisReport(basis).load_error[0, 0] == pytest.approx(gravity, rel=2e-2)
    with pytest.raises(fc.InputError, match="loads complete the modes only with reduction"):
        fc.modal_basis(long, 2, contact="bottom", loads=["gravity"])
    with pytest.raises(fc.MeshError, match=r"no point or boundary 'gravty'"):
        fc.modal_basis(long, 2, contact="bottom", reduction="residual", loads=["gravty"])


def test_gravity_does_not_deform_a_free_body():
    basis = fc.modal_basis(body(), 5, contact="bottom")
    np.testing.assert_array_equal(BasisReport(basis).load_error[0], 0.0)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: Load(gravity=-G), "gravity = -9.81 must be two finite numbers"),
    (lambda: Load(gravity=(0.0, np.nan)), "must be two finite numbers"),
    (lambda: Load(base_acceleration_x=3.0), "base_acceleration_x = 3.0 must be a Signal"),
    (lambda: Load(boundaries=[3]), "must be a list of BoundaryLoad"),
    (lambda: BoundaryLoad("top"), "pressure and shear on 'top' are zero"),
    (lambda: BoundaryLoad("top", np.inf), "pressure = inf must be finite"),
    (lambda: BoundaryLoad("top", "a"), "pressure = 'a'"),
    (lambda: BoundaryLoad(3, 1.0), "boundary"),
    (lambda: PointLoad((1.0,), signal=Constant(1.0)), "point"),
    (lambda: PointLoad(None, signal=Constant(1.0)), r"or a place \(x, y\)"),
])
def test_bad_loads_are_refused(make, message):
    with pytest.raises(fc.InputError, match=message):
        make()


def test_a_boundary_load_of_zero_is_none():
    """The first case of a sweep over a pressure."""
    still, none = (beam(Load(5.0, boundaries=boundaries), B=(0.2, 0.01)) for boundaries in (
        [BoundaryLoad("top", pressure=0.0)], ()))
    np.testing.assert_array_equal(still.arrays.constant_load, none.arrays.constant_load)
    for defaults in (False, True):
        table = to_table(BoundaryLoad("top", shear=0.0), defaults=defaults)
        assert from_table(BoundaryLoad, table, "load").shear == 0.0
    assert "pressure" not in to_table(BoundaryLoad("top", shear=0.0), defaults=False)


def test_a_number_is_a_constant_signal():
    assert fc.PointLoad("B", "x", signal=3) == fc.PointLoad("B", "x", signal=Constant(3.0))
    table = {"point": "B", "component": "x", "signal": 3}
    assert from_table(fc.PointLoad, table, "forces") == fc.PointLoad("B", "x", signal=3.0)
    for wrong in (True, np.nan, "3", None):
        with pytest.raises(fc.InputError, match=r"signal|value"):
            fc.PointLoad("B", "x", signal=wrong)
