"""Solids with friction in two directions: a pad that tips, a disc brake, a bolted plate."""

from pathlib import Path
from tempfile import TemporaryDirectory

import bolted_plate
import disc_brake
import numpy as np
import tipping_pad
from comparison import Comparison, comparisons, table
from pictures import shrink

from fecontact import simulate
from fecontact.analysis import complex_modes

HEADS = ("amplitude of the end [mm]", "frequency of the loop [Hz]", "of the ring-down",
         "damping ratio of the loop", "of the ring-down")


def section(images: Path) -> str:
    """Tables and pictures of all three."""
    pad, settled = _pad()
    brake, squealing = _brake(images)
    loops, rings = _plate(images)
    with TemporaryDirectory() as folder:
        drawn = Path(folder) / "pad.png"
        tipping_pad.plot((0.1, 0.25, 0.45), 35.0, drawn)
        shrink(drawn, images / "tipping-pad.png")
    return f"""## Solids that slide

A steel pad of 60 x 36 x 30 mm on a belt, pressed and held at its top (`tipping_pad.py`).
Friction mu N moves the resultant of the pressure ahead by mu h, h = 30 mm, on belts in any
direction. The rows with an edge that lifts off give the largest difference from a rigid pad on
unilateral springs (three equations), relative to the largest force. Six modes make the pad rigid.

{comparisons(pad)}

A run from rest on a belt at 35 degrees ends {settled:.0e} of the largest force from statics.

![Pressure below a pad that tips](images/validation/tipping-pad.png)

An annular disc between two pads that squeals (`disc_brake.py`). A disturbance of 1 nm
grows in time as the complex mode about steady sliding does, the rate to at least seven digits and
the frequency to nine: what the run's tolerance of 1e-9 leaves, as the contact is linear until a pad
lifts off. The disc turns as a prescribed motion, without gyroscopic terms.

{comparisons(brake)}

Pads that lift off are softer: in large motions it squeals at {squealing:.0f} Hz, and the size of
the motion varies slowly.

![Growth of a squeal, and forces on both pads](images/validation/disc-brake.png)

A plate with a bolted lap (`bolted_plate.py`): ring-downs in time beside a slow loop under
the inertia force of the mode, from the equations alone, in its second cycle: in the first one
friction still finds its way and loses up to half as much again. The loop leaves out the inertia of
other modes, so that the shift of the frequency differs by up to a tenth and damping by up to 6 %.
Its area is the work of friction.

{comparisons(loops)}

{table(HEADS, rings)}

![Frequency and damping of a bolted plate over amplitude](images/validation/bolted-plate.png)
"""


def _pad() -> tuple[list[Comparison], float]:
    rows = []
    for friction, angle in ((0.1, 0.0), (0.25, 0.0), (0.45, 0.0), (0.45, 35.0)):
        normal, _ = tipping_pad.forces(tipping_pad.system(friction, angle))
        way = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        name = f"friction {friction:g}, belt at {angle:g} degrees"
        rows.append(Comparison(f"{name}: shift of the resultant [mm]",
                               1e3 * friction * tipping_pad.HEIGHT,
                               float(-1e3 * tipping_pad.resultant(normal) @ way)))
        wanted = tipping_pad.bed(friction, angle)
        for kind, modes in (("elastic", 12), ("rigid", 6)):
            normal, _ = tipping_pad.forces(tipping_pad.system(friction, angle, modes))
            rows.append(Comparison(f"{name}, {kind}: difference of pressure", 0.0,
                                   float(np.abs(normal - wanted).max() / wanted.max())))
    system = tipping_pad.system(0.45, 35.0)
    run, wanted = simulate(system, 0.2, outputs=3), tipping_pad.forces(system)[0]
    return rows, float(np.abs(run.normal_force[-1] - wanted).max() / wanted.max())


def _brake(images: Path) -> tuple[list[Comparison], float]:
    rows = []
    for friction in (0.3, 0.5):
        system = disc_brake.brake(friction)
        modes = complex_modes(system, "sliding")
        mode = disc_brake.flutter_mode(modes)
        rate, frequency = disc_brake.growth(system)
        rows += [Comparison(f"friction {friction:g}: growth rate [1/s]",
                            float(modes.eigenvalues[mode].real), rate),
                 Comparison(f"friction {friction:g}: frequency [Hz]",
                            float(modes.frequencies_hz[mode]), frequency)]
    system = disc_brake.brake()
    run, frequency = disc_brake.squeal(system, 0.02)
    with TemporaryDirectory() as folder:
        drawn = Path(folder) / "brake.png"
        disc_brake.plot(system, run, np.linspace(0.0, 0.6, 31), drawn)
        shrink(drawn, images / "disc-brake.png")
    return rows, frequency


def _plate(images: Path) -> tuple[list[Comparison], list[tuple[str, ...]]]:
    mode = bolted_plate.stuck_mode()
    scale = 1e3 * abs(mode.end)
    loops = []
    for deflection in (0.6e-3, 1.2e-3, 3e-3):
        one = bolted_plate.loop(mode, mode.angular_frequency**2 * deflection / abs(mode.end))
        loops.append(Comparison(f"amplitude {scale * one.amplitude:.3f} mm: area of the loop [J]",
                                one.loss, one.area))
    estimated = bolted_plate.estimate(mode, np.geomspace(3e-4, 5e-3, 21))
    runs = [bolted_plate.ring_down(mode, amplitude / abs(mode.end), 3)[1]
            for amplitude in (0.6e-3, 1.2e-3, 3e-3)]
    rows = []
    for size, frequency, ratio in np.concatenate(runs):
        by_loop = [np.interp(size, estimated[:, 0], estimated[:, k]) for k in (1, 2)]
        rows.append((f"{scale * size:.3f}", f"{by_loop[0]:.4f}", f"{frequency:.4f}",
                     f"{by_loop[1]:.5f}", f"{ratio:.5f}"))
    with TemporaryDirectory() as folder:
        drawn = Path(folder) / "plate.png"
        bolted_plate.plot(mode, estimated, runs, drawn)
        shrink(drawn, images / "bolted-plate.png")
    return loops, rows
