"""A change of temperature as a load of bodies in contact."""

import numpy as np
import pytest
from meshes_for_tests import grid

import fecontact as fc
from fecontact import ContactSystem, ElasticBody, InputError, Load, Material, modal_basis
from fecontact.fem import pair_faces
from fecontact.io import read_basis, write_basis
from fecontact.laws import Frictionless, LinearContact
from fecontact.reduction import LargeDeflections, assembled_basis, reduce_bodies

STEEL = Material(2.1e11, 0.3, 7850.0, thermal_expansion=1.2e-5)
ALUMINIUM = Material(7e10, 0.33, 2700.0, thermal_expansion=2.3e-5)
WIDTH, HEIGHT, THICKNESS, K, GAP, HEAT = 0.02, 0.1, 0.05, 4e8, 3e-5, 60.0
AREA = WIDTH * THICKNESS


def column(fixed, material=STEEL, height=0.0):
    mesh = grid(np.linspace(0.0, WIDTH, 5), np.linspace(height, height + HEIGHT, 13),
                points={"corner": (0.0, height), "above": (0.0, height + HEIGHT)})
    return ElasticBody(mesh, material, thickness=THICKNESS, degree=1, fixed=fixed)


def system_of(basis, gap=GAP):
    return ContactSystem(basis, normal=LinearContact(K), friction=Frictionless(), gap=gap)


def warm_column(**options):
    return modal_basis(column({"top": "y", "above": "x"}), 6, contact="bottom",
                       reduction="residual", tolerance=0.0, temperature=HEAT, **options)


def pressed(heat, compliance):
    """Force of a contact that closes by the expansion less the gap."""
    return max(heat - GAP, 0.0) / (1.0 / K + compliance)


def test_a_column_closes_its_gap_as_it_grows_warm():
    basis = warm_column()
    system = system_of(basis)
    rest = fc.equilibrium(system, "rest")
    force = pressed(1.2e-5 * HEAT * HEIGHT, HEIGHT / (2.1e11 * AREA))
    assert force > 0.0
    assert rest.normal_force.sum() == pytest.approx(force, rel=1e-6)
    fields = basis.fields(rest.modal_coordinates)
    assert fields.stress[:, 1] == pytest.approx(-force / AREA, rel=1e-5)
    assert np.abs(fields.stress[:, [0, 3]]).max() < 1e-5 * force / AREA
    assert fields.temperature == pytest.approx(HEAT)


def test_a_column_that_does_not_reach_the_ground_is_free_of_stress():
    basis = warm_column()
    far = system_of(basis, 1e-3)
    rest = fc.equilibrium(far, "rest")
    assert not rest.normal_force.any()
    fields = basis.fields(rest.modal_coordinates)
    assert np.abs(fields.stress).max() < 1e-6 * 2.1e11 * 1.2e-5 * HEAT
    assert np.ptp(fields.displacement[:, 1]) == pytest.approx(1.2e-5 * HEAT * HEIGHT, rel=1e-9)


def test_two_columns_press_each_other():
    """A column of aluminium, warm, below one of steel, cold: a run settles at their equilibrium."""
    bodies = {"below": column({"bottom": "y", "corner": "x"}, ALUMINIUM),
              "above": column({"top": "y", "above": "x"}, height=HEIGHT)}
    pairing = pair_faces(bodies, "above.bottom", "below.top")
    bases = reduce_bodies(bodies, [pairing], modes=4, tolerance=0.0, damping=0.2,
                          each={"below": {"temperature": HEAT}})
    basis = assembled_basis(bases, {"joint": pairing})
    system = system_of(basis)
    force = pressed(2.3e-5 * HEAT * HEIGHT,
                    HEIGHT / (7e10 * AREA) + HEIGHT / (2.1e11 * AREA))
    rest = fc.equilibrium(system, "rest")
    assert rest.normal_force.sum() == pytest.approx(force, rel=1e-3)
    warm, cold = (basis.fields(rest.modal_coordinates, name) for name in bodies)
    for one in (warm, cold):
        middle = np.abs(one.nodes[:, 1] - one.nodes[:, 1].mean()) < 0.03
        assert one.stress[middle, 1] == pytest.approx(-force / AREA, rel=1e-2)
    assert warm.temperature == pytest.approx(HEAT)
    assert not cold.temperature.any()
    run = fc.simulate(system, 0.02, outputs=11)
    assert run.normal_force[-1].sum() == pytest.approx(force, rel=1e-2)


def test_fields_are_those_of_the_whole_body_and_stiffen_it(tmp_path):
    body = column({"top": "xy", "bottom": "xy"})
    gradient = 40.0 + 500.0 * body.nodes[:, 0]
    basis = modal_basis(body, 8, contact=(), reduction="residual", temperature=gradient)
    path = tmp_path / "warm.h5"
    write_basis(path, basis)
    state = fc.static_solution(body, Load(), temperature=gradient)
    for one in (basis, read_basis(path), basis.select(range(basis.modes))):
        found = one.fields(one.constant_load / one.angular_frequencies**2)
        scale = np.abs(state.stress).max()
        assert np.abs(found.displacement - state.displacement).max() < 1e-9 * np.abs(
            state.displacement).max()
        assert np.abs(found.stress - state.stress).max() < 1e-8 * scale
        first, other = (modal_basis(body, 4, contact=(), prestress=each).frequencies_hz
                        for each in (found, state))
        assert first == pytest.approx(other, rel=1e-9)


def test_temperatures_that_cannot_act_are_refused():
    body = column({"top": "y", "above": "x"})
    with pytest.raises(InputError, match="temperature needs the static response to it"):
        modal_basis(body, 4, contact="bottom", temperature=HEAT)
    with pytest.raises(InputError, match="large_deflections and temperature do not go together"):
        modal_basis(body, 4, contact="bottom", reduction="residual", temperature=HEAT,
                    large_deflections=LargeDeflections(1e-3, 1))
    with pytest.raises(InputError, match=r"one for each of the .* displacement nodes"):
        modal_basis(body, 4, contact="bottom", reduction="residual", temperature=[1.0, 2.0])
