"""ContinuationOptions for all tests."""

import os
from pathlib import Path

import pytest

# Small matrices: threads of the linear algebra would only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Files whose tests start processes, draw movies, run documents or follow motions for long.
LONG = {
    "test_documentation", "test_examples", "test_benchmarks", "test_bad_arguments",
    "test_benchmark_integrator", "test_impact_oscillator", "test_sliding_beam", "test_limits",
    "test_set_valued_beam", "test_friction_oscillator",
    "test_sweep", "test_sweep_command", "test_sweep_killed", "test_sweep_strobed",
    "test_sweep_summaries",
    "test_movie", "test_analysis_plots", "test_trust", "test_damaged_files", "test_whole_files",
    "test_cli", "test_cli_stop", "test_ending_signals", "test_locks", "test_bad_input",
    "test_brute_force", "test_branch_study", "test_branch_command", "test_impact_orbits",
    "test_orbits_by_shooting", "test_shooting_of_beam", "test_squeal", "test_two_mass_example",
    "test_convergence", "test_mode_convergence",
}


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark what ``make test-fast`` leaves out."""
    for item in items:
        if Path(item.path).stem in LONG:
            item.add_marker(pytest.mark.long)
