"""The scene of a motion: which parts it is made of, and from where they are seen."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from fecontact.output.render.frames_data import Motion
from fecontact.output.render.plane_parts import ContactMarks, PlaneBodies, PlaneGround, plane_camera
from fecontact.output.render.scene import Part, Scene, Shown
from fecontact.output.render.solid_ground import SolidGround, ground_corners
from fecontact.output.render.solid_parts import Corners, SolidBodies, solid_camera


def scene_of(motion: Shown, width: int, height: int, **how: Any) -> Scene:
    """The scene of a run, with ground, contact nodes and forces, or of bodies alone.

    ``width`` and ``height`` are those of its images in pixels; others are as of :class:`Scene`.
    """
    aspect = width / height
    parts: list[Callable[[Scene], Part]] = []
    if motion.mode_shapes.nodes.shape[1] == 2:
        camera = plane_camera(motion, aspect)
        parts.append(partial(PlaneBodies, motion=motion))
        if isinstance(motion, Motion) and motion.has_ground:
            parts.append(partial(PlaneGround, motion=motion))
        if isinstance(motion, Motion) and motion.trajectory.basis.contact_nodes:
            parts.append(partial(ContactMarks, motion=motion))
        return Scene(camera, parts, width, height, **how)
    ground = np.zeros((0, 3))
    if isinstance(motion, Motion) and motion.has_ground:
        ground = ground_corners(motion)
        parts.append(partial(SolidGround, motion=motion))
    parts += [partial(SolidBodies, motion=motion), partial(Corners, motion=motion)]
    return Scene(solid_camera(motion, ground, aspect), parts, width, height, **how)
