"""Links between bodies against closed forms: bars, pendulums, masses on springs, bolts."""

import numpy as np
import pytest
from meshes_for_tests import rectangle

from fecontact import (
    Block,
    ContactSystem,
    ElasticBody,
    InputError,
    Interface,
    Load,
    Material,
    Mesh,
    basis_from_matrices,
    equilibrium,
    generate,
    modal_basis,
)
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import (
    Bushing,
    Hinge,
    PointPairing,
    Spring,
    Weld,
    assembled_basis,
    linked,
    reduce_bodies,
)

STRING = Material(2.1e11, 0.0, 7800.0)


def bar(x=0.0, length=1.0, cells=10):
    mesh = rectangle(length, 0.05, cells, 1)
    return ElasticBody(Mesh(mesh.nodes + np.array([x, 0.0]), mesh.cells, mesh.boundaries,
                            mesh.points), STRING)


WELD = Weld("a.end", "b.end")


def bars(reduction="residual", modes=8, start=1.0):
    """Two bars end to end, with what the weld between them needs."""
    return reduce_bodies({"a": bar(), "b": bar(start)}, links=[WELD], modes=modes, tolerance=0.0,
                         reduction=reduction, each={"a": {"points": {"end": "right"}},
                                                    "b": {"points": {"end": "left"}}})


def mass(m, spin=1.0):
    return basis_from_matrices(np.diag([m, m, spin]), np.zeros((3, 3)), {"p": np.eye(3)})


def rod(length, m):
    """A rigid rod with points at both ends, by x, y and rotation of its centre."""
    ends = {}
    for name, x in (("left", -length / 2.0), ("right", length / 2.0)):
        ends[name] = np.eye(3)
        ends[name][1, 2] = x
    return basis_from_matrices(np.diag([m, m, m * length**2 / 12.0]), np.zeros((3, 3)), ends)


@pytest.mark.parametrize(("reduction", "modes", "error"), [
    ("residual", 14, 1e-4), ("craig-bampton", 10, 5e-8), ("vibration", 14, None)])
def test_two_welded_bars_vibrate_as_one_of_double_length(reduction, modes, error):
    """Axial frequencies k c / (2 (2 l)); without residual vectors the joint is too stiff."""
    bases = bars(reduction, modes)
    whole = assembled_basis(bases, {}, [WELD])
    assert whole.modes == sum(one.modes for one in bases.values()) - 3
    assert whole.rigid_modes == 3
    assert (np.diff(whole.angular_frequencies) >= 0.0).all()
    # Axial modes move the ends in x.
    reference = modal_basis(bar(length=2.0, cells=20), 12, contact=())
    found = whole.frequencies_hz[3:12]
    off = np.abs(found / reference.frequencies_hz[3:12] - 1.0).max()
    if error is None:
        assert off > 1e-3
        return
    assert off < error
    # Both bars are the same, in two places; rounding of places is not amplified.
    a, b = (one.angular_frequencies[one.rigid_modes :] for one in bases.values())
    assert a == pytest.approx(b, rel=1e-7)
    axial = 5188.74521 / 4.0  # sqrt(E / rho) / (2 * 2 l)
    assert np.abs(whole.frequencies_hz / axial - 1.0).min() < 1e-4


def test_rows_and_shapes_follow_the_modes():
    whole = assembled_basis(bars(), {}, [WELD])
    a, b = (whole.T[whole.point_index(name)] for name in ("a.end", "b.end"))
    assert a == pytest.approx(b, abs=1e-9 * np.abs(a).max())
    given = whole.mode_shapes.restriction @ whole.mode_shapes.shapes.reshape(-1, whole.modes)
    assert given == pytest.approx(whole.T.reshape(-1, whole.modes), abs=1e-9 * np.abs(a).max())
    # Mass of both bars in translations: rows of inertia of rigid modes.
    total = (whole.inertia_rows**2).sum(axis=1)
    assert total == pytest.approx([2.0 * 7800.0 * 0.05] * 2, rel=1e-6)
    assert [part.modes for part in whole.parts] == [(0, 0), (0, 0)]


def test_double_pendulum_of_hinged_rods():
    """Two equal rods on springs of the base along y, hinged: closed form of small rocking."""
    k, m, length = 1e3, 2.0, 0.5
    whole = assembled_basis(
        {"a": rod(length, m), "b": rod(length, m)}, {},
        [Hinge("a.left"), Hinge("a.right", "b.left"),
         Spring("b.right", direction=(0, 1), stiffness=k)])
    # Angles alpha, beta: T = m l^2 (4 alpha'^2 / 3 + alpha' beta' + beta'^2 / 3) / 2 * ...
    M = m * length**2 * np.array([[4.0 / 3.0, 0.5], [0.5, 1.0 / 3.0]])
    K = k * length**2 * np.ones((2, 2))
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    assert whole.modes == 2
    assert whole.rigid_modes == 1  # alpha = -beta
    assert whole.angular_frequencies[1] ** 2 == pytest.approx(squares[1], rel=1e-12)


def test_two_masses_on_springs():
    """k1 to the base, k2 between: the quadratic of the two frequencies, damping of the dashpots."""
    k1, k2, m1, m2, b = 2e4, 1e4, 1.0, 2.0, 3.0
    up = (0.0, 1.0)
    whole = assembled_basis({"a": mass(m1), "b": mass(m2)}, {}, [
        Spring("a.p", None, k1, direction=up), Spring("a.p", "b.p", k2, b, direction=up)])
    trace, determinant = (k1 + k2) / m1 + k2 / m2, k1 * k2 / (m1 * m2)
    root = np.sqrt(trace**2 / 4.0 - determinant)
    assert whole.rigid_modes == 4
    assert whole.angular_frequencies[4:] ** 2 == pytest.approx(
        [trace / 2.0 - root, trace / 2.0 + root], rel=1e-12)
    assert np.trace(whole.damping) == pytest.approx(b / m1 + b / m2, rel=1e-12)


def test_bushing_holds_displacements_and_rotation():
    c, b = (1e3, 4e3, 9.0), (1.0, 2.0, 0.3)
    whole = assembled_basis({"a": mass(2.0, 0.1), "b": mass(2.0, 0.1)}, {},
                            [Bushing("a.p", "b.p", c, b)])
    assert np.sort(whole.angular_frequencies[3:] ** 2) == pytest.approx(
        np.sort([2.0 * c[0] / 2.0, 2.0 * c[1] / 2.0, 2.0 * c[2] / 0.1]), rel=1e-12)
    assert np.sort(np.diag(whole.damping)[3:]) == pytest.approx(np.sort([1.0, 2.0, 6.0]), rel=1e-12)


def test_frequencies_keep_their_digits_beside_stiff_springs():
    whole = assembled_basis({"a": mass(1.0), "b": mass(1.0)}, {}, [
        Spring("a.p", "b.p", 1e14, direction=(1, 0)), Spring("a.p", None, 2.0, direction=(0, 1))])
    low = whole.angular_frequencies[whole.angular_frequencies > 0.0]
    assert low[0] ** 2 == pytest.approx(2.0, rel=1e-9)
    assert low[1] ** 2 == pytest.approx(2e14, rel=1e-9)


@pytest.mark.parametrize("bolt", [{"preload": 500.0}, {"shortening": 0.05}])
def test_a_bolt_presses_two_masses_together_with_its_preload(bolt):
    """F of the contact = N_0, or c (s + e); action equals reaction: the base carries nothing."""
    contact, k = 1e6, 1e4
    spring = Spring("top.p", "floor.p", k, 20.0, direction=(0.0, 1.0), **bolt)
    system = ContactSystem(
        bodies={"top": mass(1.0), "floor": mass(3.0)},
        interfaces=[Interface("joint", PointPairing("top", "p", "floor", "p"),
                              LinearContact(contact), ConstantFriction(0.0))],
        links=[spring, Bushing("floor.p", None, (1e5, 1e5, 1e5)),
               Bushing("top.p", None, (1e5, 0.0, 1e5))])
    q = equilibrium(system).modal_coordinates
    basis = system.basis
    top, floor = (basis.T[basis.point_index(name), 1] @ q for name in ("top.p", "floor.p"))
    force = contact * (floor - top)
    # c (s + e) + N_0 = F with e = -F / contact
    wanted = 500.0 / (1.0 + k / contact)
    assert force == pytest.approx(wanted, rel=1e-9)
    assert spring.tension(basis, q) == pytest.approx(wanted, rel=1e-9)
    rows = basis.T[[basis.point_index(name) for name in ("top.p", "floor.p")], 1]
    rising = np.linalg.lstsq(rows, [0.3, -0.2], rcond=None)[0]
    assert spring.tension(basis, [q, 0.0 * q], rising) == pytest.approx(
        [wanted + 10.0, 510.0], rel=1e-9)
    with pytest.raises(InputError, match="numbers for each state"):
        spring.tension(basis, q[1:])
    assert floor == pytest.approx(0.0, abs=1e-12)
    loaded = ContactSystem(basis, system.normal, system.friction, load=Load(gravity=None))
    assert (loaded.arrays.constant_load == system.arrays.constant_load).all()


def test_constant_load_is_stored(tmp_path):
    from fecontact.io import read_basis, write_basis

    basis = assembled_basis({"a": mass(1.0), "b": mass(1.0)}, {}, [
        Spring("a.p", "b.p", 10.0, direction=(1, 0), preload=3.0)])
    write_basis(tmp_path / "basis.h5", basis)
    assert (read_basis(tmp_path / "basis.h5").constant_load == basis.constant_load).all()
    assert basis.select([0, 5]).constant_load == pytest.approx(basis.constant_load[[0, 5]])


def test_bad_links_are_named():
    bodies = {"a": mass(1.0), "b": mass(1.0)}
    for message, link in (
        ("no point 'a.q'", lambda: Weld("a.q", "b.p")),
        ("same point", lambda: Hinge("a.p", "a.p")),
        ("needs direction", lambda: Spring("a.p", stiffness=1.0)),
        ("'a.p' and 'b.p' has length zero", lambda: Spring("a.p", "b.p", 1.0)),
        ("must be three numbers", lambda: Bushing("a.p", "b.p", (1.0, 2.0))),
        ("stiffness = -1", lambda: Spring("a.p", "b.p", -1.0)),
        ("Bushing between 'a.B' and the base|no point 'a.B'", lambda: Bushing("a.B")),
    ):
        with pytest.raises(InputError, match=message):
            assembled_basis(bodies, {}, [link()])
    with pytest.raises(InputError, match="leave no motion"):
        assembled_basis({"a": bodies["a"]}, {}, [Weld("a.p")])
    with pytest.raises(InputError, match=r"points that are 0\.5 m apart"):
        assembled_basis(bars(start=1.5), {}, [WELD])
    still = basis_from_matrices(np.eye(1), np.eye(1), {"p": np.zeros((3, 1))})
    with pytest.raises(InputError, match="The Hinge between 'p' and the base has no effect"):
        linked(still, [Hinge("p")])


def test_links_at_a_point_that_several_meshes_have():
    """C of all generated shapes is that of none, but may be had by another name."""
    block = generate(Block(0.1, 0.02, element_size=0.02))
    bodies = {"base": ElasticBody(block, fixed={"contact": "xy"}),
              "pad": ElasticBody(block.placed((0.0, 0.02)))}
    with pytest.raises(InputError, match=r"each={'pad': {'points': {'end': 'C'}}}, and link "):
        reduce_bodies(bodies, (), [Spring("pad.C", direction=(0, 1), stiffness=1e6)], modes=4)
    spring = Spring("pad.end", direction=(0, 1), stiffness=1e6)
    bases = reduce_bodies(bodies, (), [spring], modes=4, each={"pad": {"points": {"end": "C"}}})
    assert bases["pad"].positions[bases["pad"].point_index("end")] == pytest.approx([0.05, 0.04])


def test_directions_stay_the_same_when_written_and_read():
    rng = np.random.default_rng(0)
    for pair in rng.normal(size=(200, 2)):
        once = Spring("a.p", "b.p", stiffness=1.0, direction=tuple(pair)).direction
        assert np.hypot(*once) == pytest.approx(1.0, abs=1e-15)
        assert Spring("a.p", "b.p", stiffness=1.0, direction=once).direction == once
    with pytest.raises(InputError, match=r"Spring: direction = \(0, 0\) must be longer than zero"):
        Spring("a.p", "b.p", stiffness=1.0, direction=(0, 0))
