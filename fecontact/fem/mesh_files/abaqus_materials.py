"""Materials and orientations of Abaqus and CalculiX input files."""

import warnings
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fecontact.core.errors import InputError, MeshError, ModelWarning, shown
from fecontact.core.types import Array
from fecontact.fem.material import AnisotropicMaterial, AnyMaterial, Material
from fecontact.fem.material_axes import AnyAxes, CylindricalAxes, FieldAxes, MaterialAxes
from fecontact.fem.mesh_files.abaqus_constraints import number_of
from fecontact.fem.mesh_files.abaqus_keywords import Options, as_number

Given = tuple[Options, list[str]]

# Constants of each kind of *ELASTIC, and the data lines they take.
_KINDS = {"ISO": (2, 1), "ENGINEERINGCONSTANTS": (9, 2), "ORTHO": (9, 2), "ANISO": (21, 3)}
# Rows and columns of the constants of ANISO in the order 11, 22, 33, 12, 13, 23 of Abaqus.
_UPPER = [(row, column) for column in range(6) for row in range(column + 1)]
# Options of *DAMPING, of which the first is read.
_DAMPING = ("STRUCTURAL", "ALPHA", "BETA", "COMPOSITE")
_ORDER = [0, 1, 2, 3, 5, 4]  # of 11, 22, 33, 12, 23, 13 among those of Abaqus


def material(name: str, given: Mapping[str, Given]) -> AnyMaterial | str:
    """Material of the keywords below a line *MATERIAL, in units of the file; or what it lacks.

    Raises
    ------
    InputError
        For constants that are not admissible.
    """
    options, lines = given.get("ELASTIC", ({}, []))
    wanted = options.get("TYPE", "ISO").upper().replace(" ", "")
    kind = next((one for one in _KINDS if wanted.startswith(one)), None)
    density = given.get("DENSITY", ({}, []))[1]
    if kind is None:
        return (f"the material '{name}' has the elasticity TYPE={options['TYPE']}, which is not "
                f"read")
    constants, most = _KINDS[kind]
    values = _numbers("ELASTIC", lines)
    # Poisson's ratio may be left out, a temperature may follow.
    least = 1 if kind == "ISO" else constants
    if not (least <= len(values) <= constants + 1 and len(lines) <= most and len(density) == 1):
        return (f"the material '{name}' has not one set of constants of *ELASTIC and one line of "
                f"*DENSITY")
    values = [*values, 0.0][:constants]
    rho = _numbers("DENSITY", density)[0]
    damping = given.get("DAMPING", ({}, []))[0]
    loss, *others = _numbers("DAMPING", [damping.get(key, "") for key in _DAMPING])
    if unread := [key for key, value in zip(_DAMPING[1:], others, strict=True) if value]:
        warnings.warn(f"The material '{name}' has *DAMPING, {', '.join(unread)}, which is not "
                      f"read; give damping to the basis.", ModelWarning, stacklevel=4)
    expansion = _expansion(name, given, kind == "ISO")
    if kind == "ISO":
        return Material(values[0], values[1], rho, loss, expansion)
    if kind == "ENGINEERINGCONSTANTS":
        E, nu, G = zip(*[iter(values)] * 3, strict=True)
        return AnisotropicMaterial.orthotropic(E, nu, G, rho, loss_factor=loss)
    stiffness = np.zeros((6, 6))
    places = _UPPER if kind == "ANISO" else [*_UPPER[:6], (3, 3), (4, 4), (5, 5)]
    for (row, column), value in zip(places, values, strict=True):
        stiffness[row, column] = stiffness[column, row] = value
    return AnisotropicMaterial(stiffness[np.ix_(_ORDER, _ORDER)].tolist(), rho, loss_factor=loss)


def _numbers(keyword: str, lines: Sequence[str]) -> list[float]:
    """Numbers of data lines; MeshError, with the keyword, for other words."""
    return [number_of(word, f"*{keyword}") for line in lines
            for word in line.rstrip(", ").split(",")]


def _expansion(name: str, given: Mapping[str, Given], isotropic: bool) -> float:
    """Thermal expansion [1/K] of *EXPANSION; zero, with a warning, if it is not one number."""
    if "EXPANSION" not in given:
        return 0.0
    options, lines = given["EXPANSION"]
    values = _numbers("EXPANSION", lines)
    # The temperature at which it holds may follow.
    if isotropic and options.get("TYPE", "ISO").upper() == "ISO" and len(values) in (1, 2):
        return values[0]
    warnings.warn(f"The material '{name}' has an *EXPANSION over directions or temperatures, or no "
                  f"isotropic elasticity; it is not read, and the material does not expand.",
                  ModelWarning, stacklevel=4)
    return 0.0


def orientation(
    name: str, given: Mapping[str, Given], field: Callable[[str], tuple[Array, Array, Array] | None]
) -> AnyAxes | str:
    """Axes that a line *ORIENTATION of the file gives; or why they are not read.

    Parameters
    ----------
    name, given
        Name of the orientation, and all of the file.
    field : callable of str
        Places and two directions at each by the name of a line *DISTRIBUTION; None for other words.

    Raises
    ------
    MeshError
        If its points span no axes.
    """
    options, lines = given[name.upper()]
    system = options.get("SYSTEM", "RECTANGULAR").upper()
    by = options.get("DEFINITION", "COORDINATES").upper()
    if system not in ("RECTANGULAR", "CYLINDRICAL") or by != "COORDINATES":
        other = f"SYSTEM={system}" if by == "COORDINATES" else f"DEFINITION={by}"
        return f"the orientation '{name}' is given by {other}, which is not read"
    directions = field(lines[0].strip(" ,")) if lines and system == "RECTANGULAR" else None
    try:
        points = lines if directions is None else ["0, 0, 0, 0, 0, 0", *lines[1:]]
        values, turn = ([as_number(word) for word in line.rstrip(", ").split(",")]
                        for line in [*points, "1, 0"][:2])
        (ax, ay, az, bx, by_, bz), rest = values[:6], values[6:]
        about, angle = int(turn[0]), (*turn[1:], 0.0)[0]
    except (ValueError, IndexError):
        return (f"the orientation '{name}' has the data {shown('; '.join(lines))}, which are not "
                f"two points, nor a *DISTRIBUTION of directions for axes of the system RECTANGULAR")
    a, b, c = np.array((ax, ay, az)), np.array((bx, by_, bz)), np.array((*rest, 0.0, 0.0, 0.0)[:3])
    try:
        if directions is not None:
            return FieldAxes(*directions, about, angle)  # type: ignore[arg-type]
        if system == "CYLINDRICAL":
            return CylindricalAxes(tuple(a), tuple(b - a), about, angle)  # type: ignore[arg-type]
        return MaterialAxes(tuple(a - c), tuple(b - c), about, angle)  # type: ignore[arg-type]
    except InputError as error:
        raise MeshError(f"The points of the orientation '{name}' give no axes: {error}") from None
