"""A hole that turns rigidly about its centre, against the point mass of the theory."""

import math

import numpy as np
import pytest

from fecontact import ElasticBody, InputError, Material, generate, modal_basis
from fecontact.fem.shapes import Pendulum
from fecontact.reduction import eigenfrequencies_hz


def pendulum(element: str, size: float = 0.004, radius: float = 0.002) -> ElasticBody:
    shape = Pendulum(hinge_radius=radius, element_size=size, element=element)
    return ElasticBody(generate(shape), Material.named("aluminium"), 0.0196,
                       fixed={"pivot": "hinge"})


@pytest.mark.parametrize("element", ["quadrilateral", "triangle"])
def test_effective_mass_at_the_contact_is_the_moment_of_inertia_over_length_squared(element):
    body = pendulum(element)
    basis = modal_basis(body, 4, contact_nodes=3)
    assert basis.rigid_modes == 1
    assert basis.angular_frequencies[0] == 0.0
    centre = np.array([0.0, 0.033 / 2])
    arm = body.nodes - centre
    rotation = np.column_stack([-arm[:, 1], arm[:, 0]]).ravel()
    inertia = rotation @ (body.mass @ rotation)
    middle = basis.contact_T[1]
    assert basis.positions[3, 0] == pytest.approx(0.3, rel=1e-12)
    assert 1.0 / middle[1, 0] ** 2 == pytest.approx(inertia / 0.3**2, rel=1e-10)
    assert middle[2, 0] == pytest.approx(1.0 / math.sqrt(inertia), rel=1e-10)
    # Rectangles less the round hole, which the mesh makes an octagon.
    rho, t = 2700.0, 0.0196
    def box(x0, x1, y0, y1):
        area, cx, cy = (x1 - x0) * (y1 - y0), (x0 + x1) / 2, (y0 + y1) / 2 - centre[1]
        return area * (((x1 - x0) ** 2 + (y1 - y0) ** 2) / 12 + cx**2 + cy**2)
    h, b = 0.0077, 0.033
    solid = box(-h / 2, 0.3 - b / 2, b / 2 - h / 2, b / 2 + h / 2) + box(
        0.3 - b / 2, 0.3 + b / 2, 0.0, b)
    assert inertia == pytest.approx(rho * t * (solid - math.pi * 0.002**4 / 2), rel=1e-7)


def test_the_hole_turns_as_a_whole_in_every_mode():
    body = pendulum("quadrilateral")
    shapes = modal_basis(body, 6, contact_nodes=3).mode_shapes.shapes
    rim = np.unique(body.edge_nodes(body.mesh.boundaries["pivot"]))
    arm = body.nodes[rim] - np.array([0.0, 0.033 / 2])
    for mode in range(6):
        turn = (arm[:, 0] @ shapes[rim, 1, mode] - arm[:, 1] @ shapes[rim, 0, mode]) / (
            (arm**2).sum())
        left = shapes[rim, :, mode] - turn * np.column_stack([-arm[:, 1], arm[:, 0]])
        assert np.abs(left).max() < 1e-12 * np.abs(shapes[:, :, mode]).max()


def test_frequencies_converge_where_those_of_a_point_hinge_do_not():
    frequency = [eigenfrequencies_hz(pendulum("quadrilateral", size), 2)[1]
                 for size in (0.004, 0.002, 0.001)]
    steps = np.abs(np.diff(frequency)) / frequency[-1]
    assert steps[0] < 5e-5
    assert steps[1] < 0.7 * steps[0]


def test_a_hole_of_zero_radius_limit_is_the_point_hinge():
    thin = eigenfrequencies_hz(pendulum("quadrilateral", 0.002, 2e-4), 2)[1]
    body = ElasticBody(generate(Pendulum(element_size=0.002)), Material.named("aluminium"),
                       0.0196, fixed={"pivot": "hinge"})
    point = eigenfrequencies_hz(body, 2)[1]
    assert thin == pytest.approx(point, rel=2e-3)


def test_two_hinges_leave_no_rigid_mode():
    mesh = generate(Pendulum(hinge_radius=0.002))
    body = ElasticBody(mesh, fixed={"pivot": "hinge", "B": "hinge"})
    assert eigenfrequencies_hz(body, 1)[0] > 100.0


def test_bad_hinges_are_refused():
    with pytest.raises(InputError, match=r"hinge_radius = 0\.005 must be below half of arm_height"):
        Pendulum(hinge_radius=0.005)
    mesh = generate(Pendulum(hinge_radius=0.002))
    with pytest.raises(InputError, match=r"fixed\['pivot'\] = 'turn' must be one of"):
        ElasticBody(mesh, fixed={"pivot": "turn"})
