from .attractors.attractor import Attractor
from .attractors.basins import Axis, Basins, basins
from .attractors.lyapunov import LyapunovExponents, lyapunov_exponents
from .attractors.poincare_scan import PoincareScan, poincare_scan
from .codim2 import codim2_curve
from .continuation.branch import Branch
from .continuation.point import BranchHeader, BranchPoint
from .continuation.points import (
    CrossingPoint,
    DiscontinuityPoint,
    DoubleHopfPoint,
    FoldPoint,
    HopfPoint,
    NeimarkSackerPoint,
    PeriodDoublingPoint,
    UnresolvedPoint,
    ZeroHopfPoint,
)
from .continuation.problem import BranchStatus, ContinuationOptions
from .diagram_options import BranchSettings
from .equilibria.branches import equilibrium_branch
from .equilibria.equilibrium import Equilibrium, find_equilibrium
from .equilibria.stability_map import StabilityMap, stability_map
from .fields import VectorField, vector_field
from .fields.contact_field import ContactField, contact_field
from .harmonic.engine_order import EngineOrder, WaveField
from .harmonic.method import HarmonicBalance
from .harmonic.response import FrequencyResponse, frequency_response
from .harmonic.wheel_orbits import (
    WheelMotion,
    WheelStability,
    wheel_motion,
    wheel_stability,
    wheel_system,
)
from .nonlinear_modes.controlled_response import controlled_response
from .nonlinear_modes.mode_response import ModeResponse, Resonance, mode_response
from .nonlinear_modes.nonlinear_mode import NonlinearMode, nonlinear_mode
from .nonlinear_modes.resonance_curve import ResonanceCurve, resonance_curve
from .orbit_family import orbit_family
from .orbit_forms import with_normal_form
from .orbit_methods import Collocation, Shooting
from .orbits.branches import orbit_branch
from .orbits.constant_state import floquet_multipliers
from .orbits.floquet import Floquet
from .orbits.from_run import periodic_motion
from .orbits.motions import PeriodicMotion
from .orbits.samples import amplitude, observe, quantity_range
from .response_options import ResponseSettings
from .tori.branches import torus_branch
from .tori.method import SecondExcitation, TorusBalance
from .tori.motion import TorusMotion, torus_motion
from .tree import BranchTree, branch_tree

__all__ = [
    "Attractor",
    "Axis",
    "Basins",
    "Branch",
    "BranchHeader",
    "BranchPoint",
    "BranchSettings",
    "BranchStatus",
    "BranchTree",
    "Collocation",
    "ContactField",
    "ContinuationOptions",
    "CrossingPoint",
    "DiscontinuityPoint",
    "DoubleHopfPoint",
    "EngineOrder",
    "Equilibrium",
    "Floquet",
    "FoldPoint",
    "FrequencyResponse",
    "HarmonicBalance",
    "HopfPoint",
    "LyapunovExponents",
    "ModeResponse",
    "NeimarkSackerPoint",
    "NonlinearMode",
    "PeriodDoublingPoint",
    "PeriodicMotion",
    "PoincareScan",
    "Resonance",
    "ResonanceCurve",
    "ResponseSettings",
    "SecondExcitation",
    "Shooting",
    "StabilityMap",
    "TorusBalance",
    "TorusMotion",
    "UnresolvedPoint",
    "VectorField",
    "WaveField",
    "WheelMotion",
    "WheelStability",
    "ZeroHopfPoint",
    "amplitude",
    "basins",
    "branch_tree",
    "codim2_curve",
    "contact_field",
    "controlled_response",
    "equilibrium_branch",
    "find_equilibrium",
    "floquet_multipliers",
    "frequency_response",
    "lyapunov_exponents",
    "mode_response",
    "nonlinear_mode",
    "observe",
    "orbit_branch",
    "orbit_family",
    "periodic_motion",
    "poincare_scan",
    "quantity_range",
    "resonance_curve",
    "stability_map",
    "torus_branch",
    "torus_motion",
    "vector_field",
    "wheel_motion",
    "wheel_stability",
    "wheel_system",
    "with_normal_form",
]
