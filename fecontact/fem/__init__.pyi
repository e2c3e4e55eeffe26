from .fields import BodyFields
from .pairing import Pairing, TwoPassPairing, finer_face, pair_both_faces, pair_faces
from .pairing_report import PairingReport
from .rotation import Rotation

__all__ = [
    "BodyFields",
    "Pairing",
    "PairingReport",
    "Rotation",
    "TwoPassPairing",
    "finer_face",
    "pair_both_faces",
    "pair_faces",
]
