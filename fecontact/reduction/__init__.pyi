from .convergence import mode_convergence
from .eigenmodes import eigenfrequencies_hz
from .modal_basis import ModeShapes, ReductionQuality
from .report import BasisReport
from .restriction import rows_from_dofs

__all__ = [
    "BasisReport",
    "ModeShapes",
    "ReductionQuality",
    "eigenfrequencies_hz",
    "mode_convergence",
    "rows_from_dofs",
]
