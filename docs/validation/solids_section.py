"""Solids: rates of the elements, a thick plate, friction in two directions."""

from pathlib import Path

import dithered_friction
import numpy as np
import pressed_sphere
import sliding_box
import thrown_block
import two_spheres
from comparison import Comparison, comparisons, table
from pictures import save

from fecontact.plot import plot_shear


def section(images: Path) -> str:
    """Tables and pictures of the box, the plate, the throw and the dither."""
    errors = {element: (sliding_box.meshes(element),
                        sliding_box.errors(element, sliding_box.meshes(element)))
              for element in sliding_box.ELEMENTS}
    save(sliding_box.figure(errors), images / "sliding-box.png")
    block = thrown_block.thrown_block(1e5)
    crept: dict[thrown_block.Smoothing, list[tuple[float, float]]] = {
        smoothing: [(slope, thrown_block.thrown_mass(smoothing, slope).excess)
                    for slope in 10.0 ** np.arange(2.0, 5.5, 0.5)]
        for smoothing in ("arctan", "tanh", "square-root")}
    save(thrown_block.figure(block, crept), images / "thrown-block.png")
    ratios = np.array([0.02, 0.05, *np.arange(1, 21) / 10.0])
    means = {direction: np.array([dithered_friction.mean_friction(
        dithered_friction.dithered(ratio, direction)) for ratio in ratios])
        for direction in dithered_friction.DIRECTIONS}
    save(dithered_friction.figure(ratios, means, {
        f"V = {ratio:g} a": dithered_friction.dithered(ratio, "across")
        for ratio in (0.1, 0.5, 1.0)}), images / "dithered-friction.png")
    return f"""## Solids

The six faces of a steel box of 0.3 x 0.2 x 0.1 m slide without friction (`sliding_box.py`). Its
modes are standing waves in closed form, without singularities. The table has the larger relative
error of the frequencies of the two waves (1, 1, 1), and its order in the element size h between
the last two meshes. Theory gives h^2 for linear and h^4 for quadratic elements:

{_box(errors)}

![Errors of solid elements over their size](images/validation/sliding-box.png)

NAFEMS FV52, a square plate of 10 x 10 x 1 m on line supports along its bottom edges, Q2. Stresses
on line supports are infinite and the frequencies go on falling with finer meshes: they are compared
on a coarse one, where all are within 3 % of the published ones.

{_plate()}

The published values are those of Mindlin's plate whose edges do not move along themselves (modes 4
to 7 to 6e-5). Lines along the bottom hold z alone: the twist of the plate near its edges is free,
which costs mode 7, two half waves each way, most. Frequencies of each support, Q2, 8 x 8 x 2; with
sides that neither move up nor along themselves the solid has standing waves of Rayleigh and Lamb,
to which its frequencies converge like h^3.9:

{_supports()}

## Friction in two directions

A mass and a steel block of 60 x 40 x 20 mm, twelve modes and 24 contact nodes, are thrown across a
belt (`thrown_block.py`): mu = 0.3, belt 0.5 m/s along x, thrown with 1 m/s along y. In the
belt's frame they stop on a straight line. Smoothed with the arctan and k_s = 1e5 s/m, friction
lets them creep on by 2.4 um. Friction acts below the centre of mass of the block, so that its
centre of pressure runs ahead by mu h / 2.

{comparisons(_throw(block))}

Smoothing lengthens the path on the belt by the integral of v (1 / s(v) - 1) / (mu g) over the
speeds v, with the smoothed sign s. The integral is of first order in 1 / k_s for the arctan, of
second order for the other functions.

{comparisons([Comparison(f"{smoothing}, k_s = {slope:g} s/m: too far on the belt [m]",
                         thrown_block.excess(smoothing, slope), far)
              for smoothing, found in crept.items() for slope, far in found
              if slope in (1e2, 1e3, 1e4)])}

![Path of the block, and what smoothing adds to it](images/validation/thrown-block.png)

A body slides at V while the ground moves with the velocity a cos w t across or along the motion
(`dithered_friction.py`, k_s = 1e6 s/m). The mean friction along the motion over mu N is compared
with 2/pi V / sqrt(V^2 + a^2) K(a^2 / (V^2 + a^2)) (across) and 2/pi arcsin(V / a) (along).

{comparisons([Comparison(f"dither {direction}, V = {ratio:g} a",
                         float(dithered_friction.closed_form(ratio, direction)), value)
              for direction, values in means.items()
              for ratio, value in zip(ratios, values, strict=True)
              if ratio in (0.02, 0.1, 0.5, 1.0, 2.0)])}

![Mean friction under dither](images/validation/dithered-friction.png)

{spheres(images)}
{sphere_of_elements(images)}"""


def spheres(images: Path) -> str:
    """Table and picture of two spheres in partial slip."""
    rows = []
    for rings in (11, 22):
        found = two_spheres.cycle(rings)
        exact, (peak, width) = found.exact, found.peak_and_width
        part = found.part
        for quantity, wanted, value in (
                ("approach [m]", exact.approach, found.approach),
                ("peak pressure [Pa]", exact.peak, peak),
                ("radius a of contact [m]", two_spheres.WIDTH, width),
                ("radius of the circle that sticks over a, (1/4)^(1/3)",
                 (1.0 - part) ** (1.0 / 3.0), found.sticking_part),
                ("Q over mu P at the displacement of 0.75", part,
                 found.force.max() / (two_spheres.MU * exact.load)),
                ("loss of the cycle [J]", exact.loss(part), found.loss)):
            rows.append(Comparison(f"{rings} rings: {quantity}", wanted, value))
    save(two_spheres.figure(found), images / "two-spheres.png")
    return f"""## Two spheres

Two steel spheres of R = 50 mm are pressed together (Hertz) and moved to and fro by the displacement
that Q = 0.75 mu P needs, at 30 degrees to the x axis (`two_spheres.py`). Near the contact
they are half-spaces whose compliance between rings is a closed form, so that no mesh matters, and
are of one material, so that normal and tangential contact are not coupled. The references are
Cattaneo and Mindlin, and for the loss Mindlin and Deresiewicz (1953). The loss is a small
difference of large works, which magnifies errors of the forces up to thirty times. Quasi-static
increments with the same rings give the same loss to 0.1 %, with 44 rings the closed form to 0.15 %
(`tests/system/test_two_spheres.py`).

{comparisons(rows)}

![Pressure, shear and loop of two spheres beside closed forms](images/validation/two-spheres.png)
"""


def sphere_of_elements(images: Path) -> str:
    """Table and pictures of an elastic sphere on a rigid plane."""
    rows = []
    for elements in (2, 4):
        found = pressed_sphere.pressed(elements)
        exact, part = found.exact, found.part
        rows += [Comparison(f"{elements} elements: {quantity}", wanted, value)
                 for quantity, wanted, value in (
                     ("approach [m]", 0.5 * exact.approach, found.approach),
                     ("radius a of contact [m]", pressed_sphere.WIDTH, found.width),
                     ("radius of the circle that sticks over a", (1.0 - part) ** (1.0 / 3.0),
                      found.sticking_part),
                     ("displacement under Q [m]", 0.5 * exact.displacement(part),
                      found.displacement),
                     ("loss of the cycle [J]", 0.5 * exact.loss(part), found.loss))]
    save(pressed_sphere.figure(found), images / "pressed-sphere.png")
    save(pressed_sphere.displacement_figure(found), images / "pressed-sphere-displacement.png")
    save(plot_shear(found.history, 1), images / "pressed-sphere-shear.png")
    return f"""## An elastic sphere on a rigid plane

The lowest part of such a sphere is modelled by finite elements (Q2, nu = 0.49). It is pressed on a
rigid plane and sheared by +-Q, Q = 0.9 mu P, in quasi-static increments (`pressed_sphere.py`). Rows
give the number of elements along the radius of the contact. The plane is the plane of symmetry of
two such spheres; the sphere has half of their approach, displacement and loss. The body is five
times as wide and high as the contact. The missing compliance of the half-space is computed from
uniform tractions on the same face: 5 % of the approach, 4 % of the displacement; forces, radii and
loss need no correction. Radii follow from second moments of the tractions. The loss is a small
difference of large works: its error falls from 7 to 2 %.

Friction across the load, which Cattaneo and Mindlin neglect, reaches 12 % of the largest friction.
This explains why the displacement is 0.25 and 0.28 % too small with both meshes. The picture shows
the effect of this friction in a half-space of Cerruti's squares under Hertz's pressure, without
finite elements: zero for nu = 0, -0.30 % at nu = 0.49 and Q = 0.9 mu P. At smaller Q the slipping
ring is an element wide or less, and the error of the mesh is larger, up to 2.5 % at 0.18 mu P. The
plane keeps the face of this small body from tilting, an effect of 0.05 %.

{comparisons(rows)}

![Pressure, shear and loop of a sphere beside closed forms](images/validation/pressed-sphere.png)

![Displacement beside that of a half-space](images/validation/pressed-sphere-displacement.png)

![Pressure, friction, slip and states over the face](images/validation/pressed-sphere-shear.png)
"""


def _box(errors: dict[str, tuple[tuple[int, ...], dict[str, np.ndarray]]]) -> str:
    rows = []
    for element, (cells, found) in errors.items():
        size = f"{1e3 * sliding_box.SIDES[2] / cells[-1]:.1f}"
        rows.append([element, size, *(
            f"{values[-1]:.2e}, h^{sliding_box.rate(cells, values):.2f}"
            for values in found.values())])
    heads = [f"{name}, {wave.frequency_hz:.3f} Hz" for name, wave in sliding_box.WAVES.items()]
    return table(["element", "h [mm]", *heads], rows)


def _plate() -> str:
    rows = [("published", *(f"{value:.2f}" for value in sliding_box.PLATE_HZ))]
    for name, size, layers in (("4 x 4 x 1", 2.5, 1), ("8 x 8 x 2", 1.25, 2),
                               ("16 x 16 x 4", 0.625, 4)):
        rows.append((name, *(f"{value:.2f}" for value in sliding_box.plate_hz(size, layers))))
    return table(["elements", *(f"mode {k} [Hz]" for k in range(4, 11))], rows)


def _supports() -> str:
    names = {"lines": "lines along the bottom edges", "sides": "sides held along z",
             "walls": "sides held along z and along themselves"}
    published = np.array(sliding_box.PLATE_HZ)[[0, 1, 3, 5]]
    rows = [(name, *(f"{value:.2f}" for value in values)) for name, values in (
        ("published", published),
        ("Mindlin's plate", [sliding_box.mindlin_hz(halves) for halves in sliding_box.BENDING]),
        *((text, sliding_box.bending_hz(1.25, 2, name)) for name, text in names.items()),
        ("Lamb waves", [sliding_box.lamb_hz(halves) for halves in sliding_box.BENDING]))]
    return table(["supports", *(f"{m}, {n} half waves [Hz]" for m, n in sliding_box.BENDING)], rows)


def _throw(block: thrown_block.Throw) -> list[Comparison]:
    rows = []
    for name, throw in (("mass", thrown_block.thrown_mass("arctan", 1e5)), ("block", block)):
        rows.append(Comparison(f"{name}: sticks after [s]", thrown_block.STOP, throw.stop))
        rows += [Comparison(f"{name}: {axis} where it sticks [m]", wanted, found)
                 for axis, wanted, found in zip("xy", thrown_block.PLACE, throw.stuck_at,
                                                strict=True)]
    middle = np.argmin(np.abs(block.run.time - 0.5 * thrown_block.STOP))
    rows.append(Comparison("block: centre of pressure ahead of the middle [m]",
                           0.5 * thrown_block.MU * thrown_block.SHAPE.height,
                           float(np.linalg.norm(thrown_block.lean(block)[middle]))))
    return rows
