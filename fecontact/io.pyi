from .fitting.report import report_fit
from .measured.read_measurements import read_measurement, read_measurements
from .measured.uff_functions import write_uff
from .output.files.branches import (
    read_branch,
    read_branches,
    read_mode,
    read_resonance_curve,
    read_response,
    write_branch,
    write_branches,
    write_mode,
    write_resonance_curve,
    write_response,
)
from .output.files.case import Case
from .output.files.dataset import to_pandas, to_xarray
from .output.files.export import export_csv, export_fields, export_mat, export_netcdf
from .output.files.field_runs import read_run, write_run
from .output.files.hdf5 import read_basis, write_basis
from .output.files.pvd import export_pvd
from .output.files.pyvista_grid import to_pyvista
from .output.files.stored_system import read_system
from .output.files.wear import read_wear, write_wear
from .output.report.branch_report import report_branches
from .output.report.mode_report import report_modes
from .output.report.notebook import ReportFrame, report_frame, report_widget
from .output.report.response_report import report_response
from .output.report.run_comparison import report_runs
from .output.report.run_report import report
from .reduction.matrix_files import AssembledMatrix, read_matrix
from .reduction.matrix_files.uff import UffModes, read_uff
from .sweeps.report import report_sweep
from .sweeps.table import read_table

__all__ = [
    "AssembledMatrix",
    "Case",
    "ReportFrame",
    "UffModes",
    "export_csv",
    "export_fields",
    "export_mat",
    "export_netcdf",
    "export_pvd",
    "read_basis",
    "read_branch",
    "read_branches",
    "read_matrix",
    "read_measurement",
    "read_measurements",
    "read_mode",
    "read_resonance_curve",
    "read_response",
    "read_run",
    "read_system",
    "read_table",
    "read_uff",
    "read_wear",
    "report",
    "report_branches",
    "report_fit",
    "report_frame",
    "report_modes",
    "report_response",
    "report_runs",
    "report_sweep",
    "report_widget",
    "to_pandas",
    "to_pyvista",
    "to_xarray",
    "write_basis",
    "write_branch",
    "write_branches",
    "write_mode",
    "write_resonance_curve",
    "write_response",
    "write_run",
    "write_uff",
    "write_wear",
]
