"""Arrays of results are read-only, and still serve wherever results are used again."""

import copy
import importlib
import inspect
import pickle
from collections.abc import Mapping
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from scipy import sparse
from synthetic import basis, run
from systems import beam, friction_oscillator, lorenz_field, mass_in_plane, two_mass_field

import fecontact as fc
from fecontact.analysis import (
    amplitude_spectrum,
    complex_modes,
    find_impacts,
    receptance,
    strobed_states,
)
from fecontact.bifurcation import (
    ContinuationOptions,
    contact_field,
    equilibrium_branch,
    find_equilibrium,
    orbit_branch,
    stability_map,
)
from fecontact.core import kernel_parts
from fecontact.core.read_only import read_only, read_only_arrays
from fecontact.integrate import ContactEvents
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField

SPACES = ("fem", "half_space", "reduction", "integrate", "analysis", "bifurcation", "measured",
          "sweeps", "fitting", "system", "io")
# Classes that users make and hand over, and classes that make read-only copies themselves.
GIVEN = {"Task", "Axis", "PointPairing", "ReportFrame"}


def arrays(value, place, seen):
    """All arrays that are reached by public names, with their places, but those of models."""
    if isinstance(value, np.ndarray):
        yield place, value
    elif sparse.issparse(value):
        for part in ("data", "indices", "indptr"):
            yield f"{place}.{part}", getattr(value, part)
    elif isinstance(value, Mapping):
        for name, item in value.items():
            yield from arrays(item, f"{place}[{name!r}]", seen)
    elif isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        for item in value[:3]:
            yield from arrays(item, f"{place}[]", seen)
    elif (type(value).__module__.startswith("fecontact") and id(value) not in seen
          and not isinstance(value, ContactSystem | VectorField) and not inspect.isroutine(value)):
        seen.add(id(value))
        if hasattr(value, "_fields"):
            names = value._fields
        else:
            names = {name for name in {*dir(type(value)), *vars(value)} if name[0] != "_"} - {
                name for name, _ in inspect.getmembers(type(value), inspect.isroutine)}
        for name in sorted(names):
            try:
                item = getattr(value, name)
            except fc.FecontactError:
                continue
            yield from arrays(item, f"{place}.{name}", seen)


def motion():
    system = mass_in_plane(spring=1e4, load=fc.Load(normal=5.0), ground=fc.Ground(speed=0.1))
    return fc.simulate(system, 0.02, outputs=51, events=[ContactEvents()])


def hinged():
    return fc.ElasticBody(fc.generate(fc.Beam(length=0.2, height=0.01)), fc.Material(), 0.02,
                          fixed={"left": "xy"})


def static_fields():
    mesh = fc.generate(fc.Beam(length=0.2, height=0.01))
    return fc.modal_basis(fc.ElasticBody(mesh, fc.Material(), 0.02, fixed={"left": "xy"}),
                          modes=2).fields(np.ones(2))


MADE = {
    "run": motion,
    "part of a run": lambda: motion().between(0.005),
    "run of a field": lambda: fc.simulate(lorenz_field(), 0.1, initial=np.ones(3), outputs=11),
    "many runs": lambda: fc.ensemble(friction_oscillator(), np.linspace(0.0, 0.01, 5),
                                     initial=np.zeros((2, 4))),
    "sensitivity": lambda: fc.sensitivity(friction_oscillator(), 0.01, initial=np.zeros(4)),
    "equilibrium": lambda: find_equilibrium(two_mass_field()),
    "branch": lambda: equilibrium_branch(two_mass_field(), parameter="B", bounds=(0.1, 1.5)),
    "stability map": lambda: stability_map(
        two_mass_field(), {"B": [0.5, 1.0], "ground.speed": [0.5, 1.0]}),
    "modes": lambda: complex_modes(mass_in_plane(spring=1e4)),
    "basis": basis,
    "body": hinged,
    "fields": lambda: static_fields(),
    "impacts": lambda: find_impacts(motion()),
    "spectrum": lambda: amplitude_spectrum(np.linspace(0.0, 1.0, 64), np.ones(64)),
    "receptance": lambda: receptance(mass_in_plane(spring=1e4), np.array([1.0, 2.0]), [("B", "x")]),
    "strobed states": lambda: strobed_states(run(times=401), period=0.002),
    "load history": lambda: fc.load_history(
        beam(), fc.LoadPath(load_scale=(0.0, 1.0), steps=4)),
}


@pytest.mark.parametrize("name", MADE)
def test_no_array_of_a_result_can_be_written_to(name):
    found = MADE[name]()
    for kind, value in (("itself", found), ("pickled", pickle.loads(pickle.dumps(found))),
                        ("copied", copy.copy(found)), ("copied deeply", copy.deepcopy(found))):
        places = list(arrays(value, name, set()))
        assert places, kind
        assert [place for place, array in places if array.flags.writeable] == [], kind


def public_results():
    for space in SPACES:
        module = importlib.import_module(f"fecontact.{space}")
        for name in module.__all__:
            value = getattr(module, name)
            if inspect.isclass(value) and is_dataclass(value) and name not in GIVEN:
                yield value
    yield fc.Trajectory
    yield fc.ModalBasis
    yield fc.ElasticBody
    yield fc.Mesh


def test_every_public_result_with_arrays_is_protected():
    unprotected = [
        kind.__name__ for kind in public_results()
        if any("Array" in str(entry.type) or "Integers" in str(entry.type)
               or "NDArray" in str(entry.type) for entry in fields(kind))
        and not hasattr(kind.__init__, "__wrapped__")]
    assert unprotected == []


def test_writing_is_an_error_and_a_users_own_array_stays_writeable():
    time = np.linspace(0.0, 1.0, 3)
    motion_ = fc.bifurcation.PeriodicMotion(time, np.zeros((3, 1)), 1.0, state_names=["x"])
    with pytest.raises(ValueError, match="read-only"):
        motion_.times[0] = 1.0
    time[0] = 0.0
    table = fc.sweeps.SweepTable({"a": (1.0, 2.0)}, {"b": np.zeros(2)}, ["0", "1"], ["", ""])
    with pytest.raises(ValueError, match="read-only"):
        table.values["b"][0] = 1.0


def test_read_only_leaves_what_holds_no_array():
    given = {"a": [1.0, (2.0, "b")]}
    assert read_only(given) is given
    nested = read_only({"a": [np.zeros(2)]})
    assert not nested["a"][0].flags.writeable

    @read_only_arrays
    class Plain:
        @property
        def both(self):
            """Two arrays."""
            return np.zeros(1), [np.ones(1)]

        @property
        def count(self) -> int:
            """A number, which is read as often as by a plain class."""
            return 2

    assert Plain().count == 2
    assert not hasattr(Plain.count.fget, "__wrapped__")
    assert [one.flags.writeable for one in (Plain().both[0], Plain().both[1][0])] == [False] * 2
    assert Plain.both.__doc__ == "Two arrays."


@pytest.fixture
def compiled(monkeypatch):
    """Names of the functions that are compiled anew for arguments of other types."""
    found = []
    before = kernel_parts._Part.__call__

    def call(self, *arguments):
        signatures = len(self._callable.signatures)
        result = before(self, *arguments)
        if signatures and len(self._callable.signatures) > signatures:
            found.append(self.py_func.__qualname__)
        return result

    monkeypatch.setattr(kernel_parts._Part, "__call__", call)
    return found


def test_results_are_taken_up_again_without_new_kernels(compiled):
    """Kernels have one signature and would refuse arrays of another type."""
    first = motion()
    again = fc.simulate(first.system, 0.01, initial=first.states[-1], outputs=3)
    np.testing.assert_array_equal(again.states[0], first.states[-1])
    np.testing.assert_allclose(first.system.rhs(0.0, first.states[3]),
                               first.system.rhs(0.0, np.array(first.states[3])), rtol=0.0)
    copied = fc.ModalBasis(**{entry.name: getattr(first.system.basis, entry.name)
                              for entry in fields(fc.ModalBasis)})
    assert ContactSystem(copied, normal=first.system.normal,
                         friction=first.system.friction).rhs(0.0, first.states[3]).shape == (4,)
    branch = equilibrium_branch(two_mass_field(), parameter="B", bounds=(0.1, 1.5))
    field = two_mass_field()
    assert branch.at(field, 1.3).parameter == pytest.approx(1.3, rel=1e-9)
    orbits = orbit_branch(field, branch.of_kind("Hopf")[0],
                          options=ContinuationOptions(points=3))
    further = orbit_branch(field, orbits.points[-1], options=ContinuationOptions(points=2))
    assert further.points[0].parameter == pytest.approx(orbits.points[-1].parameter, rel=1e-6)
    places = list(arrays(orbits, "orbits", set()))
    assert [place for place, array in places if array.flags.writeable] == []
    history_ = fc.load_history(beam(), fc.LoadPath(load_scale=(0.0, 1.0), steps=4))
    fc.load_history(beam(), fc.LoadPath(load_scale=(1.0, 0.5), steps=2), start=history_)
    assert contact_field(first.system, ["load.normal"]).rates(
        np.zeros(1), first.states[-1:], np.array([5.0])).shape == (1, 4)
    assert compiled == []
