from .bodies_section import BodyBasisSettings, BodySections, InterfaceSettings, Placement, Reduced
from .convergence import study_convergence
from .fit_section import FitDataSettings, FitParameter, FitSettings, PosteriorSettings
from .geometry_section import MeshFile
from .links_section import FaceWeldSettings, ShakerSettings
from .materials_section import MaterialSettings
from .measurement_section import MeasurementSettings
from .preload_section import PreloadSettings
from .render_section import RenderSettings
from .sections import (
    BasisSettings,
    BodySettings,
    OutputSettings,
    SimulationSettings,
    WearSettings,
)
from .sector_section import MistuningSettings
from .sweep_section import Distribution, Span, Strobing, SweepSettings

__all__ = [
    "BasisSettings",
    "BodyBasisSettings",
    "BodySections",
    "BodySettings",
    "Distribution",
    "FaceWeldSettings",
    "FitDataSettings",
    "FitParameter",
    "FitSettings",
    "InterfaceSettings",
    "MaterialSettings",
    "MeasurementSettings",
    "MeshFile",
    "MistuningSettings",
    "OutputSettings",
    "Placement",
    "PosteriorSettings",
    "PreloadSettings",
    "Reduced",
    "RenderSettings",
    "ShakerSettings",
    "SimulationSettings",
    "Span",
    "Strobing",
    "SweepSettings",
    "WearSettings",
    "study_convergence",
]
