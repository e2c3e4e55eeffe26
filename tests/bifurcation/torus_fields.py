"""Fields with quasi-periodic motions that several tests share."""

import numpy as np

from fecontact.bifurcation import SecondExcitation, vector_field


def van_der_pol(t, x, p, out):
    out[0] = x[1]
    out[1] = p[0] * (1.0 - x[0] * x[0]) * x[1] - x[0] + p[1] * np.cos(p[2] * t)


def period_of_w(p):
    return 2.0 * np.pi / p["w"]


def forced_van_der_pol(eps, force, w):
    return vector_field(van_der_pol, {"eps": eps, "force": force, "w": w}, ["x", "v"],
                        period=period_of_w)


def duffing(t, x, p, out):
    out[0] = x[1]
    out[1] = (-p[0] * x[1] - x[0] - p[1] * x[0] * x[0] * x[0] + p[2] * np.cos(p[3] * t)
              + p[4] * np.cos(p[5] * t * 2.0 * np.pi + p[6]))


def two_tone_duffing(w=1.7, second_hz=0.225, second=0.3):
    return vector_field(
        duffing, {"damping": 0.1, "cubic": 0.5, "force": 0.4, "w": w, "second": second,
                  "second_hz": second_hz, "phase": 0.4}, ["x", "v"], period=period_of_w)


SECOND = SecondExcitation("phase", "second_hz")
