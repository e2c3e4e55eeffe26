"""A bolted lap joint: microslip, its loop of force and displacement, and softening with amplitude.

Two beams overlap; a bolt, a spring with a prescribed shortening, presses them on each other. One
beam is clamped, the other is pulled at its end. Pulled slowly to and fro the ends of the overlap
slip first: the loop of force and displacement follows Masing's rules as long as the pressure stays.
Small vibrations are those with stuck contacts; large ones slip, are softer and die out faster.

Usage: python examples/lap_joint.py [FOLDER] [--quick]
"""

import sys
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.fem import pair_faces
from fecontact.laws import Constant, JenkinsFriction, LinearContact
from fecontact.plot import COLOURS, new_figure, plot_loop
from fecontact.reduction import Spring, reduce_bodies

LENGTH, HEIGHT, OVERLAP = 0.2, 0.01, 0.06  # of each beam [m]
STIFFNESS, RATIO = 2e9, 0.8  # of the interface [N/m], and that along it over that across
COEFFICIENT, BOLT = 0.3, 2e8  # of friction; stiffness of the bolt [N/m]


def joint(shortening: float = 2e-5, nodes: int = 12) -> fc.ContactSystem:
    """Two lapped beams and a bolt that is tightened by a shortening [m]."""
    size = HEIGHT / 2.0
    beam = fc.generate(fc.Beam(LENGTH, HEIGHT, size))
    upper = LENGTH - OVERLAP
    bodies = {"lower": fc.ElasticBody(beam.placed((0.0, -HEIGHT)), thickness=0.02,
                                      fixed={"left": "xy"}),
              "upper": fc.ElasticBody(beam.placed((upper, 0.0)), thickness=0.02)}
    face = pair_faces(bodies, "upper.contact", "lower.top", nodes=nodes)
    middle = LENGTH - 0.5 * OVERLAP
    bolt = Spring("upper.head", "lower.nut", stiffness=BOLT, damping=50.0, shortening=shortening)
    points = {"upper": {"head": (middle, HEIGHT), "end": (upper + LENGTH, 0.5 * HEIGHT)},
              "lower": {"nut": (middle, -HEIGHT)}}
    bases = reduce_bodies(bodies, [face], [bolt], modes=8, damping=0.001, each={
        name: {"points": given} for name, given in points.items()})
    return fc.ContactSystem(
        bodies=bases, links=[bolt], interfaces=[fc.Interface(
            "lap", face, LinearContact(STIFFNESS, damping=100.0),
            JenkinsFriction(RATIO * STIFFNESS, COEFFICIENT))],
        load=fc.Load(forces=(fc.PointLoad("upper.end", "x", signal=Constant(0.0)),)))
