"""Thermal strain: free expansion, held bodies, bending by a gradient, buckling, modes."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from solid_blocks import block_mesh

from fecontact import (
    ElasticBody,
    InputError,
    Load,
    Material,
    modal_basis,
    static_solution,
)
from fecontact.analysis import buckling_loads
from fecontact.fem import AnisotropicMaterial

ALPHA, E, NU = 1.2e-5, 2.1e11, 0.3
STEEL = Material(E, NU, 7850.0, thermal_expansion=ALPHA)
L, H = 1.0, 0.02
EVEN = {"left": "x", "right": "x"}


def beam(fixed, plane="stress", **options):
    return ElasticBody(rectangle(L, H, 20, 2, **options), STEEL, thickness=0.05, plane=plane,
                       fixed=fixed)


def bodies():
    return {"stress": beam({}), "strain": beam({}, "strain"), "solid": ElasticBody(
        block_mesh((2, 2, 1)), STEEL)}


@pytest.mark.parametrize("name", ["stress", "strain", "solid"])
def test_free_body_expands_without_stress(name):
    """alpha DT, in plane strain (1 + nu) alpha DT, with the stress E alpha DT across alone."""
    body = bodies()[name]
    found = static_solution(body, Load(), temperature=100.0)
    factor = 1.0 + NU if name == "strain" else 1.0
    strain = np.ptp(found.displacement[:, 0]) / np.ptp(body.nodes[:, 0])
    assert strain == pytest.approx(factor * ALPHA * 100.0, rel=1e-9)
    stress = found.stress.copy()
    if name == "strain":
        assert stress[:, 2] == pytest.approx(-E * ALPHA * 100.0, rel=1e-9)
        stress[:, 2] = 0.0
    assert np.abs(stress).max() < 1e-6 * E * ALPHA * 100.0


def test_held_bar_is_pressed():
    """- E alpha DT along the bar."""
    found = static_solution(beam({**EVEN, "bottom": "y"}), Load(), temperature=50.0)
    assert found.stress[:, 0] == pytest.approx(-E * ALPHA * 50.0, rel=1e-9)
    assert np.abs(found.stress[:, 1]).max() < 1e-6 * E * ALPHA * 50.0


def test_gradient_bends_a_cantilever():
    """A linear temperature over the height: curvature alpha DT / h, without stress."""
    body = beam({"left": "x"}, points={"corner": (0.0, 0.0)})
    body = ElasticBody(body.mesh, STEEL, thickness=0.05, fixed={"left": "x", "corner": "y"})
    found = static_solution(body, Load(), temperature=lambda x, y: 40.0 * (y / H - 0.5))
    tip = found.displacement[np.argmax(body.nodes[:, 0] - body.nodes[:, 1]), 1]
    assert tip == pytest.approx(-0.5 * ALPHA * 40.0 / H * L**2, rel=1e-6)
    assert np.abs(found.stress).max() < 1e-6 * E * ALPHA * 40.0


def test_clamped_beam_buckles_by_heat():
    """alpha DT = pi^2 h^2 / (3 L^2), of a beam with shear 0.4 % less."""
    body = beam({"left": "xy", "right": "xy"})
    found = buckling_loads(body, Load(), 1, temperature=1.0)
    euler = np.pi**2 * H**2 / (3.0 * L**2) / ALPHA
    shear = 1.0 + E * ALPHA * euler * 1.2 * 2.0 * (1.0 + NU) / E
    assert found.load_factors[0] == pytest.approx(euler / shear, rel=3e-3)


def test_heat_lowers_frequencies():
    """The lowest one vanishes where the beam buckles: its square falls linearly but for 2.5 %."""
    body = beam({"left": "xy", "right": "xy"})
    warm = buckling_loads(body, Load(), 1, temperature=1.0).load_factors[0]
    cold, half = (modal_basis(body, 1, contact=(), prestress=state).frequencies_hz[0]
                  for state in (None, static_solution(body, Load(), temperature=0.5 * warm)))
    assert (half / cold) ** 2 == pytest.approx(0.5, abs=0.0125)


def test_bad_temperatures_are_refused():
    body = beam(EVEN)
    with pytest.raises(InputError, match=r"one finite number or one for each of the \d+"):
        static_solution(body, Load(), temperature=[1.0, 2.0])
    plain = ElasticBody(body.mesh, Material(), fixed=EVEN)
    with pytest.raises(InputError, match="thermal expansion of the material, which is zero"):
        static_solution(plain, Load(), temperature=1.0)
    wood = AnisotropicMaterial.orthotropic((1e10, 1e9, 1e9), (0.3, 0.3, 0.3), (1e9, 1e9, 1e9),
                                           500.0)
    with pytest.raises(InputError, match="isotropic materials"):
        static_solution(ElasticBody(body.mesh, wood, fixed=EVEN), Load(), temperature=1.0)
