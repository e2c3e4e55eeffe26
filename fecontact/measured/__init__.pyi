from .acquisition import Acquisition, measure
from .amplitude_curve import AmplitudeCurve, backbone_curve, modal_mass_at, mode_curve
from .assurance import (
    ModePairs,
    modal_assurance,
    pair_modes,
    response_assurance,
    scale_question,
)
from .averaged_responses import averaged_responses
from .experimental_modes import ExperimentalModes, experimental_modes
from .measurement import Channel, Measurement
from .ring_down import ring_down
from .sensors import Accelerometer, ForceGauge, Sensor, with_sensors
from .shaker import Shaker
from .swept_response import swept_curve
from .time_series import from_sep005

__all__ = [
    "Accelerometer",
    "Acquisition",
    "AmplitudeCurve",
    "Channel",
    "ExperimentalModes",
    "ForceGauge",
    "Measurement",
    "ModePairs",
    "Sensor",
    "Shaker",
    "averaged_responses",
    "backbone_curve",
    "experimental_modes",
    "from_sep005",
    "measure",
    "modal_assurance",
    "modal_mass_at",
    "mode_curve",
    "pair_modes",
    "response_assurance",
    "ring_down",
    "scale_question",
    "swept_curve",
    "with_sensors",
]
