"""The check of laws: passed by the laws of the package, failed by laws with one mistake."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from law_values import made

import fecontact as fc
from fecontact.cli import execute
from fecontact.laws import (
    AsperityContact,
    BackBurdekinContact,
    BilateralPiecewise,
    BilateralPlay,
    BilateralPolynomial,
    BoucWenFriction,
    CosineSurface,
    ExponentialContact,
    ExponentialFriction,
    FrictionContact3D,
    FrictionLaw,
    GaussianSurface,
    GreenwoodWilliamson,
    JenkinsFriction,
    LinearContact,
    MeasuredSurface,
    NormalLaw,
    ParabolicSurface,
    ParallelSliders,
    PowerContact,
    PrescribedForce,
    RestitutionContact,
    RoughSurface,
    TwoSidedStop,
    check_law,
    friction_law,
    law_names,
    memory_friction_law,
    normal_law,
)
from fecontact.laws import check as checks
from fecontact.laws.sampling import cycle_work

NEEDED = {
    RoughSurface: (1e6, 1e-5, 3.0), ParabolicSurface: (1e6, 1e-5, 3.0),
    CosineSurface: (1e6, 1e-5, 3.0), GaussianSurface: (1e6, 1e-5, 3.0),
    MeasuredSurface: (1e6, 1e-5, 3.0),
    LinearContact: (1e6, 3.0), PowerContact: (1e9, 1.5, 2.0),
    RestitutionContact: (1e9, 0.5, 1.0), ExponentialContact: (10.0, 1e-6),
    BackBurdekinContact: (1e-4, 1e-9), TwoSidedStop: (1e6, 1e-4, 1.5), PrescribedForce: (3.0,),
    BilateralPolynomial: (1e6, 1e15, 3.0), BilateralPlay: (1e6, 1e-5, 3.0),
    BilateralPiecewise: ((-1e-3, 0.0, 1e-3), (-1e3, 0.0, 2e3), 3.0),
    GreenwoodWilliamson: (1e4, 1e-4, 1e11, 1e-6),
    AsperityContact: (1e4, 1e-4, 1e11, 1e-5, (1.0, 3.0, 0.0), 1e9),
    ParallelSliders: (2e6, 0.4, (1.0, 2.0), (1.0, 3.0)), FrictionContact3D: (1e6, 8e5, 0.4),
}


@pytest.mark.parametrize("cls", [
    cls for kind in (NormalLaw, FrictionLaw) for cls in law_names()[kind].values()
    if not getattr(cls, "rigid", False)],
    ids=lambda cls: cls.__name__)
def test_laws_of_the_package_pass(cls):
    check_law(cls(*NEEDED[cls]) if cls in NEEDED else made(cls))


def test_parameters_per_node_and_springs_with_smoothing_pass():
    check_law(RoughSurface((1e6, 2e6), 1e-6, 3.0))
    check_law(JenkinsFriction((2e6, 1e6), (0.4, 0.7)))
    check_law(ExponentialFriction(0.3, 0.5, 1000.0, viscous_coefficient=1.0, smoothing="tanh"))


@normal_law
def _spring(u, v, p):
    """A spring with a dashpot; p: stiffness, damping, then what is wrong with it."""
    stiffness, damping, wrong = p[0], p[1], p[2]
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    force, slope = stiffness * u, stiffness
    if wrong == 3.0 and u > 5e-6:
        force, slope = stiffness * (1e-5 - u), -stiffness
    if wrong == 4.0:
        damping = -damping
    force += damping * v
    if force <= 0.0 and wrong != 5.0:
        return 0.0, 0.0, 0.0
    return (force, slope * (1.01 if wrong == 1.0 and u > 5e-6 else 1.0),
            damping * (0.99 if wrong == 2.0 else 1.0))


@dataclass(frozen=True)
class Spring(NormalLaw):
    kernel: ClassVar = _spring
    penetration_scale: ClassVar = 1e-6

    stiffness: float = 1e6
    damping: float = 3.0
    wrong: float = 0.0

    def stored_energy(self, penetration, share):
        energy = super().stored_energy(penetration, share)
        return energy * {6.0: 1.01, 7.0: -1.0}.get(self.wrong, 1.0)


@friction_law
def _coulomb(v, F, p):
    """Coulomb with a Stribeck fall, smoothed by tanh; p: what is wrong with it."""
    wrong = p[0]
    s, fall = math.tanh(1e4 * v), math.exp(-10.0 * abs(v))
    mu = 0.3 + 0.2 * fall
    slope = mu * 1e4 * (1.0 - s * s) - 2.0 * fall * abs(s)
    ratio = mu * s
    if wrong == 1.0 and abs(v) > 1e-2:
        slope = -slope
    if wrong == 3.0:
        ratio, slope = -ratio, -slope
    if wrong == 4.0:
        return ratio * (F + 1.0), slope * (F + 1.0), ratio
    return ratio * F, slope * F, ratio * (1.01 if wrong == 2.0 else 1.0)


@dataclass(frozen=True)
class Coulomb(FrictionLaw):
    kernel: ClassVar = _coulomb
    velocity_scale: ClassVar = 1e-4

    wrong: float = 0.0


@memory_friction_law
def _bristle(v, F, z, p, force, rates):
    """LuGre's law with constant friction 0.5; p: what is wrong with it."""
    wrong = p[0]
    force[0] = 1e5 * z[0] * F + (1.0 if wrong == 4.0 else 0.0)
    force[1] = 0.0
    force[2] = 1e5 * z[0]
    force[3] = 1e5 * F * (1.01 if wrong == 1.0 else 1.0)
    sign = 1.0 if v >= 0.0 else -1.0
    rates[0, 0] = v - 2e5 * abs(v) * z[0]
    rates[0, 1] = 1.0 - 2e5 * z[0] * sign
    rates[0, 2] = 1e-7 if wrong == 2.0 else 0.0
    rates[0, 3] = -2e5 * abs(v) * (0.99 if wrong == 3.0 else 1.0)


@dataclass(frozen=True)
class Bristle(FrictionLaw):
    kernel: ClassVar = _bristle
    memory: ClassVar = 1
    velocity_scale: ClassVar = 5e-5

    wrong: float = 0.0

    @property
    def state_scale(self):
        return np.array([5e-6])


@pytest.mark.parametrize("law", [Spring(), Coulomb(), Bristle()], ids=repr)
def test_own_laws_without_mistake_pass(law):
    check_law(law)


@pytest.mark.parametrize(("law", "message"), [
    (Spring(wrong=1.0), r"Spring: at \(u, v\) = .* must be equal: dF/du as returned and by"),
    (Spring(wrong=2.0), r"must be equal: dF/dv as returned and by differences\."),
    (Spring(wrong=3.0), r"must not (pull at u > 0|fall as u grows)"),
    (Spring(wrong=4.0), r"must not give energy off by damping"),
    (Spring(wrong=5.0), r"must not pull at u > 0\."),
    (Spring(wrong=6.0), r"at u = .* must be equal: stored_energy and the integral of F"),
    (Spring(wrong=7.0), r"must be equal: stored_energy"),
    (Coulomb(wrong=1.0), r"Coulomb: at \(v, F\) = .* must be equal: dR/dv as returned and by"),
    (Coulomb(wrong=2.0), r"must be equal: dR/dF as returned and by differences\."),
    (Coulomb(wrong=3.0), r"must have the sign of v, or zero: friction would give energy off\."),
    (Coulomb(wrong=4.0), r"must be zero without normal force\."),
    (Bristle(wrong=1.0), r"Bristle: at \(v, F, z\[0\]\) = .* must be equal: dR/dz\[0\] as"),
    (Bristle(wrong=2.0), r"must be equal: dz\[0\]'/dF as returned and by differences\."),
    (Bristle(wrong=3.0), r"must be equal: dz\[0\]'/dz\[0\] as returned and by differences\."),
    (Bristle(wrong=4.0), r"must be zero without normal force\."),
], ids=lambda value: repr(value) if not isinstance(value, str) else "")
def test_single_mistakes_are_found(law, message):
    with pytest.raises(fc.FecontactError, match=message):
        check_law(law)


@dataclass(frozen=True)
class FarSpring(Spring):
    """A spring that says up to where it is not touched."""

    limit: float = 0.0

    def untouched(self, nodes):
        return np.full(nodes, self.limit)


def test_force_on_untouched_nodes_is_found():
    check_law(FarSpring(limit=0.0))
    check_law(FarSpring(limit=-1e-6))
    for limit in (1e-9, np.inf):
        law = FarSpring()
        object.__setattr__(law, "limit", limit)
        with pytest.raises(fc.FecontactError,
                           match=r"FarSpring: at \(u, v\) = .* must be zero, as untouched = "):
            check_law(law)


# None where the force ends nowhere, or where this is not known.
UNTOUCHED = {
    ExponentialContact: -50e-6, GreenwoodWilliamson: None, PrescribedForce: None,
    TwoSidedStop: None, BilateralPolynomial: None, BilateralPlay: None,
    BilateralPiecewise: None}


@pytest.mark.parametrize("cls", [cls for cls in law_names()[NormalLaw].values() if not cls.rigid],
                         ids=lambda cls: cls.__name__)
def test_penetration_up_to_which_laws_are_zero(cls):
    law = cls(*NEEDED.get(cls, ()))
    found = law.untouched(3)
    assert found.shape == (3,)
    expected = UNTOUCHED.get(cls, 0.0)
    if cls is GreenwoodWilliamson:
        expected = law.height_deviation * (law.separation - 9.0)
    if expected is None:
        assert np.isneginf(found).all()
    else:
        assert found == pytest.approx(expected, rel=0.005)


def test_hysteresis_that_gives_energy_off_is_found():
    law = BoucWenFriction(0.55, 5e-6)
    object.__setattr__(law, "beta", -0.5)
    with pytest.raises(fc.FecontactError, match=r"BoucWenFriction: cycles of slip .* give off"):
        check_law(law)


def test_work_of_a_cycle_of_jenkins_element():
    """mu F times the way, less 2 mu F / k at each turn, where the spring only turns over."""
    law = JenkinsFriction(2e6, 0.4)
    p = law.table(np.ones(1))[0]
    work, size = cycle_work(law.kernel.address, law.memory, p, 1.0, 1e-5, 1e-5)
    # Four turning points of the travel -cos x - 0.4 cos(3 x + 1) within a period.
    x = np.linspace(0.0, 2.0 * np.pi, 200_001)
    travel = -(np.cos(x) + 0.4 * np.cos(3.0 * x + 1.0))
    turns = travel[1:-1][np.diff(np.sign(np.diff(travel))) != 0]
    way = np.abs(np.diff([*turns, turns[0]])).sum()
    elastic = 2.0 * 0.4 / 2e6
    assert work[-1] == pytest.approx(0.4 * (1e-5 * way - len(turns) * elastic), rel=2e-3)
    assert (size > work).all()


def test_own_laws_on_the_command_line(tmp_path, capsys):
    source = '''
import math
from dataclasses import dataclass
from typing import ClassVar
from fecontact.laws import FrictionLaw, friction_law

@friction_law
def f(v, F, p):
    s = math.tanh(1e4 * v)
    return p[0] * s * F, p[0] * 1e4 * (1.0 - s * s) * F, p[0] * s

@dataclass(frozen=True)
class Mine(FrictionLaw):
    """My own friction."""
    kernel: ClassVar = f
    velocity_scale: ClassVar = 1e-4
    mu: float = 0.5
'''
    (tmp_path / "own.py").write_text(source)
    assert execute(["laws", f"{tmp_path}/own.py:Mine"]) == 0
    out = capsys.readouterr().out
    assert "My own friction." in out
    assert "mu = 0.5" in out
    assert "keeps the contract of laws" in out
    (tmp_path / "wrong.py").write_text(source.replace("1e4 * (1.0", "1.01e4 * (1.0"))
    assert execute(["laws", f"{tmp_path}/wrong.py:Mine"]) == 1
    assert "must be equal: dR/dv" in capsys.readouterr().err
    (tmp_path / "open.py").write_text(source.replace("mu: float = 0.5", "mu: float"))
    assert execute(["laws", f"{tmp_path}/open.py:Mine"]) == 0
    assert "not checked" in capsys.readouterr().out
    assert execute(["laws", f"{tmp_path}/own.py:Yours"]) == 1
    assert "has no law of that name" in capsys.readouterr().err


@friction_law
def _slow(v, F, p):
    x = 1.0
    if v == 1e-3 and F == 1.0:
        for _ in range(200_000_000):
            x = 1.0 + math.sin(x)
    return 1e-300 * x + math.tanh(1e4 * v) * F, 1e4 * F, 1.0


@dataclass(frozen=True)
class Slow(FrictionLaw):
    kernel: ClassVar = _slow

    @property
    def velocity_scale(self):
        return 1e-4


def test_a_law_that_does_not_return_is_refused(monkeypatch):
    """A loop of some seconds stands for one without end, which no test could leave."""
    monkeypatch.setattr(checks, "_PATIENCE", 0.2)
    with pytest.raises(fc.InputError, match=r"Slow has not returned after 0\.2 s at \(v, F\) = "
                                            r"\(0\.001, 1\); end its loops"):
        check_law(Slow())
