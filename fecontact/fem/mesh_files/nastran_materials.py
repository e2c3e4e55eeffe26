"""Materials of Nastran's bulk data by property: MAT1, MAT8, MAT9 and MAT11.

MAT8 is that of plane bodies in plane stress, with its first axis along the first side of the
elements, turned by their angle, or along the x axis of a system.
"""

import math
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fecontact.core.errors import InputError, MeshError, ModelWarning
from fecontact.core.types import Array
from fecontact.fem.material import AnisotropicMaterial, AnyMaterial, Material
from fecontact.fem.material_axes import AnyAxes, CylindricalAxes, MaterialAxes
from fecontact.fem.mesh_files.nastran_bulk import BulkData
from fecontact.fem.mesh_files.nastran_cards import Line, real, reals
from fecontact.fem.mesh_files.raw import PLANE, RawMesh

_SAME = 1e-6  # angles of one axis [rad]; a shear modulus E / (2 + 2 nu) within a hundredth of it
_ISOTROPIC = 0.01


def add_materials(bulk: BulkData, raw: RawMesh, path: Path) -> None:
    """Add the materials of the properties of a file's elements.

    Warns
    -----
    ModelWarning
        If there are materials, of which one is not read: none is taken then.
    """
    if not any(bulk.cards[name] for name in ("MAT1", "MAT2", "MAT8", "MAT9", "MAT11")):
        return
    bodies = [name for name, cells in raw.parts.items()
              if any((kind in PLANE) != raw.is_solid for kind, _ in cells)]
    try:
        raw.materials = {name: _of_property(bulk, name, raw.is_solid) for name in bodies}
    except (InputError, MeshError) as error:
        warnings.warn(f"{path}: {str(error).rstrip('.')}; no material of the file is taken, give "
                      f"material to the body.", ModelWarning, stacklevel=5)


def _of_property(bulk: BulkData, name: str, is_solid: bool) -> AnyMaterial:
    """Material of the elements of a property, in units of the file; InputError for unread ones."""
    kinds = ("PSOLID",) if is_solid else ("PSHELL", "PPLANE")
    card = next((card for kind in kinds for card in bulk.cards[kind] if card[1][0] == name), None)
    if card is None:
        raise InputError(f"The file holds no {' or '.join(kinds)} {name}")
    line, fields = card
    if is_solid and any(fields[place] for place in (3, 5)):
        warnings.warn(f"PSOLID {name} of line {line} chooses points of integration (IN, ISOP), "
                      f"which are not read; give integration = 'full' or 'reduced' to the body.",
                      ModelWarning, stacklevel=6)
    found = [(kind, one) for kind in _READERS for one in bulk.cards[kind] if one[1][0] == fields[1]]
    if len(found) != 1:
        raise InputError(f"The property {name} of line {line} has the material {fields[1]}, for "
                         f"which the file holds {'several' if found else 'no'} MAT1, MAT8, MAT9 or "
                         f"MAT11")
    (kind, (at, constants)), = found
    if kind in (("MAT8",) if is_solid else ("MAT9", "MAT11")):
        raise InputError(f"The property {name} of line {line} has a material of the kind {kind}, "
                         f"which is that of {'plane bodies' if is_solid else 'solids'}")
    axes: AnyAxes = MaterialAxes()
    if kind == "MAT8":
        axes = _axes_of_shells(bulk, name)
    elif kind != "MAT1" and fields[2] not in ("", "0"):
        axes = _axes_of_system(bulk, line, fields[2])
    return _READERS[kind](at, constants, axes, _unit_of_mass(bulk))


def _unit_of_mass(bulk: BulkData) -> float:
    """Factor of all densities (PARAM, WTMASS)."""
    return next((real(line, fields[1]) for line, fields in bulk.cards["PARAM"]
                 if fields[0].upper() == "WTMASS"), 1.0)


def _isotropic(line: Line, fields: list[str], _: AnyAxes, mass: float) -> Material:
    E, G, nu, rho, expansion, _reference, loss = reals(line, fields[1:], 7)
    given = [bool(word) for word in fields[1:4]]
    if given == [False, True, True]:
        E = 2.0 * G * (1.0 + nu)
    elif given == [True, True, False]:
        nu = 0.5 * E / G - 1.0 if G else math.inf
    elif all(given) and abs(G - 0.5 * E / (1.0 + nu)) > _ISOTROPIC * G:
        raise InputError(f"MAT1 of line {line} is not isotropic: G differs from E / (2 + 2 NU)")
    return Material(E, nu, mass * rho, loss, expansion)


def _of_plane(line: Line, fields: list[str], axes: AnyAxes, mass: float) -> AnisotropicMaterial:
    E1, E2, nu, G12, G13, G23, rho = reals(line, fields[1:], 7)
    # Plane stress has no part of those across the plane.
    return AnisotropicMaterial.orthotropic(
        (E1, E2, E2), (nu, 0.0, 0.0), (G12, G13 or G12, G23 or G12), mass * rho, axes,
        reals(line, fields[16:], 1)[0])


def _anisotropic(line: Line, fields: list[str], axes: AnyAxes, mass: float) -> AnisotropicMaterial:
    values = reals(line, fields[1:], 30)
    C = np.zeros((6, 6))
    C[np.triu_indices(6)] = values[:21]
    C = C + C.T - np.diag(np.diag(C))
    return AnisotropicMaterial(tuple(map(tuple, C.tolist())), mass * values[21], axes, values[29])


def _orthotropic(line: Line, fields: list[str], axes: AnyAxes, mass: float) -> AnisotropicMaterial:
    values = reals(line, fields[1:], 15)
    E, nu, G = (tuple(values[k : k + 3]) for k in (0, 3, 6))
    return AnisotropicMaterial.orthotropic(E, nu, G, mass * values[9],  # type: ignore[arg-type]
                                           axes, values[14])


_READERS: dict[str, Callable[[Line, list[str], AnyAxes, float], AnyMaterial]] = {
    "MAT1": _isotropic, "MAT8": _of_plane, "MAT9": _anisotropic, "MAT11": _orthotropic}


def _axes_of_system(bulk: BulkData, line: Line, word: str) -> AnyAxes:
    """Axes of solids along those of a system."""
    if word.startswith("-"):
        raise InputError(f"The property of line {line} has axes of its elements (CORDM = {word})")
    kind, origin, axes = bulk.systems.frame(int(word))
    if kind == "S":
        raise InputError(f"The property of line {line} has axes of a spherical system ({word})")
    return _rectangular(axes) if kind == "R" else CylindricalAxes(
        tuple(origin.tolist()), tuple(axes[2].tolist()))


def _axes_of_shells(bulk: BulkData, name: str) -> MaterialAxes:
    """Axes of plane elements of a property, if they are the same in all of them."""
    angles = []
    for (kind, _), rows in bulk.elements.items():
        if kind not in PLANE:
            continue
        for number, _, first, second in rows[rows[:, 1] == int(name), :4].tolist():
            word = bulk.angles.get(number, "")
            x, y, _ = (bulk.points[second] - bulk.points[first]
                       if not word or "." in word or word == "0"
                       else bulk.systems.frame(int(word))[2][0]).tolist()
            turn = real(f"of the element {number}", word) if "." in word else 0.0
            angles.append(math.atan2(y, x) + math.radians(turn))
    # Axes have no sign.
    double = np.exp(2.0j * np.array(angles))
    if np.abs(double - double[0]).max() > 2.0 * _SAME:
        raise InputError(f"The axes of MAT8 in the property {name} follow sides of elements, which "
                         f"have other directions; give the elements a system (MCID)")
    c, s = math.cos(angles[0]), math.sin(angles[0])
    return _rectangular(np.array([[c, s, 0.0], [-s, c, 0.0]]))


def _rectangular(axes: Array) -> MaterialAxes:
    """Axes along rows of unit vectors."""
    return MaterialAxes(tuple(axes[0].tolist()), tuple(axes[1].tolist()))
