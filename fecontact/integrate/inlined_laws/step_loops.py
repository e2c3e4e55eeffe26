"""Step loops of small systems in which their laws are written out.

The numbers are those of the loops that call laws by address, up to rounding.
"""

from functools import cache
from typing import Any

import numpy as np

from fecontact.core.compiled import CompiledLaw
from fecontact.core.errors import InputError
from fecontact.core.progress import say
from fecontact.core.references import constants
from fecontact.integrate.inlined_laws.code import Given, with_laws
from fecontact.integrate.inlined_laws.kernels import kernel_of
from fecontact.integrate.rodas5p import step_loop
from fecontact.integrate.rodas5p.small_systems import fixed_values, not_small
from fecontact.integrate.rodas5p.state import Problem
from fecontact.system.contact_system import ContactSystem
from fecontact.system.nodes import SYSTEM


def advance_with_laws(system: ContactSystem, problem: Problem) -> Any:
    """The step loop of a system with its laws, compiled once for systems of its size and laws.

    Raises
    ------
    InputError
        For a system that is not small, or with laws that cannot be a part of its step loop.
    """
    found = not_small(problem.system) or _foreign(system)
    if len(problem.blocks.coupled) > 1:
        found = "bodies that are not coupled are not among them"
    if found is not None:
        raise InputError(f"Rodas5P: inline_laws = True is for small plane systems with compiled "
                         f"laws, but {found}; leave it out.")
    arrays = system.arrays
    loads, modes = arrays.load_shapes.shape
    values = {
        "load_shapes": (loads, modes), "load": (loads,), "leans": arrays.leans,
        "on_ground": tuple(arrays.on_ground.tolist())}
    return _of_laws(modes, len(arrays.gap), tuple(values.items()), tuple(laws_of(system).items()))


def laws_of(system: ContactSystem) -> dict[str, Given]:
    """The laws in a system's arrays, by the fields that hold their addresses."""
    kinds = {kind: tuple(law.kernel for nodes, _, law in system.law_groups(kind)
                         for _ in range(nodes.start, nodes.stop))
             for kind in ("normal", "friction")}
    ground, dimension = system.ground, system.basis.dimension
    return {
        **kinds,
        "drive": tuple(motion.kernel for motion in system.drive.motions[:dimension]),
        "load": tuple(signal.kernel for signal in system.load.signals.values()),
        "profile": ground.profile_kernel,
        "friction_scale": ground.friction_scale_kernel,
        "ground_motion": system.prescribed_motion.motions[0].motion_kernel,
    }


def _foreign(system: ContactSystem) -> str | None:
    """Which of the laws is not compiled here, or None."""
    for field, value in laws_of(system).items():
        for law in value if isinstance(value, tuple) else (value,):
            if not isinstance(law, CompiledLaw | None):
                return f"the function of its {field.replace('_', ' ')} is a {type(law).__name__}"
    return None


# What is kept for laws keeps them too: an address says which law it is while that lives.
@cache
def _of_laws(
    modes: int, nodes: int, values: tuple[tuple[str, Any], ...],
    laws: tuple[tuple[str, Given], ...],
) -> Any:
    fixed = fixed_values(modes, nodes)
    fixed[SYSTEM] = {**fixed[SYSTEM], **dict(values)}
    fixed[SYSTEM]["on_ground"] = np.array(fixed[SYSTEM]["on_ground"], dtype=np.int64)
    return _of_code(with_laws(constants(fixed), SYSTEM, dict(laws)))


@cache
def _of_code(code: str) -> Any:
    return kernel_of(step_loop.advance, step_loop.ADVANCE, code, _announce)


def _announce(prepared: bool) -> None:
    seconds = 4 if prepared else 30
    say(f"Compiling the step loop of this system with its laws, once for all parameters: about "
        f"{seconds} s.")
