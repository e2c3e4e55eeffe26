"""Outputs of runs that end early."""

from types import SimpleNamespace

import numpy as np
import pytest

from fecontact.integrate.step_runs import until_end

STATE = np.array([7.0, 8.0])


@pytest.mark.parametrize(("outputs", "time", "state", "wanted"), [
    (0, 0.0, STATE, []),  # the first step failed before the first output
    (2, 1.5, STATE, [0.0, 1.0, 1.5]),
    (2, 1.0, STATE, [0.0, 1.0]),
    (2, 1.5, np.array([np.nan, 8.0]), [0.0, 1.0]),
    (3, 2.0, STATE, [0.0, 1.0, 2.0]),
])
def test_outputs_until_the_time_reached(outputs, time, state, wanted):
    rows = np.arange(6.0).reshape(3, 2)
    run = SimpleNamespace(outputs=outputs, time=time, times=np.arange(3.0),
                          progress=SimpleNamespace(state=state))
    times, states = until_end(run, (rows, state))
    assert times.tolist() == wanted
    assert states[:outputs].tolist() == rows[:outputs].tolist()
    assert states[outputs:].tolist() == [state.tolist()] * (len(wanted) - outputs)
