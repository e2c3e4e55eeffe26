"""Fingerprints of folders of blocks: they distinguish other numbers to the last digit."""

import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from systems import TURN, friction_oscillator, impact_oscillator

from fecontact import ContactSystem, Drive, Ground, InputError, Load, basis_from_matrices, simulate
from fecontact.bifurcation import VectorField, poincare_scan, vector_field
from fecontact.bifurcation.attractors.fingerprint import fingerprint
from fecontact.integrate import Crossing, Radau, Rodas5P
from fecontact.laws import (
    ConstantFriction,
    Harmonic,
    ParabolicSurface,
    RoughSurface,
)

FREQUENCY = "drive.frequency_hz"


def test_the_fingerprint_sees_laws_and_functions(tmp_path):
    """Another stiffness, another law of equal numbers, another function of the same names."""
    def scan(rates, folder):
        field = vector_field(rates, {"c": 1.0}, states=("x", "v"), scales=[1.0, 1.0])
        return poincare_scan(field, "c", [1.0, 2.0], section=Crossing("x"), transient=10.0, keep=2,
                             initial=[1.0, 0.0], folder=folder)

    scan(swing, tmp_path / "field")
    scan(swing, tmp_path / "field")
    with pytest.raises(InputError, match="another system"):
        scan(stiffer, tmp_path / "field")
    base = impact_oscillator(1)
    numbers = (base.normal.stiffness, base.normal.roughness_height, base.normal.damping)
    short_scan(base, FREQUENCY, tmp_path / "laws")
    short_scan(base.with_(normal=RoughSurface(*numbers)), FREQUENCY, tmp_path / "laws")
    for other in (base.with_(**{"normal.stiffness": 1.01 * base.normal.stiffness}),
                  base.with_(normal=ParabolicSurface(*numbers))):
        with pytest.raises(InputError, match="another system"):
            short_scan(other, FREQUENCY, tmp_path / "laws")


def short_scan(system, parameter, folder, initial=(0.0, 0.0), **settings):
    return poincare_scan(system, parameter, np.array([60.0, 61.0, 62.0]) / TURN,
                         transient_periods=2, keep=1, initial=initial, folder=folder, **settings)


def straight(system, f):
    return system.with_(**{FREQUENCY: f})


def bent(system, f):
    return system.with_(**{FREQUENCY: f + 0.1 * (f - 60.0 / TURN) * (62.0 / TURN - f)})


def test_the_fingerprint_sees_functions_of_the_parameter_between_the_ends(tmp_path):
    base = impact_oscillator(1)
    first = short_scan(base, straight, tmp_path / "a")
    assert (short_scan(base, straight, tmp_path / "a").up == first.up).all()
    with pytest.raises(InputError, match="another system"):
        short_scan(base, bent, tmp_path / "a")
    other = short_scan(base, bent, tmp_path / "b")
    assert (other.up[0] == first.up[0]).all()
    assert (other.up[1] != first.up[1]).all()


def test_the_fingerprint_sees_starts_to_the_last_digit(tmp_path):
    """Two runs whose summaries read alike; a state in whatever form is the same."""
    base = impact_oscillator(1)
    one, other = (simulate(base, 0.1, initial=np.array([start, 0.0]))
                  for start in (1e-4, 1e-4 * (1.0 + 1e-10)))
    assert repr(one) == repr(other)
    assert (one.states[-1] != other.states[-1]).any()
    short_scan(base, FREQUENCY, tmp_path / "a", initial=one)
    for same_start in (one, one.states[-1], one.states[-1].tolist(), tuple(one.states[-1])):
        short_scan(base, FREQUENCY, tmp_path / "a", initial=same_start, rtol=np.float64(1e-5))
    with pytest.raises(InputError, match="another system"):
        short_scan(base, FREQUENCY, tmp_path / "a", initial=other)


LONG = np.linspace(0.0, 1.0, 5000)


@pytest.mark.parametrize(("one", "other", "alike"), [
    ([1.0], [np.float64(1.0)], True),
    ([3], [np.int64(3)], True),
    ([0.1], [0.1 + 2e-17], False),
    (["a", "bc"], ["ab", "c"], False),
    ([["a"], "b"], [["a", "b"]], False),
    ([LONG.reshape(2, -1)], [LONG.reshape(-1, 2)], False),
    ([[LONG]], [[np.where(LONG[2500] == LONG, 0.0, LONG)]], False),
    ([[LONG]], [[LONG.copy()]], True),
    ([None], [0], False),
    ([Rodas5P()], [Rodas5P()], True),
    ([Rodas5P()], [Radau()], False),
    ([Crossing("x", value=np.float64(2.0))], [Crossing("x", value=2.0)], True),
    ([Crossing("x")], [Crossing("x", value=1e-12)], False),
])
def test_fingerprints_of_settings(one, other, alike):
    assert (fingerprint([], *one) == fingerprint([], *other)) is alike


@pytest.mark.parametrize("changes", [
    {"ground": Ground(speed=2e-3)}, {"load": Load(14.1)}, {"gap": 1e-6},
    {"drive": Drive(stiffness_x=5610.0, motion_x=Harmonic(1e-4, 9.0))},
    {"friction": ConstantFriction(0.41)}, {"normal": RoughSurface(10e6, 10e-6)}])
def test_the_fingerprint_sees_all_parts_of_a_system(changes):
    base = friction_oscillator()
    assert fingerprint([base]) == fingerprint([friction_oscillator()])
    assert fingerprint([base]) != fingerprint([base.with_(**changes)])


def test_the_fingerprint_sees_the_body():
    one, other = (contact_of(mass) for mass in (1.0, 1.0 + 1e-12))
    assert fingerprint([one]) == fingerprint([contact_of(1.0)]) != fingerprint([other])


def contact_of(mass):
    """A mass on a ground; the laws, ground and loads are those of all masses."""
    body = basis_from_matrices(mass * np.eye(2), np.eye(2), {"contact": [np.eye(2)]})
    return ContactSystem(body, RoughSurface(10e6, 10e-6), ConstantFriction(0.4))


def test_the_fingerprint_sees_what_a_field_does_where_it_is_asked():
    one, other = (vector_field(rates, {"c": 1.0}, states=("x", "v")) for rates in (swing, stiffer))
    assert fingerprint([one]) == fingerprint([vector_field(swing, {"c": 1.0}, states=("x", "v"))])
    assert len({fingerprint([field]) for field in (
        one, other, vector_field(swing, {"c": 1.0}, states=("x", "v"), period=2.0),
        vector_field(swing, {"c": 1.1}, states=("x", "v")))}) == 4


class Called(VectorField):
    """A field of Python that asks an object for its rates."""

    parameters, state_names = {"c": 1.0}, ("x", "v")

    def __init__(self, reach):
        self.reach = reach

    def rates(self, t, x, values):
        return np.stack([x[:, 1], -self.pull(x, values) * x[:, 0]], axis=1)

    def derivatives(self, t, x, values, active=()):
        J = np.zeros((len(x), 2, 2))
        J[:, 0, 1], J[:, 1, 0] = 1.0, -self.pull(x, values)
        return self.rates(t, x, values), J, np.zeros((len(x), 2, 0))

    def pull(self, x, values):
        return np.where(np.abs(x[:, 0]) < self.reach(), values[0], 0.0)


def test_other_code_is_kept_apart_by_the_name_of_the_folder(tmp_path):
    """Both fields are alike where they are asked, and hold what cannot be looked into."""
    def scan(limit, folder):
        lock = threading.Lock()
        return poincare_scan(Called(lambda: limit if lock else 0.0), "c", [1.0, 2.0],
                             section=Crossing("x"), transient=10.0, keep=1, initial=[80.0, 0.5],
                             folder=tmp_path / folder)

    first = scan(100.0, "first")
    assert np.array_equal(scan(50.0, "first").up, first.up, equal_nan=True)
    assert not np.array_equal(scan(50.0, "second").up, first.up, equal_nan=True)


def test_fingerprints_are_the_same_in_other_processes(tmp_path):
    script = tmp_path / "field.py"
    script.write_text("""
from fecontact.bifurcation import vector_field
from fecontact.bifurcation.attractors.fingerprint import fingerprint
from fecontact.integrate import Crossing, Rodas5P
from fecontact.laws import RoughSurface

def swing(t, x, p, out):
    out[0] = x[1]
    out[1] = -p[0] * x[0]

print(fingerprint([vector_field(swing, {"c": 1.0}, states=("x", "v"))], Rodas5P(), Crossing("x"),
                  RoughSurface(10e6, 10e-6), swing))
""")
    found = {subprocess.run([sys.executable, script], check=True, capture_output=True, text=True,
                            env={**os.environ, "PYTHONHASHSEED": seed}).stdout
             for seed in ("1", "2")}
    assert len(found) == 1


def swing(t, x, p, out):
    out[0] = x[1]
    out[1] = -p[0] * x[0]


def stiffer(t, x, p, out):
    out[0] = x[1]
    out[1] = -2.0 * p[0] * x[0]
