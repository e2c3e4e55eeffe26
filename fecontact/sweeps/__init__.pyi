from .executors import dask_executor
from .statistics import SobolIndices, sobol_indices, statistics
from .table import SweepTable

__all__ = [
    "SobolIndices",
    "SweepTable",
    "dask_executor",
    "sobol_indices",
    "statistics",
]
