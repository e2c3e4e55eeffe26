from .amplitude_curve import AmplitudeCurve, backbone_curve, modal_mass_at, mode_curve
from .assurance import (
    ModePairs,
    modal_assurance,
    pair_modes,
    response_assurance,
    scale_question,
)
from .measurement import Channel, Measurement
from .ring_down import ring_down
from .swept_response import swept_curve

__all__ = [
    "AmplitudeCurve",
    "Channel",
    "Measurement",
    "ModePairs",
    "backbone_curve",
    "modal_assurance",
    "modal_mass_at",
    "mode_curve",
    "pair_modes",
    "response_assurance",
    "ring_down",
    "scale_question",
    "swept_curve",
]
