"""Linear elastic materials: isotropic, and anisotropic with axes."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import (
    InputError,
    choices,
    nearest,
    require_finite,
    require_not_negative,
    require_positive,
    shown,
)
from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.fem.material_axes import AnyAxes, MaterialAxes, rotated_stiffness

_COMPONENTS = ("11", "22", "33", "12", "23", "13")
_ASYMMETRIC = 1e-6  # largest difference between two entries that must be equal, relative to C
_PLANE, _ACROSS = [0, 1, 3], [4, 5]
_COUPLED = 1e-9  # of a plane body: stiffness between its plane and shear across it, relative to C


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material.

    Parameters
    ----------
    youngs_modulus : float
        E, positive [Pa].
    poisson_ratio : float
        nu, above -1 and below 0.5.
    density : float
        rho, positive [kg/m^3].
    loss_factor : float
        Share of the elastic energy that a cycle dissipates, over 2 pi; zero or above.
    thermal_expansion : float
        Coefficient alpha, the strain of free expansion per kelvin [1/K].

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    youngs_modulus: float = 2.1e11
    poisson_ratio: float = 0.3
    density: float = 7850.0
    loss_factor: float = 0.0
    thermal_expansion: float = 0.0

    def __post_init__(self) -> None:
        require_positive("Material", youngs_modulus=self.youngs_modulus, density=self.density)
        require_not_negative("Material", loss_factor=self.loss_factor)
        require_finite("Material", poisson_ratio=self.poisson_ratio,
                       thermal_expansion=self.thermal_expansion)
        if not -1.0 < self.poisson_ratio < 0.5:
            raise InputError(f"Material: poisson_ratio = {self.poisson_ratio!r} must be above -1 "
                             f"and below 0.5.")

    @classmethod
    def named(cls, name: str) -> "Material":
        """'steel' or 'aluminium' with handbook values; InputError for other names."""
        require_kind("Material.named", str, name=name)
        if name not in _MATERIALS:
            raise InputError(f"There is no material '{name}'"
                             f"{nearest(str(name), _MATERIALS)}; named materials are "
                             f"{choices(_MATERIALS)}, or give youngs_modulus, poisson_ratio and "
                             f"density.")
        return cls(*_MATERIALS[name][:3], thermal_expansion=_MATERIALS[name][3])

    @property
    def youngs_moduli(self) -> tuple[float, ...]:
        """Young's modulus in each distinct direction [Pa]."""
        return (self.youngs_modulus,)

    @property
    def stiffness_ratio(self) -> float:
        """Largest over smallest eigenvalue of the stiffness, ``(1 + nu) / (1 - 2 nu)`` or 1 / it.

        It grows without bound for incompressible materials.
        """
        ratio = (1.0 + self.poisson_ratio) / (1.0 - 2.0 * self.poisson_ratio)
        return max(ratio, 1.0 / ratio)

    def scaled(self, scale: float) -> "Material":
        """The material of a file whose unit of length is ``scale`` m, and whose forces are in N."""
        return replace(self, youngs_modulus=self.youngs_modulus / scale**2,
                       density=self.density / scale**4)

    def moved(self, turn: Array, shift: Array) -> "Material":
        """The material of a body that is turned or mirrored by ``turn`` (3, 3), then shifted."""
        return self

    @property
    def description(self) -> str:
        """Constants in words."""
        return (f"{quantity(self.youngs_modulus, 'Pa')}, Poisson ratio {self.poisson_ratio:.4g}, "
                f"{self.density:.4g} kg/m³{_lossy(self.loss_factor)}")


_MATERIALS = {"steel": (2.1e11, 0.3, 7850.0, 1.2e-5), "aluminium": (7.0e10, 0.33, 2700.0, 2.3e-5)}


@dataclass(frozen=True)
class AnisotropicMaterial:
    """Linear elastic material with a stiffness in its own axes.

    ``stress = stiffness @ strain`` in axes 1, 2, 3 of the material, with the components 11, 22,
    33, 12, 23, 13 and engineering strains of shear (twice the tensor's components). Abaqus lists
    13 before 23; readers of its decks change the order.
    :meth:`orthotropic` and :meth:`transversely_isotropic` take engineering constants.

    Parameters
    ----------
    stiffness : (6, 6) lists
        Symmetric, positive definite [Pa].
    density : float
        rho, positive [kg/m^3].
    axes : MaterialAxes, CylindricalAxes, CurveAxes or FieldAxes
        Axes of the material; by default those of the body: x, y, z.
    loss_factor : float
        Share of the elastic energy that a cycle dissipates, over 2 pi; zero or above.

    Raises
    ------
    InputError
        For values outside these ranges, with the condition that the stiffness violates.
    """

    stiffness: tuple[tuple[float, ...], ...]
    density: float
    axes: AnyAxes = field(default_factory=MaterialAxes)
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        require_positive("AnisotropicMaterial", density=self.density)
        require_not_negative("AnisotropicMaterial", loss_factor=self.loss_factor)
        require_kind("AnisotropicMaterial", get_args(AnyAxes), axes=self.axes)
        C = as_floats(self.stiffness, "AnisotropicMaterial: stiffness")
        if C.shape != (6, 6) or not np.isfinite(C).all():
            raise InputError(f"AnisotropicMaterial: stiffness must be 6 rows of 6 finite numbers, "
                             f"not {shown(self.stiffness)}.")
        apart = np.abs(C - C.T)
        if apart.max() > _ASYMMETRIC * np.abs(C).max():
            i, j = np.unravel_index(int(np.argmax(apart)), (6, 6))
            raise InputError(f"AnisotropicMaterial: stiffness must be symmetric, but has "
                             f"{C[i, j]:g} Pa in row {i + 1}, column {j + 1}, and {C[j, i]:g} Pa "
                             f"in row {j + 1}, column {i + 1}.")
        C = 0.5 * (C + C.T)
        if violated := _violated(C):
            raise InputError(f"AnisotropicMaterial: the stiffness is not positive definite, so "
                             f"that a deformation would release energy: {violated}; correct its "
                             f"entries, or their order 11, 22, 33, 12, 23, 13.")
        object.__setattr__(self, "stiffness", tuple(map(tuple, C.tolist())))

    @classmethod
    def orthotropic(
        cls,
        youngs_moduli: tuple[float, float, float],
        poisson_ratios: tuple[float, float, float],
        shear_moduli: tuple[float, float, float],
        density: float,
        axes: AnyAxes | None = None,
        loss_factor: float = 0.0,
    ) -> "AnisotropicMaterial":
        """Material of engineering constants, with three planes of symmetry.

        Stress s_1 alone makes the strains ``e_1 = s_1 / E_1``, ``e_2 = -nu_12 s_1 / E_1``, so that
        ``nu_12 / E_1 = nu_21 / E_2``. Admissible are ``E_i, G_ij > 0``,
        ``nu_ij^2 < E_i / E_j`` and ``1 - nu_12 nu_21 - nu_23 nu_32 - nu_13 nu_31
        - 2 nu_21 nu_32 nu_13 > 0`` (Lempriere, AIAA Journal 6, 1968).

        Parameters
        ----------
        youngs_moduli : (E_1, E_2, E_3)
            [Pa]
        poisson_ratios : (nu_12, nu_13, nu_23)
            Strains across over the strain along, under stress along the first of both axes.
        shear_moduli : (G_12, G_13, G_23)
            [Pa]
        density, axes, loss_factor
            See the class.

        Raises
        ------
        InputError
            For values that are not admissible, with the condition that is violated.
        """
        constants = []
        for name, values in (("youngs_moduli", youngs_moduli), ("poisson_ratios", poisson_ratios),
                             ("shear_moduli", shear_moduli)):
            found = as_floats(values, f"AnisotropicMaterial: {name}")
            if found.shape != (3,) or not np.isfinite(found).all():
                raise InputError(f"AnisotropicMaterial: {name} = {shown(values)} must be three "
                                 f"finite numbers.")
            constants.append(found)
        E, (nu12, nu13, nu23), G = constants
        for symbol, moduli, pairs in (("E", E, ("1", "2", "3")), ("G", G, ("12", "13", "23"))):
            require_positive("AnisotropicMaterial", **{
                f"{symbol}_{at}": float(value) for at, value in zip(pairs, moduli, strict=True)})
        for (i, j), nu in {(0, 1): nu12, (0, 2): nu13, (1, 2): nu23}.items():
            if not nu * nu < E[i] / E[j]:
                at = f"{i + 1}{j + 1}"
                raise InputError(f"AnisotropicMaterial: nu_{at} = {nu:g} must lie between "
                                 f"-{np.sqrt(E[i] / E[j]):.4g} and {np.sqrt(E[i] / E[j]):.4g}, the "
                                 f"root of E_{i + 1} / E_{j + 1}, so that every deformation takes "
                                 f"energy.")
        S = np.diag([*1.0 / E, 1.0 / G[0], 1.0 / G[2], 1.0 / G[1]])
        S[0, 1] = S[1, 0] = -nu12 / E[0]
        S[0, 2] = S[2, 0] = -nu13 / E[0]
        S[1, 2] = S[2, 1] = -nu23 / E[1]
        rest = float(np.linalg.det(S[:3, :3]) * E.prod())
        if not rest > 0.0:
            raise InputError(f"AnisotropicMaterial: poisson_ratios = {shown(poisson_ratios)} give "
                             f"1 - nu_12 nu_21 - nu_23 nu_32 - nu_13 nu_31 - 2 nu_21 nu_32 nu_13 = "
                             f"{rest:.4g}, which must be above zero, so that every deformation "
                             f"takes energy.")
        return cls(np.linalg.inv(S).tolist(), density, axes or MaterialAxes(), loss_factor)

    @classmethod
    def transversely_isotropic(
        cls,
        youngs_moduli: tuple[float, float],
        poisson_ratios: tuple[float, float],
        shear_modulus: float,
        density: float,
        axes: AnyAxes | None = None,
        loss_factor: float = 0.0,
    ) -> "AnisotropicMaterial":
        """Material with equal properties in all directions across axis 1, such as fibres along it.

        Parameters
        ----------
        youngs_moduli : (E_1, E_2)
            Along axis 1 and across it [Pa].
        poisson_ratios : (nu_12, nu_23)
            Strains across over the strain along, under stress along the first of both axes.
        shear_modulus : float
            G_12 = G_13 [Pa]; ``G_23 = E_2 / (2 (1 + nu_23))``.
        density, axes, loss_factor
            See the class.

        Raises
        ------
        InputError
            As in :meth:`orthotropic`.
        """
        for name, values in (("youngs_moduli", youngs_moduli), ("poisson_ratios", poisson_ratios)):
            if as_floats(values, f"AnisotropicMaterial: {name}").shape != (2,):
                raise InputError(f"AnisotropicMaterial: {name} = {shown(values)} must be two "
                                 f"numbers, along axis 1 and across it.")
        (along, across), (nu12, nu23) = youngs_moduli, poisson_ratios
        if not -1.0 < nu23 < 1.0:
            raise InputError(f"AnisotropicMaterial: nu_23 = {nu23:g} must be above -1 and below 1.")
        return cls.orthotropic((along, across, across), (nu12, nu12, nu23),
                               (shear_modulus, shear_modulus, across / (2.0 * (1.0 + nu23))),
                               density, axes, loss_factor)

    @cached_property
    def youngs_moduli(self) -> tuple[float, ...]:
        """Young's moduli along the axes of the material, by the inverse of the stiffness [Pa]."""
        one, two, three = 1.0 / np.diag(np.linalg.inv(self.stiffness))[:3]
        return float(one), float(two), float(three)

    @cached_property
    def stiffness_ratio(self) -> float:
        """Largest over smallest eigenvalue of the stiffness as a tensor."""
        weights = np.sqrt([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
        values = np.linalg.eigvalsh(np.array(self.stiffness) * weights[:, None] * weights)
        return float(values[-1] / values[0])

    def stiffness_at(
        self, places: Array, dimension: int = 3, plane: Literal["stress", "strain"] = "stress"
    ) -> Array:
        """Stiffness (n, 6, 6) in x, y, z at places (n, 3), or (1, 6, 6) if equal everywhere [Pa].

        Components are xx, yy, zz, xy, yz, xz. In a plane body strains are xx, yy and xy; in plane
        stress the strain zz is that without stress zz.

        Raises
        ------
        InputError
            For a plane body whose plane is no plane of symmetry of the material.
        """
        C = rotated_stiffness(np.array(self.stiffness), self.axes.at(places))
        if dimension == 3:
            return C
        size = np.abs(C).max()
        across = np.abs(C[:, [0, 1, 2, 3]][:, :, _ACROSS]).max()
        if across > _COUPLED * size:
            raise InputError(f"AnisotropicMaterial: strains in the plane of the body make stresses "
                             f"that shear it across this plane, of {across:.4g} Pa per strain; "
                             f"choose axes of which one is normal to the plane, or a solid.")
        if plane == "stress":
            C = C - C[:, :, 2:3] * C[:, 2:3] / C[:, 2:3, 2:3]
        found = np.zeros_like(C)
        rows = np.ix_(range(len(C)), [*_PLANE, 2], _PLANE)
        found[rows] = C[rows]
        if plane == "stress":
            found[:, 2] = 0.0
        return found

    def scaled(self, scale: float) -> "AnisotropicMaterial":
        """The material of a file whose unit of length is ``scale`` m, and whose forces are in N."""
        return replace(self, stiffness=(np.array(self.stiffness) / scale**2).tolist(),
                       density=self.density / scale**4, axes=self.axes.scaled(scale))

    def moved(self, turn: Array, shift: Array) -> "AnisotropicMaterial":
        """The material of a body that is turned or mirrored by ``turn`` (3, 3), then shifted."""
        axes, (a, b, c) = self.axes.moved(turn, shift)
        signs = np.array([1.0, 1.0, 1.0, a * b, b * c, a * c])
        return replace(self, axes=axes, stiffness=(
            np.array(self.stiffness) * signs[:, None] * signs).tolist())

    @property
    def description(self) -> str:
        """Constants in words."""
        E = " × ".join(quantity(one, "Pa") for one in self.youngs_moduli)
        return f"anisotropic, {E}, {self.density:.4g} kg/m³{_lossy(self.loss_factor)}"


AnyMaterial = Material | AnisotropicMaterial


def _lossy(loss_factor: float) -> str:
    return f", loss factor {loss_factor:.4g}" if loss_factor else ""


def _violated(C: Array) -> str:
    """Condition of positive definiteness that a symmetric stiffness (6, 6) violates, or ''."""
    at = _COMPONENTS
    for i in range(6):
        if not C[i, i] > 0.0:
            return f"C_{at[i]},{at[i]} = {C[i, i]:g} Pa must be above zero"
    for i in range(6):
        for j in range(i):
            if not C[i, j] ** 2 < C[i, i] * C[j, j]:
                return (f"C_{at[j]},{at[i]} = {C[i, j]:g} Pa must be smaller in magnitude than "
                        f"{np.sqrt(C[i, i] * C[j, j]):g} Pa, the root of C_{at[j]},{at[j]} "
                        f"C_{at[i]},{at[i]}")
    size = np.sqrt(np.diag(C))
    least = float(np.linalg.eigvalsh(C / size[:, None] / size)[0])
    # Rounding of the entries makes singular matrices look like regular ones.
    return "" if least > 1e-12 else (f"its smallest eigenvalue, with entries over the roots of the "
                                     f"diagonal, is {least:.3g} and must be above zero")

