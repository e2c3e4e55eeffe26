"""Checks of what a modal basis is made of: shapes of arrays, groups, normals and bodies."""

from typing import Any

import numpy as np

from fecontact.core.errors import LARGEST, InputError, choices, require_positive
from fecontact.core.units import listed


def frozen_arrays(basis: Any) -> None:
    """Replace the arrays of a basis by copies of floats that nobody can write to.

    InputError for values that are not finite, frequencies below zero, and values beyond 1e60, whose
    squares overflow.
    """
    names = ["angular_frequencies", "damping", "T", "positions", "tributary", "boundary_rows"]
    names += [name for name in ("inertia_rows", "stiffness", "contact_normals", "constant_load")
              if getattr(basis, name) is not None]
    for name in names:
        array = np.array(getattr(basis, name), dtype=float, order="C")
        if not np.isfinite(array).all():
            raise InputError(f"Modal basis: {name} holds values that are not finite.")
        least = 0.0 if name == "angular_frequencies" else -LARGEST
        if ((array < least) | (array > LARGEST)).any():
            worst = array.max() if array.max() > LARGEST else array.min()
            raise InputError(f"Modal basis: {name} holds {worst:g}; every value must be a number "
                             f"from {least:g} to {LARGEST:g}.")
        array.setflags(write=False)
        object.__setattr__(basis, name, array)


def check_groups(basis: Any) -> None:
    """Check tributary lengths, and that the interfaces add up to the contact nodes."""
    if not (basis.tributary > 0.0).all():
        raise InputError(f"Modal basis: tributary lengths must be above zero, not "
                         f"{basis.tributary.min()}.")
    if basis.thickness is not None:
        if basis.dimension == 3:
            raise InputError(f"Modal basis: thickness = {basis.thickness!r} is for bodies in the "
                             f"plane; the tributary of a contact node in space is an area, so "
                             f"leave it out.")
        require_positive("Modal basis", thickness=basis.thickness)
        object.__setattr__(basis, "thickness", float(basis.thickness))
    groups = tuple((str(name), int(count)) for name, count in basis.groups)
    if not groups and len(basis.tributary):
        groups = (("contact", len(basis.tributary)),)
    if sum(count for _, count in groups) != len(basis.tributary):
        raise InputError(f"Modal basis: the interfaces {groups} do not add up to the "
                         f"{len(basis.tributary)} contact nodes.")
    object.__setattr__(basis, "groups", groups)
    object.__setattr__(basis, "springs", tuple(map(str, basis.springs)))
    if unknown := set(basis.springs) - {name for name, _ in groups}:
        raise InputError(f"Modal basis: springs names {choices(sorted(unknown))}, but the "
                         f"groups are {choices([name for name, _ in groups])}.")


def check_shapes(basis: Any) -> None:
    """Check the shapes of all arrays against the numbers of modes, nodes, points and directions."""
    m, n, d = basis.modes, len(basis.tributary), basis.dimension
    points = 2 + n + len(basis.extra)
    for name, shape in (("damping", (m, m)), ("T", (points, 3 * (d - 1), m)),
                        ("positions", (points, d)), ("inertia_rows", (d, m)),
                        ("boundary_rows", (len(basis.boundaries), d, m)),
                        ("stiffness", (m, m)), ("constant_load", (m,)),
                        ("contact_normals", (n, d))):
        given = getattr(basis, name)
        if given is not None and given.shape != shape:
            raise InputError(f"Modal basis: {name} must have shape {shape}, not {given.shape}.")


def check_sides(basis: Any) -> None:
    """Check normals, other sides and bodies."""
    if basis.contact_normals is not None:
        lengths = np.linalg.norm(basis.contact_normals, axis=1)
        if (np.abs(lengths - 1.0) > 1e-9).any():
            worst = int(np.argmax(np.abs(lengths - 1.0)))
            raise InputError(f"Modal basis: the normal of contact node {worst} has the length "
                             f"{lengths[worst]:.6g}; contact_normals must be of length one.")
    if basis.on_ground is not None:
        given = np.array(basis.on_ground)
        if given.shape != basis.tributary.shape or given.dtype != bool:
            raise InputError(f"Modal basis: on_ground must be {basis.contact_nodes} flags, true "
                             f"or false, not an array of shape {given.shape} of {given.dtype}.")
        given.setflags(write=False)
        object.__setattr__(basis, "on_ground", given)
    object.__setattr__(basis, "parts", tuple(basis.parts))
    names = [part.name for part in basis.parts]
    if len(set(names)) < len(names):
        raise InputError(f"Modal basis: the bodies {listed(names)} must have different names.")
    nodes = 0 if basis.mode_shapes is None else len(basis.mode_shapes.nodes)
    for part in basis.parts:
        for what, (first, size), total in (("modes", part.modes, basis.modes),
                                           ("nodes", part.nodes, nodes)):
            if not 0 <= first <= first + size <= total:
                raise InputError(f"Modal basis: body '{part.name}' has {size} {what} from "
                                 f"{first}, but there are {total}.")
