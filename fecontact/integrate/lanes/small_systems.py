"""The step loop of lanes for each size of small systems, with loops over modes and nodes unrolled."""

from functools import cache
from typing import Any

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.lanes.vectors import WIDTH
from fecontact.core.references import constants
from fecontact.integrate.lanes import arrays, step_loop
from fecontact.integrate.rodas5p.small_systems import fixed_values


@cache
def advance_for(modes: int, nodes: int) -> Any:
    """The step loop for so many modes and nodes."""
    m, n = modes, nodes
    shapes = [(m, m), (m, m), (m,), (2, m), (2,), (2,), (None, m), (n, m), (n, m), (n,), (n,),
              (n, None), (n, None), (None,), (2, None), (None, None)]
    limits = [(m,), (n,), (n,), (n,), (m,), (None, n), (arrays.LIMITS,)]
    some = arrays.lanes_for([tuple(k or 1 for k in shape) for shape in shapes],
                            [tuple(k or 1 for k in shape) for shape in limits],
                            [np.zeros(n, int), np.zeros(n, int), np.zeros(2, int),
                             np.zeros(0, int), 0, 0], m, n)
    given = {
        arrays.LANE_SYSTEM: {
            **{name: (*shape, WIDTH)
               for name, shape in zip(arrays.LaneSystem._fields, shapes, strict=False)},
            "normal": (n,), "friction": (n,), "drive": (2,)},
        arrays.LANE_CONTROL: {name: (*shape, WIDTH) for name, shape in zip(
            arrays.LaneControl._fields, limits, strict=True)},
        arrays.LANE_PROGRESS: {name: value.shape for name, value in
                               some.progress._asdict().items()},
        arrays.LANE_ROOM: {name: value.shape for name, value in some.room._asdict().items()},
        arrays.LANE_RUNS: {"states": (None, None, 2 * m)},
        **fixed_values(m, n),
    }
    return kernel(step_loop.ADVANCE, constants=constants(given), nogil=True)(
        step_loop.advance.py_func)
