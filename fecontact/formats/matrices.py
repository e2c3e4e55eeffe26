"""Files of mass, stiffness and damping matrices."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class AssembledMatrix:
    """A matrix from a file, with the names of its degrees of freedom where the file has them."""

    matrix: Any
    labels: NDArray[np.int64] | None
    source: str
