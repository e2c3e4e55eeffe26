from .executors import dask_executor
from .statistics import Estimate, SobolIndices, sobol_indices, statistics
from .table import SweepTable

__all__ = [
    "Estimate",
    "SobolIndices",
    "SweepTable",
    "dask_executor",
    "sobol_indices",
    "statistics",
]
