from .basis import ModalBasis
from .basis_report import BasisReport
from .body import ElasticBody, Material
from .damping import LossFactor, Rayleigh
from .errors import FecontactError
from .formats.matrices import read_matrix
from .formats.uff import read_uff
from .gap import Crown
from .geometry import Beam, Block, Pendulum, generate
from .integrate.initial import RigidStart
from .integrate.simulate import simulate
from .integrate.trajectory import ContactState, Energies, Status, Trajectory
from .laws.drive import Drive, Load
from .laws.friction import ExponentialFriction
from .laws.ground import Ground
from .laws.normal import RoughSurface
from .mesh import Mesh
from .mesh_io import read_mesh, write_mesh
from .mode_convergence import mode_convergence
from .output.movie import picture, render
from .output.plots import plot_contact_map, plot_energies, plot_history, plot_modes, plot_phase
from .output.pvd import export_pvd
from .output.store import read_case, write_case
from .points import Patch
from .rows import rows_from_dofs
from .statics import static_equilibrium
from .study import Study
from .system import ContactSystem

__version__: str

__all__ = [
    "BasisReport",
    "Beam",
    "Block",
    "ContactState",
    "ContactSystem",
    "Crown",
    "Drive",
    "ElasticBody",
    "Energies",
    "ExponentialFriction",
    "FecontactError",
    "Ground",
    "Load",
    "LossFactor",
    "Material",
    "Mesh",
    "ModalBasis",
    "Patch",
    "Pendulum",
    "Rayleigh",
    "RigidStart",
    "RoughSurface",
    "Status",
    "Study",
    "Trajectory",
    "export_pvd",
    "generate",
    "mode_convergence",
    "picture",
    "plot_contact_map",
    "plot_energies",
    "plot_history",
    "plot_modes",
    "plot_phase",
    "read_case",
    "read_matrix",
    "read_mesh",
    "read_uff",
    "render",
    "rows_from_dofs",
    "simulate",
    "static_equilibrium",
    "write_case",
    "write_mesh",
]
