"""Why a sliding part squeals: two modes meet, and friction couples them.

A steel beam slides on a belt with constant friction, so nothing falls with slip velocity. On a
rough, compliant contact its bouncing and its rocking mode have nearly the same frequency; friction
couples them, and from some friction coefficient on they merge into one mode that grows. The
equilibrium is followed over the friction coefficient, the Hopf point is located, and then the
border of flutter is followed over friction coefficient and load.

Usage: python examples/squeal.py [FOLDER] [--quick]
"""

import sys
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    Branch,
    codim2_curve,
    contact_field,
    equilibrium_branch,
    find_equilibrium,
    stability_map,
)
from fecontact.laws import ConstantFriction, RoughSurface
from fecontact.plot import plot_eigenvalues, plot_stability_map

FRICTION = "friction.friction_coefficient"


def system(friction: float = 0.0, load: float = 14.0) -> fc.ContactSystem:
    """The beam, held by a spring at its left end."""
    body = fc.ElasticBody(fc.generate(fc.Beam(length=0.2, height=0.02)), thickness=0.01)
    basis = fc.modal_basis(body, 20, contact_nodes=40, B=(0.0, 0.01), C=(0.1, 0.02), damping=0.01)
    return fc.ContactSystem(
        basis, normal=RoughSurface(stiffness=10e6, roughness_height=10e-6, damping=40.0),
        friction=ConstantFriction(friction, smoothing_slope=1e6),
        ground=fc.Ground(speed=0.05), load=fc.Load(normal=load),
        drive=fc.Drive(stiffness_x=5610.0, damping_x=0.768))


def main(folder: Path = Path(), quick: bool = False) -> tuple[Branch, Branch]:
    """Pictures in the folder; gives the branch over friction and the border of flutter."""
    folder.mkdir(parents=True, exist_ok=True)
    columns, rows = (7, 5) if quick else (31, 29)
    field = contact_field(system(), [FRICTION, "load.normal"])
    branch = equilibrium_branch(field, parameter=FRICTION, bounds=(0.0, 0.6))
    plot_eigenvalues(branch, x_label="friction coefficient", range_hz=(300.0, 1200.0),
                     path=folder / "squeal_modes.png")
    hopf = branch.of_kind("Hopf")[0]
    print(f"flutter from a friction coefficient of {hopf.parameter:.4f} on, "
          f"at {hopf.frequency_hz:.1f} Hz, {hopf.criticality}")
    modes = find_equilibrium(field, {FRICTION: 0.55}).modes
    worst = int(np.argmin(modes.damping_ratios))
    print(f"at 0.55 a mode of {modes.frequencies_hz[worst]:.1f} Hz grows, "
          f"damping ratio {modes.damping_ratios[worst]:.4f}")

    box = {FRICTION: (0.0, 0.6), "load.normal": (2.0, 30.0)}
    border = codim2_curve(field, hopf, "load.normal", bounds=box)
    loads, frictions = border.column("load.normal"), border.column(FRICTION)
    print(f"border: {len(border)} points, friction coefficient from {frictions.min():.3f} to "
          f"{frictions.max():.3f}, load from {loads.min():.1f} to {loads.max():.1f} N")
    found = stability_map(field, {FRICTION: np.linspace(0.0, 0.6, columns),
                                  "load.normal": np.linspace(2.0, 30.0, rows)})
    plot_stability_map(found, borders=[border], x_label="friction coefficient",
                       y_label="load [N]", path=folder / "squeal_map.png")
    return branch, border


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
