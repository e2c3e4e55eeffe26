"""Units of measured channels by their symbols, and the SI units they are converted to."""

import re
from typing import Literal

# Factors to SI by symbol.
_LENGTHS = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "um": 1e-6, "nm": 1e-9, "cm": 1e-2, "in": 0.0254}
_TIMES = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "us": 1e-6, "min": 60.0}
_FORCES = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605}
_SIMPLE = {
    **{symbol: ("m", factor) for symbol, factor in _LENGTHS.items()},
    **{symbol: ("s", factor) for symbol, factor in _TIMES.items()},
    **{symbol: ("N", factor) for symbol, factor in _FORCES.items()},
    "g": ("m/s^2", 9.80665), "Hz": ("Hz", 1.0), "kHz": ("Hz", 1e3),
    "rad": ("rad", 1.0), "mrad": ("rad", 1e-3), "deg": ("rad", 0.017453292519943295),
    "°": ("rad", 0.017453292519943295), "1": ("", 1.0), "-": ("", 1.0), "": ("", 1.0),
    "Nm": ("N m", 1.0), "N m": ("N m", 1.0), "N*m": ("N m", 1.0),
    "Pa": ("Pa", 1.0), "kPa": ("Pa", 1e3), "MPa": ("Pa", 1e6), "bar": ("Pa", 1e5),
}
_RATES = {f"/{time}": ("/s", 1.0 / factor) for time, factor in _TIMES.items()}
_RATES |= {f"/{time}^2": ("/s^2", 1.0 / factor**2) for time, factor in _TIMES.items()}


def si_unit(symbol: str) -> tuple[str, float] | None:
    """SI unit and factor of a unit such as 'mm/s^2', 'g/N' or 'kN'; None if it is not known."""
    text = " ".join(symbol.strip().replace("²", "^2").replace("**2", "^2").split())
    text = re.sub(r"([A-Za-zµ])2\b", r"\1^2", text).replace("μ", "µ")
    if text in _SIMPLE:
        return _SIMPLE[text]
    for rate, (power, factor) in _RATES.items():
        base = _SIMPLE.get(text.removesuffix(rate)) if text.endswith(rate) else None
        if base is not None and base[0] in ("m", "rad"):
            return base[0] + power, base[1] * factor
    above, slash, below = text.rpartition("/")
    upper, lower = si_unit(above) if slash else None, _SIMPLE.get(below.strip("()"))
    if upper is None or lower is None or not lower[0] or not upper[0]:
        return None
    under = f"({lower[0]})" if " " in lower[0] else lower[0]
    return f"{upper[0]}/{under}", upper[1] / lower[1]


def parted(title: str) -> tuple[str, str | None]:
    """Name and unit of a title such as ``x [mm]``, ``x (mm)`` or ``x``; None without a unit."""
    found = re.fullmatch(r"(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*", title)
    return (found[1].strip(), found[2].strip()) if found else (title.strip(), None)


def response_kind(unit: str) -> Literal["receptance", "mobility", "accelerance"]:
    """Kind of a frequency response, by the SI unit of its channel."""
    return ("accelerance" if unit.startswith(("m/s^2", "rad/s^2")) else
            "mobility" if unit.startswith(("m/s", "rad/s")) else "receptance")
