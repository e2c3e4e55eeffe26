from .analysis.receptance import receptance
from .analysis.histories import history
from .analysis.impacts import Impacts, find_impacts, find_rests
from .analysis.periodicity import Periodicity, count_periods, periodicity, strobed_states
from .analysis.spectra import amplitude_spectrum, power_spectral_density, spectrogram
from .bifurcation.attractors.basins import Attractor, Axis, Basins, basins
from .bifurcation.attractors.lyapunov import LyapunovExponents, lyapunov_exponents
from .bifurcation.attractors.poincare_scan import PoincareScan, poincare_scan
from .bifurcation.continuation.branch import Branch
from .bifurcation.continuation.points import (
    BranchPoint,
    CrossingPoint,
    FoldPoint,
    HopfPoint,
    NeimarkSackerPoint,
    PeriodDoublingPoint,
    UnresolvedPoint,
)
from .bifurcation.equilibria.branches import equilibrium_branch
from .bifurcation.equilibria.codim2 import fold_curve, hopf_curve
from .bifurcation.equilibria.equilibrium import find_equilibrium
from .bifurcation.equilibria.stability_map import stability_map
from .bifurcation.fields.contact_field import contact_field
from .bifurcation.fields.function_field import vector_field
from .bifurcation.fields.vector_field import VectorField
from .bifurcation.orbits.branches import Collocation, Shooting, orbit_branch
from .bifurcation.orbits.codim2 import orbit_curve
from .bifurcation.orbits.from_run import periodic_motion
from .bifurcation.orbits.motions import PeriodicMotion
from .bifurcation.orbits.samples import amplitude, observe, quantity_range
from .core.errors import FecontactError, InputError, ModelWarning
from .fem.elastic_body import ElasticBody, Material
from .fem.generate import Beam, Block, Pendulum, generate
from .fem.mesh import Mesh
from .fem.mesh_files import read_mesh, write_mesh
from .fem.points import Patch
from .integrate.ensemble import Ensemble, ensemble, strobe
from .integrate.events import ContactEvents, Crossing, Event, Events, event
from .integrate.initial_state import RigidStart
from .integrate.sensitivity import Sensitivity, sensitivity
from .integrate.simulate import simulate
from .integrate.smoothing_cost import SmoothingCost, smoothing_cost
from .integrate.solvers import CVODE, Rodas5P, Scipy, SetValued
from .integrate.trajectory import ContactState, Energies, Status, Trajectory
from .laws.base import FrictionLaw, NormalLaw, PerNode
from .laws.check import check_law
from .laws.excitation import Drive, Load, PointLoad
from .laws.friction.bristle import BoucWenFriction, DahlFriction, LuGreFriction
from .laws.friction.maxwell_slip import IwanFriction, JenkinsFriction
from .laws.friction.stribeck import (
    ConstantFriction,
    CubicFriction,
    ExponentialFriction,
    GalvanettoFriction,
    GaussianFriction,
    HyperbolicFriction,
    ProductFriction,
)
from .laws.ground.fourier_series import FourierSeries
from .laws.ground.ground import Ground
from .laws.ground.measured_profile import MeasuredProfile
from .laws.ground.motion import HarmonicSpeed, SpeedRamp
from .laws.ground.profile import Flat, Sine
from .laws.ground.random_roughness import RandomRoughness
from .laws.normal.linear import LinearContact, PrescribedForce, TwoSidedStop
from .laws.normal.measured_surface import MeasuredSurface
from .laws.normal.power import PowerContact, PowerLawContact, RestitutionContact
from .laws.normal.rough_surface import (
    CosineSurface,
    GaussianSurface,
    ParabolicSurface,
    RoughSurface,
)
from .laws.normal.statistical import ExponentialContact, GreenwoodWilliamson
from .laws.signals.harmonic import Constant, Harmonic, Harmonics, Sweep
from .laws.signals.transient import Pulse, Step, Tabulated
from .laws.signatures import friction_law, memory_friction_law, normal_law
from .output.files.branches import read_branch, read_branches, write_branch, write_branches
from .output.files.case import read_case, write_case
from .output.files.dataset import to_xarray
from .output.files.export import export_csv, export_mat, export_netcdf
from .output.files.hdf5 import read_basis, write_basis
from .output.files.pvd import export_pvd
from .output.plots.analysis import (
    plot_friction_work,
    plot_poincare,
    plot_receptance,
    plot_spectrogram,
    plot_spectrum,
)
from .output.plots.basins import plot_basins
from .output.plots.bifurcation_diagram import plot_branches
from .output.plots.diagram_insets import Inset, phase_inset
from .output.plots.modes import plot_modes
from .output.plots.run import plot_contact_map, plot_energies, plot_history, plot_phase
from .output.plots.stability import plot_eigenvalues, plot_stability_map
from .output.render.movie import picture, render
from .reduction.convergence import mode_convergence
from .reduction.damping import LossFactor, Rayleigh
from .reduction.eigenmodes import eigenfrequencies_hz
from .reduction.from_matrices import basis_from_matrices
from .reduction.from_modes import basis_from_modes
from .reduction.matrix_files import read_matrix
from .reduction.matrix_files.uff import read_uff
from .reduction.modal_basis import ModalBasis
from .reduction.reduce_body import modal_basis
from .reduction.report import BasisReport
from .reduction.restriction import rows_from_dofs
from .study.study import Study
from .study.sweep_section import Distribution, Span, Strobing, SweepSettings
from .sweeps.executors import dask_executor
from .sweeps.plots import plot_sobol, plot_strobed, plot_sweep
from .sweeps.statistics import SobolIndices, sobol_indices, statistics
from .sweeps.sweep import sweep
from .sweeps.table import SweepTable, read_table
from .system.contact_system import ContactSystem
from .system.forcing_period import forcing_period
from .system.gap import Crown
from .system.statics import static_equilibrium

__version__: str

__all__ = [
    "CVODE",
    "Attractor",
    "Axis",
    "Basins",
    "BasisReport",
    "Beam",
    "Block",
    "BoucWenFriction",
    "Branch",
    "BranchPoint",
    "PoincareScan",
    "Collocation",
    "Constant",
    "ConstantFriction",
    "ContactEvents",
    "ContactState",
    "ContactSystem",
    "CosineSurface",
    "Crossing",
    "CrossingPoint",
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
    "FoldPoint",
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
    "HopfPoint",
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
    "NeimarkSackerPoint",
    "NormalLaw",
    "ParabolicSurface",
    "Patch",
    "Pendulum",
    "PerNode",
    "PeriodDoublingPoint",
    "PeriodicMotion",
    "Periodicity",
    "PointLoad",
    "PowerContact",
    "PowerLawContact",
    "PrescribedForce",
    "ProductFriction",
    "Pulse",
    "RandomRoughness",
    "Span",
    "Rayleigh",
    "RestitutionContact",
    "RigidStart",
    "Rodas5P",
    "RoughSurface",
    "Scipy",
    "Sensitivity",
    "SetValued",
    "Shooting",
    "Sine",
    "SmoothingCost",
    "SobolIndices",
    "SpeedRamp",
    "Status",
    "Step",
    "Strobing",
    "Study",
    "SweptSine",
    "SweepSettings",
    "SweepTable",
    "Tabulated",
    "MeasuredProfile",
    "Trajectory",
    "TwoSidedStop",
    "UnresolvedPoint",
    "VectorField",
    "amplitude",
    "amplitude_spectrum",
    "basins",
    "basis_from_matrices",
    "basis_from_modes",
    "poincare_scan",
    "check_law",
    "contact_field",
    "count_periods",
    "dask_executor",
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
    "receptance",
    "friction_law",
    "generate",
    "history",
    "hopf_curve",
    "lyapunov_exponents",
    "memory_friction_law",
    "modal_basis",
    "mode_convergence",
    "normal_law",
    "observe",
    "orbit_branch",
    "orbit_curve",
    "periodic_motion",
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
    "plot_receptance",
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
    "to_xarray",
    "vector_field",
    "write_basis",
    "write_branch",
    "write_branches",
    "write_case",
    "write_mesh",
]
