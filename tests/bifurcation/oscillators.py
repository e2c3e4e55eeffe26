"""Forced oscillators of one mass for harmonic balance, with what is known of them."""

import numpy as np
from scipy.special import ellipk
from systems import TURN

from fecontact import ContactSystem, Drive, basis_from_matrices
from fecontact.bifurcation import contact_field, vector_field
from fecontact.laws import JenkinsFriction, LinearContact, PrescribedForce


def _duffing(t, x, p, out):
    out[0] = x[1]
    out[1] = p[1] * np.cos(p[0] * t) - 0.05 * x[1] - x[0] - 0.1 * x[0] ** 3


def duffing(W=0.8, P=0.18):
    """x'' + .05 x' + x + .1 x^3 = P cos W t."""
    return vector_field(_duffing, {"W": W, "P": P}, ("x", "v"),
                        period=lambda p: 2.0 * np.pi / p["W"])


def duffing_frequency(amplitude):
    """Angular frequency of x'' + x + .1 x^3 = 0, by the complete elliptic integral."""
    stiffening = 0.1 * amplitude**2
    m = stiffening / (2.0 * (1.0 + stiffening))
    return np.pi / 2.0 * np.sqrt(1.0 + stiffening) / ellipk(m)


def one_mode(mass=1.0):
    """A mass that moves along the ground or, by ``axis``, away from it."""
    rows = np.zeros((3, 1))
    rows[0, 0] = 1.0
    return basis_from_matrices([[mass]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows})


def jenkins_system(w=1.1, amplitude=1.0):
    """m 1, k 1, c .02, k_d .5, limit 1, force cos w t; the force moves the end of the spring."""
    return ContactSystem(
        one_mode(), normal=PrescribedForce(1.0),
        friction=JenkinsFriction(stiffness=0.5, friction_coefficient=1.0),
        drive=Drive(stiffness_x=1.0, damping_x=0.02, amplitude_x=amplitude, frequency_hz=w / TURN))


def jenkins(w=1.1, **options):
    """Field of :func:`jenkins_system` over its frequency."""
    return contact_field(jenkins_system(w, **options), ["drive.frequency_hz"])


def jenkins_amplitude(w, amplitude=1.0):
    """Amplitude of one harmonic of a Jenkins element, by its describing function."""
    from scipy.optimize import brentq

    def misfit(X):
        f_c, f_s = 0.5 * X, 0.0
        if X > 2.0:
            turned = np.arccos(1.0 - 4.0 / X)
            f_c = 0.5 * X / np.pi * (turned - np.sin(2.0 * turned) / 2.0)
            f_s = 4.0 / np.pi * (1.0 - 2.0 / X)
        return (((1.0 - w * w) * X + f_c) ** 2 + (0.02 * w * X + f_s) ** 2) - amplitude**2

    X = np.linspace(1e-3, 60.0, 60001)
    values = np.array([misfit(one) for one in X])
    last = np.flatnonzero(values[:-1] * values[1:] < 0.0)[-1]
    return brentq(misfit, X[last], X[last + 1], xtol=1e-13)


def unilateral(w=1.0, **options):
    """A mass on a spring, above a stop that it leaves: bilinear, with separation."""
    rows = np.zeros((3, 1))
    rows[1, 0] = 1.0
    basis = basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows})
    return contact_field(ContactSystem(
        basis, normal=LinearContact(3.0, 0.0),
        drive=Drive(stiffness_y=1.0, damping_y=0.1, amplitude_y=1.0, frequency_hz=w / TURN)),
        ["drive.frequency_hz"])
