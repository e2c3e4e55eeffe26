from .fitting.plots import plot_fit, plot_posterior, plot_profile
from .output.diagrams.colours import COLOURS, STATE_COLOURS
from .output.plots.amplitude_curve import plot_amplitude_curve
from .output.plots.analysis import (
    plot_friction_work,
    plot_poincare,
    plot_receptance,
    plot_spectrogram,
    plot_spectrum,
)
from .output.plots.assurance import plot_modal_assurance
from .output.plots.bifurcation_diagram import plot_branches
from .output.plots.campbell import plot_campbell
from .output.plots.contact_map import plot_contact_map
from .output.plots.diagram_insets import Inset, phase_inset
from .output.plots.diameters import plot_diameters
from .output.plots.fields import plot_stress
from .output.plots.figure import StyledFigure, new_figure, styled
from .output.plots.half_space import plot_half_space
from .output.plots.many_runs import plot_basins, plot_poincare_scan, plot_runs
from .output.plots.modes import plot_buckling, plot_convergence, plot_modes, plot_wheel
from .output.plots.phase_space import plot_phase_space
from .output.plots.preload import plot_loop, plot_shear
from .output.plots.responses import plot_nonlinear_mode, plot_resonance_curve, plot_response
from .output.plots.run import plot_energies, plot_history, plot_phase
from .output.plots.stability import plot_eigenvalues, plot_stability_map
from .output.plots.wear import plot_wear
from .output.render.mode_movie import render_mode
from .output.render.movie import picture
from .output.render.offscreen import rendering_problem
from .output.render.phase_movie import render_phase_space
from .output.render.wheel_movie import render_wheel
from .sweeps.plots import plot_sobol, plot_strobed, plot_sweep

__all__ = [
    "COLOURS",
    "STATE_COLOURS",
    "Inset",
    "StyledFigure",
    "new_figure",
    "phase_inset",
    "picture",
    "plot_amplitude_curve",
    "plot_basins",
    "plot_branches",
    "plot_buckling",
    "plot_campbell",
    "plot_contact_map",
    "plot_convergence",
    "plot_diameters",
    "plot_eigenvalues",
    "plot_energies",
    "plot_fit",
    "plot_friction_work",
    "plot_half_space",
    "plot_history",
    "plot_loop",
    "plot_modal_assurance",
    "plot_modes",
    "plot_nonlinear_mode",
    "plot_phase",
    "plot_phase_space",
    "plot_poincare",
    "plot_poincare_scan",
    "plot_posterior",
    "plot_profile",
    "plot_receptance",
    "plot_resonance_curve",
    "plot_response",
    "plot_runs",
    "plot_shear",
    "plot_sobol",
    "plot_spectrogram",
    "plot_spectrum",
    "plot_stability_map",
    "plot_stress",
    "plot_strobed",
    "plot_sweep",
    "plot_wear",
    "plot_wheel",
    "render_mode",
    "render_phase_space",
    "render_wheel",
    "rendering_problem",
    "styled",
]
