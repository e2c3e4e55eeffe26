"""Stiffness and mass over free unknowns, E^T A E, whose products need no sparse matrix of them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.types import Array


@dataclass(frozen=True, eq=False)
class Congruence:
    """A symmetric matrix E^T A E (f, f), formed where more than its products are needed.

    Attributes
    ----------
    expansion : sparse (n, f) array
        E.
    product : callable
        A u (n, k) of vectors u (n, k).
    matrix : callable
        Returns A, sparse (n, n).
    """

    expansion: Any
    product: Callable[[Array], Array]
    matrix: Callable[[], Any]

    @property
    def shape(self) -> tuple[int, int]:
        """(f, f)."""
        return (self.expansion.shape[1],) * 2

    def __matmul__(self, x: Array) -> Array:
        """E^T A E x of vectors (f,) or (f, k)."""
        u = np.asarray(self.expansion @ x.reshape(len(x), -1))
        return np.asarray(self.expansion.T @ self.product(u)).reshape(x.shape)

    @cached_property
    def formed(self) -> Any:
        """The matrix, sparse (f, f) by columns."""
        return (self.expansion.T @ self.matrix() @ self.expansion).tocsc()


def as_matrix(matrix: Any) -> Any:
    """A matrix as it is, or a congruence in full."""
    return matrix.formed if isinstance(matrix, Congruence) else matrix


def largest_column_sum(matrix: Any) -> float:
    """The 1-norm of a sparse matrix; of a congruence an upper bound, ``| |E|^T |A| |E| 1 |``."""
    if not isinstance(matrix, Congruence):
        return float(abs(matrix).sum(axis=0).max())
    E = abs(matrix.expansion)
    return float((E.T @ (abs(matrix.matrix()) @ (E @ np.ones(E.shape[1])))).max())
