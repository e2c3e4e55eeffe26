from .contact_quantities import Instant
from .forcing_period import forcing_period
from .interfaces import PrescribedMotion
from .nodes import SystemArrays
from .quasistatic.history import LoadHistory, Loop
from .quasistatic.pose import Sliders
from .quasistatic.rest_state import RestState
from .statics.equilibrium import ContactEquilibrium

__all__ = [
    "ContactEquilibrium",
    "Instant",
    "LoadHistory",
    "Loop",
    "PrescribedMotion",
    "RestState",
    "Sliders",
    "SystemArrays",
    "forcing_period",
]
