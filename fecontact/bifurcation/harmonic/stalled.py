"""Why a branch by harmonic balance could not be followed on, and what helps."""

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.problem import BranchStatus
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.engine_order import WaveField
from fecontact.system.columns import NORMAL_FORCE
from fecontact.system.fields.vector_field import VectorField

# Samples that a contact phase should have, and truncation error above which harmonics lack.
_ENOUGH, _LARGE = 16, 1e-2

# Remedy where one sector does not represent the wheel.
NO_WAVE = ("Where contact opens, the wheel may not move in a wave that repeats: press the contacts "
           "more, or run all sectors, simulate(wheel_system(...)).")


def stall_reason(field: VectorField, branch: Branch) -> str:
    """Message of a branch; of one that stalled with contacts that open and close, with the reason.

    Springs between two points push and pull: they do not open.

    A contact phase of few samples makes corners of the branch that are not those of the system, and
    harmonics that are neglected shift what contact excites.
    """
    if branch.status is not BranchStatus.STALLED or not isinstance(field, ContactField):
        return branch.message
    last, N = branch.points[-1], branch.method.count
    motion = last.orbit(samples=N + 1)
    system = field.system(last.parameter_values(field))
    force = system.contact_history(motion.times[:-1], motion.states[:-1])[:, :, NORMAL_FORCE]
    nodes = np.arange(force.shape[1])
    contacts = [nodes[which] for which, _, law in system.law_groups("normal") if not law.bilateral]
    force = force[:, np.concatenate([nodes[:0], *contacts])]
    closed = np.count_nonzero(force > 0.0, axis=0)
    opens = (closed > 0) & (closed < N)
    error = float(last.values["truncation_error"])
    said = [branch.message] if branch.message else []
    if opens.any():
        fewest = int(np.minimum(closed, N - closed)[opens].min())
        said.append(
            f"Contact opens and closes at {np.count_nonzero(opens)} of {len(closed)} nodes, for "
            f"{fewest} of {N} samples at the least.")
        if fewest < _ENOUGH:
            needed = 2 ** int(np.ceil(np.log2(_ENOUGH * N / fewest)))
            said.append(f"Take samples = {needed}, or a softer contact.")
    if error > _LARGE:
        said.append(f"The truncation error is {error:.2g} with {branch.method.highest} "
                    f"harmonics: take more, or damp the modes that they excite.")
    if isinstance(field, WaveField):
        if np.isnan(error):
            said.append("The truncation error is not known, as the wheel lacks nodal diameters of "
                        "further harmonics: make it with all.")
        if opens.any():
            said.append(NO_WAVE)
    return " ".join(said)
