from .ensembles import Ensemble, strobe
from .event_table import Events
from .events import ContactEvents, Crossing
from .field_runs.field_run import FieldRun
from .initial_state import PointStart, initial_state
from .kept_steps import KeptSteps
from .recorded import RecordedContact
from .sensitivities import Sensitivity
from .smoothing_cost import SmoothingCost, smoothing_cost
from .solvers import (
    CVODE,
    Auto,
    EventDriven,
    PowerSeries,
    Radau,
    Rodas5P,
    Scipy,
    SetValued,
    Solver,
    TimeStepping,
)
from .task import Task
from .trajectory import Energies, Solution
from .wear import WearHistory, wear_history

__all__ = [
    "CVODE",
    "Auto",
    "ContactEvents",
    "Crossing",
    "Energies",
    "Ensemble",
    "EventDriven",
    "Events",
    "FieldRun",
    "KeptSteps",
    "PointStart",
    "PowerSeries",
    "Radau",
    "RecordedContact",
    "Rodas5P",
    "Scipy",
    "Sensitivity",
    "SetValued",
    "SmoothingCost",
    "Solution",
    "Solver",
    "Task",
    "TimeStepping",
    "WearHistory",
    "initial_state",
    "smoothing_cost",
    "strobe",
    "wear_history",
]
