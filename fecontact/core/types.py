"""Types of arrays, for annotations; signatures show them by these names."""

import numpy as np
from numpy import typing as npt
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

Array = TypeAliasType("Array", NDArray[np.float64])
Integers = TypeAliasType("Integers", NDArray[np.int64])
ComplexArray = TypeAliasType("ComplexArray", NDArray[np.complex128])

# A place in the plane, or in space [m].
Coordinates = tuple[float, float] | tuple[float, float, float]

# Objects that NumPy converts to an array.
ArrayLike = TypeAliasType("ArrayLike", npt.ArrayLike)
