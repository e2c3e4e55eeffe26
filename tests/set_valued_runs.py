"""Runs with set-valued friction, by what they take."""

from fecontact.integrate import EventDriven, SetValued, TimeStepping
from fecontact.integrate.nonsmooth import driver
from fecontact.integrate.task import Task

SOLVERS = {one.method: one for one in (SetValued, EventDriven, TimeStepping)}
OF_TASKS = "max_step", "events", "keep_steps", "progress"


def integrate_set_valued(*given, **options):
    """Result of a run of a system from a state to output times, with options of task and solver."""
    return driver.integrate_set_valued(*_task(*given, **options))


def start_set_valued(*given, **options):
    """Such a run before its first step."""
    return driver.start(*_task(*given, **options))


def _task(system, state, times, *, rtol=1e-6, method="set-valued", **options):
    task = Task(system, state, times, rtol,
                **{name: options.pop(name) for name in OF_TASKS if name in options})
    return task, SOLVERS[method](**options)
