from .basis import ModalBasis
from .body import ElasticBody, Material
from .damping import Rayleigh
from .errors import FecontactError
from .geometry import Beam, Block, Pendulum, generate
from .integrate.initial import RigidStart
from .integrate.simulate import simulate
from .integrate.trajectory import ContactState, Status, Trajectory
from .laws.drive import Drive, Load
from .laws.friction import ExponentialFriction
from .laws.ground import Ground
from .laws.normal import RoughSurface
from .mesh import Mesh
from .mesh_io import read_mesh, write_mesh
from .points import Patch
from .statics import static_equilibrium
from .system import ContactSystem

__version__: str

__all__ = [
    "Beam",
    "Block",
    "ContactState",
    "ContactSystem",
    "Drive",
    "ElasticBody",
    "ExponentialFriction",
    "FecontactError",
    "Ground",
    "Load",
    "Material",
    "Mesh",
    "ModalBasis",
    "Patch",
    "Pendulum",
    "Rayleigh",
    "RigidStart",
    "RoughSurface",
    "Status",
    "Trajectory",
    "generate",
    "read_mesh",
    "simulate",
    "static_equilibrium",
    "write_mesh",
]
