from .amplitude_curve import AmplitudeCurve, backbone_curve, modal_mass_at, mode_curve
from .ring_down import ring_down
from .swept_response import swept_curve

__all__ = [
    "AmplitudeCurve",
    "backbone_curve",
    "modal_mass_at",
    "mode_curve",
    "ring_down",
    "swept_curve",
]
