"""Wear histories in HDF5 files."""

from pathlib import Path

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.files.stored import array, member, text
from fecontact.integrate.trajectory import Status
from fecontact.integrate.wear import WearHistory
from fecontact.laws.wear import ArchardWear, EnergyWear
from fecontact.output.files.hdf5 import new_file, open_file

_LAWS = {"EnergyWear": EnergyWear, "ArchardWear": ArchardWear}
# Shapes by the numbers of blocks B and nodes n.
_UNITS = {"x": "m", "tributary": "m", "gap": "m", "cycles": "-", "time": "s", "depth": "m",
          "normal_force": "N", "slip_work": "J", "state": ""}


def write_wear(path: str | Path, history: WearHistory) -> Path:
    """Write a wear history into an HDF5 file, whole or not at all.

    Group ``wear``: the arrays of :class:`fecontact.integrate.WearHistory` with their units.

    Raises
    ------
    InputError
        If the file cannot be written, or the wear law is one of your own.
    """
    require_kind("write_wear", WearHistory, history=history)
    law = history.law
    require_kind("write_wear", (EnergyWear, ArchardWear), law=law)
    with new_file(path) as file:
        group = file.create_group("wear")
        group.attrs.update(
            law=type(law).__name__, coefficient=law.coefficient,  # type: ignore[attr-defined]
            thickness=history.thickness, acceleration=history.acceleration,
            status=history.status.name)
        for name, unit in _UNITS.items():
            group.create_dataset(name, data=getattr(history, name)).attrs["unit"] = unit
    return Path(path)


def read_wear(path: str | Path) -> WearHistory:
    """Read a wear history written by :func:`write_wear`.

    Raises
    ------
    InputError
        If there is no such file, or it holds no wear history.
    """
    with open_file(path, "wear") as file:
        group = member(file, "wear")
        x, cycles = array(group, "x", (None,)), array(group, "cycles", (None,))
        n, points = len(x), len(cycles)
        shapes = {"tributary": (n,), "gap": (n,), "time": (points,), "depth": (points, n),
                  "normal_force": (points - 1, n), "slip_work": (points - 1, n), "state": (None,)}
        coefficient, thickness, acceleration = (
            float(np.asarray(group.attrs[name])) for name in ("coefficient", "thickness",
                                                              "acceleration"))
        return WearHistory(
            _LAWS[text(group, "law")](coefficient), thickness, acceleration, x=x, cycles=cycles,
            status=Status[text(group, "status")],
            **{name: array(group, name, shape) for name, shape in shapes.items()})
