"""Values for the parameters of friction laws that have no default."""

from dataclasses import MISSING, fields

REQUIRED = {
    "static_coefficient": 0.8, "kinetic_coefficient": 0.55, "minimum_coefficient": 0.55,
    "friction_coefficient": 0.55, "minimum_velocity": 1e-2, "stribeck_velocity": 1e-3,
    "stribeck_exponent": 2.0, "decay": 1000.0, "factor": 0.14, "excess": 1.14,
    "smoothing_slope": 100.0, "stiffness": 1e7, "presliding_stiffness": 1e5,
    "bristle_stiffness": 1e5, "yield_displacement": 5e-6, "chi": -0.5, "beta": 0.1}


def made(cls, **values):
    """A law with the given values, and those above for what it requires besides."""
    needed = {entry.name: REQUIRED[entry.name] for entry in fields(cls)
              if entry.default is MISSING and entry.default_factory is MISSING
              and entry.name not in values}
    return cls(**needed, **values)
