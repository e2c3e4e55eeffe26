"""Cost of several bodies: relative rows beside those of one body, and chains of bodies.

Steel beams lie on each other, clamped at one end, pressed and shaken. Time per accepted step of two
beams of 20 modes with 40 nodes between them over that of one beam of 40 modes with 40 nodes on the
ground; and of stacks of 1 to 16 beams of 20 modes, 10 nodes at each interface.

Usage: python benchmarks/bodies.py [--quick]
"""

import sys
import time

import numpy as np
from usage import explain

from fecontact import (
    Beam,
    ContactSystem,
    Drive,
    ElasticBody,
    Interface,
    Load,
    PointLoad,
    generate,
    simulate,
)
from fecontact.fem import pair_faces
from fecontact.laws import ConstantFriction, Harmonic, LinearContact
from fecontact.reduction import reduce_bodies

HEIGHT, LENGTH = 0.004, 0.1
NORMAL, FRICTION = LinearContact(2e8, 2e3), ConstantFriction(0.3, smoothing_slope=1e4)


def stack(count: int, modes: int, nodes: int) -> ContactSystem:
    """Beams on each other and the lowest on the ground; shaken at the top."""
    mesh = generate(Beam(length=LENGTH, height=HEIGHT, element_size=0.002))
    bodies = {f"beam{k}": ElasticBody(mesh.placed((0.0, k * HEIGHT)), thickness=0.01,
                                      fixed={"left": "xy"}) for k in range(count)}
    faces = [pair_faces(bodies, f"beam{k}.contact", "ground" if k == 0 else f"beam{k - 1}.top",
                        nodes=nodes, nodes_on="face") for k in range(count)]
    return system(bodies, faces, modes)


def pair(modes: int, nodes: int) -> ContactSystem:
    """Two beams with contact between them only."""
    mesh = generate(Beam(length=LENGTH, height=HEIGHT, element_size=0.002))
    bodies = {f"beam{k}": ElasticBody(mesh.placed((0.0, k * HEIGHT)), thickness=0.01,
                                      fixed={"left": "xy"}) for k in range(2)}
    return system(bodies, [pair_faces(bodies, "beam1.contact", "beam0.top", nodes=nodes,
                                      nodes_on="face")], modes)


def system(bodies: dict[str, ElasticBody], faces: list, modes: int) -> ContactSystem:
    """Vibration modes alone, so that their number is as given."""
    top = list(bodies)[-1]
    bases = reduce_bodies(bodies, faces, modes=modes, reduction="vibration", damping=0.01,
                          each={name: {"B": "", "C": "top" if name == top else "",
                                       "points": {"end": "right"}} for name in bodies})
    return ContactSystem(
        bodies=bases, drive=Drive(),
        interfaces=[Interface(f"face{k}", face, NORMAL, FRICTION)
                    for k, face in enumerate(faces)],
        load=Load(300.0, (PointLoad(f"{top}.end", "x", signal=Harmonic(100.0, 127.0)),)))


def per_step(systems: dict[str, ContactSystem], t_end: float, rounds: int) -> dict[str, float]:
    """Least processor time of an accepted step [us], in rounds of all systems in turn."""
    best = dict.fromkeys(systems, np.inf)
    simulate(next(iter(systems.values())), 1e-6, outputs=2)  # loads what is compiled
    for _ in range(rounds):
        for name, one in systems.items():
            begin = time.process_time()
            run = simulate(one, t_end, outputs=2)
            spent = time.process_time() - begin
            best[name] = min(best[name], 1e6 * spent / run.statistics["steps"])
    return best


def main(quick: bool = False) -> None:
    """Print the tables."""
    t_end, rounds = (2e-4, 1) if quick else (5e-3, 5)
    found = per_step({"one body": stack(1, 40, 40), "two bodies": pair(20, 40)}, t_end, rounds)
    for name, spent in found.items():
        print(f"{name:12s} 40 modes, 40 nodes: {spent:8.1f} us a step")
    print(f"ratio {found['two bodies'] / found['one body']:.2f}\n", flush=True)
    counts = (1, 2) if quick else (1, 2, 4, 8, 16)
    chain = per_step({str(count): stack(count, 20, 10) for count in counts}, t_end, rounds)
    for name, spent in chain.items():
        print(f"{name:>2s} bodies of 20 modes, 10 nodes an interface: {spent:8.1f} us a step")
    slope = np.polyfit(np.log(counts), np.log(list(chain.values())), 1)[0]
    print(f"slope {slope:.2f}")


if __name__ == "__main__":
    explain(__doc__)
    main("--quick" in sys.argv)
