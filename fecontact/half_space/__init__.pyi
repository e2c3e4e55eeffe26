from .friction import HalfSpaceFriction, half_space_friction
from .normal_contact import HalfSpaceContact, half_space_contact
from .surface_compliance import SurfaceCompliance

__all__ = [
    "HalfSpaceContact",
    "HalfSpaceFriction",
    "SurfaceCompliance",
    "half_space_contact",
    "half_space_friction",
]
