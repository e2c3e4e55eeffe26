"""Marks of folders of blocks: they distinguish other runs to the last digit."""

import functools
import math
import os
import subprocess
import sys
import threading
import types

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from systems import TURN, friction_oscillator, impact_oscillator

from fecontact import Drive, Ground, InputError, Load, PointLoad, simulate
from fecontact.bifurcation import VectorField, contact_field, poincare_scan, vector_field
from fecontact.bifurcation.attractors.marks import mark_of
from fecontact.integrate import Crossing, Radau, Rodas5P
from fecontact.laws import (
    ConstantFriction,
    Harmonic,
    HarmonicSpeed,
    ParabolicSurface,
    RoughSurface,
    Sine,
    friction_law,
    ground_profile,
    normal_law,
    signal,
)

FREQUENCY = "drive.frequency_hz"


def test_the_mark_sees_laws_and_functions(tmp_path):
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


def test_the_mark_sees_functions_of_the_parameter_between_the_ends(tmp_path):
    base = impact_oscillator(1)
    first = short_scan(base, straight, tmp_path / "a")
    assert (short_scan(base, straight, tmp_path / "a").up == first.up).all()
    with pytest.raises(InputError, match="another system"):
        short_scan(base, bent, tmp_path / "a")
    other = short_scan(base, bent, tmp_path / "b")
    assert (other.up[0] == first.up[0]).all()
    assert (other.up[1] != first.up[1]).all()


def test_the_mark_sees_starts_to_the_last_digit(tmp_path):
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
    ([1], [1.0], False),
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
def test_marks_of_settings(one, other, alike):
    assert (mark_of([], *one) == mark_of([], *other)) is alike


def own(base, kernel):
    """A class of one name and the same fields for every kernel."""
    return type("Own", (base,), {"kernel": kernel, "__doc__": base.__doc__})


def pressed(c):
    @normal_law
    def law(u, v, p):
        return (c * p[0] * u, c * p[0], 0.0) if u > 0.0 else (0.0, 0.0, 0.0)

    return friction_oscillator().with_(normal=own(RoughSurface, law)(10e6, 10e-6))


def rubbed(c):
    @friction_law
    def law(v, F, p):
        s = math.tanh(1e3 * v)
        return c * p[0] * F * s, c * p[0] * F * 1e3 * (1.0 - s * s), c * p[0] * s

    return friction_oscillator().with_(friction=own(ConstantFriction, law)(0.5))


def wave(c):
    @signal
    def law(t, p):
        return c * p[0] * math.sin(p[1] * t), c * p[0] * p[1] * math.cos(p[1] * t)

    return own(Harmonic, law)(1e-4, 60.0 / TURN)


def driven(c):
    return friction_oscillator().with_(drive=Drive(stiffness_x=5610.0, motion_x=wave(c)))


def loaded(c):
    return friction_oscillator().with_(
        load=Load(14.0, forces=[PointLoad("B", "x", signal=wave(c))]))


def uneven(c):
    @ground_profile
    def law(xi, p):
        y, k = c * p[1], 2.0 * math.pi / p[2]
        return p[0] + y * math.sin(k * xi), y * k * math.cos(k * xi), -y * k**2 * math.sin(k * xi)

    return own(Sine, law)(1e-6, 0.1)


def over_waves(c):
    return friction_oscillator().with_(ground=Ground(speed=1e-3, profile=uneven(c)))


def over_patches(c):
    return friction_oscillator().with_(ground=Ground(speed=1e-3, friction_variation=uneven(c)))


def on_a_shaker(c):
    @signal
    def law(t, p):
        return c * p[1] / p[2] * (1.0 - math.cos(p[2] * t)), c * p[1] * math.sin(p[2] * t)

    return friction_oscillator().with_(
        ground=Ground(motion=own(HarmonicSpeed, law)(1e-3, 60.0 / TURN)))


def far_away(limit):
    """A field whose rates differ only where no sample is."""
    def rates(t, x, p, out):
        out[0] = x[1]
        out[1] = -p[0] * x[0] if abs(x[0]) < limit else 0.0

    return vector_field(rates, {"c": 1.0}, ["x", "v"])


def far_away_in_python(limit):
    class Own(VectorField):
        parameters, state_names = {"c": 1.0}, ("x", "v")

        def rates(self, t, x, values):
            return np.where(np.abs(x) < limit, -values[0] * x, 0.0)

        def derivatives(self, t, x, values, active=()):
            raise NotImplementedError

    return Own()


def of_period(period):
    return vector_field(swing, {"c": 1.0}, ["x", "v"], period=period)


@pytest.mark.parametrize("made", [pressed, rubbed, driven, loaded, over_waves, over_patches,
                                  on_a_shaker, far_away, far_away_in_python, of_period],
                         ids=lambda made: made.__name__)
def test_the_mark_sees_what_functions_hold(made):
    """Kernels of one name in classes of one name and equal fields, with another number inside."""
    one, other, again = made(50.0), made(60.0), made(50.0)
    assert mark_of([one]) == mark_of([again])
    assert mark_of([one]) != mark_of([other])


class Spring:
    """A spring that ends where ``reach`` says: what fields call by objects differs far away."""

    def __init__(self, reach, inner=None):
        self.reach, self.inner = reach, inner

    def force(self, x):
        return np.where(np.abs(x) < self.reach(), -x, 0.0)


class Called(VectorField):
    """A field of Python that asks an object for its rates."""

    parameters, state_names = {"c": 1.0}, ("x", "v")

    def __init__(self, spring):
        self.spring = spring

    def rates(self, t, x, values):
        return values[0] * self.spring.force(x)

    def derivatives(self, t, x, values, active=()):
        slopes = np.where(np.abs(x) < self.spring.reach(), -values[0], 0.0)
        return self.rates(t, x, values), slopes[:, :, None] * np.eye(2), np.zeros((len(x), 2, 0))


def by_a_closure(limit):
    return Called(Spring(lambda: limit))


def by_a_default(limit):
    return Called(Spring(lambda at=limit: at))


def by_a_keyword(limit):
    def reach(*, at=limit):
        return at

    return Called(Spring(reach))


def by_a_partial_function(limit):
    return Called(Spring(functools.partial(float, limit)))


def by_an_attribute(limit):
    class Stiff(Spring):
        def force(self, x):
            return np.where(np.abs(x) < self.inner[0]["limit"], -x, 0.0)

    return Called(Stiff(None, [{"limit": limit}]))


def by_a_method(limit):
    class Reach:
        def __init__(self):
            self.limit = limit

        def of(self):
            return self.limit

    return Called(Spring(Reach().of))


def by_a_slot(limit):
    class Reach:
        __slots__ = ("limit",)

        def __init__(self):
            self.limit = limit

        def __call__(self):
            return self.limit

    return Called(Spring(Reach()))


def by_a_class(limit):
    class Base:
        most = limit

    class Reach(Base):
        def __call__(self):
            return self.most

    return Called(Spring(Reach()))


def by_a_property(limit):
    class Reach(Spring):
        @property
        def reach(self):
            return lambda: limit

        @reach.setter
        def reach(self, value):
            pass

    return Called(Reach(None))


def by_a_cache(limit):
    @functools.cache
    def reach():
        return limit

    return Called(Spring(reach))


def by_the_code_of_a_helper(limit):
    """Same names and values in another order of the code."""
    if limit == 50.0:
        class Reach:
            def __call__(self):
                return 50.0 if self else 60.0
    else:
        class Reach:
            def __call__(self):
                return 60.0 if self else 50.0

    return Called(Spring(Reach()))


def by_a_table(limit):
    table = PchipInterpolator([0.0, 1.0, 2.0], [limit, limit, 1.0])
    return Called(Spring(functools.partial(table, 0.5)))


def by_a_global(limit):
    """Names of globals, and of what is in modules."""
    module = types.ModuleType("springs_of_the_user")
    exec("def limit():\n    return LIMIT\n\nLIMIT = None\n", vars(module))
    module.LIMIT = limit
    known = {"springs": module}
    exec("def reach():\n    return springs.limit()\n", known)
    return Called(Spring(known["reach"]))


@pytest.mark.parametrize("made", [
    by_a_closure, by_a_default, by_a_keyword, by_a_partial_function, by_an_attribute, by_a_method,
    by_a_slot, by_a_class, by_a_property, by_a_cache, by_the_code_of_a_helper, by_a_table,
    by_a_global], ids=lambda made: made.__name__)
def test_the_mark_sees_what_fields_call_through_objects(made):
    one, other, again = made(50.0), made(60.0), made(50.0)
    assert mark_of([one]) == mark_of([again])
    assert mark_of([one]) != mark_of([other])


def test_objects_in_circles_have_marks():
    def ring(limit):
        spring = Spring(lambda: 1.0)
        spring.inner = [limit, spring]
        return Called(spring)

    assert mark_of([ring(1.0)]) == mark_of([ring(1.0)])
    assert mark_of([ring(1.0)]) != mark_of([ring(2.0)])


def test_marks_are_the_same_in_other_processes(tmp_path):
    """Texts and sets, whose hashes differ from process to process, and addresses of objects."""
    script = tmp_path / "field.py"
    script.write_text("""
import numpy as np
from fecontact.bifurcation import VectorField
from fecontact.bifurcation.attractors.marks import mark_of

class Helper:
    kinds = {"a", "b", "cc", "ddd"}
    def force(self, x):
        return -x

class Own(VectorField):
    parameters, state_names = {"c": 1.0}, ("x", "v")
    def __init__(self):
        self.helper, self.names = Helper(), {name: {name} for name in ("x", "y")}
    def rates(self, t, x, values):
        return self.helper.force(x)
    def derivatives(self, t, x, values, active=()):
        raise NotImplementedError

print(mark_of([Own()]))
""")
    found = {subprocess.run([sys.executable, script], check=True, capture_output=True, text=True,
                            env={**os.environ, "PYTHONHASHSEED": seed}).stdout
             for seed in ("1", "2", "3")}
    assert len(found) == 1


@pytest.mark.parametrize("held", [threading.Lock(), (one for one in "abc"), memoryview(b"abc")],
                         ids=lambda held: type(held).__name__)
def test_what_cannot_be_looked_into_is_refused(held, tmp_path):
    with pytest.raises(InputError, match=r"cannot be looked into .* leave out the folder"):
        mark_of([Called(Spring(lambda: 1.0, [held]))])


def test_runs_of_another_helper_are_not_taken_as_kept(tmp_path):
    def scan(limit):
        return poincare_scan(by_a_closure(limit), "c", [1.0, 2.0], section=Crossing("x"),
                             transient=1.0, keep=1, initial=[1.0, 0.5], folder=tmp_path / "kept")

    scan(50.0)
    scan(50.0)
    with pytest.raises(InputError, match="another system"):
        scan(60.0)


def swing(t, x, p, out):
    out[0] = x[1]
    out[1] = -p[0] * x[0]


def stiffer(t, x, p, out):
    out[0] = x[1]
    out[1] = -2.0 * p[0] * x[0]


def on_contact(factor):
    """A field that asks one of a contact system, whose ground moves ``factor`` times as fast."""
    def moved(system, speed):
        return system.with_(**{"ground.speed": factor * speed})

    return Called(contact_field(friction_oscillator(), {"speed": (1e-3, moved)}))


def test_contact_fields_within_others():
    """Working data of the fields do not enter the mark; they hold addresses of this process."""
    one, other = on_contact(1.0), on_contact(2.0)
    mark, inner = mark_of([one.spring]), one.spring
    inner.rates(np.zeros(3), np.zeros((3, inner.dimension)), 1.2 * inner.values)
    inner.derivatives(np.zeros(3), np.zeros((3, inner.dimension)), inner.values, (0,))
    assert mark_of([inner]) == mark == mark_of([on_contact(1.0).spring])
    assert mark_of([], one) == mark_of([], on_contact(1.0)) != mark_of([], other)


def test_cached_properties_count_as_if_not_there():
    class Reach:
        def __init__(self, limit):
            self.limit = limit

        @functools.cached_property
        def half(self):
            return 0.5 * self.limit

        def __call__(self):
            return 2.0 * self.half

    used = Called(Spring(Reach(50.0)))
    mark = mark_of([], used)
    assert used.spring.reach() == 50.0
    assert mark == mark_of([], used) == mark_of([], Called(Spring(Reach(50.0))))
    assert mark != mark_of([], Called(Spring(Reach(60.0))))
