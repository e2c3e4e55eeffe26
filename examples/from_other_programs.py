"""
A body from another program
===========================

Matrices and modes of other finite-element programs become a modal basis: mass and stiffness from
Matrix Market, Abaqus, MATLAB or NumPy files, or modes from a universal file. Here a free steel
block comes in three of these ways, and all of them give the same frequencies.
"""

from pathlib import Path

import fecontact as fc
from fecontact.io import read_matrix, read_uff
from fecontact.laws import ConstantFriction, RoughSurface
from fecontact.plot import plot_phase
from fecontact.reduction import rows_from_dofs

data = Path(fc.__file__).parents[1] / "tests" / "data"

# %%
# Matrices that know their nodes: 101 to 105 touch the ground, 106 and 113 are B and C.
M, K = (read_matrix(data / f"block_{name}2.mtx") for name in ("MASS", "STIF"))
rows = rows_from_dofs(K.matrix.shape[0], [(K.dof(node, 1), K.dof(node, 2))
                                          for node in range(101, 106)],
                      B=(K.dof(106, 1), K.dof(106, 2)), C=(K.dof(113, 1), K.dof(113, 2)))
x = [0.0, 0.025, 0.05, 0.075, 0.1]
bases = {"Abaqus": fc.basis_from_matrices(M, K, rows, modes=8, damping=0.01, contact_x=x)}

# %%
# Matrices by name in a MATLAB file, and modes that were measured or computed elsewhere.
M, K = (read_matrix(data / "block.mat", name) for name in ("M", "K"))
bases["MATLAB"] = fc.basis_from_matrices(M, K, rows, modes=8, damping=0.01, contact_x=x)
bases["universal file"] = read_uff(data / "block.uff").modal_basis(contact=range(101, 106), B=106,
                                                                   C=113)
for name, basis in bases.items():
    print(f"{name}: {', '.join(f'{value:.1f}' for value in basis.frequencies_hz[3:6])} Hz")

# %%
# From here on it is a body like any other: a block that sticks and slips on a belt.
system = fc.ContactSystem(
    bases["Abaqus"],
    normal=RoughSurface(stiffness=10e6, roughness_height=10e-6, damping=40.0),
    friction=ConstantFriction(0.4, smoothing_slope=1e4), ground=fc.Ground(speed=0.01),
    load=fc.Load(normal=100.0), drive=fc.Drive(stiffness_x=1e5, damping_x=1.0))
run = fc.simulate(system, 0.1, outputs=2001)
plot_phase(run, "B", path="from_other_programs.png")
