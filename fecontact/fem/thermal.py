r"""Thermal strain: nodal forces and stress of a change of temperature.

Free expansion is the strain :math:`\alpha \Delta T` in all directions; the stress is that of the
rest of the strain,

.. math:: \sigma = D (\epsilon - \alpha \Delta T\, 1), \qquad
    f = \int B^T D\, \alpha \Delta T\, 1\, dV

so that supports and neighbours press on a body that grows warm.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.element_block import ElementBlock
from fecontact.fem.elements.refinement import at_second_order
from fecontact.fem.material import Material

Temperature = float | ArrayLike | Callable[..., Any]


def nodal_temperatures(body: ElasticBody, temperature: Temperature) -> Array:
    """Change of temperature (N,) at the displacement nodes [K].

    Parameters
    ----------
    body : ElasticBody
        Body of isotropic materials with a thermal expansion.
    temperature : float, (N,) array, function of the coordinates or 'mesh'
        The change from the state without stress [K]; ``lambda x, y: 100.0 * y``, of solids of x, y
        and z; 'mesh' for that of its file, ``body.mesh.temperature``.

    Raises
    ------
    InputError
        For another number of nodes, values that are not finite, anisotropic materials or materials
        without expansion, bricks with incompatible modes.
    """
    if body.has_incompatible_modes:
        raise InputError("temperature is for bodies without incompatible modes; give bricks = "
                         "'full', or degree = 2.")
    if not all(isinstance(one, Material) for one in body.materials):
        raise InputError("temperature is for isotropic materials; anisotropic ones have no thermal "
                         "expansion.")
    if not any(one.thermal_expansion for one in body.materials):  # type: ignore[union-attr]
        raise InputError("temperature acts through the thermal expansion of the material, which is "
                         "zero; give Material(..., thermal_expansion=1.2e-5), that of steel.")
    if isinstance(temperature, str):
        return _of_mesh(body, temperature)
    given = temperature(*body.nodes.T) if callable(temperature) else temperature
    values = as_floats(given, "temperature")
    if values.shape not in ((), (len(body.nodes),)) or not np.isfinite(values).all():
        raise InputError(f"temperature must be one finite number or one for each of the "
                         f"{len(body.nodes)} displacement nodes, not an array of shape "
                         f"{values.shape}.")
    return np.broadcast_to(values, (len(body.nodes),))


def _of_mesh(body: ElasticBody, word: str) -> Array:
    """Change of temperature (N,) at the displacement nodes that the file of a mesh holds [K]."""
    if word != "mesh":
        raise InputError(f"temperature = {word!r} must be a number, or 'mesh' for the changes of "
                         f"temperature that the file of the mesh holds.")
    if body.mesh.temperature is None:
        raise InputError("temperature = 'mesh' is for meshes of decks with *TEMPERATURE or "
                         "*INITIAL CONDITIONS, TYPE=TEMPERATURE; this one holds none, give "
                         "numbers.")
    values = body.mesh.temperature
    if len(body.nodes) <= len(values):
        return values[: len(body.nodes)]
    return at_second_order(body.mesh, values)


def thermal_moduli(body: ElasticBody) -> Array:
    """Stress (M,) of each cell that is held, over the change of temperature [Pa/K]."""
    direct, lateral, _ = body.elasticity.T
    across = 1.0 if body.dimension == 2 and body.plane == "stress" else 2.0
    expansions = np.array([getattr(one, "thermal_expansion", 0.0) for one in body.materials])
    return np.asarray(expansions[body.cell_materials] * (direct + across * lateral))


def thermal_stress(body: ElasticBody, temperatures: Array, part: ElementBlock) -> Array:
    """Pressure (e, q) at the points of quadrature of elements that are held [Pa]."""
    at_points = np.einsum("qk,ek->eq", part.values, temperatures[part.nodes])
    return np.asarray(thermal_moduli(body)[part.numbers][:, None] * at_points)


def thermal_forces(body: ElasticBody, temperatures: Array) -> Array:
    """Nodal forces (d N,) of temperatures (N,), in balance with themselves [N]."""
    found = np.zeros((len(body.nodes), body.dimension))
    for part in body.parts():
        gradients, volumes = part.gradients()
        pressure = thermal_stress(body, temperatures, part) * volumes * body.thickness
        np.add.at(found, part.nodes, np.einsum("eq,eqkd->ekd", pressure, gradients))
    return found.ravel()


def held_stress(body: ElasticBody, temperatures: Array) -> Array:
    """Stress (N, 4), of solids (N, 6), at the nodes of a body that cannot move [Pa].

    The mean over the adjacent elements; what the body's strain adds is not in it.
    """
    moduli, around = np.zeros(len(temperatures)), np.zeros(len(temperatures))
    of_cells = thermal_moduli(body)
    for block in body.blocks:
        volumes = block.volumes[:, None]
        np.add.at(moduli, block.nodes, volumes * of_cells[block.numbers][:, None])
        np.add.at(around, block.nodes, volumes)
    pressure = moduli / around * temperatures
    found = np.zeros((len(temperatures), 4 if body.dimension == 2 else 6))
    found[:, : 2 if body.dimension == 2 and body.plane == "stress" else 3] = -pressure[:, None]
    return found
