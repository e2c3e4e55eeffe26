"""Stick that almost lets go where static friction is above the kinetic one: adding-sliding.

The reference is a program of its own that goes from event to event by ``solve_ivp``.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar
from test_sliding_bifurcations import DAMPING, forced

from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    Shooting,
    contact_field,
    orbit_branch,
    periodic_motion,
)
from fecontact.integrate import SetValued

KINETIC, STATIC, SPEED, FREQUENCY = 0.6, 0.66, 0.05, 0.25
SOLVER = SetValued(static_coefficient=STATIC)
AMPLITUDE = "drive.amplitude_x"
PERIOD = 2.0 * np.pi / FREQUENCY


class Reference:
    """The forced mass on the belt; its force in stick is A / 2 sin(w t) - x - 2 D V."""

    def __init__(self, amplitude):
        self.amplitude = amplitude

    def force(self, t, place):
        """Friction in stick."""
        return (0.5 * self.amplitude * np.sin(FREQUENCY * t) - place
                - 2.0 * DAMPING * SPEED)

    def left(self, t, begin, place):
        """Margin of static friction at time t, for stick that began at a place."""
        return STATIC - abs(self.force(t, place + SPEED * (t - begin)))

    def release(self, begin, place):
        """Time at which stick ends, and its least margin before, at a minimum between."""
        times = np.linspace(begin, begin + 1.5 * PERIOD, 3001)
        values = np.array([self.left(t, begin, place) for t in times])
        first = np.flatnonzero((values[:-1] > 0.0) & (values[1:] <= 0.0))[0]
        end = brentq(lambda t: self.left(t, begin, place), times[first], times[first + 1],
                     xtol=1e-14)
        low = 1 + np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:]))
        least = [minimize_scalar(lambda t: self.left(t, begin, place), method="bounded",
                                 bounds=(times[i - 1], times[i + 1]),
                                 options={"xatol": 1e-10}).fun for i in low if times[i] < end]
        return end, min(least, default=np.inf)

    def slip(self, begin, place, sense):
        """Time and place at which slip comes to rest."""
        def rate(t, y):
            return [y[1], 0.5 * self.amplitude * np.sin(FREQUENCY * t) - y[0]
                    - 2.0 * DAMPING * y[1] - sense * KINETIC]

        def stops(t, y):
            return y[1] - SPEED if t > begin + 1e-6 else sense

        stops.terminal = True
        found = solve_ivp(rate, (begin, begin + 2.0 * PERIOD), [place, SPEED], method="DOP853",
                          rtol=1e-12, atol=1e-14, events=stops)
        return float(found.t[-1]), float(found.y[0, -1])

    def settled(self, begin, place, periods=20):
        """Least margin of stick in the last period, and begin and place of the last stick phase."""
        least, end = [], begin + periods * PERIOD
        while begin < end:
            release, low = self.release(begin, place)
            turned = place + SPEED * (release - begin)
            begin, place = self.slip(release, turned,
                                     float(np.sign(self.force(release, turned))))
            least.append((release, low))
        return min(low for at, low in least if at > end - PERIOD), begin, place


def border(ramp):
    """Amplitude at which a stick phase just touches its limit, beyond a ramp where it does not.

    What is left falls as a line there; steps fall short of its zero, since the way to the settled
    motion would touch the limit otherwise.
    """
    begin, place, known, ahead = 0.0, 0.0, [], list(ramp)
    for _ in range(30):
        amplitude = ahead.pop(0)
        least, begin, place = Reference(amplitude).settled(begin % PERIOD, place)
        known.append((amplitude, least))
        if ahead:
            continue
        (a, fa), (b, fb) = known[-2:]
        zero = b - fb * (b - a) / (fb - fa)
        if fb < 1e-5:
            return zero
        ahead.append(b + 0.4 * (zero - b))
    raise AssertionError("It never comes near.")


def test_adding_sliding_with_static_friction():
    """Beyond the border friction would jump to its kinetic value: no orbit follows."""
    system = forced(KINETIC, SPEED, FREQUENCY)
    field = contact_field(system, [AMPLITUDE, "ground.speed"])
    branch = orbit_branch(
        field, periodic_motion(system, solver=SOLVER, rtol=1e-9), AMPLITUDE, bounds=(1.9, 4.0),
        method=Shooting(1, solver=SOLVER), options=ContinuationOptions(step=0.02))
    end, = branch.special
    assert branch.status is BranchStatus.DISCONTINUITY
    assert (end.kind, end.persists, end.nodes) == ("adding-sliding", False, (0,))
    assert end.parameter == pytest.approx(border([2.2, 2.21, 2.24, 2.255, 2.26]), rel=1e-8)
