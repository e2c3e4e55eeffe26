"""Polynomial stiffness that couples coordinates, as springs along sums of coordinates."""

from itertools import combinations_with_replacement
from math import factorial, gcd, prod

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.laws.normal.bilateral import BilateralPolynomial

# Relative asymmetry of tensors that is rounding, and relative size of springs that are left out.
_SYMMETRIC, _NO_SPRING = 1e-9, 1e-13
# Most coordinates: the number of springs grows with their fourth power.
_MOST = 8


def polynomial_stiffness(
    quadratic: ArrayLike | None = None, cubic: ArrayLike | None = None
) -> tuple[Array, BilateralPolynomial]:
    r"""Contact rows and law of forces that are quadratic and cubic in d coordinates.

    The forces have a potential,

    .. math::

        f_i = \sum_{jk} a_{ijk}\,q_j q_k + \sum_{jkl} b_{ijkl}\,q_j q_k q_l
            = \sum_r w_{ri} \left(c_r\,(w_r \cdot q)^2 + d_r\,(w_r \cdot q)^3\right),

    and are the forces of springs between the base and sums of coordinates :math:`w_r \cdot q` whose
    coefficients are small whole numbers.

    Parameters
    ----------
    quadratic : (d, d, d) array, optional
        a, symmetric in all indices [N/m^2].
    cubic : (d, d, d, d) array, optional
        b, symmetric in all indices [N/m^3].

    Returns
    -------
    rows : (n, 3, d) array
        Displacements of n nodes, one for each spring, for
        :func:`fecontact.basis_from_matrices`, ``{"contact": rows}``.
    law : BilateralPolynomial
        Normal law of the springs.

    Raises
    ------
    InputError
        For tensors of different size, not symmetric, all zero, or of more than 8 coordinates.
    """
    tensors = {power: _checked(given, power, name) for given, power, name in (
        (quadratic, 2, "quadratic"), (cubic, 3, "cubic")) if given is not None}
    sizes = {len(tensor) for tensor in tensors.values()}
    if len(sizes) != 1:
        raise InputError("polynomial_stiffness: give quadratic, cubic or both, of as many "
                         "coordinates each.")
    (d,) = sizes
    springs: dict[tuple[int, ...], dict[int, float]] = {}
    for power, tensor in tensors.items():
        directions = _directions(d, power + 1)
        for direction, size in zip(directions, _along(tensor, directions), strict=True):
            springs.setdefault(tuple(direction), {})[power] = size
    largest = {power: max(abs(found.get(power, 0.0)) for found in springs.values())
               for power in tensors}
    kept = {direction: found for direction, found in springs.items() if any(
        abs(size) > _NO_SPRING * largest[power] for power, size in found.items())}
    if not kept:
        raise InputError("polynomial_stiffness: all coefficients are zero.")
    rows = np.zeros((len(kept), 3, d))
    rows[:, 1] = list(kept)
    return rows, BilateralPolynomial(
        stiffness=0.0, quadratic_stiffness=tuple(found.get(2, 0.0) for found in kept.values()),
        cubic_stiffness=tuple(found.get(3, 0.0) for found in kept.values()))


def _checked(given: ArrayLike, power: int, name: str) -> Array:
    """A symmetric tensor with one index more than its power."""
    tensor = as_floats(given, f"polynomial_stiffness: {name}")
    if tensor.ndim != power + 1 or len(set(tensor.shape)) != 1 or not tensor.size:
        raise InputError(f"polynomial_stiffness: {name} has the shape {tensor.shape}; it must have "
                         f"{power + 1} indices over the same coordinates.")
    if len(tensor) > _MOST:
        raise InputError(f"polynomial_stiffness: {name} has {len(tensor)} coordinates; it may have "
                         f"at most {_MOST}.")
    largest = float(np.abs(tensor).max())
    if not np.isfinite(largest) or any(
            np.abs(tensor - np.swapaxes(tensor, 0, k)).max() > _SYMMETRIC * largest
            for k in range(1, power + 1)):
        raise InputError(f"polynomial_stiffness: {name} must be finite, and the same for any order "
                         f"of its indices; forces without a potential are for vector_field.")
    return tensor


def _directions(d: int, degree: int) -> Array:
    """Directions (n, d) whose powers are a basis of the polynomials of a degree.

    Their coefficients are whole numbers whose sum is the degree, without common factors.
    """
    found = []
    for places in combinations_with_replacement(range(d), degree):
        counts = [places.count(k) for k in range(d)]
        found.append([count // gcd(*counts) for count in counts])
    return np.array(found)


def _along(tensor: Array, directions: Array) -> Array:
    """Sizes (n,) with which powers of the directions add up to the tensor."""
    d, degree = len(tensor), tensor.ndim
    monomials = list(combinations_with_replacement(range(d), degree))
    counts = [[places.count(k) for k in range(d)] for places in monomials]
    orders = [factorial(degree) / prod(map(factorial, count)) for count in counts]
    # Coefficients of the monomials of (w . q)^degree, and of the tensor.
    powers = np.array([order * np.prod(np.power(directions, count), axis=1)
                       for count, order in zip(counts, orders, strict=True)])
    wanted = np.array([order * tensor[places]
                       for places, order in zip(monomials, orders, strict=True)])
    return np.asarray(np.linalg.solve(powers, wanted))
