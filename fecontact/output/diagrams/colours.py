"""Colours and dashes of curves, energies and contact states."""

from typing import Any

import numpy as np

INK = "#303030"  # of text, axes and lines without a colour of their own
# Colour-blind safe palette of Okabe and Ito.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#6a6a6a")
# Further colours for diagrams with many branches, as distinct as those above.
_MORE_COLOURS = ("#882200", "#99dd88", "#7766ff", "#000044", "#0000ff")
DASHES: Any = (0, (4, 2.5))
# Colours of energies and powers, by where they are stored, supplied or dissipated.
ENERGY_COLOURS = {
    "kinetic": "#0072b2", "elastic": "#56b4e9", "modal_damping": "#56b4e9",
    "drive_spring": "#d55e00", "drive_work": "#d55e00", "dashpots": "#d55e00",
    "contact": "#009e73", "belt_normal_work": "#009e73", "contact_damping": "#009e73",
    "belt_friction_work": "#e69f00", "friction": "#e69f00", "bristles": "#e69f00",
    "load_work": "#cc79a7", "circulatory_work": "#0072b2", "bristle_work": "#6a6a6a",
}
# Colour-blind safe; 'open' takes the colour of the background.
STATE_COLOURS = {"stick": "#0072b2", "slip": "#e69f00", "contact": "#009e73"}
# Colour maps of the pressure and of the depth worn off on faces of solids.
PRESSURE_MAP, WEAR_MAP = "inferno", "copper_r"
# Runs beneath branches, which have other colours.
DOTS = {"up": "#b4b0a8", "down": "#e69f00"}
# Frequencies beyond those up to which a basis is usable.
BEYOND, BEYOND_COLOUR = "beyond the basis", "#e4e0d8"


def distinct_colours(count: int) -> list[str]:
    """A number of distinct colours; up to twelve are colour-blind safe."""
    if count <= len(COLOURS) + len(_MORE_COLOURS):
        return [*COLOURS, *_MORE_COLOURS][:count]
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    # Order them so that neighbours differ most in lightness.
    shades = [to_hex(colour) for colour in colormaps["cividis"](np.linspace(0.0, 0.95, count))]
    half = (count + 1) // 2
    mixed = [""] * count
    mixed[::2], mixed[1::2] = shades[:half], shades[half:]
    return mixed
