from .sweep_section import Distribution, Span, Strobing, SweepSettings

__all__ = [
    "Distribution",
    "Span",
    "Strobing",
    "SweepSettings",
]
