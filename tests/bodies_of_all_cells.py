"""Small bodies of all kinds of cells, straight, distorted and curved."""

import numpy as np
from meshes_for_tests import rectangle
from solid_blocks import block_body, mixed_mesh

from fecontact import ElasticBody, Material, generate
from fecontact.fem import Ring

MATERIAL = Material(2.0e3, 0.3, 1.0)


def plane(triangles, degree, kind="stress", **options):
    """A plane body with distorted cells."""
    mesh = rectangle(1.2, 0.7, 3, 2, triangles=triangles, warp=lambda at: at + 0.05 * np.sin(
        5.0 * at[:, ::-1]), points={"corner": (1.2, 0.7)})
    return ElasticBody(mesh, MATERIAL, thickness=0.3, degree=degree, plane=kind, **options)


def ring(element, **options):
    """A solid ring of curved cells."""
    return ElasticBody(generate(Ring(0.5, 0.2, 0.1, element_size=0.3, layers=1, element=element)),
                       MATERIAL, **options)


def mixed(degree, **options):
    """A solid of distorted hexahedra, wedges, pyramids and tetrahedra."""
    mesh = mixed_mesh((1, 2, 2), bend=lambda at: at + 0.01 * np.sin(50.0 * at[:, ::-1]))
    return ElasticBody(mesh, MATERIAL, degree=degree, **options)


BODIES = {
    "triangles": lambda: plane(True, 1), "triangles, quadratic": lambda: plane(True, 2),
    "quadrilaterals": lambda: plane(False, 1, "strain"),
    "quadrilaterals, quadratic": lambda: plane(False, 2),
    "tetrahedra": lambda: block_body((2, 1, 1), tetrahedra=True, material=MATERIAL, degree=1),
    "tetrahedra, curved": lambda: ring("tetrahedron"),
    "hexahedra": lambda: block_body((2, 1, 1), material=MATERIAL, degree=1),
    "hexahedra, curved": lambda: ring("hexahedron"),
    "mixed": lambda: mixed(1), "mixed, quadratic": lambda: mixed(2),
    "quadrilaterals, serendipity": lambda: plane(False, 2, bricks="serendipity"),
    "hexahedra, curved, serendipity": lambda: ring("hexahedron", bricks="serendipity"),
    "mixed, serendipity": lambda: mixed(2, bricks="serendipity"),
}
