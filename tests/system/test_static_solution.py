"""Static displacement and stress of bodies against closed forms and published values."""

import meshio
import numpy as np
import pytest
from meshes_for_tests import grid, rectangle
from systems import TURN

import fecontact as fc
from fecontact import BoundaryLoad, Load, PointLoad
from fecontact.fem import Ring
from fecontact.io import export_fields
from fecontact.laws import Constant, Harmonic
from fecontact.plot import plot_stress
from fecontact.system.loads import load_rows
from fecontact.system.parameter_labels import parameter_label

E, RHO, LENGTH, HEIGHT, THICKNESS = 2e9, 1000.0, 2.0, 0.1, 0.02
UNITS = {"Pa]": 1.0, "kPa]": 1e3, "MPa]": 1e6, "GPa]": 1e9}


def bar(fixed, nu=0.0, **options):
    mesh = rectangle(LENGTH, HEIGHT, 20, 2, **options)
    return fc.ElasticBody(mesh, fc.Material(E, nu, RHO), THICKNESS, fixed=fixed)


def skewed(nodes):
    return nodes + 0.1 * np.sin(37.0 * nodes[:, ::-1]) * nodes * (nodes - [LENGTH, HEIGHT])


def test_a_bar_under_its_own_weight():
    """u = rho g L^2 / (2 E) at the end, stress rho g (L - x)."""
    fields = fc.static_solution(bar({"left": "xy"}), Load(gravity=(9.81, 0.0)))
    x = fields.nodes[:, 0]
    np.testing.assert_allclose(fields.displacement[:, 0],
                               RHO * 9.81 * x * (LENGTH - 0.5 * x) / E, atol=1e-14)
    np.testing.assert_allclose(fields.stress[:, 0], RHO * 9.81 * (LENGTH - x), atol=1.0)
    end = fields.at((LENGTH, 0.033))[0][0]
    assert end == pytest.approx(RHO * 9.81 * LENGTH**2 / (2.0 * E), rel=1e-10)
    # Halfway through a base acceleration that does the same to it.
    same = fc.static_solution(bar({"left": "xy"}), Load(
        base_acceleration_x=Harmonic(-9.81, 1.0 / TURN)), time=0.5 * np.pi)
    np.testing.assert_allclose(same.displacement, fields.displacement, atol=1e-18)


@pytest.mark.parametrize("triangles", [True, False])
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_uniform_stress_of_a_free_body_is_exact_to_round_off(triangles, plane):
    """The patch test: pressure all round, and shear that turns back at each corner."""
    mesh = rectangle(LENGTH, HEIGHT, 7, 3, triangles=triangles, warp=skewed)
    part = fc.ElasticBody(mesh, fc.Material(E, 0.3, RHO), THICKNESS, plane=plane)
    p, tau = 3e5, 2e5
    fields = fc.static_solution(part, Load(boundaries=[
        BoundaryLoad(name, p, sign * tau) for name, sign in (
            ("right", 1.0), ("left", 1.0), ("top", -1.0), ("bottom", -1.0))]))
    zz = 0.0 if plane == "stress" else -0.6 * p
    np.testing.assert_allclose(fields.stress, np.tile([-p, -p, zz, tau], (len(fields.nodes), 1)),
                               atol=1e-9 * p)
    wanted = np.sqrt((p + zz) ** 2 + 3.0 * tau**2)
    np.testing.assert_allclose(fields.von_mises, wanted, rtol=1e-9)


def test_pressure_and_force_on_a_bar():
    p = 3e5
    pressed = fc.static_solution(bar({"left": "x", "corner": "y"}, nu=0.3, points={
        "corner": (0.0, 0.0)}), Load(boundaries=[BoundaryLoad("right", p)]))
    np.testing.assert_allclose(pressed.displacement,
                               -p / E * pressed.nodes * [1.0, -0.3], atol=1e-13)
    pulled = fc.static_solution(bar({"left": "xy"}), Load(forces=[
        PointLoad("right", "x", signal=Constant(p * HEIGHT * THICKNESS))]))
    np.testing.assert_allclose(pulled.displacement[:, 0], p / E * pulled.nodes[:, 0], atol=1e-14)


def test_the_load_of_the_contact_and_named_places():
    """A cantilever: F L^3 / (3 E I), and M L^2 / (2 E I); shear adds 0.3 % to the first."""
    part = bar({"left": "xy"})
    inertia = THICKNESS * HEIGHT**3 / 12.0
    end = {"C": (LENGTH, 0.5 * HEIGHT)}
    bent = fc.static_solution(part, Load(10.0), points=end).at(end["C"])[0][1]
    assert bent == pytest.approx(-10.0 * LENGTH**3 / (3.0 * E * inertia), rel=5e-3)
    turned = fc.static_solution(part, Load(forces=[
        PointLoad("right", "phi", signal=Constant(1.0))])).at(end["C"])[0][1]
    assert turned == pytest.approx(LENGTH**2 / (2.0 * E * inertia), rel=1e-6)


def test_forces_with_a_direction():
    """A force of 13 along (5, 12) is that of 5 along x and 12 along y; also of modes, in labels."""
    part, end = bar({"left": "xy"}), {"C": (LENGTH, 0.5 * HEIGHT)}
    slanted = Load(forces=[PointLoad("right", [10.0, 24.0], signal=Constant(13.0))])
    both = Load(forces=[PointLoad("right", "x", signal=Constant(5.0)),
                        PointLoad("right", "y", signal=Constant(12.0))])
    one, other = (fc.static_solution(part, load, points=end) for load in (slanted, both))
    np.testing.assert_allclose(one.displacement, other.displacement, rtol=1e-12)
    basis = fc.modal_basis(part, 3, contact="bottom", contact_nodes=2, C=end["C"])
    one, other = (load_rows(basis, Load(forces=[
        PointLoad("C", force.component, signal=force.signal) for force in load.forces]))[0]
        for load in (slanted, both))
    np.testing.assert_allclose(one, other, rtol=1e-12)
    system = fc.ContactSystem(basis, fc.laws.LinearContact(1e6), fc.laws.Frictionless(), load=Load(
        forces=[PointLoad("C", (5.0, 12.0), signal=Constant(13.0))]))
    assert parameter_label("load.forces.0.signal.value", system=system).startswith(
        "force at C (0.3846, 0.9231)")


def cook(cells):
    """Cook's membrane: clamped on the left, shear of total one on the right."""
    lines = np.linspace(0.0, 1.0, cells + 1)
    mesh = grid(lines, lines, warp=lambda at: np.column_stack(
        [48.0 * at[:, 0], 44.0 * at[:, 0] + at[:, 1] * (44.0 - 28.0 * at[:, 0])]))
    part = fc.ElasticBody(mesh, fc.Material(1.0, 1.0 / 3.0, 1.0), fixed={"left": "xy"})
    return fc.static_solution(part, Load(boundaries=[BoundaryLoad("right", shear=1.0 / 16.0)]))


def test_cooks_membrane():
    """The converged displacement of the middle of the right side is 23.96."""
    tip = [cook(cells).at((48.0, 52.0))[0][1] for cells in (8, 32)]
    assert tip[0] < tip[1] == pytest.approx(23.96, abs=0.01)


def nafems_le1(cells):
    """A quarter of an elliptic membrane under outward pressure, cells graded towards D."""
    lines = np.linspace(0.0, 1.0, cells + 1) ** 2

    def warp(at):
        angle = 0.5 * np.pi * at[:, 1]
        return np.column_stack([np.cos(angle) * (2.0 + 1.25 * at[:, 0]) * (at[:, 1] < 1.0),
                                np.sin(angle) * (1.0 + 1.75 * at[:, 0])])

    part = fc.ElasticBody(grid(lines, lines, warp=warp), fc.Material(2.1e11, 0.3, 7800.0), 0.1,
                          fixed={"top": "x", "bottom": "y"})
    return fc.static_solution(part, Load(boundaries=[BoundaryLoad("right", -1e7)]))


def test_nafems_le1():
    """Stress yy at D is 92.7 MPa; there is none in x on the free edge."""
    stress = nafems_le1(48).at((2.0, 0.0))[1]
    assert stress[1] == pytest.approx(92.7e6, rel=5e-3)
    assert abs(stress[0]) < 1e-3 * stress[1]


@pytest.mark.parametrize(("element", "size", "accuracy"), [("hexahedron", 0.015, 3e-3),
                                                           ("tetrahedron", 0.02, 2e-2)])
def test_a_free_ring_under_pressure_is_in_balance(element, size, accuracy):
    """Lame: u = p a^2 / (E (b^2 - a^2)) ((1 - nu) r + (1 + nu) b^2 / r) without stress in z."""
    a, b, p, modulus, nu = 0.04, 0.1, 1e7, 2.1e11, 0.3
    ring = fc.ElasticBody(fc.generate(Ring(b, a, 0.02, size, 1, element)),
                          fc.Material(modulus, nu, 7800.0))
    moved = fc.static_solution(ring, Load(boundaries=[BoundaryLoad("inner", p)]))
    r = np.linalg.norm(moved.nodes[:, :2], axis=1)
    outward = (moved.nodes[:, :2] * moved.displacement[:, :2]).sum(axis=1) / r
    wanted = p * a**2 / (modulus * (b**2 - a**2)) * ((1.0 - nu) * r + (1.0 + nu) * b**2 / r)
    np.testing.assert_allclose(outward, wanted, atol=accuracy * wanted.max())
    for way, load in (("x", BoundaryLoad("top", 0.0, p)), ("z", BoundaryLoad("top", 1e-5 * p))):
        with pytest.raises(fc.AnalysisError, match=f"against a translation in {way}"):
            fc.static_solution(ring, Load(boundaries=[BoundaryLoad("inner", p), load]))


def test_what_nothing_holds_is_named():
    push = Load(boundaries=[BoundaryLoad("right", 1e5)])
    with pytest.raises(fc.AnalysisError, match="nothing holds the body against a translation in x"):
        fc.static_solution(bar({}), push)
    fc.static_solution(bar({"left": "x"}), push)  # its translation in y is not pushed
    with pytest.raises(fc.AnalysisError, match="against a translation in y"):
        fc.static_solution(bar({"left": "x"}), Load(gravity=(0.0, -9.81)))
    with pytest.raises(fc.AnalysisError, match="against a rotation"):
        fc.static_solution(bar({"pin": "xy"}, points={"pin": (0.0, 0.0)}), Load(
            gravity=(0.0, -9.81)))
    with pytest.raises(fc.InputError, match="a force at contact node 3 cannot be placed"):
        fc.static_solution(bar({"left": "xy"}), Load(forces=[
            PointLoad(3, signal=Constant(1.0))]))
    with pytest.raises(fc.MeshError, match="Point C: the mesh has no point"):
        fc.static_solution(bar({"left": "xy"}), Load(1.0))
    with pytest.raises(fc.MeshError, match="no boundary named 'rigth'"):
        fc.static_solution(bar({"left": "xy"}), Load(boundaries=[BoundaryLoad("rigth", 1.0)]))


def test_fields_are_interpolated_written_and_drawn(tmp_path):
    fields = cook(4)
    with pytest.raises(fc.InputError, match=r"at: place: \(0, 50\) lies outside the body"):
        fields.at((0.0, 50.0))
    assert export_fields(fields, tmp_path / "cook.vtu") == tmp_path / "cook.vtu"
    found = meshio.read(tmp_path / "cook.vtu")
    data = found.point_data
    np.testing.assert_array_equal(found.points[:, :2], fields.nodes)
    np.testing.assert_array_equal(data["displacement"][:, :2], fields.displacement)
    np.testing.assert_array_equal(data["stress_xy"], fields.stress[:, 3])
    np.testing.assert_array_equal(data["von_mises"], fields.von_mises)
    # At the clamped corners stresses are singular: where the largest is much above the 99th
    # percentile, colours end there.
    usual = np.percentile(np.abs(fields.stress[:, 0]), 99.0)
    for component, largest in (("von_mises", fields.von_mises.max()), ("xx", usual)):
        figure = plot_stress(fields, component=component, scale=0.5,
                             path=tmp_path / f"{component}.png")
        drawn = figure.axes[0].collections[0]
        unit = UNITS[figure.axes[1].get_ylabel().split("[")[1]]
        assert drawn.get_clim()[1] == pytest.approx(largest / unit)
        corner = fields.nodes.max(axis=0) + 0.5 * fields.displacement[
            np.argmax(fields.nodes.sum(axis=1))]
        outline = np.concatenate(figure.axes[0].collections[2].get_segments())
        assert np.abs(outline - corner).sum(axis=1).min() < 1e-9
        assert figure.axes[0].get_title() == "displacements times 0.5"
    with pytest.raises(fc.InputError, match="component = 'yx' must be one of"):
        plot_stress(fields, component="yx")
    basis = fc.modal_basis(bar({"left": "xy"}), 3, contact="bottom")
    with pytest.raises(fc.InputError, match=r"must have shape \(3,\), not \(2,\)"):
        basis.fields([1.0, 2.0])
    np.testing.assert_array_equal(basis.fields([0.0, 1.0, 0.0]).stress,
                                  basis.mode_shapes.stress[:, :, 1])
