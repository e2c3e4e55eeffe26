from .assembly.assembled_basis import PointPairing, assembled_basis
from .assembly.face_weld import FaceWeld
from .assembly.links import Bushing, Hinge, Spring, Weld, linked
from .assembly.nonlinear_springs import CubicSpring, PiecewiseSpring, PlaySpring
from .convergence import mode_convergence
from .eigenmodes import eigenfrequencies_hz
from .from_modes import normalisation
from .mode_shapes import BodyPart, ModeShapes, ReductionQuality
from .point_masses import point_masses
from .reduce_body import reduce_bodies
from .report import BasisReport
from .restriction import rows_from_dofs
from .rotating import ModalRotation

__all__ = [
    "BasisReport",
    "BodyPart",
    "Bushing",
    "CubicSpring",
    "FaceWeld",
    "Hinge",
    "ModalRotation",
    "ModeShapes",
    "PiecewiseSpring",
    "PlaySpring",
    "PointPairing",
    "ReductionQuality",
    "Spring",
    "Weld",
    "assembled_basis",
    "eigenfrequencies_hz",
    "linked",
    "mode_convergence",
    "normalisation",
    "point_masses",
    "reduce_bodies",
    "rows_from_dofs",
]
