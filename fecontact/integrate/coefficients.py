"""Type of coefficients of contact nodes, as solvers take them."""

from collections.abc import Mapping, Sequence

# One number, one for each contact node, or such by the names of interfaces.
Coefficient = float | Sequence[float] | Mapping[str, float | Sequence[float]]
