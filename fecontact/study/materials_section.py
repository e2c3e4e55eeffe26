"""``[[body.materials]]``: materials of a body by groups of its cells."""

from dataclasses import dataclass, replace
from typing import Annotated

from fecontact.core.errors import InputError, choices
from fecontact.core.tables import convert_fields, located, shown
from fecontact.core.units import Unit
from fecontact.fem.material import AnisotropicMaterial, AnyMaterial, Material
from fecontact.fem.material_axes import AnyAxes, MaterialAxes

_CONSTANTS = ("youngs_modulus", "poisson_ratio", "shear_modulus")


@dataclass(frozen=True)
class MaterialSettings:
    """``[[body.materials]]``: the material of a group of cells; see :class:`fecontact.Material`
    and :class:`fecontact.fem.AnisotropicMaterial`.

    Parameters
    ----------
    cells : str, optional
        Group of cells of the mesh; left out, the material is that of the whole body.
    material : str, optional
        'steel' or 'aluminium', isotropic; the keys below override single values.
    youngs_modulus : float or list
        One of an isotropic material; E_1 and E_2 of one that is transversely isotropic, along
        axis 1 and across it; E_1, E_2, E_3 of an orthotropic one [Pa].
    poisson_ratio : float or list
        One; nu_12 and nu_23; nu_12, nu_13, nu_23.
    shear_modulus : float or list, optional
        None for an isotropic material; G_12 of a transversely isotropic one; G_12, G_13, G_23 of
        an orthotropic one [Pa].
    stiffness : list, optional
        In place of these constants 6 rows of 6 numbers, in the order 11, 22, 33, 12, 23, 13 [Pa].
    density : float, optional
        [kg/m^3]; required without ``material``.
    axes : MaterialAxes, CylindricalAxes, CurveAxes or FieldAxes, optional
        ``{first, second}``: directions of axis 1 and in the plane of axes 1 and 2; ``{point,
        direction}`` of a line around which axis 1 is radial and axis 2 circumferential; ``{points,
        third}`` of a curve along which axis 1 leads; or ``{places, along, across}``, directions as
        ``first`` and ``second`` at places, of which each cell takes the closest. All in the
        coordinates of the placed body; x, y, z by default.
    loss_factor : float
        For ``damping = "materials"`` of ``[basis]``.
    """

    cells: str | None = None
    material: str | None = None
    youngs_modulus: Annotated[float | tuple[float, ...] | None, Unit("Pa")] = None
    poisson_ratio: float | tuple[float, ...] | None = None
    shear_modulus: Annotated[float | tuple[float, ...] | None, Unit("Pa")] = None
    stiffness: Annotated[tuple[tuple[float, ...], ...] | None, Unit("Pa")] = None
    density: Annotated[float | None, Unit("kg/m^3")] = None
    axes: AnyAxes | None = None
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        convert_fields(self)
        with located("MaterialSettings:", "Material", "AnisotropicMaterial"):
            _ = self.made

    @property
    def made(self) -> AnyMaterial:
        """The material.

        Raises
        ------
        InputError
            For keys that do not belong together, or values out of range.
        """
        given = {key: value for key in (*_CONSTANTS, "stiffness", "density")
                 if (value := getattr(self, key)) is not None}
        several = [key for key in given if isinstance(given[key], tuple)]
        if self.material is not None or not several:
            return self._isotropic(given, several)
        needed = ("stiffness",) if "stiffness" in given else _CONSTANTS
        if wrong := [key for key in _CONSTANTS if key in given and key not in needed]:
            raise InputError(f"Material: stiffness describes a material without {choices(wrong)}; "
                             f"leave one or the other out.")
        if missing := [key for key in (*needed, "density") if key not in given]:
            raise InputError(f"Material: {choices(several)} with several numbers describes an "
                             f"anisotropic material, which needs {choices(missing)} too; give it.")
        axes = self.axes or MaterialAxes()
        if "stiffness" in given:
            return AnisotropicMaterial(given["stiffness"], given["density"], axes,
                                       self.loss_factor)
        E, nu, G = (given[key] for key in _CONSTANTS)
        counts = tuple(len(one) if isinstance(one, tuple) else 1 for one in (E, nu, G))
        if counts == (2, 2, 1):
            return AnisotropicMaterial.transversely_isotropic(
                E, nu, G[0] if isinstance(G, tuple) else G, given["density"], axes,
                self.loss_factor)
        if counts != (3, 3, 3):
            raise InputError(f"Material: youngs_modulus = {shown(E)}, poisson_ratio = {shown(nu)} "
                             f"and shear_modulus = {shown(G)} must be three numbers each, or of a "
                             f"transversely isotropic material two, two and one.")
        return AnisotropicMaterial.orthotropic(E, nu, G, given["density"], axes, self.loss_factor)

    def _isotropic(self, given: dict[str, float], several: list[str]) -> Material:
        wrong = [*several, *(key for key in ("shear_modulus",) if key in given),
                 *(["axes"] if self.axes is not None else [])]
        if wrong:
            raise InputError(f"Material: {choices(set(wrong))} is for an anisotropic material, but "
                             f"the others describe an isotropic one; give youngs_modulus, "
                             f"poisson_ratio and shear_modulus as lists, or leave it out.")
        keys = ("youngs_modulus", "poisson_ratio", "density")
        if self.material is None and (missing := [key for key in keys if key not in given]):
            raise InputError(f"Material: {choices(missing)} is missing; give it, or a material.")
        return replace(Material.named(self.material or "steel"), **given,
                       loss_factor=self.loss_factor)
