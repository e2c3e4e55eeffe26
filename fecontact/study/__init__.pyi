from .convergence import study_convergence
from .preload_section import PreloadSettings
from .sections import BasisSettings
from .sweep_section import Distribution, Span, Strobing, SweepSettings

__all__ = [
    "BasisSettings",
    "Distribution",
    "PreloadSettings",
    "Span",
    "Strobing",
    "SweepSettings",
    "study_convergence",
]
