"""One sector of a wheel with friction between sectors against the whole ring, by engine order."""

import numpy as np
import pytest
from systems import TURN

from fecontact import ContactSystem, InputError, Interface, Load, PointLoad, basis_from_matrices
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    Repeats,
    contact_field,
    frequency_response,
    orbit_branch,
)
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce
from fecontact.reduction import PointPairing, PolynomialSpring, Spring

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


def sector(elastic=False):
    return ContactSystem(
        bodies={name: mass() for name in ("before", "own", "after")},
        interfaces=[damper("before", "own"), damper("own", "after")],
        links={"a": spring("before", "own"), "b": spring("own", "after")} if elastic else {},
        load=Load(forces=(force("own", 0.0),)))


def repeats(order):
    return Repeats("own", {"before": -order / N, "after": order / N})


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


def test_one_harmonic_of_the_ring_has_its_published_amplitude():
    """6.711291 for order 6 at W = 1.10, from one sector of 24."""
    _, found = response(sector(), (1.1, 1.2), "own", 1, 4096, repeats=repeats(6),
                        sampling_tolerance=1e-3)
    assert found.amplitude()[0] == pytest.approx(6.711291, rel=2e-6)


@pytest.mark.parametrize(("order", "elastic"), [
    (3, False), (6, False), (12, False), (20, False), (4, True)])
def test_one_sector_is_the_whole_ring(order, elastic):
    """To 1e-9, all harmonics of all sectors; order 20 folds back to 4 waves that run backwards."""
    samples = 144
    field, one = response(sector(elastic), (1.1, 1.2), "own", [1, 3], samples,
                          repeats=repeats(order))
    whole, all_of_them = response(ring(order, elastic), (1.1, 1.2), "m0", [1, 3], samples)
    u, v = one.branches[0].points[0].u[:-1], all_of_them.branches[0].points[0].u[:-1]
    X, Y = u.reshape(7, 3), v.reshape(7, N)
    size = np.abs(Y).max()
    assert X[:, 1] == pytest.approx(Y[:, 0], abs=1e-9 * size)
    assert X[:, 2] == pytest.approx(Y[:, 1], abs=1e-9 * size)
    assert X[:, 0] == pytest.approx(Y[:, -1], abs=1e-9 * size)
    assert field.dimension < 12 < whole.dimension


def test_folded_orders_agree():
    """Order 20 of 24 sectors is order 4 with waves that run the other way."""
    first, second = (response(sector(), (1.1, 1.2), "own", [1, 3], 144, repeats=repeats(order))[1]
                     for order in (4, 20))
    assert first.amplitude()[0] == pytest.approx(second.amplitude()[0], rel=1e-9)


def test_branch_of_a_sector_goes_on_from_its_points():
    field, found = response(sector(), (0.9, 1.4), "own", [1, 3], 144, points=120,
                            repeats=repeats(6))
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
    assert str(again.attributes["repeats_of"]) == "own"


def test_bad_repeats_are_refused():
    for arguments in (("own", {}), ("own", {"own": 0.1})):
        with pytest.raises(InputError, match="at least one body other than 'own'"):
            Repeats(*arguments)
    with pytest.raises(InputError, match=r"shifts of 'after': .* nan"):
        Repeats("own", {"after": np.nan})
    with pytest.raises(InputError, match="give stability = None"):
        HarmonicBalance(3, repeats=repeats(6))
    bodies = {name: mass() for name in ("before", "own", "after")}
    joined = ContactSystem(
        bodies=bodies, interfaces=[damper("before", "own")], load=Load(forces=(force("own", 0.0),)),
        links=[Spring("own.P", "after.P", direction=(1, 0), stiffness=0.05)])
    with pytest.raises(InputError, match=r"links have made common modes.*PolynomialSpring"):
        response(joined, (1.1, 1.2), "own", 1, 64, repeats=repeats(6))
    with pytest.raises(InputError, match=r"no body 'afte' \(did you mean 'after'"):
        response(sector(), (1.1, 1.2), "own", 1, 64, repeats=Repeats("own", {"afte": 0.1}))
