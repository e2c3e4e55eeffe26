"""Harmonic balance with gyroscopic and circulatory matrices, which differ from their transposes."""

import numpy as np
import pytest
from systems import TURN

from fecontact import ContactSystem, Load, PointLoad, basis_from_matrices
from fecontact.bifurcation import ContinuationOptions, HarmonicBalance, frequency_response
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce

K = np.array([[4.0, 1.5], [-0.5, 9.0]])
C = np.array([[0.1, 0.5], [-0.5, 0.1]])


@pytest.mark.parametrize("element", [0.0, 2.0])
def test_response_at_another_place_than_the_force(element):
    """|x_2| and |x_1| under forces on x_1 and x_2, also beside an element that sticks on x_1."""
    rows = {"a": np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]]),
            "b": np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])}
    contact = {"contact": rows["a"][None]} if element else {}
    basis = basis_from_matrices(np.eye(2), K, {**contact, **rows}, damping=C, symmetric=False)
    laws = {"normal": PrescribedForce(1e6), "friction": JenkinsFriction(element, 1.0)} if (
        element) else {}
    w = 2.2
    dynamic = K + np.diag([element, 0.0]) - w**2 * np.eye(2) + 1j * w * C
    exact = np.abs(np.linalg.inv(dynamic))
    assert abs(exact[0, 1] / exact[1, 0] - 1.0) > 0.1
    for force, seen in (("a", "b"), ("b", "a")):
        system = ContactSystem(basis, **laws, load=Load(forces=(
            PointLoad(force, "x", signal=Harmonic(1.0, w / TURN)),)))
        found = frequency_response(
            system, (w / TURN, 1.1 * w / TURN), "load.forces.0.signal.frequency_hz",
            observe=(seen, "x"), options=ContinuationOptions(points=1),
            method=HarmonicBalance([0, 1], 64, stability=None))
        assert abs(found.harmonic(1)[0]) == pytest.approx(exact["ab".index(seen),
                                                                "ab".index(force)], rel=1e-6)
