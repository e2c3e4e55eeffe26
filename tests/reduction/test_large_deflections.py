"""Forces of large deflections in modal bases, against beam theory and the whole body."""

import warnings
from dataclasses import replace
from functools import cache
from itertools import permutations

import numpy as np
import pytest
from meshes_for_tests import grid, rectangle
from scipy.integrate import cumulative_trapezoid
from scipy.special import ellipk

import fecontact as fc
from fecontact import (
    AnalysisError,
    BoundaryLoad,
    ContactSystem,
    Drive,
    ElasticBody,
    InputError,
    Load,
    Material,
    ModelWarning,
    PointLoad,
    equilibrium,
    modal_basis,
    simulate,
)
from fecontact.analysis import DeflectionSteps, deflection_path
from fecontact.bifurcation import (
    HarmonicBalance,
    contact_field,
    equilibrium_branch,
    nonlinear_mode,
)
from fecontact.output.files.hdf5 import read_basis, write_basis
from fecontact.reduction import LargeDeflections
from fecontact.reduction.large_deflections.fit import CondensedBody
from fecontact.reduction.large_deflections.modal_forces import (
    large_deflection_forces,
    static_response,
)
from fecontact.system.polynomial_forces import polynomial_energy, polynomial_stiffness_at

E, L, H, B = 2e11, 1.0, 0.004, 0.01
STEEL = Material(E, 0.0, 7800.0)
RADIUS = H / np.sqrt(12.0)  # of gyration


def beam(ends, columns=30):
    """A beam whose ends are clamped or hinged in the middle of their height, or a cantilever."""
    mesh = rectangle(L, H, columns, 2, points={
        "first": (0.0, 0.5 * H), "last": (L, 0.5 * H), "middle": (0.5 * L, 0.5 * H)})
    fixed = {"clamped": {"left": "xy", "right": "xy"}, "hinged": {"first": "xy", "last": "xy"},
             "sliding": {"first": "xy", "last": "y"}, "cantilever": {"left": "xy"}}[ends]
    return ElasticBody(mesh, STEEL, thickness=B, fixed=fixed)


@cache
def bent(ends, largest, modes=1, count=1, **options):
    """Basis with large deflections."""
    return modal_basis(beam(ends), count, contact=(), points={"middle": "middle", "last": "last"},
                       large_deflections=LargeDeflections(largest, modes), **options)


def backbone(system, largest, observe, at, harmonics=4):
    """Frequencies at amplitudes, relative to the lowest one."""
    mode = nonlinear_mode(system, (1e-3 * largest, largest), 1, observe=observe,
                          method=HarmonicBalance(harmonics, stability=None))
    assert (np.diff(mode.amplitude) > 0.0).all()
    return np.interp(at, mode.amplitude, mode.frequency_hz) / mode.frequency_hz[0]


@pytest.mark.parametrize(("d", "m"), [(1, 3), (2, 5), (3, 8)])
def test_forces_have_the_potential(d, m):
    """V_3 + V_4 - sum w^2 y y^ + sum w^2 y^2 / 2; forces and their Jacobian by differences."""
    rng = np.random.default_rng(1)

    def symmetric(indices):
        given = rng.normal(size=(d,) * indices)
        return sum(np.transpose(given, order) for order in permutations(range(indices)))

    A, C = symmetric(3), symmetric(4)
    modes, w = np.arange(d), rng.uniform(1.0, 50.0, m)
    R = rng.normal(size=(m, d, d))
    R = R + np.swapaxes(R, 1, 2)
    ranges = np.outer(rng.uniform(0.5, 2.0, d), [-1.0, 1.5])
    fitted = CondensedBody(modes, A, C, np.zeros((1, d, d)), np.zeros((0, d), int),
                           np.zeros((1, 4, 0)), ranges, 0.0, 0.0, 0.0, 0.0, 0.0, 1)
    R = static_response(fitted, R, w)
    assert not R[modes].any()
    forces = large_deflection_forces(fitted, R, w, 1.0)

    def potential(x):
        q = x[modes]
        y = 0.5 * np.einsum("kij,i,j->k", R, q, q)
        return (np.einsum("ijk,i,j,k", A, q, q, q) / 3.0
                + np.einsum("ijkl,i,j,k,l", C, q, q, q, q) / 4.0
                + (w**2 * (0.5 * y**2 - x * y)).sum())

    # In other coordinates, as links make them, no combination is a coordinate.
    linear = fc.ModalBasis(w, np.zeros((m, m)), np.ones((2, 3, m)), np.zeros((2, 2)), np.zeros(0))
    turn = np.linalg.qr(rng.normal(size=(m, m)))[0]
    for way in (np.eye(m), turn):
        basis = replace(linear, large_deflections=(forces.in_modes(way),))
        system = ContactSystem(basis)
        x, h = rng.normal(size=m), 1e-6
        assert polynomial_energy(x, system.arrays) == pytest.approx(potential(way @ x), rel=1e-12)
        slope = [(potential(way @ (x + h * v)) - potential(way @ (x - h * v))) / (2.0 * h)
                 for v in np.eye(m)]
        found = -system.rhs(0.0, np.append(x, 0.0 * x))[m:] - basis.stiffness_matrix @ x
        assert found == pytest.approx(slope, abs=1e-7 * np.abs(slope).max())
        steps = [[system.rhs(0.0, np.append(x + sign * h * v, 0.0 * x))[m:] for sign in (1.0, -1.0)]
                 for v in np.eye(m)]
        exact = np.array([(ahead - behind) / (2.0 * h) for ahead, behind in steps]).T
        J = system.jacobian(0.0, np.append(x, 0.0 * x))[m:, :m]
        assert pytest.approx(exact, abs=1e-7 * np.abs(exact).max()) == J
        assert -polynomial_stiffness_at(x, system.arrays) - basis.stiffness_matrix == pytest.approx(
            J, abs=1e-12 * np.abs(J).max())


@pytest.mark.parametrize(("ends", "modes", "exact"), [
    ("hinged", 1, 1.317776), ("clamped", 1, 1.085671), ("clamped", (0, 2), 1.085671)])
def test_beams_with_immovable_ends(ends, modes, exact):
    """x'' + x + c (a x)^3 = 0, c = 1/4 or 0.0599411, at a = 2 radii of gyration."""
    basis = bent(ends, 0.6 * H, modes, 1 if modes == 1 else 3)
    forces = basis.large_deflections[0]
    assert forces.force_error < 1e-3
    found = backbone(ContactSystem(basis), 2.1 * RADIUS, ("middle", "y"), [2.0 * RADIUS])
    assert found == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("stiffness", [0.0, 0.5, 9.0])
def test_a_spring_holds_the_end_of_a_beam(stiffness):
    """k in series with E A / L at a sliding end: c = k / (k + E A / L) / 4, by the map at B."""
    axial = E * B * H / L
    basis = bent("sliding", 0.7 * H, B="last", reduction="residual")
    system = ContactSystem(basis, drive=Drive(stiffness_x=stiffness * axial))
    a = 2.0
    found = backbone(system, a * RADIUS, ("middle", "y"), [a * RADIUS])[0]
    c = 0.25 * stiffness / (1.0 + stiffness)
    assert found == pytest.approx(duffing(c * a**2), rel=2e-3)


@pytest.mark.parametrize("part", [-0.5, 2.0])
def test_backbone_of_a_stressed_beam(part):
    """Between hinges with the tension N = part N_E: x'' + (1 + N / N_E) x + (a x)^3 / 4 = 0.

    Compressed by heat, or pulled, and then held in its hinges.
    """
    pull = part * np.pi**2 * E * H**2 / 12.0 / L**2
    held, slides = beam("hinged"), beam("sliding")
    if part < 0.0:
        held = ElasticBody(held.mesh, Material(E, 0.0, 7800.0, thermal_expansion=1e-5),
                           thickness=B, fixed=held.fixed)
        state = fc.static_solution(held, Load(), temperature=-pull / (E * 1e-5))
    else:
        state = fc.static_solution(slides, Load(boundaries=(
            BoundaryLoad("right", pressure=-pull),)))
    basis = modal_basis(held, 1, contact=(), points={"middle": "middle"}, prestress=state,
                        large_deflections=LargeDeflections(0.6 * H))
    linear = np.pi / 2.0 * np.sqrt(E / 7800.0) * RADIUS / L**2 * np.sqrt(1.0 + part)
    assert basis.frequencies_hz[0] == pytest.approx(linear, rel=2e-3)
    a = 2.0
    found = backbone(ContactSystem(basis), a * RADIUS, ("middle", "y"), [a * RADIUS])[0]
    c = 0.25 / (1.0 + part)
    assert found == pytest.approx(duffing(c * a**2), rel=3e-3)


def duffing(c):
    """Frequency ratio of x'' + x + c x^3 = 0 at the amplitude 1."""
    hard = 1.0 + c
    return np.pi / 2.0 * np.sqrt(hard) / ellipk(c / 2.0 / hard)


def backbone_coefficient(free):
    """Curvature of the backbone of an inextensible cantilever, or a free beam, by Galerkin.

    With the first mode, T = (m + b q^2) q'^2 / 2 and V = k q^2 / 2 + k_4 q^4 / 2, with the axial
    motion u = -int w'^2 / 2 and the curvature w''^2 (1 + w'^2).
    """
    s, root = np.linspace(0.0, 1.0, 20001), 4.730040744862704 if free else 1.875104068711961
    end = -1.0 if free else 1.0
    part = (np.cosh(root) + end * np.cos(root)) / (np.sinh(root) + end * np.sin(root))

    def shape(sign):
        return (np.cosh(root * s) - sign * np.cos(root * s)
                - part * (np.sinh(root * s) - sign * np.sin(root * s)))

    w = shape(end)
    curvature, w = root**2 * shape(-end) / w[-1], w / w[-1]
    slope = np.gradient(w, s, edge_order=2)
    mass, stiff = np.trapezoid(w**2, s), np.trapezoid(curvature**2, s)
    quartic = np.trapezoid((curvature * slope) ** 2, s)
    inwards = cumulative_trapezoid(slope**2, s, initial=0.0)
    if free:
        inwards -= np.trapezoid(inwards, s)
    inertia = np.trapezoid(inwards**2, s)
    # Harmonic balance of (m + b q^2) q'' + b q q'^2 + k q + 2 k_4 q^3 = 0.
    return 0.5 * (1.5 * quartic / stiff - 0.5 * inertia / mass)


def test_inertia_of_a_cantilever():
    """Inertia of the axial motion takes nearly all of the hardening: w / w_0 = 1 + 0.019 (a / L)^2.

    Without it the factor would be 0.58.
    """
    exact = backbone_coefficient(free=False)
    assert exact == pytest.approx(0.0194, abs=1e-4)
    body = ElasticBody(rectangle(L, 0.01 * L, 40, 1, points={"last": (L, 0.0)}), STEEL,
                       fixed={"left": "xy"})
    basis = modal_basis(body, 1, contact=(), points={"last": "last"},
                        large_deflections=LargeDeflections(0.06 * L))
    a = 0.05 * L
    found = backbone(ContactSystem(basis), a, ("last", "y"), [a])[0]
    assert (found - 1.0) / a**2 == pytest.approx(exact, abs=3e-3)


def test_a_free_beam_softens():
    """w / w_0 = 1 - 3.80 (a / L)^2 with the deflection a of its ends; 3.85 without inertia."""
    exact = backbone_coefficient(free=True)
    body = ElasticBody(rectangle(L, 0.01 * L, 40, 1, points={"last": (L, 0.0)}), STEEL)
    basis = modal_basis(body, 4, contact=(), points={"last": "last"},
                        large_deflections=LargeDeflections(0.03 * L))
    assert (basis.large_deflections[0].coordinates.argmax(axis=1) == 3).all()
    assert basis.rigid_modes == 3
    a = 0.02 * L
    found = backbone(ContactSystem(basis), a, ("last", "y"), [a])[0]
    assert (found - 1.0) / a**2 == pytest.approx(exact, rel=0.02)
    with pytest.raises(InputError, match="mode 0 is a rigid motion; name modes from 3"):
        modal_basis(body, 4, contact=(), large_deflections=LargeDeflections(0.03 * L, (0, 3)))


def test_statics_of_the_reduced_and_the_whole_body():
    """A clamped beam under uniform pressure up to a deflection of 1.5 thicknesses."""
    basis = bent("clamped", 2.5 * H, (0, 2), 3, reduction="residual", loads=("top",))
    assert basis.large_deflections[0].displacement_error < 0.02
    load = Load(boundaries=(BoundaryLoad("top", pressure=9e3),))
    whole = deflection_path(beam("clamped"), load, steps=DeflectionSteps(first=0.5))
    rest = equilibrium(ContactSystem(basis, load=load))
    found = basis.point_row("middle", "y") @ rest.modal_coordinates
    exact = whole.displacement("middle")[-1, 1]
    assert exact < -1.4 * H
    assert found == pytest.approx(exact, rel=0.02)
    assert rest.stable


@pytest.mark.slow
def test_modes_are_chosen_by_accuracy():
    """The third mode of a clamped beam follows the first one; antisymmetric modes do not."""
    def made(count, accuracy):
        return modal_basis(beam("clamped"), count, contact=(), large_deflections=LargeDeflections(
            2.5 * H, accuracy=accuracy)).large_deflections[0]

    loose, tight = made(4, 0.25), made(4, 0.05)
    assert len(loose.ranges) == 1
    assert 0.01 < loose.displacement_error < 0.06
    assert 0.05 < loose.other_load_error < 0.25
    assert (tight.coordinates.argmax(axis=1) == [0, 2]).all()
    assert max(tight.force_error, tight.displacement_error) < 0.01
    assert tight.other_load_error < 0.05
    with pytest.raises(AnalysisError, match=r"with the modes 0, 1 .* above accuracy = 0.01"):
        made(2, 0.01)


@pytest.mark.slow
def test_errors_under_loads_of_another_shape():
    """A force in the middle of a clamped beam, which is not the inertia of its first mode.

    With one mode, in which tension does not stiffen the rest of the deflection, the displacement
    is off by as much as the error of the trials says; errors in the fitted states are far smaller.
    """
    load = Load(forces=(PointLoad("middle", "y", signal=-80.0),))
    exact = deflection_path(beam("clamped"), load).displacement("middle")[-1, 1]
    assert exact < -2.0 * H
    errors, told = [], []
    for modes in (1, (0, 2)):
        basis = bent("clamped", 2.0 * H, modes, 4, reduction="residual", tolerance=0.0,
                     loads=("middle",))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ModelWarning)  # a little beyond the fitted range
            rest = equilibrium(ContactSystem(basis, load=load))
        found = basis.point_row("middle", "y") @ rest.modal_coordinates
        errors.append(abs(found - exact) / (2.0 * H))
        told.append(basis.large_deflections[0])
    assert 0.5 * told[0].other_load_error < errors[0] < 2.0 * told[0].other_load_error
    assert told[0].displacement_error < 0.4 * told[0].other_load_error
    assert errors[1] < told[1].other_load_error < 0.05


def test_another_load_works_on_the_quadratic_displacement():
    """In a curved cantilever, where it moves along the load; without that the error is 2.3 %."""
    mesh = rectangle(L, 0.01 * L, 30, 1, warp=lambda at: at + np.column_stack(
        [0.0 * at[:, 0], 0.1 * at[:, 0] ** 2]))
    basis = modal_basis(ElasticBody(mesh, STEEL, fixed={"left": "xy"}), 2, contact=(),
                        large_deflections=LargeDeflections(0.1 * L))
    assert basis.large_deflections[0].other_load_error < 0.015


def test_the_potential_ends_with_the_fourth_degree():
    """Error of a cantilever's forces, of the fifth degree, grows with the fourth power.

    Relative to the load; twice the range has sixteen times the error.
    """
    sizes = np.array([0.07, 0.14]) * L
    body = ElasticBody(rectangle(L, 0.01 * L, 24, 1), STEEL, fixed={"left": "xy"})
    errors = [modal_basis(body, 1, contact=(), large_deflections=LargeDeflections(
        size)).large_deflections[0].force_error for size in sizes]
    assert np.log2(errors[1] / errors[0]) == pytest.approx(4.0, abs=0.6)


def test_end_of_a_cantilever_follows_its_arc():
    """P L^2 / EI = 1: the end comes down by 0.30172 L and in by 0.05643 L (Mattiasson 1981)."""
    h = 0.01
    body = ElasticBody(rectangle(L, h, 40, 1, points={"last": (L, 0.0)}), STEEL,
                       fixed={"left": "xy"}, thickness=B)
    basis = modal_basis(body, 3, contact=(), points={"last": (L, 0.5 * h)}, reduction="residual",
                        loads=["right"], large_deflections=LargeDeflections(0.35 * L, 2))
    force = E * B * h**3 / 12.0 / L**2
    rest = equilibrium(ContactSystem(basis, load=Load(boundaries=(
        BoundaryLoad("right", shear=force / (h * B)),))))
    x, y = (basis.point_row("last", axis) @ rest.modal_coordinates for axis in "xy")
    assert [-x, y] == pytest.approx([0.05643, 0.30172], rel=0.015)


def test_run_keeps_its_energy_and_watches_its_range():
    """Free vibration of the reduced beam: energy to the tolerance; too far, it says so."""
    basis = bent("hinged", H)
    system = ContactSystem(basis)
    start = np.zeros(system.size)
    start[0] = 0.8 * basis.large_deflections[0].ranges[0, 1]
    run = simulate(system, 2.0 / basis.frequencies_hz[0], initial=start, outputs=101)
    total = run.energies.kinetic + run.energies.elastic
    assert total == pytest.approx(np.full(len(total), total[0]), rel=1e-2)
    with pytest.warns(ModelWarning, match="times the range in which its forces were fitted"):
        simulate(system, 0.5 / basis.frequencies_hz[0], initial=1.5 * start)


@cache
def arch(a, h=0.01):
    """Half of a shallow sinusoidal arch between hinges, whose rise is a radii of gyration."""
    radius = h / np.sqrt(12.0)

    def warp(at):
        return at + np.column_stack([0.0 * at[:, 0], a * radius * np.sin(np.pi * at[:, 0] / L)])

    mesh = grid(np.linspace(0.0, 0.5 * L, 17), np.linspace(-0.5 * h, 0.5 * h, 3), warp=warp,
                points={"end": (0.0, 0.0)})
    body = ElasticBody(mesh, STEEL, fixed={"end": "xy", "right": "x"}, thickness=B)
    return modal_basis(body, 1, contact=(), points={"middle": "right"}, damping=0.2,
                       large_deflections=LargeDeflections(2.4 * a * radius)), radius


def test_snap_through_of_a_reduced_arch():
    """Limit loads of Fung and Kaplan (NACA TN 2840, 1952), along the branch of its rest states.

    p = (a - b) + b (a^2 - b^2) / 4 in units of EI r (pi / L)^4 at b^2 = (a^2 - 4) / 3; uniform
    gravity has the sinusoidal part 4 / pi.
    """
    a, h = 5.0, 0.01
    basis, radius = arch(a)
    unit = E * B * h**3 / 12.0 * radius * (np.pi / L)**4
    per_gravity = 4.0 / np.pi * 7800.0 * B * h / unit
    system = ContactSystem(basis, load=Load(gravity=(0.0, -1.0)))
    field = contact_field(system, {"g": (0.0, lambda given, value: given.with_(
        load=Load(gravity=(0.0, -value / per_gravity))))})
    turning = np.sqrt((a**2 - 4.0) / 3.0)
    limits = [(a - b) + b * (a**2 - b**2) / 4.0 for b in (turning, -turning)]
    branch = equilibrium_branch(field, np.zeros(system.size), "g", bounds=(-8.0, 25.0))
    folds = branch.of_kind("fold")
    assert [one.parameter for one in folds] == pytest.approx(limits, rel=0.02)
    moved = [basis.point_row("middle", "y") @ one.values["state"][: basis.modes] / radius
             for one in folds]
    assert moved == pytest.approx([turning - a, -turning - a], rel=0.02)


def test_two_wells_of_a_shallow_arch():
    """With the rise a = 5 radii of gyration it rests at b = 5 and, beyond b = -1, at b = -4.

    Runs with damping end in the well in which they start.
    """
    a = 5.0
    basis, radius = arch(a)
    row = basis.point_row("middle", "y")
    # (a - b) + b (a^2 - b^2) / 4 = 0 has the roots b = a and b^2 + a b + 4 = 0.
    other = 0.5 * (-a - np.sqrt(a**2 - 16.0))
    slow = ContactSystem(basis)
    q = np.zeros(slow.size)
    q[0] = (other - a) * radius / row[0]
    run = simulate(slow, 40.0 / basis.frequencies_hz[0], initial=1.05 * q)
    assert row @ run.states[-1, : basis.modes] == pytest.approx((other - a) * radius, rel=0.02)
    run = simulate(slow, 40.0 / basis.frequencies_hz[0], initial=0.1 * q)
    assert row @ run.states[-1, : basis.modes] == pytest.approx(0.0, abs=0.01 * a * radius)
    assert basis.large_deflections[0].force_error < 0.1


@pytest.mark.slow
def test_clamped_plate_under_pressure():
    """Levy (NACA TN 847, 1942): p a^4 / (E h^4) = 63.4 and 184 give 0.695 and 1.323 h.

    The whole body, by :func:`deflection_path`, comes to 0.692 and 1.305 with 10 x 10 cells, the
    reduced one of one mode to a percent less.
    """
    a, h, nu = 1.0, 0.016, 0.316
    x = 0.5 * a * np.linspace(0.0, 1.0, 6) ** 1.8  # finer at the clamped edges
    mesh = fc.Mesh.grid(x, x, [0.0, h])
    body = ElasticBody(mesh, Material(E, nu, 7800.0), fixed={
        "left": "xyz", "front": "xyz", "right": "x", "back": "y"})
    basis = modal_basis(body, 4, contact=(), points={"middle": (0.5 * a, 0.5 * a, 0.5 * h)},
                        reduction="residual", loads=["top"],
                        large_deflections=LargeDeflections(1.7 * h))
    for pressure, deflection, error in ((63.4, 0.695, 0.02), (184.0, 1.323, 0.03)):
        load = Load(boundaries=(BoundaryLoad("top", pressure=pressure * E * (h / a) ** 4),))
        rest = equilibrium(ContactSystem(basis, load=load))
        found = -basis.point_row("middle", "z") @ rest.modal_coordinates / h
        assert found == pytest.approx(deflection, rel=error)


def test_basis_is_stored_and_assembled(tmp_path):
    basis = bent("hinged", 0.5 * H)
    write_basis(tmp_path / "basis.h5", basis)
    again = read_basis(tmp_path / "basis.h5")
    for name, value in vars(basis.large_deflections[0]).items():
        assert np.array_equal(getattr(again.large_deflections[0], name), value)
    assert (again.T == basis.T).all()
    both = ContactSystem(bodies={"one": basis, "two": bent("clamped", 0.5 * H)}, interfaces=())
    state = np.zeros(both.size)
    state[: both.basis.modes] = np.arange(both.basis.modes) * 1e-3
    alone = ContactSystem(basis)
    part = np.zeros(alone.size)
    part[: basis.modes] = state[: basis.modes]
    m = both.basis.modes
    assert both.rhs(0.0, state)[m : m + basis.modes] == pytest.approx(
        alone.rhs(0.0, part)[basis.modes :], rel=1e-9)
    assert "modes with large deflections" in str(basis)


def test_limits_are_said():
    body = beam("hinged", 8)
    given = LargeDeflections(0.5 * H)
    for options, told in (({"reduction": "craig-bampton"}, "vibration modes"),
                          ({"rotation": fc.fem.Rotation(1.0, frame="standing")},
                           "in the rotating frame only"),
                          ({"temperature": 1.0, "reduction": "residual"}, "as prestress")):
        with pytest.raises(InputError, match=told):
            modal_basis(body, 2, contact=(), large_deflections=given, **options)
    with pytest.raises(InputError, match="mode 3 is not among the 2 modes"):
        modal_basis(body, 2, contact=(), large_deflections=LargeDeflections(H, (3,)))
    for accuracy in (0.0, -1.0, 1.0, float("nan")):
        with pytest.raises(InputError, match="accuracy"):
            LargeDeflections(H, accuracy=accuracy)
    for modes in (0, 11, (1, 1), (-1,), "a"):
        with pytest.raises(InputError, match="modes = "):
            LargeDeflections(H, modes)
    basis = modal_basis(body, 2, contact=(), points={"middle": "middle"}, large_deflections=given)
    with pytest.raises(InputError, match="would leave out coordinates"):
        basis.select([0, 1])
    for harmonics in (5, [1, 3, 5], [0, 2, 3, 4, 5]):
        with pytest.raises(InputError, match="large deflections"):
            nonlinear_mode(ContactSystem(basis), (1e-5, 1e-4), observe=("middle", "y"),
                           method=HarmonicBalance(harmonics))
