from . import (
    analysis,
    bifurcation,
    fem,
    fitting,
    half_space,
    integrate,
    io,
    laws,
    measured,
    plot,
    reduction,
    study,
    sweeps,
    system,
)
from .core.errors import (
    AnalysisError,
    FecontactError,
    InputError,
    MeshError,
    MissingLibraryError,
    ModelWarning,
)
from .fem.elastic_body import ElasticBody
from .fem.generate import Beam, Block, Pendulum, generate
from .fem.material import Material
from .fem.mesh import Mesh
from .fem.mesh_files import read_mesh, write_mesh
from .fem.points import Patch
from .fitting.fit_model import fit
from .integrate.ensembles import ensemble
from .integrate.events import Event, event
from .integrate.initial_state import RigidStart
from .integrate.sensitivities import sensitivity
from .integrate.simulate import simulate
from .integrate.trajectory import Status, Trajectory
from .laws.excitation import BoundaryLoad, Drive, Load, PointLoad
from .laws.ground.ground import Ground
from .output.files.case import read_case, write_case
from .output.render.movie import render
from .reduction.damping import LossFactor, Rayleigh
from .reduction.from_matrices import basis_from_matrices
from .reduction.from_modes import basis_from_modes
from .reduction.modal_basis import ModalBasis
from .reduction.reduce_body import modal_basis
from .study.study import Study
from .sweeps.sweep import sweep
from .system.assembly import Assembly
from .system.contact_quantities import ContactState
from .system.contact_system import ContactSystem
from .system.gap import Crown
from .system.interfaces import Interface
from .system.quasistatic.loading import load_history
from .system.quasistatic.path import LoadPath
from .system.statics.equilibrium import equilibrium
from .system.statics.static_solution import static_solution

__version__: str

__all__ = [
    "AnalysisError",
    "Assembly",
    "Beam",
    "Block",
    "BoundaryLoad",
    "ContactState",
    "ContactSystem",
    "Crown",
    "Drive",
    "ElasticBody",
    "Event",
    "FecontactError",
    "Ground",
    "InputError",
    "Interface",
    "Load",
    "LoadPath",
    "LossFactor",
    "Material",
    "Mesh",
    "MeshError",
    "MissingLibraryError",
    "ModalBasis",
    "ModelWarning",
    "Patch",
    "Pendulum",
    "PointLoad",
    "Rayleigh",
    "RigidStart",
    "Status",
    "Study",
    "Trajectory",
    "analysis",
    "basis_from_matrices",
    "basis_from_modes",
    "bifurcation",
    "ensemble",
    "equilibrium",
    "event",
    "fem",
    "fit",
    "fitting",
    "generate",
    "half_space",
    "integrate",
    "io",
    "laws",
    "load_history",
    "measured",
    "modal_basis",
    "plot",
    "read_case",
    "read_mesh",
    "reduction",
    "render",
    "sensitivity",
    "simulate",
    "static_solution",
    "study",
    "sweep",
    "sweeps",
    "system",
    "write_case",
    "write_mesh",
]
