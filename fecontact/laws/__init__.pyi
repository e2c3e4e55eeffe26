from .base import Bound, FrictionLaw, NormalLaw, NotNegative, PerNode, Positive
from .check import CompiledLaw, check_law
from .friction.bristle import BoucWenFriction, DahlFriction, LuGreFriction
from .friction.maxwell_slip import (
    FourParameterIwanFriction,
    IwanFriction,
    JenkinsFriction,
    ParallelSliders,
)
from .friction.stribeck import (
    ConstantFriction,
    CubicFriction,
    ExponentialFriction,
    Frictionless,
    GalvanettoFriction,
    GaussianFriction,
    HyperbolicFriction,
    ProductFriction,
)
from .friction_contact import FrictionContact3D
from .ground.fourier_series import FourierSeries
from .ground.height_map import HeightMap
from .ground.measured_profile import MeasuredProfile
from .ground.motion import GroundMotion, HarmonicSpeed, SpeedRamp
from .ground.profile import Flat, Profile, Sine
from .ground.random_roughness import RandomRoughness
from .ground.sliding import SlidingRotation, SlidingTranslation
from .normal.asperities import AsperityContact
from .normal.bilateral import (
    BilateralLaw,
    BilateralPiecewise,
    BilateralPlay,
    BilateralPolynomial,
)
from .normal.linear import LinearContact, PrescribedForce, TwoSidedStop
from .normal.measured_surface import MeasuredSurface
from .normal.power import BackBurdekinContact, PowerContact, RestitutionContact
from .normal.rigid_stop import RigidStop
from .normal.rough_surface import CosineSurface, GaussianSurface, ParabolicSurface, RoughSurface
from .normal.statistical import ExponentialContact, GreenwoodWilliamson
from .registry import law_names
from .signals.base import Signal
from .signals.harmonic import Constant, Harmonic, Harmonics, SweptSine
from .signals.transient import Pulse, Step, Tabulated
from .signatures import (
    friction_law,
    ground_profile,
    memory_friction_law,
    normal_law,
    planar_friction_law,
    signal,
)
from .wear import ArchardWear, EnergyWear, WearLaw

__all__ = [
    "ArchardWear",
    "AsperityContact",
    "BackBurdekinContact",
    "BilateralLaw",
    "BilateralPiecewise",
    "BilateralPlay",
    "BilateralPolynomial",
    "BoucWenFriction",
    "Bound",
    "CompiledLaw",
    "Constant",
    "ConstantFriction",
    "CosineSurface",
    "CubicFriction",
    "DahlFriction",
    "EnergyWear",
    "ExponentialContact",
    "ExponentialFriction",
    "Flat",
    "FourParameterIwanFriction",
    "FourierSeries",
    "FrictionContact3D",
    "FrictionLaw",
    "Frictionless",
    "GalvanettoFriction",
    "GaussianFriction",
    "GaussianSurface",
    "GreenwoodWilliamson",
    "GroundMotion",
    "Harmonic",
    "HarmonicSpeed",
    "Harmonics",
    "HeightMap",
    "HyperbolicFriction",
    "IwanFriction",
    "JenkinsFriction",
    "LinearContact",
    "LuGreFriction",
    "MeasuredProfile",
    "MeasuredSurface",
    "NormalLaw",
    "NotNegative",
    "ParabolicSurface",
    "ParallelSliders",
    "PerNode",
    "Positive",
    "PowerContact",
    "PrescribedForce",
    "ProductFriction",
    "Profile",
    "Pulse",
    "RandomRoughness",
    "RestitutionContact",
    "RigidStop",
    "RoughSurface",
    "Signal",
    "Sine",
    "SlidingRotation",
    "SlidingTranslation",
    "SpeedRamp",
    "Step",
    "SweptSine",
    "Tabulated",
    "TwoSidedStop",
    "WearLaw",
    "check_law",
    "friction_law",
    "ground_profile",
    "law_names",
    "memory_friction_law",
    "normal_law",
    "planar_friction_law",
    "signal",
]
