from .executors import dask_executor
from .mistuning import MistuningSweep, mistuning_sweep
from .statistics import Estimate, SobolIndices, sobol_indices, statistics
from .table import SweepTable

__all__ = [
    "Estimate",
    "MistuningSweep",
    "SobolIndices",
    "SweepTable",
    "dask_executor",
    "mistuning_sweep",
    "sobol_indices",
    "statistics",
]
