"""Results of 200 runs by all solvers, kept in a file, and compared with those of another tree.

Random systems of all laws in the plane and in space (see `random_systems.py`), oscillators of one
to three modes (see `integrator_problems.py`), two stacked beams and a solid, by every solver that
takes them; half of them with derivatives to the start and the ground speed, and ensembles of eight
starts. Kept are states at 20 times, powers integrated over time,
steps, numbers of events, and derivatives. What a solver refuses is kept as its sentence.

Usage: python benchmarks/kept_runs.py keep FILE [--quick]
       python benchmarks/kept_runs.py compare FILE [--quick] [--within D]
With `compare` the exit code is 1 if a difference, over the range of what is compared, exceeds D.
"""

import argparse
import sys
import time
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
from bodies import stack
from integrator_problems import diagram, friction_oscillator, impact_oscillator
from random_systems import random_case
from solids import solid

import fecontact as fc
from fecontact.core.types import Array
from fecontact.integrate import (
    CVODE,
    EventDriven,
    PowerSeries,
    Radau,
    Rodas5P,
    Scipy,
    SetValued,
    TimeStepping,
)
from fecontact.integrate.events import ContactEvents

OUTPUTS, WITHIN = 20, 1e-9
SYSTEMS, QUICK = 24, 2
# Solvers and their tolerances.
SOLVERS: dict[str, tuple[Any, float]] = {
    "rodas5p": (Rodas5P(), 1e-6),
    "series": (PowerSeries(), 1e-6),
    "collocation": (Radau(), 1e-9),
    "events": (EventDriven(), 1e-6),
    "stepping": (TimeStepping(), 1e-4),
    "rigid": (SetValued(restitution=0.5), 1e-6),
    "scipy": (Scipy(), 1e-6),
    "cvode": (CVODE(), 1e-6),
}
Results = dict[str, Array]


def systems(quick: bool) -> Iterator[tuple[str, Any, Any, float]]:
    """Names, systems, starts and lengths of runs."""
    for number in range(QUICK if quick else SYSTEMS):
        case = random_case(number)
        yield f"{number} {' '.join(case.names)}", case.system, case.state, 0.25 * case.end
    if quick:
        return
    for problem in (impact_oscillator(), *map(friction_oscillator, ("b", "b2", "c", "r"))):
        yield problem.name, problem.system, problem.state, 1.0
    for one in diagram(np.linspace(6.4, 14.3, 4)):
        yield f"f at {one.drive.frequency_hz:.1f} Hz", one, np.zeros(one.size), 0.5
    yield "two beams", stack(2, 4, 5), np.zeros(stack(2, 4, 5).size), 2e-3
    yield "solid", solid(4, 8), "rest", 2e-3


def run(system: Any, initial: Any, end: float, solver: Any, rtol: float) -> Results:
    """A run: states, work, steps, events."""
    events = (ContactEvents(),) if solver == SOLVERS["rodas5p"][0] else ()
    found = fc.simulate(system, end, initial=initial, outputs=OUTPUTS, rtol=rtol, solver=solver,
                        events=events)
    count = 0 if found.events is None else len(found.events)
    return {"states": found.states, "work": found.work,
            "counts": np.array([found.statistics["steps"], count], dtype=float)}


def derivatives(system: Any, initial: Any, end: float) -> Results:
    """Derivatives of a run to its start and to the speed of the ground."""
    found = fc.sensitivity(system, end, initial=initial, parameter="ground.speed")
    return {"monodromy": found.monodromy, "forced": found.parameter_derivative}


def eight(system: Any, initial: Array, end: float) -> Results:
    """States of an ensemble of eight starts."""
    starts = np.asarray(initial)[None] * np.linspace(0.5, 1.0, 8)[:, None]
    found = fc.ensemble(system, np.linspace(0.0, end, OUTPUTS), initial=starts)
    return {"states": found.states, "counts": found.steps.astype(float)}


def all_runs(quick: bool) -> Iterator[tuple[str, Results]]:
    """Names and results of all runs."""
    for number, (name, system, initial, end) in enumerate(systems(quick)):
        tasks = {kind: (run, (system, initial, end, *chosen)) for kind, chosen in SOLVERS.items()}
        if number % 2 == 0:
            tasks["derivatives"] = derivatives, (system, initial, end)
        elif not isinstance(initial, str):
            tasks["ensemble"] = eight, (system, initial, end)
        for kind, (task, arguments) in tasks.items():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", fc.ModelWarning)
                try:
                    found = task(*arguments)
                except fc.FecontactError as error:
                    found = {"refused": np.array(str(error))}
            yield f"{kind}: {name}", found


def difference(found: Array, kept: Array) -> float:
    """Largest difference over the range of what is kept; infinite where shapes or NaN differ."""
    if found.shape != kept.shape:
        return np.inf
    if found.dtype.kind == "U":
        return 0.0
    if (np.isnan(found) != np.isnan(kept)).any():
        return np.inf
    scale = np.nanmax(np.abs(kept), initial=0.0)
    return float(np.nanmax(np.abs(found - kept), initial=0.0) / scale) if scale else float(
        np.nanmax(np.abs(found), initial=0.0))


def main(task: str, path: str, quick: bool, within: float) -> int:
    """Keep or compare; return the exit code."""
    begin, count, worst, far = time.perf_counter(), 0, 0.0, 0
    kept: dict[str, Array] = {} if task == "keep" else dict(np.load(path))
    for name, found in all_runs(quick):
        count += 1
        keys = {f"{name} | {key}": value for key, value in found.items()}
        if task == "keep":
            kept |= keys
            continue
        before = {key for key in kept if key.startswith(f"{name} | ")}
        apart = [f"{key.rpartition(' ')[2]} {difference(keys[key], kept[key]):.1e}"
                 for key in sorted(before & set(keys)) if not key.endswith("counts")
                 and difference(keys[key], kept[key]) > within]
        worst = max([worst, *(difference(keys[key], kept[key]) for key in before & set(keys)
                              if not key.endswith("counts"))])
        steps = f"{name} | counts"
        if steps in before & set(keys) and (keys[steps] != kept[steps]).any():
            apart.append(f"counts {kept[steps].ravel()[:8]} -> {keys[steps].ravel()[:8]}")
        apart += [f"only {'here' if key in keys else 'kept'}: {key.rpartition(' ')[2]}"
                  for key in sorted(before ^ set(keys))]
        far += bool(apart)
        if apart:
            print(f"{name}: {', '.join(apart)}", flush=True)
    if task == "keep":
        np.savez_compressed(path, **kept)  # type: ignore[arg-type]
        refused = sum(key.endswith("refused") for key in kept)
        print(f"kept {count} runs, {refused} of them refused")
    else:
        print(f"compared {count} runs, {far} differ; largest difference {worst:.1e}")
    print(f"{time.perf_counter() - begin:.0f} s", file=sys.stderr)
    return int(far > 0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("task", choices=["keep", "compare"])
    parser.add_argument("file")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--within", type=float, default=WITHIN)
    given = parser.parse_args()
    sys.exit(main(given.task, given.file, given.quick, given.within))
