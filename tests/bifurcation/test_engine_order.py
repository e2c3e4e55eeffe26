"""One sector of a wheel with friction between sectors against the whole ring, by engine order."""

import numpy as np
import pytest
from systems import TURN

from fecontact import ContactSystem, InputError, Interface, Load, PointLoad, basis_from_matrices
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    contact_field,
    frequency_response,
    orbit_branch,
    wheel_motion,
)
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce
from fecontact.plot import render_wheel
from fecontact.reduction import PointPairing, PolynomialSpring, Spring, cyclic_basis_from_bases

N = 24
ROW = np.array([[1.0], [0.0], [0.0]])


def mass():
    """Mass 1 on a spring 1 and a dashpot .02."""
    return basis_from_matrices([[1.0]], [[1.0]], {"P": ROW}, damping=[[0.02]])


def damper(first, second):
    """A Jenkins element of stiffness .2 and limit 1 between two masses."""
    return Interface(f"{first}-{second}", PointPairing(first, "P", second, "P"),
                     PrescribedForce(2.0), JenkinsFriction(0.2, 0.5))


def force(name, shift, w=1.1):
    """cos(w (t - shift T)) on a mass."""
    return PointLoad(f"{name}.P", "x", signal=Harmonic(1.0, w / TURN, 0.5 * np.pi - TURN * shift))


def spring(first, second):
    return PolynomialSpring(f"{first}.P", f"{second}.P", direction=(1, 0), stiffness=0.05)


def ring(order, elastic=False):
    names = [f"m{s}" for s in range(N)]
    return ContactSystem(
        bodies={name: mass() for name in names},
        interfaces=[damper(names[s], names[(s + 1) % N]) for s in range(N)],
        links={f"k{s}": spring(names[s], names[(s + 1) % N]) for s in range(N)} if elastic else {},
        load=Load(forces=tuple(force(name, order * s / N) for s, name in enumerate(names))))


def wheel(elastic=False, sectors=N):
    links = {"k": Spring("own.P", "next_own.P", direction=(1, 0), stiffness=0.05)}
    return cyclic_basis_from_bases({"own": mass()}, sectors, {"damper": PointPairing(
        "own", "P", "next_own", "P")}, links if elastic else {})


def sector(made):
    return ContactSystem(made.basis, normal=PrescribedForce(2.0),
                         friction=JenkinsFriction(0.2, 0.5), load=Load(forces=(force("own", 0.0),)))


def excited_at(system, w):
    """The system with all forces at an angular frequency."""
    return system.with_({f"load.forces.{number}.signal.frequency_hz": w / TURN
                         for number in range(len(system.load.forces))})


def response(system, bounds, seen, harmonics, samples, points=1, **options):
    field = contact_field(system, {"w": (bounds[0], excited_at)})
    found = frequency_response(
        field, bounds, "w", observe=(f"{seen}.P", "x"), options=ContinuationOptions(
            points=points, largest_step=0.1),
        method=HarmonicBalance(harmonics, samples, stability=None, **options))
    return field, found


def by_order(order, bounds, harmonics, samples, elastic=False, points=1, **options):
    """Field of the wave and response of one sector."""
    made = wheel(elastic)
    wave = EngineOrder(made, order)
    field, found = response(sector(made), bounds, "own", harmonics, samples, points, repeats=wave,
                            **options)
    return wave.field(field), found


def test_one_harmonic_of_the_ring_has_its_published_amplitude():
    """6.711291 for order 6 at W = 1.10, from one sector of 24."""
    _, found = by_order(6, (1.1, 1.2), 1, 4096, sampling_tolerance=1e-3)
    assert found.amplitude()[0] == pytest.approx(6.711291, rel=2e-6)


@pytest.mark.parametrize(("order", "elastic"), [
    (3, False), (6, False), (12, False), (20, False), (4, True)])
def test_one_sector_is_the_whole_ring(order, elastic):
    """To 1e-9, all harmonics of all sectors; order 20 folds back to 4 waves that run backwards."""
    field, one = by_order(order, (1.1, 1.2), [1, 3], 144, elastic)
    whole, all_of_them = response(ring(order, elastic), (1.1, 1.2), "m0", [1, 3], 144)
    motion = wheel_motion(field, one.branches[0].points[0])
    Y = all_of_them.branches[0].points[0].u[:-1].reshape(7, N)
    size = np.abs(Y).max()
    for h in (1, 3):
        waves = motion.amplitudes[h] * np.exp(-2j * np.pi * h * order * np.arange(N) / N)
        assert waves.real == pytest.approx(Y[2 * h - 1], abs=1e-9 * size)
        assert -waves.imag == pytest.approx(Y[2 * h], abs=1e-9 * size)
    assert field.dimension < 12 < whole.dimension


def test_folded_orders_agree():
    """Order 20 of 24 sectors is order 4 with waves that run the other way."""
    first, second = (by_order(order, (1.1, 1.2), [1, 3], 144)[1] for order in (4, 20))
    assert first.amplitude()[0] == pytest.approx(second.amplitude()[0], rel=1e-9)


def test_branch_of_a_sector_goes_on_from_its_points():
    field, found = by_order(6, (0.9, 1.4), [1, 3], 144, points=120)
    branch = found.branches[0]
    assert (np.diff(branch.parameter) > 0.0).all()
    assert found.peak_reached()
    point = branch.points[len(branch) // 2]
    again = orbit_branch(field, point, options=ContinuationOptions(points=2, step=0.01,
                                                                      bounds=(0.9, 1.4)))
    at = again.points[-1]
    near = np.interp(at.parameter, branch.parameter, found.amplitude())
    motion = at.orbit(field)
    row = field.displacement_row("own.P", "x")
    assert np.ptp(motion.states @ row) / 2.0 == pytest.approx(near, rel=5e-3)
    assert again.attributes["engine_order"] == 6


@pytest.mark.parametrize("linear", [True, False])
def test_springs_between_sectors(linear):
    """w_k^2 = 1 + 4 k sin^2(pi k / N), also as an interface with the law of the spring."""
    kind = Spring if linear else PolynomialSpring
    link = kind("own.P", "next_own.P", direction=(1, 0), stiffness=0.05)
    made = cyclic_basis_from_bases({"own": mass()}, N, {}, {"k": link})
    for one in made.diameters:
        row = one.T[2] if not linear else np.zeros((3, 1))
        K = one.stiffness + 0.05 * row.conj().T @ row
        exact = 1.0 + 0.2 * np.sin(np.pi * one.diameter / N) ** 2
        assert np.linalg.eigvalsh(K) == pytest.approx([exact], rel=1e-12)
    if not linear:
        hertz = np.sqrt(1.0 + 0.2 * np.sin(np.pi * 6 / N) ** 2) / TURN
        system = ContactSystem(made.basis, normal={"k": link.law},
                               load=Load(forces=(force("own", 0.0),)))
        found = frequency_response(
            system, (hertz, 1.1 * hertz), "load.forces.0.signal.frequency_hz",
            observe=("own.P", "x"), options=ContinuationOptions(points=1),
            method=HarmonicBalance(1, 24, stability=None, repeats=EngineOrder(made, 6)))
        assert found.amplitude()[0] == pytest.approx(1.0 / (0.02 * TURN * hertz), rel=1e-6)


def test_reduced_bodies_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="must not begin with 'next_'"):
        cyclic_basis_from_bases({"next_own": mass()}, N)
    with pytest.raises(InputError, match="'k' has a preload; give a PolynomialSpring"):
        cyclic_basis_from_bases({"own": mass()}, N, {}, {"k": Spring(
            "own.P", "next_own.P", direction=(1, 0), stiffness=0.05, preload=1.0)})
    with pytest.raises(InputError, match=r"no body 'next_ow' \(did you mean 'next_own'"):
        cyclic_basis_from_bases({"own": mass()}, N, {"damper": PointPairing(
            "own", "P", "next_ow", "P")})
    with pytest.raises(InputError, match="give stability = None"):
        HarmonicBalance(3, repeats=EngineOrder(wheel(), 6))
    field, found = by_order(6, (1.1, 1.2), [1, 3], 144)
    motion = wheel_motion(field, found.branches[0].points[0])
    with pytest.raises(InputError, match="one of reduced bodies, without meshes"):
        render_wheel(motion, "wheel.mp4")
