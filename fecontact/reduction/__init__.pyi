from .convergence import mode_convergence
from .eigenmodes import eigenfrequencies_hz
from .from_modes import normalisation
from .mode_shapes import BodyPart, ModeShapes, ReductionQuality
from .report import BasisReport
from .restriction import rows_from_dofs
from .rotating import ModalRotation

__all__ = [
    "BasisReport",
    "BodyPart",
    "ModalRotation",
    "ModeShapes",
    "ReductionQuality",
    "eigenfrequencies_hz",
    "mode_convergence",
    "normalisation",
    "rows_from_dofs",
]
