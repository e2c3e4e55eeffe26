"""Drives and loads must act on places that the modes move."""

import numpy as np
import pytest

import fecontact as fc
from fecontact.laws import Constant, ExponentialFriction, PrescribedForce


def basis():
    """Two masses along x on two contact nodes, B at the first of them."""
    rows = np.zeros((2, 3, 2))
    rows[:, 0] = np.eye(2)
    return fc.basis_from_matrices(
        np.eye(2), [[2.0, -1.0], [-1.0, 1.0]], {"B": rows[0], "contact": rows})


@pytest.mark.parametrize(("parts", "message"), [
    ({"drive": fc.Drive(stiffness_y=3.0)},
     r"Drive: stiffness_y = 3\.0 has no effect, as 'B' moves along y in no mode of the basis"),
    ({"drive": fc.Drive(damping_y=3.0)}, r"Drive: damping_y = 3\.0 has no effect"),
    ({"load": fc.Load(normal=2.0)}, r"Load: normal = 2\.0 has no effect, as 'C' moves along y"),
    ({"load": fc.Load(forces=[fc.PointLoad(1, "phi", signal=Constant(1.0))])},
     r"Load: a force at 1 with component 'phi' has no effect, as 1 turns in no mode"),
    ({"load": fc.Load(forces=[fc.PointLoad("C", "x", signal=Constant(1.0))])},
     r"Load: a force at 'C' with component 'x' has no effect, .* B and C are keys of .basis"),
])
def test_what_could_do_no_work_is_refused(parts, message):
    with pytest.raises(fc.InputError, match=message):
        fc.ContactSystem(basis(), normal=PrescribedForce((1.0, 1.0)),
                         **{"friction": ExponentialFriction(0.8, 0.55, 1e3), **parts})


def test_what_moves_is_driven_and_loaded():
    system = fc.ContactSystem(
        basis(), normal=PrescribedForce((1.0, 1.0)), drive=fc.Drive(stiffness_x=3.0),
        load=fc.Load(forces=[fc.PointLoad(1, "x", signal=Constant(1.0))]),
        friction=ExponentialFriction(0.8, 0.55, 1e3))
    assert system.rhs(0.0, np.zeros(4))[2:] @ system.basis.contact_T[1, 0] == pytest.approx(1.0)
