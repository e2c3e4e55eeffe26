"""Choice of the kernel that carries derivatives over the steps of a run."""

from fecontact.core.records import shapes
from fecontact.integrate.rodas5p import dynamics, state
from fecontact.integrate.rodas5p.variational import (
    DIRECTIONS,
    Variation,
    propagate,
    propagate_in_parts,
)
from fecontact.integrate.small_systems import USUAL, Sized, Values, is_small, sizes_of


def open_nodes(modes: int, nodes: int) -> Values:
    """Gradients of any number of nodes: of all, or in a workspace for those of each of them."""
    known = shapes(sizes_of(modes, nodes), dynamics.Gradients)[dynamics.Gradients]
    return {dynamics.Gradients: {name: (None, *shape[1:]) for name, shape in known.items()
                                 if name != "polynomial"}}


RECORDS = (state.Problem, state.Progress, state.Workspace, state.Output, Variation)
SMALL = Sized(propagate.for_values, RECORDS, USUAL, open_nodes, lambda nodes: {DIRECTIONS: 4})


def propagate_for(problem: state.Problem) -> int:
    """Address of the kernel that carries derivatives over a step, for this size or for all.

    For the same systems as the step loops, with any number of columns; other systems without
    internal variables go in parts of steps.
    """
    if is_small(problem):
        n, _, m = problem.system.rows.shape
        return int(SMALL.of(m, n).address)
    return int((propagate_in_parts if in_parts(problem) else propagate).address)


def in_parts(problem: state.Problem) -> bool:
    """Whether derivatives go over a step in parts, which leaves the steps to the motion."""
    return not (is_small(problem) or problem.system.memory.any())
