from .analysis.impacts import Impacts, find_impacts, find_rests
from .analysis.periods import Periodicity, count_periods, periodicity, strobed_states
from .analysis.quantities import history
from .analysis.receptance import frequency_response
from .analysis.spectra import amplitude_spectrum, power_spectral_density, spectrogram
from .analysis.window import window
from .assembled import basis_from_matrices
from .basis import ModalBasis
from .basis_report import BasisReport
from .bifurcation.basins import Attractor, Axis, Basins, basins
from .bifurcation.branch import Branch
from .bifurcation.brute_force import BruteForce, brute_force
from .bifurcation.contact_field import contact_field
from .bifurcation.curves import fold_curve, hopf_curve
from .bifurcation.equilibria import find_equilibrium
from .bifurcation.equilibrium_branch import equilibrium_branch, switched_branch
from .bifurcation.function_field import vector_field
from .bifurcation.lyapunov import LyapunovExponents, lyapunov_exponents
from .bifurcation.observation import motion_of, observe
from .bifurcation.orbit_curves import orbit_curve
from .bifurcation.orbit_output import amplitude, orbit_history, quantity_range
from .bifurcation.orbits import orbits_beyond, orbits_from_hopf, orbits_from_motion
from .bifurcation.settled import SettledMotion, settled_motion
from .bifurcation.shooting_branch import orbits_by_shooting
from .bifurcation.shooting_switch import doubled_by_shooting, hopf_orbits_by_shooting
from .bifurcation.stability_map import stability_map
from .bifurcation.vector_field import VectorField
from .body import ElasticBody, Material
from .damping import LossFactor, Rayleigh
from .eigen import eigenfrequencies_hz
from .errors import FecontactError, InputError, ModelWarning
from .forcing import forcing_period
from .formats.matrices import read_matrix
from .formats.uff import read_uff
from .gap import Crown
from .geometry import Beam, Block, Pendulum, generate
from .integrate.ensemble import Ensemble, ensemble, strobe
from .integrate.events import ContactEvents, Crossing, Event, Events, event
from .integrate.initial import RigidStart
from .integrate.sensitivity import Sensitivity, sensitivity
from .integrate.set_valued_cost import SmoothingCost, smoothing_cost
from .integrate.simulate import simulate
from .integrate.trajectory import ContactState, Energies, Status, Trajectory
from .laws.check import check_law
from .laws.contract import FrictionLaw, NormalLaw, PerNode
from .laws.drive import Drive, Load, PointLoad
from .laws.fourier_series import FourierSeries
from .laws.friction import (
    ConstantFriction,
    ExponentialFriction,
    GaussianFriction,
    HyperbolicFriction,
    ProductFriction,
)
from .laws.friction_minimum import CubicFriction, GalvanettoFriction
from .laws.ground import Ground
from .laws.ground_motion import HarmonicSpeed, SpeedRamp
from .laws.maxwell_slip import IwanFriction, JenkinsFriction
from .laws.memory import BoucWenFriction, DahlFriction, LuGreFriction
from .laws.normal import CosineSurface, GaussianSurface, ParabolicSurface, RoughSurface
from .laws.normal_measured import MeasuredSurface
from .laws.normal_power import PowerContact, PowerLawContact, RestitutionContact
from .laws.normal_statistical import ExponentialContact, GreenwoodWilliamson
from .laws.normal_stop import LinearContact, PrescribedForce, TwoSidedStop
from .laws.profiles import Flat, Sine
from .laws.random_roughness import RandomRoughness
from .laws.signals import Constant, Harmonic, Harmonics, Sweep
from .laws.signatures import friction_law, memory_friction_law, normal_law
from .laws.trace import Trace
from .laws.transients import Pulse, Step, Tabulated
from .mesh import Mesh
from .mesh_io import read_mesh, write_mesh
from .mode_convergence import mode_convergence
from .normalisation import basis_from_modes
from .output.analysis_plots import (
    plot_friction_work,
    plot_poincare,
    plot_response,
    plot_spectrogram,
    plot_spectrum,
)
from .output.basin_plots import plot_basins
from .output.branches import read_branch, read_branches, write_branch, write_branches
from .output.dataset import to_xarray
from .output.diagram_extras import Inset, phase_inset
from .output.diagrams import plot_branches
from .output.export import export_csv, export_mat, export_netcdf
from .output.hdf5 import read_basis, write_basis
from .output.movie import picture, render
from .output.plots import plot_contact_map, plot_energies, plot_history, plot_modes, plot_phase
from .output.pvd import export_pvd
from .output.stability_plots import plot_eigenvalues, plot_stability_map
from .output.store import read_case, write_case
from .output.sweep_plots import plot_sobol, plot_strobed, plot_sweep
from .points import Patch
from .reduction import modal_basis
from .rows import rows_from_dofs
from .statics import static_equilibrium
from .study import Study
from .sweeps.executors import dask_executor
from .sweeps.settings import Distribution, Range, Strobing, SweepSettings
from .sweeps.statistics import SobolIndices, sobol_indices, statistics
from .sweeps.sweep import sweep
from .sweeps.table import SweepTable, read_table
from .system import ContactSystem

__version__: str

__all__ = [
    "Attractor",
    "Axis",
    "Basins",
    "BasisReport",
    "Beam",
    "Block",
    "BoucWenFriction",
    "Branch",
    "BruteForce",
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
    "Distribution",
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
    "Impacts",
    "InputError",
    "Inset",
    "IwanFriction",
    "JenkinsFriction",
    "LinearContact",
    "Load",
    "LossFactor",
    "LuGreFriction",
    "LyapunovExponents",
    "Material",
    "MeasuredSurface",
    "Mesh",
    "ModalBasis",
    "ModelWarning",
    "NormalLaw",
    "ParabolicSurface",
    "Patch",
    "Pendulum",
    "PerNode",
    "Periodicity",
    "PointLoad",
    "PowerContact",
    "PowerLawContact",
    "PrescribedForce",
    "ProductFriction",
    "Pulse",
    "RandomRoughness",
    "Range",
    "Rayleigh",
    "RestitutionContact",
    "RigidStart",
    "RoughSurface",
    "Sensitivity",
    "SettledMotion",
    "Sine",
    "SmoothingCost",
    "SobolIndices",
    "SpeedRamp",
    "Status",
    "Step",
    "Strobing",
    "Study",
    "Sweep",
    "SweepSettings",
    "SweepTable",
    "Tabulated",
    "Trace",
    "Trajectory",
    "TwoSidedStop",
    "VectorField",
    "amplitude",
    "amplitude_spectrum",
    "basins",
    "basis_from_matrices",
    "basis_from_modes",
    "brute_force",
    "check_law",
    "contact_field",
    "count_periods",
    "dask_executor",
    "doubled_by_shooting",
    "eigenfrequencies_hz",
    "ensemble",
    "equilibrium_branch",
    "event",
    "export_csv",
    "export_mat",
    "export_netcdf",
    "export_pvd",
    "find_equilibrium",
    "find_impacts",
    "find_rests",
    "fold_curve",
    "forcing_period",
    "frequency_response",
    "friction_law",
    "generate",
    "history",
    "hopf_curve",
    "hopf_orbits_by_shooting",
    "lyapunov_exponents",
    "memory_friction_law",
    "modal_basis",
    "mode_convergence",
    "motion_of",
    "normal_law",
    "observe",
    "orbit_curve",
    "orbit_history",
    "orbits_beyond",
    "orbits_by_shooting",
    "orbits_from_hopf",
    "orbits_from_motion",
    "periodicity",
    "phase_inset",
    "picture",
    "plot_basins",
    "plot_branches",
    "plot_contact_map",
    "plot_eigenvalues",
    "plot_energies",
    "plot_friction_work",
    "plot_history",
    "plot_modes",
    "plot_phase",
    "plot_poincare",
    "plot_response",
    "plot_sobol",
    "plot_spectrogram",
    "plot_spectrum",
    "plot_stability_map",
    "plot_strobed",
    "plot_sweep",
    "power_spectral_density",
    "quantity_range",
    "read_basis",
    "read_branch",
    "read_branches",
    "read_case",
    "read_matrix",
    "read_mesh",
    "read_table",
    "read_uff",
    "render",
    "rows_from_dofs",
    "sensitivity",
    "settled_motion",
    "simulate",
    "smoothing_cost",
    "sobol_indices",
    "spectrogram",
    "stability_map",
    "static_equilibrium",
    "statistics",
    "strobe",
    "strobed_states",
    "sweep",
    "switched_branch",
    "to_xarray",
    "vector_field",
    "window",
    "write_basis",
    "write_branch",
    "write_branches",
    "write_case",
    "write_mesh",
]
