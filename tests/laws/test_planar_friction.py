"""Friction in two directions: all laws of the package, and laws of one's own."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from planar_conformance import ANGLES, assert_near, check_planar_law, planar_outputs, unit
from test_friction_laws import every_law
from test_memory_laws import LAWS as MEMORY_LAWS

import fecontact as fc
from fecontact import InputError
from fecontact.laws import (
    FrictionLaw,
    LinearContact,
    LuGreFriction,
    Positive,
    friction_law,
    law_names,
    memory_friction_law,
    planar_friction_law,
)
from fecontact.laws.friction.base import LimitedFriction
from fecontact.reduction import point_masses

LAWS = [*every_law(), *MEMORY_LAWS]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_conformance(law):
    check_planar_law(law, 5e-3 if isinstance(law, LuGreFriction) else None)


def test_every_law_with_a_name_is_tried_in_two_directions():
    assert set(law_names()[FrictionLaw].values()) <= {type(law) for law in LAWS}


# Laws of one's own -------------------------------------------------------------------------------

@friction_law
def _logarithmic(v, F, p):
    coefficient, effect, slope = p[0], p[1], p[2]
    smooth = math.tanh(slope * v)
    rise = coefficient + effect * math.log1p(abs(v) * slope)
    growth = effect * slope / (1.0 + slope * abs(v)) * abs(smooth)
    return rise * smooth * F, (rise * slope * (1.0 - smooth**2) + growth) * F, rise * smooth


@dataclass(frozen=True)
class Logarithmic(FrictionLaw):
    """Friction that grows with the logarithm of slip velocity, written for one direction."""

    kernel: ClassVar = _logarithmic

    coefficient: Positive = 0.3
    effect: Positive = 0.02
    slope: Positive = 1e4

    @property
    def velocity_scale(self):
        return 1.0 / float(np.max(self.slope))


def test_a_law_written_for_one_direction_acts_in_two():
    check_planar_law(Logarithmic())
    check_planar_law(Logarithmic(coefficient=(0.3, 0.5), slope=(1e4, 1e3)))


def mass_on(friction, components, depth=1e-5, weight=20.0):
    """A mass of 2 kg pressed on flat ground by its weight [N]; system and rows of its motion."""
    basis = point_masses({"a": 2.0}, components=components, contact="a")
    down = (0.0, -0.5 * weight) if components == "xy" else (0.0, 0.0, -0.5 * weight)
    system = fc.ContactSystem(basis, normal=LinearContact(stiffness=weight / depth),
                              friction=friction, load=fc.Load(gravity=down))
    return system, basis.contact_T[0, : len(components)]


def test_a_mass_with_a_law_of_ones_own_is_thrown_askew():
    """The mass stops on a straight line, as the mass in the plane does."""
    friction, angle, speed = Logarithmic(), 0.9, 0.5
    plane, rows = mass_on(friction, "xy")
    start = np.concatenate([np.linalg.solve(rows, [0.0, -1e-5]),
                            np.linalg.solve(rows, [speed, 0.0])])
    straight = fc.simulate(plane, 0.3, initial=start, outputs=61, rtol=1e-9)
    space, rows = mass_on(friction, "xyz")
    start = np.concatenate([np.linalg.solve(rows, [0.0, 0.0, -1e-5]),
                            np.linalg.solve(rows, [*speed * unit(angle), 0.0])])
    askew = fc.simulate(space, 0.3, initial=start, outputs=61, rtol=1e-9)
    way = straight.displacement(0)[:, :1] * unit(angle)
    assert np.abs(way[-1]).max() > 0.02
    assert askew.displacement(0)[:, :2] == pytest.approx(way, abs=1e-9)
    assert askew.friction_forces[:, 0] == pytest.approx(
        straight.friction_force * unit(angle), abs=1e-5)


@memory_friction_law
def _own_spring(v, F, z, p, force, rates):
    """Dahl's law of exponent one, as a user writes it."""
    mu, stiffness = p[0], p[1]
    force[0], force[1], force[2], force[3] = F * stiffness * z[0], 0.0, stiffness * z[0], (
        F * stiffness)
    rates[0, 2] = 0.0
    if F <= 0.0:
        rates[0, 0], rates[0, 1], rates[0, 3] = -1e7 * z[0], 0.0, -1e7
        return
    a = stiffness / mu
    rates[0, 0], rates[0, 3] = v - abs(v) * a * z[0], -abs(v) * a
    rates[0, 1] = 1.0 - (1.0 if v >= 0.0 else -1.0) * a * z[0]


@planar_friction_law
def _own_spring_in_two_directions(law, v1, v2, F, z, p, force, rates):
    """z' = v - a |v| z: columns are value, v1, F, z1, z2, v2."""
    mu, stiffness = p[0], p[1]
    a = stiffness / mu
    speed = math.sqrt(v1 * v1 + v2 * v2)
    e1, e2 = (v1 / speed, v2 / speed) if speed > 0.0 else (0.0, 0.0)
    for i in range(2):
        for k in range(6):
            force[6 * i + k], rates[i, k] = 0.0, 0.0
        force[6 * i], force[6 * i + 2] = F * stiffness * z[i], stiffness * z[i]
        force[6 * i + 3 + i] = F * stiffness
        if F <= 0.0:
            rates[i, 0], rates[i, 3 + i] = -1e7 * z[i], -1e7
            continue
        rates[i, 0] = (v1 if i == 0 else v2) - a * speed * z[i]
        rates[i, 3 + i] = -a * speed
        rates[i, 1], rates[i, 5] = (i == 0) - a * e1 * z[i], (i == 1) - a * e2 * z[i]


@dataclass(frozen=True)
class OwnSpring(LimitedFriction):
    """Dahl's law without a function for two directions."""

    kernel: ClassVar = _own_spring

    friction_coefficient: Positive = 0.4
    stiffness: Positive = 2e5

    @property
    def state_scale(self):
        return np.array([np.min(np.divide(self.friction_coefficient, self.stiffness))])

    def bristle_stiffness_of(self, share):
        found = np.zeros((2, len(share), 1))
        found[1, :, 0] = self.stiffness
        return found


@dataclass(frozen=True)
class OwnSpringInSpace(OwnSpring):
    """Dahl's law with a function for two directions."""

    planar_kernel: ClassVar = _own_spring_in_two_directions


def test_a_law_of_ones_own_with_memory_says_what_it_lacks_in_space():
    mass_on(OwnSpring(), "xy")
    with pytest.raises(InputError, match="OwnSpring has internal variables, but no planar_kernel"):
        mass_on(OwnSpring(), "xyz")[0].rhs(0.0, np.zeros(8))


def test_a_law_of_ones_own_with_memory_acts_in_two_directions():
    check_planar_law(OwnSpringInSpace())
    check_planar_law(OwnSpringInSpace((0.4, 0.5)))


# The checks notice what is wrong ------------------------------------------------------------------

@planar_friction_law
def _per_axis(law, v1, v2, F, z, p, force, rates):
    """Each direction by itself: a square of limits instead of a disc."""
    mu, stiffness = p[0], p[1]
    for i in range(2):
        for k in range(6):
            force[6 * i + k], rates[i, k] = 0.0, 0.0
        force[6 * i], force[6 * i + 2] = F * stiffness * z[i], stiffness * z[i]
        force[6 * i + 3 + i] = F * stiffness
        if F <= 0.0:
            rates[i, 0], rates[i, 3 + i] = -1e7 * z[i], -1e7
            continue
        v = v1 if i == 0 else v2
        rates[i, 0] = v - stiffness / mu * abs(v) * z[i]
        rates[i, 3 + i] = -stiffness / mu * abs(v)
        sign = 1.0 if v >= 0.0 else -1.0
        rates[i, 1 if i == 0 else 5] = 1.0 - stiffness / mu * sign * z[i]


@dataclass(frozen=True)
class PerAxis(OwnSpring):
    """A law that is not isotropic."""

    planar_kernel: ClassVar = _per_axis


def test_friction_of_each_axis_by_itself_is_noticed():
    with pytest.raises(AssertionError):
        check_planar_law(PerAxis())
    # Along an axis alone it is right.
    law, z = PerAxis(), np.array([[1e-6, 0.0]])
    p = law.table(np.ones(1))[0]
    right = planar_outputs(OwnSpringInSpace(), unit(0.0), 1.0, z, p)
    assert_near(planar_outputs(law, unit(0.0), 1.0, z, p).rates, right.rates, 1.0)
    assert ANGLES[0] == 0.0
