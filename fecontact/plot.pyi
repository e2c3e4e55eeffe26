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
from .output.render.movie import picture
from .sweeps.plots import plot_sobol, plot_strobed, plot_sweep

__all__ = [
    "Inset",
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
]
