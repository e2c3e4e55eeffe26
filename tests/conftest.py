"""Settings for all tests."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

# Shells make what runs in the background deaf to Ctrl-C, which some tests send to themselves.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Small matrices: threads of the linear algebra would only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Files that run all pages, examples and benchmarks, kill processes on purpose, or follow branches
# of whole examples: a minute or more each.
SLOW = {"test_documentation", "test_examples", "test_validation_cases", "test_benchmarks",
        "test_site", "test_reference", "test_sweep_killed", "test_ending_signals",
        "test_two_mass_example", "test_shooting_of_beam", "test_branch_command",
        "test_impact_orbits", "test_report_browser", "test_report_solid", "test_report_of_solids",
        "test_report_widget",
        "test_trust", "test_posterior", "test_compiles_nothing",
        "test_half_space_compliance", "test_errors_of_fast_modes", "test_flights_from_stops",
        "test_orbits_by_shooting", "test_open", "test_mode_command",
        "test_large_deflection_modes", "test_fit_command", "test_resonances",
        "test_tori", "test_intervals_along_branches", "test_hairpin", "test_corner_of_stick_slip",
        "test_borders_of_stops", "test_codim2_switching", "test_tori_with_friction",
        "test_static_friction_borders"}

# Files whose tests start processes, draw movies, compile or follow motions for long.
LONG = {
    "test_kinks_between_samples", "test_modes_at_an_amplitude", "test_bad_arguments",
    "test_damaged_caches", "test_prebuilt", "test_memory_laws", "test_laws_by_name",
    "test_plots", "test_sweep_statistics", "test_assembled",
    "test_closed_and_flat_branches", "test_shooting", "test_orbit_curves",
    "test_critical_orbits", "test_intervals_along_curves",
    "test_changes_of_stability", "test_curves", "test_condensation", "test_diagrams",
    "test_bernstein", "test_harmonic_balance", "test_harmonics_of_orbits",
    "test_frequency_response",
    "test_nonlinear_modes", "test_resonance_third", "test_resonance_quarter",
    "test_codim2_orbit_forms",
    "test_compiled_steps", "test_derivatives_of_steps", "test_compiled_bodies",
    "test_responses_of_bodies", "test_response_bifurcations",
    "test_benchmark_integrator", "test_impact_oscillator", "test_sliding_beam", "test_limits",
    "test_set_valued_beam", "test_sliding_bifurcations", "test_friction_oscillator",
    "test_disc_and_pads",
    "test_friction_damper", "test_lap_joint", "test_tipping_pad", "test_disc_brake",
    "test_bolted_plate", "test_friction_along_curves", "test_large_deflections",
    "test_large_deflection_systems", "test_deflections",
    "test_deflections_joined", "test_deflections_contact",
    "test_sweep", "test_sweep_command", "test_sweep_strobed", "test_sweep_summaries",
    "test_movie", "test_analysis_plots", "test_damaged_files", "test_whole_files",
    "test_cli", "test_solid_commands", "test_cli_stop", "test_locks", "test_bad_input",
    "test_friction_dampers", "test_response_command", "test_report_response",
    "test_orbit_trajectories", "test_corners",
    "test_poincare_scan", "test_attractors_of_fields", "test_branches_in_space",
    "test_branch_study",
    "test_squeal",
    "test_convergence", "test_mode_convergence",
    "test_integrator", "test_collocation", "test_points_as_starts", "test_orbit_bifurcations",
    "test_receptance", "test_references", "test_eigen", "test_set_valued_search",
    "test_two_bodies", "test_two_spheres", "test_pressed_sphere", "test_sliding_box",
    "test_report", "test_report_branches", "test_sweep_report",
    "test_solid_basis", "test_solid_assembly", "test_surface_patches", "test_solid_movie",
    "test_solid_plots", "test_prestressed_solids", "test_load_history_space", "test_solid_eigen",
    "test_set_valued_orbits", "test_homoclinic_curves", "test_branch_tree", "test_branch_ends",
    "test_simulate", "test_set_valued_space", "test_compliant_lift_off",
    "test_near_solver", "test_runs_in_blocks", "test_pickled_systems", "test_study_convergence",
    "test_executors", "test_event_branches", "test_homoclinic_by_projection",
    "test_sampling_error", "test_ends_by_method", "test_canards",
    "test_touch_down", "test_fitted_models", "test_fit_statistics",
    "test_ring_down",
}


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark what ``make test-fast`` leaves out, and what only ``make test-slow`` runs."""
    for item in items:
        name = Path(item.path).stem
        if name in LONG:
            item.add_marker(pytest.mark.long)
        if name in SLOW:
            item.add_marker(pytest.mark.slow)


@pytest.fixture
def cli(capsys):
    """Run a command line in this process: exit code, stdout, stderr."""

    from fecontact.cli import execute

    def run(*tokens):
        code = execute([str(token) for token in tokens])
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        return code, said.out, said.err

    return run


@pytest.fixture(autouse=True)
def broken_pipes_are_errors() -> Iterator[None]:
    """Undo what Gmsh does where a test starts it by itself: a broken pipe ends the process."""
    yield
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
