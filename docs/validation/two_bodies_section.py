"""Two elastic bodies: line contact, a patch test, colliding bars, and slip of clamped layers."""

from pathlib import Path

import clamped_layers
import colliding_bars
import numpy as np
import stacked_blocks
import two_bodies
from comparison import Comparison, comparisons, table
from pictures import save

PARTS = np.array([0.05, 0.1, 0.2, 0.3, 0.375, 0.45, 0.55, 0.65, 0.7])


def section(images: Path) -> str:
    """Tables and pictures of all four."""
    line, sheared = _line_contact()
    save(two_bodies.figure(sheared), images / "two-bodies.png")
    losses = clamped_layers.curve(PARTS)
    save(clamped_layers.figure(PARTS, losses), images / "clamped-layers.png")
    patches = [(name, f"{stacked_blocks.pressed(above, below, nodes).stress_error:.1e}")
               for name, above, below, nodes in stacked_blocks.CASES]
    slip = [Comparison(f"loss per cycle at mu p b h = {part:g} P [J]",
                       float(clamped_layers.slip_theory(part * clamped_layers.END_LOAD)), found)
            for part, found in zip(PARTS, losses, strict=True) if part in (0.1, 0.2, 0.375, 0.55,
                                                                          0.7)]
    return f"""## Two bodies

A cylinder of R = 50 mm on a block, both elastic, in plane strain, P' = 1 MN/m
(`two_bodies.py`; twelve quadratic elements per half-width, matching meshes): Hertz with
1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2. Pressed without friction and then sheared by Q = mu P / 2, a
strip sticks; for equal materials normal and tangential contact are not coupled.

{comparisons(line)}

![Pressure and shear between two bodies beside closed forms](images/validation/two-bodies.png)

Two blocks are pressed together uniformly without friction (`stacked_blocks.py`). The table has the
largest error of a stress component over the pressure. Mesh nodes of meshes that do not match load
the other face unevenly, which `pair_faces` reports. Segments with mean displacements load both
faces evenly.

{table(("meshes of the faces", "error"), patches)}

A bar of 1 m hits another one that rests, with a spring between the ends that delays waves by 2 % of
2 L / c (`colliding_bars.py`; forty modes per metre and residual vectors). Momentum is kept
to round-off. Without the spring equal bars exchange velocities, and e = L_1 / L_2 on a longer one.

{comparisons(_bars())}

Two layers clamped at one end, L = 0.5 m, h = 10 mm each, under the pressure p and an end load of
+-300 N (`clamped_layers.py`), beside the slip theory of Goodman and Klumpp (1956) for
beams: 8 F L^3 (P - 4/3 F) / (E b h^3) with F = mu p b h.

{comparisons(slip)}

![Loss per cycle of two clamped layers over their pressure](images/validation/clamped-layers.png)
"""


def _line_contact() -> tuple[list[Comparison], two_bodies.ShearedContact]:
    rows = []
    for name, block in (("steel", two_bodies.STEEL), ("aluminium", two_bodies.ALUMINIUM)):
        found = two_bodies.pressed(two_bodies.STEEL, block)
        peak, width = found.found_peak_and_width
        rows += [Comparison(f"steel on {name}: peak pressure [Pa]", found.peak, peak),
                 Comparison(f"steel on {name}: half-width of contact b [m]", found.half_width,
                            width)]
    sheared = two_bodies.sheared()
    rows.append(Comparison("steel on steel: half-width of stick over b, sqrt(1 - Q/(mu P))",
                           float(np.sqrt(0.5)), sheared.sticking_part))
    return rows, sheared


def _bars() -> list[Comparison]:
    rows = []
    for second in (1.0, 2.0):
        found = colliding_bars.collision(second, 40)
        restitution, duration = colliding_bars.closed_form(found)
        rows.append(Comparison(f"1 m on {second:g} m: coefficient of restitution", restitution,
                               found.restitution))
        if duration is not None:
            rows.append(Comparison(f"1 m on {second:g} m: contact time [s]", duration,
                                   found.contact_time))
    return rows
