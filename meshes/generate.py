"""Makes the meshes in this folder again: ``python meshes/generate.py``."""

from pathlib import Path

from fecontact import Beam, Block, Pendulum, generate, write_mesh

SHAPES = {
    "beam.msh": Beam(),
    "block.msh": Block(),
    "pendulum.msh": Pendulum(
        arm_length=0.3045, arm_height=0.00798, bob_width=0.0324, bob_height=0.0324
    ),
    "impact_pendulum.msh": Pendulum(
        arm_length=0.30447856, arm_height=0.0079768, bob_width=0.03239153, bob_height=0.03239153,
        hinge_radius=0.002, contact_length=0.006,
    ),
}

if __name__ == "__main__":
    for name, shape in SHAPES.items():
        write_mesh(generate(shape), Path(__file__).with_name(name))
