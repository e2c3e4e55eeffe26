"""Fields with quasi-periodic motions that several tests share."""

import numpy as np
import pytest

from fecontact.bifurcation import (
    ContinuationOptions,
    SecondExcitation,
    torus_branch,
    vector_field,
)
from fecontact.bifurcation.tori import branches as tori


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


def first_torus(field, start, name=None, **options):
    """The first torus of a branch."""
    return torus_branch(field, start, name, options=ContinuationOptions(points=1),
                        **options).points[0]


def torus_problem(field, start, name=None, **options):
    """Problem and unknowns of the first torus of a branch."""
    kept = {}
    followed = tori._followed

    def keep(problem, u, *rest):
        kept["at"] = problem, u
        return followed(problem, u, *rest)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(tori, "_followed", keep)
        first_torus(field, start, name, **options)
    return kept["at"]


def error_of_derivatives(problem, u, step):
    """Largest error of the derivatives of a torus against differences, relative to the largest."""
    given = problem.linearise(u).condensed
    columns = []
    for k in range(len(u)):
        aside = np.zeros(len(u))
        aside[k] = step * max(abs(u[k]), 1e-2)
        up, down = (problem.linearise(u + sign * aside).residual for sign in (1.0, -1.0))
        columns.append((up - down) / (2.0 * aside[k]))
    return np.abs(given - np.array(columns).T).max() / np.abs(given).max()
