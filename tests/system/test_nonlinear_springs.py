"""Nonlinear springs between points of bodies, against closed forms."""

import io
from contextlib import redirect_stdout

import numpy as np
import pytest
from meshes_for_tests import rectangle
from scipy.optimize import brentq
from scipy.special import ellipk

import fecontact as fc
from fecontact import plot
from fecontact.analysis import complex_modes, prestressed_modes
from fecontact.bifurcation import contact_field, equilibrium_branch
from fecontact.core.errors import InputError
from fecontact.integrate import PointStart, SetValued
from fecontact.io import read_basis, write_basis
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import (
    PiecewiseSpring,
    PlaySpring,
    PointPairing,
    PolynomialSpring,
    Spring,
    point_masses,
    reduce_bodies,
)
from fecontact.reduction.assembly.contact_faces import contact_sides
from fecontact.system.parameter_labels import parameter_label

UP = (0.0, 1.0)


def oscillator(spring, m=2.0, **parts):
    return fc.ContactSystem(bodies={"a": point_masses({"p": m})}, links={"mount": spring}, **parts)


def released(system, y, v=0.0):
    return PointStart(displacements={"a.p": (None, y)}, velocities={"a.p": (None, v)})


def height(system, q):
    return float(system.basis.T[system.basis.point_index("a.p"), 1] @ q)


@pytest.mark.parametrize("solver", [None, SetValued()], ids=["rodas5p", "set-valued"])
@pytest.mark.parametrize("cubic", [3e4, -2e3])
def test_period_of_duffings_oscillator(cubic, solver):
    """T = 4 K(m) / w with w^2 = (k + k3 A^2) / M and m = k3 A^2 / (2 (k + k3 A^2))."""
    k, M, A = 50.0, 2.0, 0.1
    system = oscillator(PolynomialSpring("a.p", None, k, cubic, direction=UP), M)
    hard = k + cubic * A**2
    period = 4.0 * ellipk(cubic * A**2 / (2.0 * hard)) / np.sqrt(hard / M)
    options = {} if solver is None else {"solver": solver}
    run = fc.simulate(system, 5.0 * period, initial=released(system, A), rtol=1e-9, outputs=21,
                      **options)
    y = run.displacement("a.p")[:, 1]
    assert y[::4] == pytest.approx(np.full(6, A), rel=1e-6)
    assert y[2::4] == pytest.approx(np.full(5, -A), rel=1e-6)
    # The frequency is wrong by 1 % without its dependence on the amplitude.
    assert abs(period * np.sqrt(k / M) / (2.0 * np.pi) - 1.0) > 0.05
    total = run.energies.kinetic + run.energies.contact
    assert total == pytest.approx(0.5 * k * A**2 + 0.25 * cubic * A**4, rel=1e-6)
    assert run.energies.imbalance < 1e-6


def test_a_run_from_zero_elongation_feels_the_spring():
    """The force is exactly zero there, but not the stiffness."""
    k, M = 50.0, 2.0
    system = oscillator(PolynomialSpring("a.p", None, k, direction=UP), M)
    state = np.zeros(2)
    assert system.jacobian(0.0, state)[1, 0] == pytest.approx(-k / M, rel=1e-12)
    run = fc.simulate(system, 1.0, initial=released(system, 0.0, 0.3), rtol=1e-9, outputs=11)
    w = np.sqrt(k / M)
    assert run.displacement("a.p")[:, 1] == pytest.approx(0.3 / w * np.sin(w * run.time), abs=1e-8)


@pytest.mark.parametrize("solver", [None, SetValued()], ids=["rodas5p", "set-valued"])
def test_period_of_an_oscillator_with_play(solver):
    """Two half sines beyond the clearance and two free flights across it."""
    c, h, M, v = 2e3, 0.01, 0.5, 0.4
    system = oscillator(PlaySpring("a.p", None, c, h, direction=UP), M)
    period = 2.0 * np.pi * np.sqrt(M / c) + 4.0 * h / v
    options = {} if solver is None else {"solver": solver}
    run = fc.simulate(system, 4.0 * period, initial=released(system, 0.0, v), rtol=1e-8,
                      outputs=17, **options)
    y, rate = run.displacement("a.p")[:, 1], run.velocity("a.p")[:, 1]
    reach = h + v * np.sqrt(M / c)
    assert y == pytest.approx(np.tile([0.0, reach, 0.0, -reach], 5)[:17], abs=1e-5 * reach)
    assert rate[::2] == pytest.approx(np.tile([v, -v], 5)[:9], rel=1e-5)
    assert run.energies.imbalance < 1e-5


def test_period_of_a_piecewise_linear_oscillator():
    """Stiffness c1 up to e1 and c2 beyond: arcs of two harmonic motions."""
    c1, c2, e1, M, v = 100.0, 900.0, 0.02, 1.0, 0.6
    system = oscillator(PiecewiseSpring("a.p", None, (-1.0, -e1, e1, 1.0), (
        -c1 * e1 - c2 * (1.0 - e1), -c1 * e1, c1 * e1, c1 * e1 + c2 * (1.0 - e1)),
        direction=UP), M)
    w1, w2 = np.sqrt(c1 / M), np.sqrt(c2 / M)
    inner = np.arcsin(e1 * w1 / v) / w1
    at_corner = np.sqrt(v**2 - (e1 * w1) ** 2)
    # Beyond the corner about e1 - c1 e1 / c2, from there to the turning point.
    outer = np.arctan2(at_corner / w2, c1 * e1 / c2) / w2
    period = 4.0 * (inner + outer)
    turning = e1 * (1.0 - c1 / c2) + np.hypot(c1 * e1 / c2, at_corner / w2)
    run = fc.simulate(system, 3.0 * period, initial=released(system, 0.0, v), rtol=1e-9,
                      outputs=13)
    y = run.displacement("a.p")[:, 1]
    assert y == pytest.approx(np.tile([0.0, turning, 0.0, -turning], 4)[:13], abs=1e-5 * turning)


@pytest.mark.parametrize(("spring", "tension"), [
    (PolynomialSpring("a.p", None, 200.0, 5e5, 1.0, UP, 3.0, 2e-3),
     lambda e: 200.0 * (e + 2e-3) + 5e5 * (e + 2e-3) ** 3 + 3.0),
    (PlaySpring("a.p", None, 800.0, 0.01, 1.0, UP, 3.0, 2e-3),
     lambda e: np.sign(e + 2e-3) * 800.0 * max(abs(e + 2e-3) - 0.01, 0.0) + 3.0),
    (PiecewiseSpring("a.p", None, (-0.1, 0.0, 0.01), (-30.0, 0.0, 9.0), 1.0, UP, 3.0, 2e-3),
     lambda e: (300.0 if e < -2e-3 else 900.0) * (e + 2e-3) + 3.0),
], ids=["cubic", "play", "piecewise"])
@pytest.mark.parametrize("load", [-20.0, 20.0, 4.0])
def test_elongation_at_rest_and_modes_about_it(spring, tension, load):
    """The root of N(e) = F, and w^2 = N'(e) / M about it; load.normal acts downwards at C."""
    bodies = {"a": fc.basis_from_matrices(np.diag([1.0, 2.0]), np.diag([1e3, 0.0]), {
        "p": [[1, 0], [0, 1], [0, 0]], "C": [[1, 0], [0, 1], [0, 0]]})}
    system = fc.ContactSystem(bodies=bodies, links={"mount": spring}, load=fc.Load(load))
    rest = height(system, fc.equilibrium(system).modal_coordinates)
    expected = brentq(lambda e: tension(e) + load, -1.0, 1.0, xtol=1e-14)
    assert rest == pytest.approx(expected, rel=1e-8)
    run = fc.simulate(system, 0.01, initial="rest", outputs=3)
    assert run.displacement("a.p")[:, 1] == pytest.approx([expected] * 3, rel=1e-6)
    assert -run.normal_force[-1] == pytest.approx([-load], rel=1e-6)
    slope = (tension(expected + 1e-6) - tension(expected - 1e-6)) / 2e-6
    modes = complex_modes(system, "rest")
    frequency = np.sqrt(slope / 2.0) / (2.0 * np.pi)
    undamped = np.abs(modes.eigenvalues) / (2.0 * np.pi)
    assert np.abs(undamped - frequency).min() < 1e-6 * frequency
    assert modes.eigenvalues.real.min() == pytest.approx(-0.25, rel=1e-6)
    if isinstance(spring, PlaySpring):  # a path of loads across the play has nothing to hold it
        return
    held = fc.load_history(system, fc.LoadPath(load_scale=(0.5, 1.0)))
    assert height(system, held.modal_coordinates[-1]) == pytest.approx(expected, rel=1e-6)
    again = prestressed_modes(system, held)
    assert np.abs(again.eigenvalues).max() == pytest.approx(np.abs(modes.eigenvalues).max(),
                                                            rel=1e-6)


def test_momentum_of_two_free_masses():
    """A cubic spring between them acts on both with opposite forces; the centre goes on."""
    m = {"a": 1.0, "b": 3.0}
    system = fc.ContactSystem(
        bodies={name: point_masses({"p": mass}, components="xy") for name, mass in m.items()},
        links={"rope": PolynomialSpring("a.p", "b.p", 10.0, 4e3, direction=(3.0, 4.0))})
    run = fc.simulate(system, 2.0, rtol=1e-9, outputs=41, initial=PointStart(velocities={
        "a.p": (0.5, 0.2), "b.p": (0.0, 0.0)}))
    momentum = sum(mass * run.velocity(f"{name}.p")[:, :2] for name, mass in m.items())
    assert momentum == pytest.approx(np.tile([0.5, 0.2], (41, 1)), abs=1e-13)
    assert run.energies.imbalance < 1e-6
    # Across the spring nothing acts.
    across = run.velocity("a.p")[:, :2] @ np.array([4.0, -3.0]) / 5.0
    assert across == pytest.approx(np.full(41, (0.5 * 4.0 - 0.2 * 3.0) / 5.0), rel=1e-12)
    assert np.abs(run.normal_force).max() > 1.0


def test_folds_of_a_spring_with_two_places_of_rest():
    """-k e + k3 e^3 = F has its folds at F = 2 k / 3 sqrt(k / (3 k3))."""
    k, cubic = 40.0, 1e5
    bodies = {"a": fc.basis_from_matrices(np.diag([1.0, 2.0]), np.diag([1e3, 0.0]), {
        "p": [[1, 0], [0, 1], [0, 0]], "C": [[1, 0], [0, 1], [0, 0]]})}
    system = fc.ContactSystem(bodies=bodies, load=fc.Load(-2.0), links={
        "arch": PolynomialSpring("a.p", None, -k, cubic, 1.0, UP)})
    rest = height(system, fc.equilibrium(system).modal_coordinates)
    assert -k * rest + cubic * rest**3 == pytest.approx(2.0, rel=1e-6)
    # Without load it leaves the crest between both places of rest.
    unloaded = system.with_(**{"load.normal": 0.0})
    freed = abs(height(system, fc.equilibrium(unloaded).modal_coordinates))
    assert freed == pytest.approx(np.sqrt(k / cubic), rel=1e-6)
    branch = equilibrium_branch(contact_field(system, ["load.normal"]), parameter="load.normal",
                                bounds=(-2.0, 2.0))
    fold = 2.0 * k / 3.0 * np.sqrt(k / (3.0 * cubic))
    found = sorted(point.parameter for point in branch.of_kind("fold"))
    assert found == pytest.approx([-fold, fold], rel=1e-6)


def test_branch_over_a_parameter_of_a_spring():
    bodies = {"a": fc.basis_from_matrices(np.diag([1.0, 2.0]), np.diag([1e3, 0.0]), {
        "p": [[1, 0], [0, 1], [0, 0]], "C": [[1, 0], [0, 1], [0, 0]]})}
    system = fc.ContactSystem(bodies=bodies, load=fc.Load(-5.0), links={
        "mount": PolynomialSpring("a.p", None, 100.0, 1e5, 1.0, UP)})
    name = "links.mount.cubic_stiffness"
    branch = equilibrium_branch(contact_field(system, [name]), parameter=name, bounds=(1e5, 1e6))
    e = height(system, branch.points[-1].u[:2])
    stiffness = branch.points[-1].parameter
    assert stiffness == pytest.approx(1e6, rel=1e-6)
    assert 100.0 * e + stiffness * e**3 == pytest.approx(5.0, rel=1e-6)


def bolted(bolt):
    """A pad on a base, pulled on it by a bolt."""
    rows, base = rectangle(0.1, 0.03, 8, 2), rectangle(0.1, 0.03, 8, 2)
    bodies = {
        "pad": fc.ElasticBody(rows.placed((0.0, 0.03))),
        "base": fc.ElasticBody(fc.Mesh(base.nodes, base.cells, base.boundaries),
                               fixed={"bottom": "xy"})}
    face = fc.fem.pair_faces(bodies, "pad.bottom", "base.top")
    each = {"pad": {"points": {"head": (0.05, 0.06)}},
            "base": {"points": {"foot": (0.05, 0.015)}}}
    bases = reduce_bodies(bodies, [face], [bolt], modes=6, damping=0.02, each=each)
    return fc.ContactSystem(bodies=bases, links={"bolt": bolt}, interfaces=[
        fc.Interface("joint", face, LinearContact(1e9), ConstantFriction(0.3))])


def test_a_bolt_without_cubic_term_is_the_linear_one():
    """Normal forces at rest under its preload, and its own tension, with a mesh between."""
    linear = bolted(Spring("pad.head", "base.foot", 1e7, preload=500.0, shortening=1e-5))
    cubic = bolted(PolynomialSpring("pad.head", "base.foot", 1e7, preload=500.0,
                                    shortening=1e-5))
    runs = [fc.simulate(system, 1e-6, outputs=2, initial="rest") for system in (linear, cubic)]
    contact = runs[0].normal_force[0]
    assert contact.sum() > 400.0
    assert runs[1].normal_force[0, :-1] == pytest.approx(contact, rel=1e-6)
    assert -runs[1].normal_force[0, -1] == pytest.approx(contact.sum(), rel=1e-6)
    assert cubic.basis.groups == (("joint", 17), ("bolt", 1))
    assert cubic.basis.spring_nodes.tolist() == [False] * 17 + [True]
    assert not cubic.basis.ground_nodes.any()


def test_springs_are_no_contact_in_what_is_shown(tmp_path):
    from fecontact.cli.tables import run_table

    system = bolted(PlaySpring("pad.head", "base.foot", 1e7, 1e-6, preload=500.0))
    run = fc.simulate(system, 1e-5, outputs=3, initial="rest")
    assert dict(system.basis.summary())["contact nodes"] == "17 (17 joint)"
    assert dict(system.basis.summary())["nonlinear springs"] == "bolt"
    assert dict(system.summary())["friction"] == "ConstantFriction (joint)"
    from rich.console import Console

    # In movies its end on the pad moves as the pad does there, along the spring.
    own, feet = contact_sides(system.basis)
    moved = system.basis.mode_shapes.shapes.reshape(-1, system.basis.modes)
    for rows, name in ((own, "pad.head"), (feet, "base.foot")):
        assert rows[-1] @ moved == pytest.approx(
            system.basis.T[system.basis.point_index(name), 1], abs=1e-10)
    text = io.StringIO()
    Console(file=text, width=200).print(run_table(run))
    assert "bolt: pad and base" in text.getvalue()
    assert "nonlinear spring, at most" in text.getvalue()
    figure = plot.plot_contact_map(run)
    titles = [axis.get_title(loc="left") for axis in figure.axes]
    assert [title for title in titles if title] == ["joint: pad and base"]
    write_basis(tmp_path / "basis.h5", system.basis)
    assert read_basis(tmp_path / "basis.h5").springs == ("bolt",)
    fc.write_case(tmp_path / "run.h5", run)
    again = fc.read_case(tmp_path / "run.h5").trajectory
    assert again.system.parameters() == system.parameters()
    assert (again.normal_force == run.normal_force).all()
    with redirect_stdout(io.StringIO()):
        alone = oscillator(PolynomialSpring("a.p", None, 50.0, direction=UP))
    with pytest.raises(fc.AnalysisError, match="There is no contact map: nonlinear springs join"):
        plot.plot_contact_map(fc.simulate(alone, 0.1, outputs=3, initial=released(alone, 0.1)))


def test_parameters_of_springs_go_by_the_name_of_the_link():
    system = oscillator(PolynomialSpring("a.p", None, 50.0, 1e3, 2.0, UP))
    assert system.parameters()["links.mount.cubic_stiffness"] == 1e3
    assert not [name for name in system.parameters() if "friction" in name]
    other = system.with_(**{"links.mount.cubic_stiffness": 4e3})
    assert other.parameter("links.mount.cubic_stiffness") == 4e3
    assert other.parameter("links.mount.damping") == 2.0
    assert parameter_label("links.mount.cubic_stiffness") == (
        "links mount cubic stiffness [N/m^3]")
    with pytest.raises(fc.InputError, match=r"'links\.mount\.cubic'.*did you mean"):
        system.with_(**{"links.mount.cubic": 1.0})
    numbered = fc.ContactSystem(bodies={"a": point_masses({"p": 1.0})},
                                links=[PolynomialSpring("a.p", None, 50.0, direction=UP)])
    assert numbered.basis.springs == ("spring_1",)


def test_a_spring_to_the_base_does_not_feel_the_ground():
    """Waves pass below, the belt runs: neither is a matter of the spring."""
    system = oscillator(PolynomialSpring("a.p", None, 50.0, direction=UP),
                        ground=fc.Ground(speed=1.0, amplitude=0.05, wavelength=0.1))
    run = fc.simulate(system, 0.5, initial=released(system, 0.0), outputs=6)
    assert np.abs(run.displacement("a.p")).max() < 1e-290


@pytest.mark.parametrize(("make", "message"), [
    (lambda: PolynomialSpring("a.p", stiffness=1.0),
     "PolynomialSpring: a spring to the base needs"),
    (lambda: PolynomialSpring("a.p", "a.p", 1.0),
     "PolynomialSpring: first and second are the same point"),
    (lambda: PolynomialSpring("a.p", "b.p"),
     "PolynomialSpring: all stiffnesses and dampings are zero"),
    (lambda: PolynomialSpring("a.p", "b.p", 1.0, damping=-1.0),
     r"PolynomialSpring: damping = -1\.0 must be zero or above"),
    (lambda: PolynomialSpring("a.p", "b.p", np.nan), "PolynomialSpring: stiffness = nan must be"),
    (lambda: PolynomialSpring("a.p", "b.p", (1.0, 2.0)),
     "PolynomialSpring: stiffness = .* must be"),
    (lambda: PolynomialSpring(3, "b.p", 1.0), "PolynomialSpring: first"),
    (lambda: PolynomialSpring("a.p", "b.p", 1.0, direction=(0, 0)), "PolynomialSpring: direction"),
    (lambda: PlaySpring("a.p", "b.p", 0.0, 1.0), r"PlaySpring: stiffness = 0\.0 must be above"),
    (lambda: PlaySpring("a.p", "b.p", 1.0, -1.0), r"PlaySpring: clearance = -1\.0 must be zero"),
    (lambda: PiecewiseSpring("a.p", "b.p", (0.0, 1.0), (0.0,)),
     "PiecewiseSpring: elongations and forces must be as many"),
    (lambda: PiecewiseSpring("a.p", "b.p", (1.0, 0.0), (0.0, 1.0)), "ascending elongations"),
    (lambda: PiecewiseSpring("a.p", "b.p", (0.0, 1.0), (2.0, 2.0)), "are all equal"),
    (lambda: PiecewiseSpring("a.p", "b.p"), "PiecewiseSpring: elongations = "),
])
def test_springs_out_of_range_are_explained(make, message):
    with pytest.raises(fc.InputError, match=message):
        make()


@pytest.mark.parametrize(("links", "message"), [
    ({"mount": PolynomialSpring("a.q", None, 1.0, direction=UP)}, "Link 'mount': .*q"),
    ({"mount": PolynomialSpring("c.p", None, 1.0, direction=UP)},
     "Link 'mount': 'c.p' is a point of no body"),
    ({"mount": PolynomialSpring("a.p", "b.p", 1.0)}, "Link 'mount': .* has length zero; give its"),
    ({"mo.unt": PolynomialSpring("a.p", "b.p", 1.0, direction=UP)},
     "name 'mo.unt' of a link must be"),
    ({"touch": PolynomialSpring("a.p", "b.p", 1.0, direction=UP)},
     "'touch' of a nonlinear spring is"),
])
def test_bad_places_of_springs_are_explained(links, message):
    with pytest.raises(fc.InputError, match=message):
        fc.ContactSystem(
            bodies={"a": point_masses({"p": 1.0}), "b": point_masses({"p": 1.0})}, links=links,
            interfaces=[fc.Interface("touch", PointPairing("a", "p", "b", "p"),
                                     LinearContact(1e3), ConstantFriction(0.0))])


def test_rigid_stops_beside_a_nonlinear_spring_are_refused():
    system = oscillator(PolynomialSpring("a.p", None, 50.0, direction=UP))
    with pytest.raises(fc.InputError, match="nonlinear springs, 'mount'; leave restitution out"):
        fc.simulate(system, 1.0, solver=SetValued(restitution=0.5),
                    initial=released(system, 0.1))


@pytest.mark.parametrize(("stiffness", "cubic", "preload"), [
    (-50.0, 0.0, 0.0), (-50.0, 0.0, 3.0), (-50.0, -3e4, 0.0), (50.0, -3e4, 20.0)])
def test_springs_without_a_place_of_rest(stiffness, cubic, preload):
    """Equilibrium ends in a sentence, a run with a status."""
    system = oscillator(PolynomialSpring("a.p", None, stiffness, cubic, 0.0, UP, preload))
    with pytest.raises(fc.AnalysisError, match="force of the spring mount falls with its elong"):
        fc.equilibrium(system)
    assert complex_modes(system).summary()
    run = fc.simulate(system, 100.0, initial=released(system, 0.1), outputs=3)
    assert run.status in (
        fc.Status.MINIMUM_STEP, fc.Status.NOT_FINITE, fc.Status.ENERGY_NOT_FINITE)


@pytest.mark.parametrize("preload", [0.0, 0.1])
def test_a_softening_spring_rests_beside_zero_elongation(preload):
    """At the root of N = 0 at which the spring still holds."""
    system = oscillator(PolynomialSpring("a.p", None, 50.0, -3e4, 0.0, UP, preload))
    rest = abs(height(system, fc.equilibrium(system).modal_coordinates))
    assert 50.0 * rest - 3e4 * rest**3 == pytest.approx(preload, abs=1e-9)
    assert 3.0 * 3e4 * rest**2 < 50.0


def test_period_of_a_polynomial_spring():
    """x'' + x + .3 x^2 + .2 x^3 + .5 x^5 = 0 against the integral of dx / v over the energy."""
    A, steps = 0.8, np.linspace(0.0, np.pi, 20001)
    spring = PolynomialSpring("a.p", None, 1.0, 0.2, direction=UP, quadratic_stiffness=0.3,
                              quintic_stiffness=0.5)
    run = fc.simulate(oscillator(spring, 1.0), 40.0, initial=released(oscillator(spring, 1.0), A),
                      rtol=1e-10, outputs=4001)

    def potential(x):
        return x**2 / 2.0 + 0.1 * x**3 + 0.05 * x**4 + 0.5 * x**6 / 6.0

    low = brentq(lambda x: potential(x) - potential(A), -2.0, -1e-6, xtol=1e-15)
    middle, half = (A + low) / 2.0, (A - low) / 2.0
    x = middle + half * np.cos(steps[1:-1])
    inner = half * np.sin(steps[1:-1]) / np.sqrt(2.0 * (potential(A) - potential(x)))
    ends = [np.sqrt(half / abs(z + 0.3 * z**2 + 0.2 * z**3 + 0.5 * z**5)) for z in (A, low)]
    values = np.concatenate([ends[:1], inner, ends[1:]])
    period = 2.0 * np.trapezoid(values, steps)
    y = run.displacement("a.p")[:, 1]
    count = int(40.0 / period)
    assert np.interp(count * period, run.time, y) == pytest.approx(A, abs=1e-4)
    assert y.min() == pytest.approx(low, abs=1e-4)
    # Energy is kept.
    assert abs(run.energies.imbalance) < 1e-6


@pytest.mark.parametrize(("parts", "exact"), [
    ({"quadratic_damping": 0.5}, lambda v, t: v / (1.0 + 0.25 * v * t)),
    ({"cubic_damping": 0.5}, lambda v, t: v / np.sqrt(1.0 + 0.5 * v**2 * t)),
])
@pytest.mark.parametrize("v", [3.0, -3.0])
def test_polynomial_dashpots_slow_a_mass(parts, exact, v):
    """2 v' = -.5 |v| v and 2 v' = -.5 v^3, in closed form."""
    system = oscillator(PolynomialSpring("a.p", None, direction=UP, **parts))
    run = fc.simulate(system, 4.0, initial=released(system, 0.0, v), rtol=1e-9, outputs=5)
    speed = run.velocity("a.p")[:, 1]
    assert speed == pytest.approx(np.sign(v) * exact(abs(v), run.time), rel=1e-6)


def test_polynomial_springs_are_checked():
    with pytest.raises(InputError, match="PolynomialSpring: all stiffnesses and dampings are zero"):
        PolynomialSpring("a.p", direction=UP)
    with pytest.raises(InputError, match="PolynomialSpring: cubic_damping = -1"):
        PolynomialSpring("a.p", direction=UP, cubic_damping=-1.0)
    with pytest.raises(InputError, match="direction"):
        PolynomialSpring("a.p", stiffness=1.0)
