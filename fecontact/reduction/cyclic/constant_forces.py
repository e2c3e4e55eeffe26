"""Forces of rotation and temperature on the bodies of one sector, alike in all of them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.tables import located
from fecontact.core.types import Array
from fecontact.fem.cyclic_symmetry import CyclicSymmetry, SectorNodes
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.rotation import Rotation, centrifugal_force
from fecontact.fem.thermal import Temperature, nodal_temperatures, thermal_forces
from fecontact.reduction.cyclic.sector_rows import known_bodies

# Rounding of temperatures on the two faces of a sector, relative to the largest one.
_SAME = 1e-3


def warmed(
    bodies: Mapping[str, ElasticBody], temperature: Mapping[str, Temperature], rigid: Sequence[str]
) -> dict[str, Array]:
    """Changes of temperature (N,) at the nodes of bodies; InputError where they do nothing."""
    require_kind("cyclic_basis", Mapping, temperature=temperature)
    found = {}
    for name in known_bodies("temperature", temperature, bodies):
        if name in rigid:
            raise InputError(f"cyclic_basis: temperature names the body '{name}', which is rigid "
                             f"and does not expand; leave one of them out.")
        with located(f"Body '{name}':"):
            found[name] = nodal_temperatures(bodies[name], temperature[name])
    return found


def require_same_temperature(
    body: ElasticBody, symmetry: CyclicSymmetry, nodes: SectorNodes, warm: Array
) -> None:
    """Refuse temperatures (N,) that differ on the two faces at which sectors meet.

    Raises
    ------
    InputError
        Naming the node of the largest difference.
    """
    d = body.dimension
    low = warm[nodes.low] if nodes.weights is None else nodes.weights[::d, ::d] @ warm
    apart = np.abs(warm[nodes.high] - low)
    worst = int(apart.argmax())
    if apart[worst] > _SAME * np.abs(warm).max():
        x = ", ".join(f"{value:g}" for value in body.nodes[nodes.high[worst]])
        raise InputError(f"temperature is {warm[nodes.high[worst]]:.6g} K on '{symmetry.high}' at "
                         f"({x}) and {low[worst]:.6g} K on '{symmetry.low}', turned; all sectors "
                         f"are alike, give both faces the same.")


def constant_forces(body: ElasticBody, rotation: Rotation | None, warm: Array | None) -> Array:
    """Nodal forces (d N,) of rotation and temperature, the same for all sectors [N]."""
    found = np.zeros(body.unknowns)
    if rotation is not None and rotation.centrifugal_load:
        found += rotation.speed**2 * centrifugal_force(body, rotation)
    if warm is not None:
        found += thermal_forces(body, warm)
    return found


def with_constant(rows: Any, forces: Array | None) -> Any:
    """Rows, sparse (p, d N), with one of forces (d N,) that do not vanish."""
    import scipy.sparse as sp

    if forces is None or not forces.any():
        return rows
    own = sp.csr_array(forces[None])
    return sp.csr_array(sp.vstack([rows, own])) if rows.shape[0] else own
