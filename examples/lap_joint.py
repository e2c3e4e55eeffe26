"""
A bolted lap joint: microslip
=============================

Two beams overlap; two bolts, springs with a prescribed shortening, press them on each other. One
beam is clamped, the other is pulled at its end. The ends of the overlap slip first, long before the
joint slides: a loop of force and displacement, and the energy that it takes.
"""

import fecontact as fc
from fecontact.analysis import prestressed_modes
from fecontact.laws import JenkinsFriction, LinearContact
from fecontact.plot import plot_loop
from fecontact.reduction import Spring

# %%
# Beams of 200 x 10 mm overlap by 80 mm; heads and nuts of the bolts are points of the beams.
beam = fc.generate(fc.Beam(length=0.2, height=0.01, element_size=0.005))
bolts = {1: 0.14, 2: 0.18}  # m
model = fc.Assembly()
model.add("lower", fc.ElasticBody(beam.placed((0.0, -0.01)), thickness=0.02, fixed={"left": "xy"}),
          points={f"nut{k}": (x, -0.01) for k, x in bolts.items()})
model.add("upper", fc.ElasticBody(beam.placed((0.12, 0.0)), thickness=0.02),
          points={"end": (0.32, 0.005)} | {f"head{k}": (x, 0.01) for k, x in bolts.items()})
for k in bolts:
    model.join(Spring(f"upper.head{k}", f"lower.nut{k}", stiffness=2e8, damping=50.0,
                      shortening=1e-5))

# %%
# The interface: stiffness of the rough surfaces, and friction that sticks elastically.
model.contact("lap", "upper.contact", "lower.top", nodes=8,
              normal=LinearContact(2e9, damping=100.0),
              friction=JenkinsFriction(1.6e9, friction_coefficient=0.3))
joint = model.system(modes=6, damping=0.001,
                     load=fc.Load(forces=(fc.PointLoad("upper.end", "x", signal=0.0),)))

# %%
# Tightened, then pulled to one side, to the other, and back, all without time.
for force in (100.0, 200.0, 300.0, 500.0):
    history = fc.load_history(
        joint, fc.LoadPath(forces={"upper.end.x": (0.0, force, -force, force)}, steps=40))
    if force == 100.0:
        pressed = history.normal_force[0].sum()
        print(f"the bolts press with {pressed:.0f} N, friction holds {0.3 * pressed:.0f} N")
    loop = history.loop(1, 3)
    slips = (history.contact_state[history.row(1)] == fc.ContactState.SLIP).sum()
    print(f"{force:.0f} N: {slips} of {joint.basis.contact_nodes} nodes slip, "
          f"{1e6 * loop.loss:.3f} uJ in a cycle")
plot_loop(history, path="lap_joint_loop.png")

# %%
# Small vibrations are those of the joint with stuck contacts.
stuck = prestressed_modes(joint, history.state(0))
print("stuck:", ", ".join(f"{value:.2f}" for value in stuck.frequencies_hz[:3]), "Hz")
