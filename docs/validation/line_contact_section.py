"""A cylinder on a rigid plane: Hertz's pressure and Cattaneo's partial slip."""

from pathlib import Path

import line_contact
import numpy as np
from comparison import Comparison, comparisons
from pictures import save


def section(images: Path) -> str:
    """Table and picture of the pressed and sheared face."""
    rows = []
    for ratio in (0.3, 0.49):
        found = line_contact.pressed(ratio, 16)
        peak, width = found.found_peak_and_width
        rows += [Comparison(f"nu = {ratio}: peak pressure [Pa]", found.peak, peak),
                 Comparison(f"nu = {ratio}: half-width of contact b [m]", found.half_width, width)]
        if ratio < 0.4:
            rows.append(Comparison("nu = 0.3: half-width of stick over b, coupled (0.714 "
                                   "published)", 0.714, found.sticking_part))
        else:
            rows.append(Comparison("nu = 0.49: half-width of stick over b, sqrt(1 - Q/(mu P))",
                                   float(np.sqrt(0.5)), found.uncoupled_part))
    save(line_contact.figure(found), images / "line-contact.png")
    return f"""## Line contact with partial slip

A cylinder of R = 50 mm in plane strain (E = 210 GPa, P' = 1 MN/m, mu = 0.3) is pressed on a rigid
plane without friction, then sheared by Q = mu P / 2 (`line_contact.py`; sixteen quadratic
elements per half-width). On a rigid plane normal and tangential contact are coupled unless
nu = 1/2. The results at nu = 0.49 are compared with Cattaneo's closed form.

{comparisons(rows)}

![Pressure and shear of a line contact beside the closed forms](images/validation/line-contact.png)
"""
