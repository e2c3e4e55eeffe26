"""Nonlinear modes of whole bodies with large deflections, by harmonic balance of all unknowns.

Without damping a mode whose velocities vanish at an instant is ``u = sum_h c_h cos(h w t)``. The
forces are cubic, so that 2 H + 1 instants of half a period give their harmonics exactly. Newton's
method starts from the orbit of a reduced body.
"""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from fecontact.fem.elimination import least_squares
from fecontact.fem.finite_strain import FiniteStrainModel


class WholeBody:
    """A body by all its free unknowns, observed by a row over the displacements of its nodes."""

    def __init__(self, body, row):
        self.model = FiniteStrainModel(body)
        self.mass = sp.csc_array(body.expansion.T @ body.mass @ body.expansion)
        self.row = np.asarray(body.expansion.T @ row).ravel()

    def frequency_near(self, basis, mode, amplitude):
        """Frequency [Hz] of the orbit next to that of a reduced body, and of the reduced body.

        ``amplitude`` is that of the first harmonic of the observed motion, which both have.
        """
        sizes = np.abs(mode.harmonic())
        place = int(np.flatnonzero(np.diff(sizes > amplitude))[0])
        part = (amplitude - sizes[place]) / (sizes[place + 1] - sizes[place])
        harmonics = mode.branch.method.highest
        turn = np.exp(-1j * np.arange(harmonics + 1) * np.angle(mode.harmonic()[place]))
        q = (np.array([mode.coordinates(k)[place] for k in range(harmonics + 1)])
             * turn[:, None]).real
        shapes = basis.mode_shapes.shapes.reshape(-1, basis.modes)
        moved = least_squares(self.model.body.expansion, shapes @ q.T).T
        w = mode.angular_frequency
        reduced = w[place] + part * (w[place + 1] - w[place])
        return self._solved(moved, reduced, amplitude) / (2.0 * np.pi), reduced / (2.0 * np.pi)

    def _solved(self, c, speed, amplitude):
        H, f = len(c) - 1, len(self.row)
        count = 2 * H + 1
        angles = (np.arange(count) + 0.5) * np.pi / count
        waves = np.cos(np.outer(np.arange(H + 1), angles))
        weights = 2.0 * waves / count
        weights[0] *= 0.5
        border = np.kron(np.arange(H + 1) == 1, self.row)[None]
        largest = np.abs(c).max()
        for _ in range(15):
            states = [self.model.state(q) for q in waves.T @ c]
            inertia = np.arange(H + 1)[:, None] ** 2 * (self.mass @ c.T).T
            forces = weights @ np.array([one.force for one in states])
            residual = np.append((forces - speed**2 * inertia).ravel(),
                                 border @ c.ravel() - amplitude)
            blocks = [[sum(weights[h, j] * waves[k, j] * one.tangent
                           for j, one in enumerate(states))
                       - (h == k) * (h * speed) ** 2 * self.mass for k in range(H + 1)]
                      for h in range(H + 1)]
            turned = -2.0 * speed * inertia.reshape(-1, 1)
            matrix = sp.block_array([[sp.block_array(blocks), turned], [border, None]],
                                    format="csc")
            step = splu(matrix).solve(residual)
            c, speed = c - step[:-1].reshape(H + 1, f), speed - step[-1]
            if np.abs(step[:-1]).max() < 1e-8 * largest:
                self.harmonics = c
                return speed
        raise AssertionError(f"no orbit with the amplitude {amplitude}")
