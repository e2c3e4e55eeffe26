from .attractors.basins import Attractor, Axis, Basins, basins
from .attractors.lyapunov import LyapunovExponents, lyapunov_exponents
from .attractors.poincare_scan import PoincareScan, poincare_scan
from .continuation.branch import Branch
from .continuation.points import (
    BranchPoint,
    CrossingPoint,
    FoldPoint,
    HopfPoint,
    NeimarkSackerPoint,
    PeriodDoublingPoint,
    UnresolvedPoint,
)
from .continuation.problem import BranchStatus, ContinuationOptions
from .equilibria.branches import equilibrium_branch
from .equilibria.codim2 import fold_curve, hopf_curve
from .equilibria.equilibrium import Equilibrium, find_equilibrium
from .equilibria.stability_map import stability_map
from .fields.contact_field import ContactField, contact_field
from .fields.function_field import vector_field
from .fields.vector_field import VectorField
from .orbits.branches import Collocation, Shooting, orbit_branch
from .orbits.codim2 import orbit_curve
from .orbits.from_run import periodic_motion
from .orbits.motions import PeriodicMotion
from .orbits.samples import amplitude, observe, quantity_range

__all__ = [
    "Attractor",
    "Axis",
    "Basins",
    "Branch",
    "BranchPoint",
    "BranchStatus",
    "Collocation",
    "ContactField",
    "ContinuationOptions",
    "CrossingPoint",
    "Equilibrium",
    "FoldPoint",
    "HopfPoint",
    "LyapunovExponents",
    "NeimarkSackerPoint",
    "PeriodDoublingPoint",
    "PeriodicMotion",
    "PoincareScan",
    "Shooting",
    "UnresolvedPoint",
    "VectorField",
    "amplitude",
    "basins",
    "contact_field",
    "equilibrium_branch",
    "find_equilibrium",
    "fold_curve",
    "hopf_curve",
    "lyapunov_exponents",
    "observe",
    "orbit_branch",
    "orbit_curve",
    "periodic_motion",
    "poincare_scan",
    "quantity_range",
    "stability_map",
    "vector_field",
]
