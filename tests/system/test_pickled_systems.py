"""Contact systems in other processes: the same rates there, bit for bit."""

import pickle
import subprocess
import sys

import numpy as np
import pytest
from joined_bodies import stack_system
from systems import beam, friction_oscillator, impact_oscillator

from fecontact import simulate
from fecontact.bifurcation import contact_field, vector_field

SCRIPT = """
import pickle, sys
for system, y, rate in pickle.load(open(sys.argv[1], "rb")):
    assert (system.rhs(0.1, y) == rate).all()
"""


def test_pickled_systems_have_the_same_rates_elsewhere(tmp_path):
    """Addresses of compiled laws, which differ between processes, are not taken along."""
    systems = impact_oscillator(2), friction_oscillator(3), beam(), stack_system()
    rows = []
    for system in systems:
        y = 1e-5 * np.random.default_rng(1).normal(size=system.size)
        rows.append((system, y, system.rhs(0.1, y)))
    (tmp_path / "systems").write_bytes(pickle.dumps(rows))
    subprocess.run([sys.executable, "-c", SCRIPT, str(tmp_path / "systems")], check=True)
    for system in systems:
        assert pickle.loads(pickle.dumps(system)).parameters() == system.parameters()


def decay(t, x, p, out):
    out[0] = -p[0] * x[0]


@pytest.mark.parametrize("used", [False, True])
def test_pickled_fields_have_the_same_rates(used):
    for field in (contact_field(friction_oscillator(2), ["ground.speed"]).with_(
            **{"ground.speed": 0.002}), vector_field(decay, {"rate": 2.0}, ["x"])):
        t, x = np.zeros(1), np.full((1, field.dimension), 1e-3)
        expected = field.rates(t, x, field.values) if used else None
        again = pickle.loads(pickle.dumps(field))
        assert dict(again.parameters) == dict(field.parameters)
        found = again.rates(t, x, again.values)
        assert (found == (field.rates(t, x, field.values) if expected is None else expected)).all()


def test_pickled_run_of_a_field():
    run = simulate(vector_field(decay, {"rate": 2.0}, ["x"]), 1.0, initial=[1.0], outputs=5)
    again = pickle.loads(pickle.dumps(run))
    assert (again.states == run.states).all()
    assert again.parameters == run.parameters
