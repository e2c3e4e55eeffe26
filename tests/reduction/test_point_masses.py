"""Point masses against closed forms of chains, and initial states by points."""

import numpy as np
import pytest

from fecontact import ContactSystem, InputError, simulate
from fecontact.integrate import PointStart, initial_state
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import point_masses


def test_chain_of_equal_masses():
    """w_k = 2 sqrt(c / m) sin(k pi / (2 (n + 1))) between two walls."""
    n, m, c = 5, 0.3, 2e4
    names = [f"m{i}" for i in range(n)]
    springs = dict.fromkeys(zip(names, [*names[1:], None], strict=True), c)
    basis = point_masses(dict.fromkeys(names, m), {**springs, ("m0", None): c}, components="x")
    k = np.arange(1, n + 1)
    assert basis.angular_frequencies == pytest.approx(
        2.0 * np.sqrt(c / m) * np.sin(k * np.pi / (2.0 * (n + 1))), rel=1e-12)
    assert basis.extra == tuple(names)
    assert (basis.inertia_rows[0] ** 2).sum() == pytest.approx(n * m, rel=1e-12)
    assert not basis.inertia_rows[1].any()


def test_directions_and_dashpots_are_independent():
    basis = point_masses({"C": 2.0}, {("C", None): (200.0, 800.0)},
                         dashpots={("C", None): (1.0, 3.0)}, components="xy", contact="C")
    assert basis.angular_frequencies == pytest.approx([10.0, 20.0], rel=1e-14)
    assert np.diag(basis.damping) == pytest.approx([0.5, 1.5], rel=1e-14)
    assert basis.contact_nodes == 1
    assert (np.abs(basis.T[1]) == np.abs(basis.contact_T[0])).all()


def test_a_run_starts_with_the_motion_of_its_points():
    """Free vibration of two masses: the lower one is given, the upper one held by least mass."""
    basis = point_masses({"a": 1.0, "b": 2.0}, {("a", "b"): 1e3, ("b", None): 5e2}, contact="a")
    system = ContactSystem(basis, LinearContact(1e5), ConstantFriction(0.0), gap=1.0)
    start = PointStart({"a": (None, 1e-3)}, {"a": (None, 0.2), "b": (None, -0.1)})
    y = initial_state(system, start, 0.0)
    rows = np.array([basis.T[basis.point_index(name), 1] for name in "ab"])
    assert rows @ y[:2] == pytest.approx([1e-3, 0.0], abs=1e-17)
    assert rows @ y[2:] == pytest.approx([0.2, -0.1], rel=1e-13)
    run = simulate(system, 0.1, initial=start, rtol=1e-9, outputs=2)
    w, t = basis.angular_frequencies, 0.1
    assert run.states[-1, :2] == pytest.approx(
        y[:2] * np.cos(w * t) + y[2:] / w * np.sin(w * t), rel=1e-6)


def test_bad_masses_are_named():
    for message, arguments in (
        ("masses is empty", {"masses": {}}),
        ("mass of 'a' = -1", {"masses": {"a": -1.0}}),
        ("components = 'zx'", {"components": "zx"}),
        ("springs names the mass 'c'", {"springs": {("a", "c"): 1.0}}),
        ("between two masses", {"springs": {("a", "a"): 1.0}}),
        ("dashpots between", {"dashpots": {("a", None): -1.0}}),
        ("contact names the mass 'c'", {"contact": "c"}),
    ):
        with pytest.raises(InputError, match=message):
            point_masses(**{"masses": {"a": 1.0, "b": 1.0}, **arguments})
    system = ContactSystem(point_masses({"a": 1.0}, contact="a"), LinearContact(1.0))
    with pytest.raises(InputError, match="not a motion that the modes can make"):
        initial_state(system, PointStart({"a": (1.0, 0.0)}), 0.0)
    with pytest.raises(InputError, match="two, three or six finite numbers"):
        PointStart({"a": (1.0, np.nan)})
    with pytest.raises(InputError, match="no point 'c'"):
        initial_state(system, PointStart({"c": (1.0, 0.0)}), 0.0)
