"""Half-spaces: what the tests say of them, with the numbers that they print."""

TEXT = """## Half-spaces

Pressures and friction on a grid, without elements (`pytest tests/half_space`, the last row with
`-m slow` where Tamaas 2.9 is installed):

| beside | pixels | error |
|---|---|---|
| Hertz: approach, largest pressure | 32, 64 a side | 0.04, 0.01 %; 0.09, 0.02 % |
| Westergaard: width of the contact | 128 a wave | within a pixel and a half |
| Cattaneo and Mindlin, nu = 0: displacement | 32, 64 a side | 0.13, 0.02 % |
| Mindlin and Deresiewicz: loss of a cycle at 0.9 mu P, nu = 0 and 0.3 | 32 a side | 0.04, 0.75 % |
| Jäger and Ciavarella: tractions, rough, nu = 0 | 32 x 32, periodic | 1e-5 of the largest |
| Tamaas: pressures of a rough surface | 64 x 64, periodic | 2e-8 of the largest |

At nu = 0.3 the closed form leaves out friction across the load, which the grid has: 0.75 % of the
loss are that difference.

Contact nodes of bodies that `with_half_space` completes (`pytest
tests/reduction/test_half_space_compliance.py`). Mean displacement of a square of 4 mm under an
even load, on a block of 12 x 12 x 8 mm (errors beside the limit of fine meshes):

| elements along the square | normal, alone | completed | tangential, alone | completed |
|---|---|---|---|---|
| 2 linear | -17.3 % | +0.5 % | -12.7 % | -1.2 % |
| 4 linear | -6.2 % | +0.1 % | -4.5 % | -0.4 % |
| 2 quadratic | -2.2 % | +0.1 % | -1.5 % | -0.1 % |
| 4 quadratic | -0.5 % | +0.1 % | -0.3 % | +0.1 % |
| 4 linear, tetrahedra | -12.6 % | -0.2 % | -9.4 % | -1.0 % |

A block of linear bricks of a third of the contact radius, with nu = 0.49 where they lock, pressed
by a sphere and sheared by 0.9 mu P, beside half-spaces on the same pixels: alone its pressures
are wrong by 38 % in the mean; completed by 0.3 %, and the loss of a cycle by 0.5 %. With bricks
that grow twice as fast away from the contact (the test) these are 2.4 and 2.3 %. With random
heights of 1 um (RMS) on the sphere as `HeightMap`, nu = 0.3, the same 32 of 64 nodes touch and
forces differ by 0.5 % in the mean.
"""


def section() -> str:
    """Tables of errors, which the tests named there compute."""
    return TEXT
