"""The model once more, slowly: plain Python, straight from its equations, for real and complex y.

Nothing here uses the package's laws or kernels; only the numbers of a system are taken over.
"""

import numpy as np


def _positive(x):
    return np.real(x) > 0.0


class Model:
    """Right-hand side, energies and powers of a contact system."""

    def __init__(self, system):
        basis = system.basis
        self.w, self.C, self.T = basis.angular_frequencies, basis.damping, basis.T
        self.n, self.m = len(basis.tributary), len(self.w)
        self.X = [basis.positions[2 + j][0] for j in range(self.n)]
        share = [length / sum(basis.tributary) for length in basis.tributary]
        self.values = system.parameters()
        self.gap = np.broadcast_to(system.gap, self.n)
        self.carried = float(self.values["drive.dashpots"] == "relative")

        def per_node(name, extensive):
            value = self.values[name]
            if isinstance(value, tuple):
                return value
            return [value * s for s in share] if extensive else [value] * self.n

        self.c, self.R_Z, self.beta_c = (
            per_node(f"normal.{name}", name != "roughness_height")
            for name in ("stiffness", "roughness_height", "damping"))
        self.mu_0, self.mu_inf, self.decay, self.k_s = (
            per_node(f"friction.{name}", False)
            for name in ("static_coefficient", "kinetic_coefficient", "decay", "smoothing_slope"))

    def drive(self, axis, t):
        """Moving end of the spring at B, and its rate."""
        w = 2.0 * np.pi * self.values["drive.frequency_hz"]
        a = self.values[f"drive.amplitude_{axis}"]
        return a * np.sin(w * t), a * w * np.cos(w * t)

    def normal(self, j, u, v):
        """(4.1-16) with uniform asperity heights."""
        s = u / self.R_Z[j]
        if not _positive(s):
            f, h = 0.0, 0.0
        elif np.real(s) < 1.0:
            f, h = s**2 / 2.0, s
        else:
            f, h = s - 0.5, 1.0
        F = self.c[j] * self.R_Z[j] * f + self.beta_c[j] * h * v
        return F if _positive(F) else 0.0 * F

    def friction(self, j, v, F):
        """(4.1-21) to (4.1-23)."""
        speed = v if np.real(v) >= 0.0 else -v
        mu = (self.mu_0[j] - self.mu_inf[j]) * np.exp(-self.decay[j] * speed) + self.mu_inf[j]
        return mu * F * (2.0 / np.pi) * np.arctan(self.k_s[j] * v)

    def node(self, j, t, y):
        """Normal force, friction, penetration, its rate, slip velocity, slope of the ground."""
        q, rate = y[: self.m], y[self.m :]
        x, height = self.T[2 + j, 0] @ q, self.T[2 + j, 1] @ q
        x_rate, height_rate = self.T[2 + j, 0] @ rate, self.T[2 + j, 1] @ rate
        V, y_A = self.values["ground.speed"], self.values["ground.amplitude"]
        k = 2.0 * np.pi / self.values["ground.wavelength"]
        phase = k * (self.X[j] + x - V * t)
        slip = x_rate - V
        ground, slope = y_A * np.sin(phase), y_A * k * np.cos(phase)
        u, v = ground - height - self.gap[j], slope * slip - height_rate
        F = self.normal(j, u, v)
        return F, self.friction(j, slip, F), u, v, slip, slope

    def inclined(self, F, slope):
        """Force on a node in -x that belongs to its normal force."""
        return F * slope if self.values["ground.normal"] == "surface" else 0.0

    def rhs(self, t, y):
        """y' = [q', -2 D w q' - w^2 q + T^T f_ex]."""
        q, rate = y[: self.m], y[self.m :]
        force = np.zeros((2 + self.n, 3), dtype=y.dtype)
        w_B, v_B = self.T[0] @ q, self.T[0] @ rate
        for i, axis in enumerate("xy"):
            c, b = self.values[f"drive.stiffness_{axis}"], self.values[f"drive.damping_{axis}"]
            end, end_rate = self.drive(axis, t)
            force[0, i] = -(c * (w_B[i] - end) + b * (v_B[i] - self.carried * end_rate))
        force[1, 1] = -self.values["load.normal"]
        for j in range(self.n):
            F, R, *_, slope = self.node(j, t, y)
            force[2 + j] = [-R - self.inclined(F, slope), F, 0.0]
        total = -self.C @ rate - self.w**2 * q
        for point in range(2 + self.n):
            for i in range(3):
                total = total + self.T[point, i] * force[point, i]
        return np.concatenate([rate, total])

    def jacobian(self, t, y):
        """Jacobian by complex steps: exact to round-off."""
        step = 1e-30
        return np.column_stack([
            self.rhs(t, y + 1j * step * direction).imag / step for direction in np.eye(len(y))])

    def stored(self, t, y):
        """Kinetic energy, and the energy in modes, springs at B and asperities."""
        q, rate = y[: self.m], y[self.m :]
        energy = 0.5 * rate @ rate + 0.5 * (self.w * q) @ (self.w * q)
        for i, axis in enumerate("xy"):
            energy += 0.5 * self.values[f"drive.stiffness_{axis}"] * (
                self.T[0, i] @ q - self.drive(axis, t)[0]) ** 2
        for j in range(self.n):
            s = self.node(j, t, y)[2] / self.R_Z[j]
            if np.real(s) >= 1.0:
                # The cubic up to s = 1, from there the trapezium under c (u - R_Z / 2).
                shape = 1.0 / 6.0 + 0.5 * (0.5 + s - 0.5) * (s - 1.0)
            else:
                shape = s**3 / 6.0 if _positive(s) else 0.0
            energy += self.c[j] * self.R_Z[j] ** 2 * shape
        return energy

    def stored_rate(self, t, y):
        """Time derivative of the stored energy along the motion."""
        step = 1e-30
        moved = y + 1j * step * self.rhs(t, y + 0j)
        return self.stored(t + 1j * step, moved).imag / step

    def powers(self, t, y):
        """Powers put in and lost, by name."""
        q, rate = y[: self.m], y[self.m :]
        out = dict.fromkeys(("drive", "belt_normal", "belt_friction", "load", "circulatory",
                             "modal_damping", "dashpots", "contact_damping", "friction",
                             "bristles"), 0.0)
        for i, axis in enumerate("xy"):
            end, end_rate = self.drive(axis, t)
            c, b = self.values[f"drive.stiffness_{axis}"], self.values[f"drive.damping_{axis}"]
            lag = self.carried * end_rate - self.T[0, i] @ rate
            out["drive"] += (c * (end - self.T[0, i] @ q) + b * lag * self.carried) * end_rate
            out["dashpots"] += b * lag**2
        out["load"] = -self.values["load.normal"] * (self.T[1, 1] @ rate)
        out["modal_damping"] = rate @ self.C @ rate
        for j in range(self.n):
            F, R, u, v, slip, slope = self.node(j, t, y)
            # Work of the normal force on the body beyond the work that goes into the contact.
            out["belt_normal"] += F * slope * slip - self.inclined(F, slope) * (
                slip + self.values["ground.speed"])
            out["belt_friction"] -= R * self.values["ground.speed"]
            out["contact_damping"] += (F - self.normal(j, u, 0.0)) * v
            out["friction"] += R * slip
        return out
