"""Cost of the laws in the right-hand side of a system with 400 contact nodes and 40 modes.

Every law of the package and one of a user's own (examples/own_law.py), all in one run. Every
node is in contact and slides or sticks, none is skipped.

Usage: python benchmarks/laws.py [--quick]
"""

import sys
import time
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np
from usage import explain

from fecontact import ContactSystem, ModalBasis
from fecontact.laws import ConstantFriction, FrictionLaw, LinearContact, NormalLaw, law_names
from fecontact.laws.base import NodeLaw
from fecontact.laws.registry import law_class
from fecontact.system.kernels import right_hand_side

NODES, MODES = 400, 40
SURFACE = {"stiffness": 0.3e6, "roughness_height": 5.2e-6, "damping": 6.0}
GIVEN: dict[str, dict[str, Any]] = {
    **dict.fromkeys(("rough-surface", "parabolic-surface", "cosine-surface", "gaussian-surface",
                     "measured-surface"), SURFACE),
    "linear": {"stiffness": 1e7}, "power": {"stiffness": 1e9}, "prescribed-force": {"force": 14.0},
    "restitution": {"stiffness": 1e9, "restitution": 0.8, "reference_velocity": 0.1},
    "exponential": {"force": 10.0, "decay_length": 1e-6},
    "back-burdekin": {"nominal_area": 1e-4, "coefficient": 1e-9},
    "greenwood-williamson": {"asperities": 1e4, "asperity_radius": 1e-5,
                             "composite_modulus": 1e11, "height_deviation": 1e-6},
    "asperity": {"asperities": 1e4, "asperity_radius": 1e-5, "composite_modulus": 1e11,
                 "gap_range": 1e-5, "yield_stress": 1e9},
    "bilateral-polynomial": {"stiffness": 1e7, "cubic_stiffness": 1e17},
    "bilateral-play": {"stiffness": 1e7, "clearance": 1e-6},
    "bilateral-piecewise": {"elongations": (-1e-6, 0.0, 1e-6), "forces": (-20.0, 0.0, 10.0)},
    "two-sided-stop": {"stiffness": 1e7, "clearance": 1e-3},
}


def microseconds(normal: NormalLaw, friction: FrictionLaw, repetitions: int = 30) -> float:
    """Shortest time of a right-hand side [us]."""
    rng = np.random.default_rng(0)
    T = rng.standard_normal((2 + NODES, 3, MODES))
    basis = ModalBasis(np.geomspace(1e2, 1e5, MODES), np.diag(np.geomspace(1.0, 1e3, MODES)), T,
                       np.zeros((2 + NODES, 2)), np.ones(NODES))
    system = ContactSystem(basis, normal=normal, friction=friction)
    y = 1e-7 * rng.standard_normal(system.size)
    # All nodes pressed in by some micrometres.
    y[:MODES] += np.linalg.lstsq(T[2 : 2 + MODES, 1], np.full(MODES, -3e-6), rcond=None)[0]
    arrays = system.arrays._replace(gap=-np.abs(T[2:, 1] @ y[:MODES]) - 3e-6)
    out = np.empty(system.size)
    best = np.inf
    for _ in range(repetitions):
        begin = time.perf_counter()
        for _ in range(100):
            right_hand_side(0.0, y, arrays, out)
        best = min(best, (time.perf_counter() - begin) / 100)
    return 1e6 * best


# Values for the parameters of friction laws.
FRICTION = {
    "static_coefficient": 0.8, "kinetic_coefficient": 0.55, "minimum_coefficient": 0.55,
    "friction_coefficient": 0.55, "minimum_velocity": 1e-2, "stribeck_velocity": 1e-3,
    "stribeck_exponent": 2.0, "decay": 1000.0, "factor": 0.14, "excess": 1.14,
    "smoothing_slope": 100.0, "stiffness": 1e7, "presliding_stiffness": 1e5,
    "bristle_stiffness": 1e5, "yield_displacement": 5e-6, "chi": -0.5, "beta": 0.1,
    "springs": (3.0, 2.0, 1.0), "limits": (1.0, 2.0, 3.0)}


def main(quick: bool = False) -> None:
    """Print the tables."""
    repetitions = 2 if quick else 30
    own = f"{Path(__file__).parents[1] / 'examples' / 'own_law.py'}:LogarithmicFriction"
    for kind, other in ((NormalLaw, ConstantFriction(0.55)), (FrictionLaw, LinearContact(1e7))):
        # The contact element is two other laws, and a rigid stop has no force to be computed.
        names = [name for name in law_names()[kind]
                 if name not in ("friction-contact-3d", "rigid-stop")]
        names += [own] if kind is FrictionLaw else []
        costs = {}
        for name in names:
            made = law_class(kind, name, "")
            law: NodeLaw = made(**GIVEN.get(name, {}) if kind is NormalLaw else {
                entry.name: FRICTION[entry.name] for entry in fields(made)
                if entry.default is MISSING and entry.default_factory is MISSING})
            parts = (law, other) if kind is NormalLaw else (other, law)
            costs[Path(name).name] = microseconds(*parts, repetitions)  # type: ignore[arg-type]
            memory = getattr(law, "memory", 0)
            print(f"{kind.__name__:12s} {Path(name).name:32s} {costs[Path(name).name]:6.1f} us"
                  f"{f', {memory} internal variables a node' if memory else ''}", flush=True)
        plain = [cost for name, cost in costs.items()
                 if name not in ("jenkins", "iwan", "four-parameter-iwan",
                                 "parallel-sliders", "dahl", "lugre", "bouc-wen")]
        print(f"{kind.__name__:12s} slowest to fastest, without memory: "
              f"{max(plain) / min(plain):.2f}\n")


if __name__ == "__main__":
    explain(__doc__)
    main("--quick" in sys.argv)
