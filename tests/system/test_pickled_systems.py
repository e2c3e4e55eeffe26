"""Contact systems in other processes: the same rates there, bit for bit."""

import pickle
import subprocess
import sys

import numpy as np
from joined_bodies import stack_system
from systems import beam, friction_oscillator, impact_oscillator

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
