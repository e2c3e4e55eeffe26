from .assembly.assembled_basis import assembled_basis
from .assembly.bodies_convergence import BodiesConvergence, bodies_convergence
from .assembly.changed_modes import with_masses
from .assembly.face_weld import FaceWeld
from .assembly.interface_compliance import InterfaceCompliance, interface_compliance
from .assembly.links import Bushing, Hinge, NonlinearSpring, Spring, Weld, linked
from .assembly.nonlinear_springs import (
    PiecewiseSpring,
    PlaySpring,
    PolynomialSpring,
)
from .assembly.point_pairing import PointPairing
from .assembly.tightened import TightenedBolts, tightened
from .convergence import ModeConvergence, mode_convergence
from .cyclic.cyclic_basis import CyclicBasis, DiameterModes, cyclic_basis
from .cyclic.cyclic_basis_from_bases import cyclic_basis_from_bases
from .cyclic.whole_wheel import WholeWheel
from .eigenmodes import eigenfrequencies_hz
from .from_modes import Normalisation, normalisation
from .half_space_compliance import with_half_space
from .large_deflections.forces import LargeDeflectionForces
from .large_deflections.options import LargeDeflections
from .matrix_files.nastran import grid_places
from .modal_rotation import ModalRotation
from .mode_shapes import BodyPart, ModeShapes, NonlinearStress, ReductionQuality
from .point_masses import point_masses
from .polynomial_stiffness import polynomial_stiffness
from .recovery import Recovery
from .reduce_body import reduce_bodies
from .report import BasisReport
from .restriction import rows_from_dofs
from .sector_modes import SectorModes, WheelShape, sector_modes
from .sector_rotation import SectorRotation

__all__ = [
    "BasisReport",
    "BodiesConvergence",
    "BodyPart",
    "Bushing",
    "CyclicBasis",
    "DiameterModes",
    "FaceWeld",
    "Hinge",
    "InterfaceCompliance",
    "LargeDeflectionForces",
    "LargeDeflections",
    "ModalRotation",
    "ModeConvergence",
    "ModeShapes",
    "NonlinearSpring",
    "NonlinearStress",
    "Normalisation",
    "PiecewiseSpring",
    "PlaySpring",
    "PointPairing",
    "PolynomialSpring",
    "Recovery",
    "ReductionQuality",
    "SectorModes",
    "SectorRotation",
    "Spring",
    "TightenedBolts",
    "Weld",
    "WheelShape",
    "WholeWheel",
    "assembled_basis",
    "bodies_convergence",
    "cyclic_basis",
    "cyclic_basis_from_bases",
    "eigenfrequencies_hz",
    "grid_places",
    "interface_compliance",
    "linked",
    "mode_convergence",
    "normalisation",
    "point_masses",
    "polynomial_stiffness",
    "reduce_bodies",
    "rows_from_dofs",
    "sector_modes",
    "tightened",
    "with_half_space",
    "with_masses",
]
