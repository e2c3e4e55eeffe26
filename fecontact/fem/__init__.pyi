from .pairing import Pairing, PairingReport, finer_face, pair_both_faces, pair_faces

__all__ = [
    "Pairing",
    "PairingReport",
    "finer_face",
    "pair_both_faces",
    "pair_faces",
]
