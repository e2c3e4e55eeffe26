"""Isotropic linear elastic materials."""

from dataclasses import dataclass

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, nearest, require_finite, require_positive


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

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    youngs_modulus: float = 2.1e11
    poisson_ratio: float = 0.3
    density: float = 7850.0

    def __post_init__(self) -> None:
        require_positive("Material", youngs_modulus=self.youngs_modulus, density=self.density)
        require_finite("Material", poisson_ratio=self.poisson_ratio)
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
        return cls(*_MATERIALS[name])


_MATERIALS = {"steel": (2.1e11, 0.3, 7850.0), "aluminium": (7.0e10, 0.33, 2700.0)}
