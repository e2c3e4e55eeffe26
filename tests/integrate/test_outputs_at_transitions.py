"""Outputs of implicit steps beside a moment at which slip comes to rest, against closed forms."""

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact.integrate import SetValued, TimeStepping
from fecontact.laws import ConstantFriction, PrescribedForce

STEPPING = TimeStepping()


def block(**parts):
    """A block of 1 kg under 10 N, with a friction coefficient of 0.3."""
    rows = [[1.0], [0.0], [0.0]]
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": [rows], "B": rows, "C": rows})
    return fc.ContactSystem(basis, normal=PrescribedForce(10.0), friction=ConstantFriction(0.3),
                            **parts)


@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_a_block_comes_to_rest_between_outputs(rtol):
    """Speed 1 - 3 t until t = 1/3, and rest from there on, however dense the outputs are."""
    times = np.unique(np.concatenate([np.linspace(0.0, 0.4, 41),
                                      1.0 / 3.0 + np.linspace(-3e-3, 3e-3, 101)]))
    run = fc.simulate(block(), 0.4, initial=[0.0, 1.0], outputs=times, rtol=rtol, solver=STEPPING)
    slipping = np.minimum(times, 1.0 / 3.0)
    assert run.states[:, 1] == pytest.approx(1.0 - 3.0 * slipping, abs=2.0 * rtol)
    assert run.states[:, 0] == pytest.approx(slipping - 1.5 * slipping**2, abs=2.0 * rtol)


def test_outputs_of_stick_slip_agree_with_steps_from_event_to_event():
    system = block(drive=fc.Drive(stiffness_x=100.0, amplitude_x=0.05, frequency_hz=7.0 / TURN))
    outputs = np.linspace(0.0, 3.0, 3001)
    run, exact = (fc.simulate(system, 3.0, initial=[0.0, 1.0], outputs=outputs, rtol=rtol,
                              solver=solver)
                  for rtol, solver in ((1e-6, STEPPING), (1e-10, SetValued())))
    assert run.states[:, 1] == pytest.approx(exact.states[:, 1], abs=1e-4)
