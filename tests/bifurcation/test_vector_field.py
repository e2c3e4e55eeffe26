"""Vector fields: derivatives against closed forms and against each other."""

import math
import pickle
from copy import deepcopy
from dataclasses import replace

import numba
import numpy as np
import pytest
from systems import (
    TURN,
    belt,
    friction_slope,
    lorenz,
    lorenz_field,
    two_mass_system,
    with_damping,
    with_force,
)

from fecontact import (
    AnalysisError,
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    ModalBasis,
    PointLoad,
)
from fecontact.bifurcation import (
    contact_field,
    equilibrium_branch,
    find_equilibrium,
    stability_map,
    vector_field,
)
from fecontact.laws import (
    ExponentialFriction,
    Harmonic,
    LuGreFriction,
    MeasuredProfile,
    RoughSurface,
    Sine,
)

PLACES = np.random.default_rng(4).normal(size=(7, 3)) * 5.0
TIMES = np.zeros(7)


def lorenz_jacobian(t, x, p, out):
    out[0, 0], out[0, 1], out[0, 2] = -p[1], p[1], 0.0
    out[1, 0], out[1, 1], out[1, 2] = p[0] - x[2], -1.0, -x[0]
    out[2, 0], out[2, 1], out[2, 2] = x[1], x[0], -p[2]


def expected_lorenz(x, rho=2.0, sigma=10.0, b=8.0 / 3.0):
    J = np.empty((len(x), 3, 3))
    for place, out in zip(x, J, strict=True):
        lorenz_jacobian(0.0, place, (rho, sigma, b), out)
    P = np.zeros((len(x), 3, 2))
    P[:, 1, 0], P[:, 2, 1] = x[:, 0], -x[:, 2]
    return J, P


@pytest.mark.parametrize(("options", "way", "tolerance"), [
    ({}, "complex", 1e-14),
    ({"differentiation": "differences"}, "differences", 1e-10),
    ({"jacobian": lorenz_jacobian}, "complex", 1e-14),
])
def test_derivatives_of_a_function(options, way, tolerance):
    field = lorenz_field(**options)
    assert field.differentiation == way
    f, J, P = field.derivatives(TIMES, PLACES, field.values, (0, 2))
    expected_J, expected_P = expected_lorenz(PLACES)
    assert np.abs(J - expected_J).max() < tolerance * 20.0
    assert np.abs(P - expected_P).max() < tolerance * 20.0
    assert (f == field.rates(TIMES, PLACES, field.values)).all()
    out = np.empty(3)
    lorenz(0.0, PLACES[2], field.values, out)
    assert f[2] == pytest.approx(out, rel=1e-14)
    assert all(array.flags.c_contiguous for array in (f, J, P))


def rest(t, x, p, out):
    out[0] = math.exp(-p[0] * abs(x[0])) * math.atan(p[1] * x[0])


@numba.njit
def magnitude(x):
    return np.abs(x)


def rest_inside(t, x, p, out):
    out[0] = np.exp(-p[0] * magnitude(x[0])) * np.arctan(p[1] * x[0])


@pytest.mark.parametrize("function", [rest, rest_inside])
def test_what_is_not_analytic_is_differenced(function):
    """The complex step would lose the derivative of |x|."""
    field = vector_field(function, {"b": 2.0, "k": 3.0}, 1)
    assert field.differentiation == "differences"
    x = np.array([[0.4], [-0.7]])
    _, J, _ = field.derivatives(np.zeros(2), x, field.values)
    exact = np.exp(-2.0 * np.abs(x)) * (-2.0 * np.sign(x) * np.arctan(3.0 * x)
                                        + 3.0 / (1.0 + 9.0 * x * x))
    assert J[:, :, 0] == pytest.approx(exact, rel=1e-9)
    with pytest.raises(InputError, match=r"complex step|complex numbers"):
        vector_field(function, {"b": 2.0, "k": 3.0}, 1, differentiation="complex")


def test_kind_errors_of_functions():
    with pytest.raises(InputError, match=r"no parameter 'roh' \(did you mean 'rho'\?\).*'sigma'"):
        lorenz_field().values_with(roh=3.0)
    with pytest.raises(InputError, match="must be one of 'automatic', 'complex'"):
        lorenz_field(differentiation="exact")
    with pytest.raises(InputError, match="3 numbers above zero"):
        lorenz_field(scales=[1.0, 2.0])

    def unusable(t, x, p, out):
        out[0] = x.no_such_thing

    with pytest.raises(InputError, match=r"not one of the form f\(t, x, p, out\)"):
        vector_field(unusable, {}, 1)
    with pytest.raises(InputError, match="period = None must be a finite number above zero"):
        vector_field(forced, {"force": 1.0}, 1, period=lambda parameters: None)


TABLE = np.array([1.0, 2.0])


def from_table(t, x, p, out):
    out[0] = TABLE[int(7.0 + x[0])] if x[0] > 0.5 else 0.0


def test_tables_may_end_before_states_that_a_motion_does_not_reach():
    field = vector_field(from_table, {}, 1, differentiation="differences")
    assert field.rates(np.zeros(1), np.zeros((1, 1)), field.values) == 0.0


@pytest.mark.parametrize(("parameters", "states", "numbers"), [
    ({"force": 1.0}, 1, "states: 1, parameters: 1"), ({"a": 1.0, "b": 1.0}, 2, "states: 2, par")])
def test_functions_stay_within_their_arrays(parameters, states, numbers):
    """Compiled code does not check indices."""
    def beyond(t, x, p, out):
        out[0] = p[1] * x[0]
        out[1] = x[2] if states == 2 else 0.0

    with pytest.raises(InputError, match=f"beyond its arrays .* which hold {numbers}"):
        vector_field(beyond, parameters, states)

    def rows_beyond(t, x, p, out):
        out[states, 0] = 1.0

    with pytest.raises(InputError, match=r"the jacobian rows_beyond uses an entry beyond"):
        vector_field(forced, {"force": 1.0}, 1, jacobian=rows_beyond)


def test_functions_fill_all_rates():
    def forgets(t, x, p, out):
        out[0] = x[1]
        if x[0] > 0.0:
            out[1] = -x[0]

    with pytest.raises(InputError, match=r"the function forgets leaves out\[1\] as it is; fill"):
        vector_field(forgets, {}, 2)

    def adds(t, x, p, out):
        out[0] += x[0]

    with pytest.raises(InputError, match=r"the function adds leaves out\[0\] as it is"):
        vector_field(adds, {}, 1)

    def diagonal(t, x, p, out):
        out[0, 0] = out[1, 1] = -1.0

    def falls(t, x, p, out):
        out[:] = -x

    with pytest.raises(InputError, match=r"jacobian diagonal leaves out\[0, 1\] as it is; .* 4"):
        vector_field(falls, {}, 2, jacobian=diagonal)

    def without_number(t, x, p, out):
        out[0] = np.sqrt(x[0])
        out[1] = np.nan

    assert vector_field(without_number, {}, 2, differentiation="differences").dimension == 2


# Contact systems -----------------------------------------------------------------------------

def forced(t, x, p, out):
    out[0] = p[0] * np.cos(np.pi * t) - x[0]


def two_seconds(parameters):
    return 2.0


@pytest.mark.parametrize("period", [2.0, two_seconds])
def test_fields_of_importable_functions_are_pickled(period):
    field = vector_field(forced, {"a": 1.0}, 1, period=period)
    found = pickle.loads(pickle.dumps(field))
    assert found.forcing_period(found.values) == 2.0
    np.testing.assert_array_equal(found.rates(TIMES[:1], PLACES[:1, :1].copy(), found.values),
                                  field.rates(TIMES[:1], PLACES[:1, :1].copy(), field.values))


def test_fields_of_functions_within_functions_are_copied_but_not_pickled():
    def inner(t, x, p, out):
        out[0] = -x[0]

    for field in (vector_field(inner, {}, 1), vector_field(forced, {"a": 1.0}, 1,
                                                           period=lambda parameters: 2.0)):
        assert deepcopy(field).rates(np.zeros(1), np.zeros((1, 1)), field.values) is not None
        with pytest.raises(InputError, match=r"<locals>.* define it by def at the top level of a"):
            pickle.dumps(field)


def squared(system, a):
    return with_force(system, a * a)


def test_contact_system_and_its_parameters():
    system = two_mass_system(2.0)
    field = contact_field(system, {"B": (2.0, with_force), "D": (0.1, with_damping),
                                   "ground.speed": None})
    values = np.array([3.0, 0.15, 1.7])
    x = np.random.default_rng(1).normal(size=(50, 4))
    f, J, P = field.derivatives(np.zeros(50), x, values, (0, 1, 2))
    made = field.system(values)
    assert f == pytest.approx(np.array([made.rhs(0.0, y) for y in x]), abs=1e-13)
    assert pytest.approx(np.array([made.jacobian(0.0, y) for y in x]), abs=1e-12) == J
    # The mass-normalised equations, by hand.
    T = made.basis.contact_T[:, 0]
    v = x[:, 2:] @ T.T - 1.7
    size = np.abs(v)
    mu = 0.14 * (1.0 + 1.14 * np.exp(-2.0 * size)) * np.arctan(100.0 * v)
    assert P[:, 2:, 0] == pytest.approx(-mu @ T, abs=1e-11)
    assert P[:, 2:, 1] == pytest.approx(-x[:, 2:] @ made.basis.damping.T / 0.15, abs=1e-10)
    assert P[:, 2:, 2] == pytest.approx(3.0 * friction_slope(size) @ T, rel=1e-8, abs=1e-7)
    assert (P[:, :2] == 0.0).all()


@pytest.mark.parametrize("friction", [ExponentialFriction(0.8, 0.5, 3.0, 50.0),
                                      LuGreFriction(0.8, 0.55, 1e-3, 2.0, 1e5)])
def test_many_nodes_waves_memory_and_drive(friction):
    """Rates and Jacobian are those of the system, some nodes open and some closed."""
    rng = np.random.default_rng(3)
    T = rng.normal(size=(6, 3, 3))
    basis = ModalBasis(np.array([0.0, 2.0, 5.0]), 0.1 * np.eye(3), T,
                       rng.normal(size=(6, 2)), np.ones(4))
    system = ContactSystem(
        basis, normal=RoughSurface(10.0, 2.0, 0.5), friction=friction,
        ground=Ground(0.3, profile=Sine(0.3, 2.0), friction_variation=Sine(0.2, 1.0)),
        drive=Drive(2.0, 3.0, 0.1, 0.2, 0.4, 0.5, 1.3 / TURN), load=Load(2.0))
    field = contact_field(system, ["load.normal"])
    assert field.dimension == system.size == len(field.state_names)
    t, x = rng.normal(size=30), rng.normal(size=(30, system.size))
    f, J, _ = field.derivatives(t, x, field.values)
    forces = system.contact_history(t, x)[..., 0]
    assert 0.1 < np.mean(forces > 0.0) < 0.9
    expected = np.array([system.rhs(*at) for at in zip(t, x, strict=True)])
    assert np.abs(f - expected).max() < 1e-13 * np.abs(expected).max()
    assert np.abs(field.rates(t, x, field.values) - f).max() < 1e-13 * np.abs(f).max()
    expected = np.array([system.jacobian(*at) for at in zip(t, x, strict=True)])
    assert np.abs(J - expected).max() < 1e-13 * np.abs(expected).max()


def test_derivative_to_a_normal_force_that_begins_at_zero():
    """Friction at zero force is still zero, but grows with the force."""
    field = contact_field(two_mass_system(1.0), {"B": (1.0, with_force)})
    x = np.random.default_rng(1).normal(size=(20, 4))
    T = field.system().basis.contact_T[:, 0]
    v = x[:, 2:] @ T.T - 1.0
    mu = 0.14 * (1.0 + 1.14 * np.exp(-2.0 * np.abs(v))) * np.arctan(100.0 * v)
    for B in (0.0, 3.0):
        _, _, P = field.derivatives(np.zeros(20), x, np.array([B]), (0,))
        assert P[:, 2:, 0] == pytest.approx(-mu @ T, abs=1e-12)


def with_modes(system, size):
    basis = system.basis
    return system.with_(basis=replace(
        basis, T=size**2 * basis.T, angular_frequencies=size * basis.angular_frequencies))


def with_normals(system, stiffness):
    return system.with_(**{"normal.stiffness": (stiffness, *[1.3 * stiffness] * 3)})


@pytest.mark.parametrize(("law", "own"), [
    (ExponentialFriction(0.8, 0.5, 3.0, 50.0), ["friction.decay", "friction.static_coefficient"]),
    (LuGreFriction(0.8, 0.55, 1e-3, 2.0, 1e5),
     ["friction.bristle_stiffness", "friction.kinetic_coefficient"]),
])
def test_derivatives_to_parameters_of_everything(law, own):
    """Against extrapolated differences of the rates, in one parameter at a time and in pairs."""
    rng = np.random.default_rng(5)
    basis = ModalBasis(np.array([1.0, 2.0, 5.0]), 0.1 * np.eye(3), rng.normal(size=(6, 3, 3)),
                       rng.normal(size=(6, 2)), np.ones(4))
    system = ContactSystem(
        basis, normal=RoughSurface(10.0, 2.0, 0.5), friction=law,
        ground=Ground(0.3, profile=Sine(0.3, 2.0), friction_variation=Sine(0.2, 1.0)),
        drive=Drive(2.0, 3.0, 0.1, 0.2, 0.4, 0.5, 1.3 / TURN), load=Load(2.0))
    t, x = rng.normal(size=30), 0.5 * rng.normal(size=(30, system.size))
    named = ["load.normal", "ground.speed", "ground.profile.amplitude", "ground.profile.wavelength",
             "ground.friction_variation.amplitude", "drive.amplitude_x", "drive.damping_y",
             "drive.frequency_hz", "normal.roughness_height", *own]
    given = [*([name] for name in named), {"size": (1.0, with_modes)}, {"k": (9.0, with_normals)},
             [own[0], "ground.speed"]]
    for parameters in given:
        field = contact_field(system, parameters)
        values = 1.01 * field.values
        _, _, P = field.derivatives(t, x, values, range(len(values)))
        for index, value in enumerate(values):
            def slope(h, index=index, field=field, values=values):
                step = h * np.eye(len(values))[index]
                return (field.rates(t, x, values + step) - field.rates(t, x, values - step)) / (
                    2.0 * h)

            coarse, middle, fine = (slope(part * abs(value)) for part in (2e-3, 1e-3, 5e-4))
            first, second = (4.0 * middle - coarse) / 3.0, (4.0 * fine - middle) / 3.0
            expected = (16.0 * second - first) / 15.0
            # Differences fail where a node opens between them.
            smooth = (np.abs(second - first) <= 1e-6 * np.abs(expected) + 1e-6).all(axis=1)
            assert smooth.mean() > 0.8, parameters
            scale = np.abs(expected[smooth]).max()
            assert scale > 1e-3, parameters
            off = np.abs(P[smooth, :, index] - expected[smooth]).max()
            assert off < 1e-7 * scale, parameters


@pytest.mark.parametrize("parameters", [
    {"B": (2.0, with_force), "ground.speed": None},
    {"a": (1.4, squared), "ground.speed": None},
    ["friction.decay", "friction.smoothing_slope", "ground.speed"],
    ["friction.decay", "friction.smoothing_slope", "ground.speed", "friction.factor",
     "friction.excess"],
])
def test_arrays_are_those_of_the_system_itself(parameters):
    """Interpolated or not, near the base values and far from them."""
    field = contact_field(two_mass_system(2.0), parameters)
    x = np.random.default_rng(2).normal(size=(20, 4))
    for factor in (1.0, 1.02, 0.7, 3.0, 40.0, 0.05, 2.0):
        values = field.values * factor
        f = field.rates(np.zeros(20), x, values)
        made = field.system(values)
        expected = np.array([made.rhs(0.0, y) for y in x])
        assert np.abs(f - expected).max() < 1e-12 * np.abs(expected).max()


def test_only_what_is_affine_is_interpolated():
    assert contact_field(two_mass_system(), ["ground.speed"]).family.varying == {
        "ground_motion_parameters"}
    assert contact_field(two_mass_system(), {"a": (1.4, squared)}).family.varying is None


def test_values_out_of_range_are_refused_however_near_the_base():
    field = contact_field(two_mass_system(0.01), {"B": (0.01, with_force)})
    x = np.zeros((1, 4))
    field.rates(np.zeros(1), x, np.array([0.0]))
    with pytest.raises(InputError, match=r"force = .* must be zero or above"):
        field.rates(np.zeros(1), x, np.array([-1e-6]))


def in_millimetres(system, V):
    return system.with_(**{"ground.speed": 1e-3 * V})


def test_steps_are_small_beside_the_smoothing_of_friction():
    """Slip velocities within the width of the arctan, 1e-6 m/s, whatever the speed is called."""
    system = belt(speed=8e-3)
    x = np.zeros((21, 2))
    x[:, 1] = np.sqrt(5.632) * (8e-3 + np.linspace(-3e-6, 3e-6, 21))
    slip = x[:, 1] / np.sqrt(5.632) - 8e-3
    size, slope = np.abs(slip), 1e6
    mu = 0.25 * np.exp(-1000.0 * size) + 0.55
    rise = (2.0 / np.pi) * (mu * slope / (1.0 + (slope * slip) ** 2)
                            - 250.0 * np.exp(-1000.0 * size) * np.arctan(slope * size))
    for name, given, scale in (("ground.speed", None, 1.0), ("V", (8.0, in_millimetres), 1e-3)):
        field = contact_field(system, {name: given})
        _, _, P = field.derivatives(np.zeros(21), x, field.values, (0,))
        assert P[:, 1, 0] == pytest.approx(14.0 * rise * scale / np.sqrt(5.632), rel=1e-5)


@pytest.mark.parametrize(("parameters", "message"), [
    (["ground.sped"], r"no parameter 'ground.sped' \(did you mean 'ground.speed'"),
    (["normal.force"], "not one number; give a pair"),
    ({"B": (None, with_force)}, "its value None must be a number"),
    ({"B": with_force}, "must be a number, None .* or a pair"),
])
def test_kind_errors_of_contact_parameters(parameters, message):
    with pytest.raises(InputError, match=message):
        contact_field(two_mass_system(), parameters)


def test_rows_of_displacements():
    field = contact_field(two_mass_system(), [])
    T = field.system().basis.contact_T[:, 0]
    assert field.displacement_row(1) == pytest.approx([*T[1], 0.0, 0.0])
    with pytest.raises(InputError, match="must be one of 'phi', 'x', 'y'"):
        field.displacement_row(1, "z")


def test_forcing_periods():
    drive = Drive(stiffness_x=1.0, amplitude_x=1.0, frequency_hz=4.0 / TURN)
    system = belt().with_(drive=drive)
    assert contact_field(belt(), ["ground.speed"]).forcing_period(np.ones(1)) is None
    field = contact_field(system, ["drive.frequency_hz"])
    assert field.forcing_period(np.array([5.0 / TURN])) == pytest.approx(2.0 * np.pi / 5.0)
    both = system.with_(load=Load(forces=(PointLoad("B", "x", signal=Harmonic(1.0, 6.0 / TURN)),)))
    assert contact_field(both, []).forcing_period(np.empty(0)) == pytest.approx(np.pi)
    wavy = belt().with_(**{"ground.profile": Sine(1e-6, 6e-3)})
    assert contact_field(wavy, ["ground.speed"]).forcing_period(np.array([3e-3])) == 2.0
    odd = both.with_(**{"drive.frequency_hz": 4.0 * np.sqrt(2.0) / TURN})
    with pytest.raises(AnalysisError, match="no common multiple"):
        contact_field(odd, []).forcing_period(np.empty(0))
    trace = wavy.with_(**{
        "ground.profile": MeasuredProfile((0.0, 1.0, 2.0, 3.0), (0.0, 1.0, 0.5, 0.0))})
    with pytest.raises(AnalysisError, match=r"ground\.profile is not periodic"):
        contact_field(trace, []).forcing_period(np.empty(0))
    rough = trace.with_(ground=replace(trace.ground, friction_variation=Sine(0.1, 2.0),
                                       profile=replace(trace.ground.profile, periodic=True)))
    assert contact_field(rough, []).forcing_period(np.empty(0)) == pytest.approx(6.0 / 12e-3)


def test_a_contact_system_is_no_field_yet():
    system = two_mass_system()
    for task in (lambda: find_equilibrium(system),
                 lambda: equilibrium_branch(system, parameter="ground.speed"),
                 lambda: stability_map(system, {"ground.speed": [1.0], "normal.force": [1.0]})):
        with pytest.raises(InputError, match="needed, not a ContactSystem; make one"):
            task()
