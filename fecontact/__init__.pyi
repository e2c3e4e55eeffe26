from .basis import ModalBasis
from .basis_report import BasisReport
from .bifurcation.branch import Branch
from .bifurcation.contact_field import contact_field
from .bifurcation.curves import fold_curve, hopf_curve
from .bifurcation.equilibria import find_equilibrium
from .bifurcation.equilibrium_branch import equilibrium_branch, switched_branch
from .bifurcation.orbit_output import amplitude, orbit_history
from .bifurcation.orbits import orbits_beyond, orbits_from_hopf, orbits_from_motion
from .bifurcation.shooting_branch import orbits_by_shooting
from .bifurcation.stability_map import stability_map
from .bifurcation.vector_field import VectorField
from .body import ElasticBody, Material
from .damping import LossFactor, Rayleigh
from .errors import FecontactError, InputError
from .formats.matrices import read_matrix
from .formats.uff import read_uff
from .gap import Crown
from .geometry import Beam, Block, Pendulum, generate
from .integrate.ensemble import Ensemble, ensemble, forcing_period, strobe
from .integrate.events import ContactEvents, Crossing, Event, Events, event
from .integrate.initial import RigidStart
from .integrate.sensitivity import Sensitivity, sensitivity
from .integrate.simulate import simulate
from .integrate.trajectory import ContactState, Energies, Status, Trajectory
from .laws.contract import (
    FrictionLaw,
    NormalLaw,
    PerNode,
    friction_law,
    memory_friction_law,
    normal_law,
)
from .laws.drive import Drive, Load, PointLoad
from .laws.friction import (
    ConstantFriction,
    CubicFriction,
    ExponentialFriction,
    GalvanettoFriction,
    GaussianFriction,
    HyperbolicFriction,
    ProductFriction,
)
from .laws.ground import Ground
from .laws.ground_motion import HarmonicSpeed, SpeedRamp
from .laws.memory import (
    BoucWenFriction,
    DahlFriction,
    IwanFriction,
    JenkinsFriction,
    LuGreFriction,
)
from .laws.normal import CosineSurface, GaussianSurface, ParabolicSurface, RoughSurface
from .laws.normal_measured import MeasuredSurface
from .laws.normal_power import PowerContact, PowerLawContact, RestitutionContact
from .laws.normal_statistical import ExponentialContact, GreenwoodWilliamson
from .laws.normal_stop import LinearContact, PrescribedForce, TwoSidedStop
from .laws.profiles import Flat, FourierSeries, RandomRoughness, Sine
from .laws.signals import Constant, Harmonic, Harmonics, Sweep
from .laws.trace import Trace
from .laws.transients import Pulse, Tabulated
from .mesh import Mesh
from .mesh_io import read_mesh, write_mesh
from .mode_convergence import mode_convergence
from .output.diagrams import plot_branches, plot_eigenvalues, plot_stability_map
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
    "BoucWenFriction",
    "Branch",
    "Constant",
    "ConstantFriction",
    "ContactEvents",
    "ContactState",
    "ContactSystem",
    "CosineSurface",
    "Crossing",
    "Crown",
    "CubicFriction",
    "DahlFriction",
    "Drive",
    "ElasticBody",
    "Energies",
    "Ensemble",
    "Event",
    "Events",
    "ExponentialContact",
    "ExponentialFriction",
    "FecontactError",
    "Flat",
    "FourierSeries",
    "FrictionLaw",
    "GalvanettoFriction",
    "GaussianFriction",
    "GaussianSurface",
    "GreenwoodWilliamson",
    "Ground",
    "Harmonic",
    "HarmonicSpeed",
    "Harmonics",
    "HyperbolicFriction",
    "InputError",
    "IwanFriction",
    "JenkinsFriction",
    "LinearContact",
    "Load",
    "LossFactor",
    "LuGreFriction",
    "Material",
    "MeasuredSurface",
    "Mesh",
    "ModalBasis",
    "NormalLaw",
    "ParabolicSurface",
    "Patch",
    "Pendulum",
    "PerNode",
    "PointLoad",
    "PowerContact",
    "PowerLawContact",
    "PrescribedForce",
    "ProductFriction",
    "Pulse",
    "RandomRoughness",
    "Rayleigh",
    "RestitutionContact",
    "RigidStart",
    "RoughSurface",
    "Sensitivity",
    "Sine",
    "SpeedRamp",
    "Status",
    "Study",
    "Sweep",
    "Tabulated",
    "Trace",
    "Trajectory",
    "TwoSidedStop",
    "VectorField",
    "amplitude",
    "contact_field",
    "ensemble",
    "equilibrium_branch",
    "event",
    "export_pvd",
    "find_equilibrium",
    "fold_curve",
    "forcing_period",
    "friction_law",
    "generate",
    "hopf_curve",
    "memory_friction_law",
    "mode_convergence",
    "normal_law",
    "orbit_history",
    "orbits_beyond",
    "orbits_by_shooting",
    "orbits_from_hopf",
    "orbits_from_motion",
    "picture",
    "plot_branches",
    "plot_contact_map",
    "plot_eigenvalues",
    "plot_energies",
    "plot_history",
    "plot_modes",
    "plot_phase",
    "plot_stability_map",
    "read_case",
    "read_matrix",
    "read_mesh",
    "read_uff",
    "render",
    "rows_from_dofs",
    "sensitivity",
    "simulate",
    "stability_map",
    "static_equilibrium",
    "strobe",
    "switched_branch",
    "write_case",
    "write_mesh",
]
