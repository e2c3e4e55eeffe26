from .attachments import PointMass, PointSpring
from .constraints import Coupling, LinearEquation, Term, Tie
from .cyclic_symmetry import CyclicSymmetry, SectorNodes
from .element_block import ElementBlock
from .elements.cell_kinds import CellBlock, CellKind
from .elimination import Elimination
from .fields import BodyFields, stress_of
from .material import AnisotropicMaterial
from .material_axes import CurveAxes, CylindricalAxes, FieldAxes, MaterialAxes
from .mesh_files import mesh_from
from .pairing import Pairing, TwoPassPairing, finer_face, pair_both_faces, pair_faces
from .pairing_report import PairingReport
from .pretension import PretensionSection, with_pretension
from .rotation import Rotation
from .solids.shapes import Cylinder, LapStrip, Plate, Ring, SolidBlock, SphereSegment
from .supports import HingeSupport

__all__ = [
    "AnisotropicMaterial",
    "BodyFields",
    "CellBlock",
    "CellKind",
    "Coupling",
    "CurveAxes",
    "CyclicSymmetry",
    "Cylinder",
    "CylindricalAxes",
    "ElementBlock",
    "Elimination",
    "FieldAxes",
    "HingeSupport",
    "LapStrip",
    "LinearEquation",
    "MaterialAxes",
    "Pairing",
    "PairingReport",
    "Plate",
    "PointMass",
    "PointSpring",
    "PretensionSection",
    "Ring",
    "Rotation",
    "SectorNodes",
    "SolidBlock",
    "SphereSegment",
    "Term",
    "Tie",
    "TwoPassPairing",
    "finer_face",
    "mesh_from",
    "pair_both_faces",
    "pair_faces",
    "stress_of",
    "with_pretension",
]
