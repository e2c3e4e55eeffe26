"""Vector fields that several tests run in time."""

import numpy as np

from fecontact.bifurcation import VectorField, vector_field


def lorenz(t, x, p, out):
    out[0] = p[1] * (x[1] - x[0])
    out[1] = x[0] * (p[0] - x[2]) - x[1]
    out[2] = x[0] * x[1] - p[2] * x[2]


LORENZ = vector_field(lorenz, {"rho": 28.0, "sigma": 10.0, "b": 8.0 / 3.0}, ["x", "y", "z"])


def rossler(t, x, p, out):
    out[0] = -x[1] - x[2]
    out[1] = x[0] + p[0] * x[1]
    out[2] = p[1] + x[2] * (x[0] - p[2])


ROSSLER = vector_field(rossler, {"a": 0.2, "b": 0.2, "c": 5.7}, ["x", "y", "z"])


class Pendulum(VectorField):
    """A pendulum that Python evaluates."""

    def __init__(self):
        self.parameters = {"g": 1.0}
        self.state_names = ("angle", "speed")

    def rates(self, t, x, values):
        return np.stack([x[:, 1], -values[0] * np.sin(x[:, 0])], axis=1)

    def derivatives(self, t, x, values, active=()):
        J = np.zeros((len(t), 2, 2))
        J[:, 0, 1], J[:, 1, 0] = 1.0, -values[0] * np.cos(x[:, 0])
        return self.rates(t, x, values), J, np.zeros((len(t), 2, len(tuple(active))))
