"""
Where a pad presses on a belt, and when it tips
===============================================

Friction below a pad and the springs that hold its top make a moment: the pressure moves to the
leading edge by friction coefficient times height, until the trailing edge lifts off. On a belt that
runs obliquely one corner carries most.
"""

import numpy as np

import fecontact as fc
from fecontact.fem import SolidBlock
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.plot import new_figure

# %%
# A steel block of 60 x 36 x 30 mm, pressed by 200 N and held at its top.
length, width, height = 0.06, 0.036, 0.03
body = fc.ElasticBody(fc.generate(SolidBlock(length, width, height, drive_height=height,
                                              element_size=0.006)))
basis = fc.modal_basis(body, 12, contact_nodes="all", B="top", C="top", damping=0.01)
system = fc.ContactSystem(
    basis, normal=LinearContact(2e7, damping=3000.0),
    friction=ConstantFriction(0.1, smoothing="tanh"), ground=fc.Ground(speed=0.5),
    drive=fc.Drive(stiffness_x=2e6, stiffness_y=2e6, damping_x=400.0, damping_y=400.0),
    load=fc.Load(normal=200.0))

# %%
# Steady sliding for several coefficients of friction and directions of the belt.
x, y = 1e3 * basis.contact_places[:, :2].T
with new_figure(8.0, 5.5, "tipping_pad.png") as figure:
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    for axes, (friction, angle) in zip(panels, ((0.1, 0.0), (0.25, 0.0), (0.45, 0.0), (0.45, 35.0)),
                                       strict=True):
        along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        pad = system.with_({"friction.friction_coefficient": friction,
                            "ground.speed": 0.5 * along[0], "ground.speed_y": 0.5 * along[1]})
        force = fc.equilibrium(pad, "sliding").normal_force
        ahead = -(force @ np.column_stack([x, y]) / force.sum() - [30.0, 18.0]) @ along
        print(f"friction {friction:g}, belt at {angle:g} degrees: resultant {ahead:.4f} mm ahead, "
              f"{(force == 0.0).mean():.0%} lifted off")
        axes.scatter(x, y, c=np.where(force > 0.0, 1e-3 * force / basis.tributary, np.nan), s=90.0,
                     plotnonfinite=False, vmin=0.0, marker="s")
        axes.scatter(x[force == 0.0], y[force == 0.0], s=10.0, color="0.7")
        axes.set(title=f"friction {friction:g}, belt {angle:g}°", aspect="equal",
                 xlabel="x [mm]", ylabel="y [mm]")
