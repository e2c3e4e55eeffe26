"""Step loops with the laws written out: same results, which law is meant, when compiled."""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from systems import friction_oscillator, impact_oscillator
from test_small_systems import run_of, system

import fecontact as fc
from fecontact import Drive, Ground, Load, PointLoad
from fecontact.core import progress
from fecontact.core.compiled import CompiledLaw
from fecontact.core.errors import InputError
from fecontact.integrate import ContactEvents, Rodas5P
from fecontact.integrate.inlined_laws import kernels, step_loops
from fecontact.integrate.inlined_laws.code import _code_of
from fecontact.integrate.rodas5p import driver, small_systems, step_loop
from fecontact.integrate.rodas5p.checkpoint import Checkpoint
from fecontact.laws import (
    Constant,
    DahlFriction,
    ExponentialFriction,
    Harmonic,
    LinearContact,
    PowerContact,
    ProductFriction,
    RoughSurface,
    Sine,
    SweptSine,
    normal_law,
)
from fecontact.laws.registry import law_names
from fecontact.study.sections import SimulationSettings

# A block on a belt, on one or two nodes, of up to four modes, with changes.
CASES = {
    "one mode": (1, 1, {}),
    "two modes": (2, 1, {}),
    "two nodes": (2, 2, {}),
    "wavy ground that leans": (3, 1, {
        "normal": PowerContact(5e8, 1.5, 30.0), "friction": ProductFriction(0.5, 1.0, 0.1, 1e4),
        "ground": Ground(profile=Sine(2e-6, 1e-3), friction_variation=Sine(0.2, 2e-3),
                         speed=1e-3)}),
    "loads in time": (4, 2, {
        "normal": LinearContact(10e6, 40.0),
        "load": Load(14.0, (PointLoad(signal=SweptSine(3.0, 20.0, 40.0, 1.0)),))}),
}


def assert_same(own, other):
    """That two runs, with the laws written out and without, have come to the same."""
    assert own.with_laws is not None
    assert other.with_laws is None
    assert own.statistics == other.statistics
    assert own.time == pytest.approx(other.time, rel=1e-12)
    for name in ("state", "rate", "work", "power"):
        found, expected = getattr(own.progress, name), getattr(other.progress, name)
        assert found == pytest.approx(expected, rel=1e-8, abs=1e-9 * np.abs(expected).max()), name


@pytest.mark.parametrize("work", [True, False])
@pytest.mark.parametrize("case", CASES)
def test_same_results_as_with_calls(case, work):
    modes, nodes, changes = CASES[case]
    block = system(modes, nodes, **changes)
    # Steps of one length: where they follow the error, rounding shifts their ends.
    own, other = (run_of(block, max_step=2e-5, work=work, inline_laws=use)
                  for use in (True, False))
    for run in (own, other):
        run.advance(500)
    assert np.abs(other.progress.state).max() > 1e-3
    assert_same(own, other)


def test_same_events_as_with_calls():
    """A block that lifts off, is dropped, slips and sticks."""
    block = system(2, 2, load=Load(14.0, (PointLoad(signal=Harmonic(40.0, 300.0)),)))
    own, other = (run_of(block, max_step=2e-5, inline_laws=use, events=[ContactEvents()])
                  for use in (True, False))
    for run in (own, other):
        for _ in range(10):
            run.advance(500)
    assert own.with_laws is not None
    found, expected = own.events, other.events
    assert set(expected.kind) == {"touch-down", "lift-off", "stick"}
    np.testing.assert_array_equal(found.kind, expected.kind)
    np.testing.assert_array_equal(found.node, expected.node)
    assert found.time == pytest.approx(expected.time, abs=1e-9)
    assert np.abs(found.states - expected.states).max() < 1e-6 * np.abs(expected.states).max()


def test_a_run_and_the_radau_of_scipy():
    """All the way by simulate, a block that is shaken from rest on its belt."""
    block = system(2, 1, load=Load(14.0, (PointLoad(signal=Harmonic(5.0, 300.0)),)))
    own = fc.simulate(block, 0.05, outputs=51, rtol=1e-6, solver=Rodas5P(inline_laws=True))
    reference = fc.simulate(block, 0.05, outputs=51, rtol=1e-8, solver=fc.integrate.Scipy("Radau"))
    size = np.abs(reference.states).max(axis=0)
    assert (np.abs(own.states - reference.states).max(axis=0) < 1e-4 * size).all()
    assert own.energies.imbalance < 1e-5


def contact(factor):
    """A class of laws whose kernels have one name, and what they do depends on the factor."""

    @normal_law
    def force(u, v, p):
        return (factor * p[0] * u, factor * p[0], 0.0) if u > 0.0 else (0.0, 0.0, 0.0)

    @dataclass(frozen=True)
    class Mine(fc.laws.NormalLaw):
        kernel: ClassVar = force
        stiffness: float = 1e6

        @property
        def penetration_scale(self):
            return 1e-6

    return Mine


@pytest.fixture
def counted(monkeypatch, tmp_path):
    """Kernels stored in a folder of the test; how many were compiled, and what was said of it."""
    counts = SimpleNamespace(compiled=0, said=[])
    stored_elsewhere(monkeypatch.setattr, tmp_path, counts)
    return counts


def stored_elsewhere(put, folder, counts):
    dispatcher, compiled = kernels._dispatcher, kernels._compiled

    def with_other_folder(function, variant, **options):
        found = dispatcher(function, variant, **options)
        if variant != "intermediate":
            file = found._cache._cache_file
            file._cache_path, file._index_path = str(folder), str(Path(folder, file._index_name))
        return found

    def count(*arguments):
        counts.compiled += 1
        return compiled(*arguments)

    put(kernels, "_dispatcher", with_other_folder)
    put(kernels, "_compiled", count)
    put(step_loops, "say", counts.said.append)


def test_laws_of_one_name_are_not_taken_for_each_other(counted):
    ends = []
    for factor in (1.0, 2.0):
        item = system(1, 1, normal=contact(factor)(3e6))
        own, expected = (run_of(item, max_step=2e-5, inline_laws=use) for use in (True, False))
        own.advance(1000)
        expected.advance(1000)
        assert_same(own, expected)
        ends.append(own.progress.state)
    assert counted.compiled == 2
    assert np.abs(ends[0] - ends[1]).max() > 0.05 * np.abs(ends[0]).max()


def test_parameters_need_no_compilation(counted):
    block = system(2, 1, normal=contact(3.0)(3e6))
    own = run_of(block, inline_laws=True)
    assert counted.compiled == len(counted.said) == 1
    changes = {"normal.stiffness": 2e6, "friction.static_coefficient": 0.7, "ground.speed": 2e-3,
               "drive.amplitude_x": 1e-3, "drive.stiffness_y": 1e3, "load.normal": 9.0}
    changed = block.with_(**changes)
    own, other = (run_of(changed, max_step=2e-5, inline_laws=use) for use in (True, False))
    assert counted.compiled == 1
    own.advance(500)
    other.advance(500)
    assert_same(own, other)
    # Another friction law needs it.
    run_of(block.with_(friction=ProductFriction(0.5, 1.0, 0.1, 1e4)), inline_laws=True)
    assert counted.compiled == len(counted.said) == 2


OWN = '''
from dataclasses import dataclass
from typing import ClassVar
from fecontact.laws import NormalLaw, normal_law

@normal_law
def force(u, v, p):
    return (FACTOR * p[0] * u, FACTOR * p[0], 0.0) if u > 0.0 else (0.0, 0.0, 0.0)

@dataclass(frozen=True)
class Own(NormalLaw):
    kernel: ClassVar = force
    stiffness: float = 1e6
    @property
    def penetration_scale(self):
        return 1e-6
'''

RUN = '''
import sys
from types import SimpleNamespace
sys.path[:0] = PATHS
from test_inlined_laws import driver, stored_elsewhere
from test_small_systems import run_of, system
LAW
counts = SimpleNamespace(compiled=0, said=[])
stored_elsewhere(setattr, "FOLDER", counts)
ends = []
for use in (True, False):
    run = run_of(system(2, 1, normal=Own(STIFFNESS)), max_step=2e-5, inline_laws=use)
    run.advance(1500)
    ends.append(run.progress.state)
print(counts.compiled, len(counts.said), float(abs(ends[0] - ends[1]).max()), float(ends[0][1]))
'''


@pytest.mark.parametrize("kept", [True, False])
def test_another_process_compiles_what_is_not_stored(kept, tmp_path):
    """Laws from a file, whose own code is kept on disk, and from a console, where it is not."""
    paths = [str(tmp_path), str(Path(__file__).parent), str(Path(__file__).parents[1])]

    def run(stiffness, factor):
        law = OWN.replace("FACTOR", str(factor))
        if kept:
            (tmp_path / "own.py").write_text(law)
            law = "from own import Own"
        script = RUN.replace("PATHS", repr(paths)).replace("LAW", law).replace(
            "FOLDER", str(tmp_path)).replace("STIFFNESS", str(stiffness))
        done = subprocess.run([sys.executable, "-"], input=script, check=False,
                              capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        compiled, said, difference, depth = map(float, done.stdout.split())
        assert difference < 1e-12
        assert compiled == said
        return compiled, depth

    first, depth = run(1e6, 1.0)
    again, same = run(1e6, 1.0)
    assert (first, again) == (1, 0)
    assert same == depth
    if not kept:
        return
    softer, deeper = run(5e5, 1.0)
    assert softer == 0
    changed, as_deep = run(1e6, 0.5)
    assert changed == 1
    # Half the stiffness, and half the force.
    assert as_deep == pytest.approx(deeper, rel=1e-9)
    assert abs(deeper - depth) > 0.1 * abs(depth)


def test_what_is_said_before_compilation(monkeypatch, capsys):
    step_loops._announce(True)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(progress, "_kind", lambda: progress._TerminalBar)
    step_loops._announce(True)
    step_loops._announce(False)
    prepared, all_of_it = capsys.readouterr().err.splitlines()
    assert prepared.startswith("Compiling the step loop")
    assert "about 4 s" in prepared
    assert "about 30 s" in all_of_it


def _small_parts():
    """Every law of the package that a small system may have."""
    for names in law_names().values():
        for law in names.values():
            for name in ("kernel", "motion_kernel"):
                found = getattr(law, name, None)
                # Those that fill arrays have internal variables.
                if isinstance(found, CompiledLaw) and "rates" not in found.form:
                    yield pytest.param(found, id=f"{law.__name__}.{name}")


@pytest.mark.parametrize("law", list(_small_parts()))
def test_every_law_of_the_package_can_be_written_out(law):
    assert law.address
    entries = [item.name for item in _code_of(law, "name").functions
               if not item.is_declaration and item.linkage.name == "external"]
    assert entries == ["name"]


@normal_law
def _allocates(u, v, p):
    values = np.zeros(int(p[0] / 1e6))
    values[:] = u
    return max(0.0, values.sum()), 1.0, 0.0


class Allocating(RoughSurface):
    kernel: ClassVar = _allocates


class Foreign(Constant):
    kernel: ClassVar = SimpleNamespace(address=Constant.kernel.address)


@pytest.mark.parametrize(("block", "reason"), [
    (lambda: system(5, 1), "5 modes and 1 nodes are not among them"),
    (lambda: system(2, 3), "2 modes and 3 nodes are not among them"),
    (lambda: system(2, 1, friction=DahlFriction(0.3, 1e6)), "there is friction with memory"),
    (lambda: system(2, 1, load=Load(14.0, (PointLoad(signal=Foreign(1.0)),))),
     "the function of its load is a SimpleNamespace"),
    (lambda: system(2, 1, normal=Allocating(10e6, 10e-6, 40.0)),
     "The law _allocates does more than arithmetic"),
])
def test_systems_that_it_is_not_for(block, reason):
    with pytest.raises(InputError, match=reason):
        run_of(block(), inline_laws=True)


def test_bodies_that_are_not_coupled():
    run = run_of(system(2, 1))
    apart = run.problem.blocks._replace(coupled=np.array([0, 0]))
    with pytest.raises(InputError, match="bodies that are not coupled"):
        step_loops.advance_with_laws(system(2, 1), run.problem._replace(blocks=apart))


def test_runs_by_series_and_by_collocation_stay_as_they_are():
    series = impact_oscillator(1)
    tight = friction_oscillator()
    for one, rtol in ((series, 1e-6), (tight, 1e-8)):
        run = driver.start(one, np.zeros(one.size), np.linspace(0.0, 0.1, 11), rtol=rtol,
                           inline_laws=True)
        assert run.with_laws is None
        assert (run.series or run.collocation) is not None


def test_derivatives_are_those_of_calls():
    run = run_of(system(2, 1), vary=True, inline_laws=True)
    assert run.with_laws is None
    assert small_systems.advance_for(run.problem, run.variation) is step_loop.advance


def test_where_it_is_asked_for():
    assert SimulationSettings(inline_laws=True).chosen_solver() == Rodas5P(inline_laws=True)
    assert SimulationSettings().chosen_solver() == Rodas5P(inline_laws=False)
    block = system(2, 1)
    for use in ("series", "collocation"):
        with pytest.raises(InputError, match=f"steps without {use}"):
            Rodas5P(inline_laws=True, **{use: "always"})
    with pytest.raises(InputError, match="inline_laws is for single runs"):
        fc.ensemble([block], [0.0, 0.1], solver=Rodas5P(inline_laws=True))
    with pytest.raises(InputError, match="only for solver = 'rodas5p'"):
        SimulationSettings(solver="radau", inline_laws=True)


def test_checkpoints_of_runs_with_calls_are_not_taken_up(tmp_path):
    block, path = system(2, 1), tmp_path / "run.npz"
    marks = [Checkpoint.of(path, run_of(block, inline_laws=use), np.zeros(4)).mark
             for use in (True, True, False)]
    assert marks[0] == marks[1] != marks[2]


def test_the_laws_are_those_of_the_arrays():
    """Each address that a system's arrays hold is that of the law that is written out for it."""
    for case in CASES.values():
        modes, nodes, changes = case
        block = system(modes, nodes, **{"drive": Drive(stiffness_y=1e3, motion_x=SweptSine(
            1e-3, 20.0, 40.0, 1.0)), **changes})
        for field, laws in step_loops.laws_of(block).items():
            found = getattr(block.arrays, field)
            if not isinstance(laws, tuple):
                assert found == (0 if laws is None else laws.address)
            else:
                np.testing.assert_array_equal(found, [law.address for law in laws])
    assert ExponentialFriction.kernel in step_loops.laws_of(system(1, 1))["friction"]
