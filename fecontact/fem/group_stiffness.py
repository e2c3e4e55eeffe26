"""Stiffness of a group of cells of a body."""

from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.material import AnisotropicMaterial


def group_stiffness(body: ElasticBody, group: str) -> Any:
    """Stiffness of the cells of a group, sparse (d N, d N), without supports [N/m].

    All cells for an empty name. It is linear in the elastic constants: the difference between the
    stiffness with twice those of the group and that of the body.
    """
    plain = replace(body, attachments=())
    if not group:
        return plain.stiffness
    inside = np.zeros(len(body.mesh.cells), dtype=bool)
    inside[body.mesh.cell_groups[group]] = True
    groups, materials = {}, {}
    for number, one in enumerate(body.materials):
        doubled = (replace(one, stiffness=tuple(tuple(2.0 * x for x in row)
                                                for row in one.stiffness))
                   if isinstance(one, AnisotropicMaterial)
                   else replace(one, youngs_modulus=2.0 * one.youngs_modulus))
        for name, cells, material in ((f"{number}", ~inside, one), (f"{number}+", inside, doubled)):
            chosen = np.flatnonzero(cells & (body.cell_materials == number))
            if len(chosen):
                groups[name], materials[name] = chosen, material
    mesh = replace(body.mesh, cell_groups=groups, materials={})
    return replace(plain, mesh=mesh, material=materials).stiffness - plain.stiffness
