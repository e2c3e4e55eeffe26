from .pairing import Pairing, finer_face, pair_both_faces, pair_faces
from .pairing_report import PairingReport

__all__ = [
    "Pairing",
    "PairingReport",
    "finer_face",
    "pair_both_faces",
    "pair_faces",
]
