from .interfaces import PrescribedMotion
from .nodes import SystemArrays
from .quasistatic.history import LoadHistory, Loop
from .quasistatic.pose import Sliders
from .quasistatic.rest_state import RestState

__all__ = [
    "LoadHistory",
    "Loop",
    "PrescribedMotion",
    "RestState",
    "Sliders",
    "SystemArrays",
]
