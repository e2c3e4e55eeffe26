"""Branches of equilibria: published values of AUTO's demos, closed forms, section 4.4."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from systems import (
    belt,
    friction_slope,
    lorenz_field,
    mode_coupling,
    two_mass_field,
    two_mass_jacobian,
)

from fecontact import AnalysisError, ContactSystem, Ground, InputError, Load, basis_from_matrices
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    contact_field,
    equilibrium_branch,
    find_equilibrium,
    vector_field,
)
from fecontact.laws import ConstantFriction, LinearContact, LuGreFriction


def reactor(t, x, p, out):
    """AUTO-07p's demo ab."""
    rate = p[0] * (1.0 - x[0]) * np.exp(x[1])
    out[0] = -x[0] + rate
    out[1] = -x[1] + p[1] * rate - p[2] * x[1]


def predator(t, x, p, out):
    """AUTO-07p's demo pp2."""
    out[0] = p[1] * x[0] * (1.0 - x[0]) - x[0] * x[1] - p[0] * (1.0 - np.exp(-p[2] * x[0]))
    out[1] = -x[1] + p[3] * x[0] * x[1]


def reactor_branch(p2):
    field = vector_field(reactor, {"p1": 0.0, "p2": p2, "p3": 3.0}, 2)
    return equilibrium_branch(field, parameter="p1", bounds=(0.0, 0.5))


def parameters(branch, kind):
    return [point.parameter for point in branch.of_kind(kind)]


def test_reactor():
    plain = reactor_branch(14.0)
    assert [point.kind for point in plain.special] == ["Hopf", "Hopf"]
    assert parameters(plain, "Hopf") == pytest.approx([0.165042, 0.336550], abs=6e-7)
    folded = reactor_branch(17.0)
    assert parameters(folded, "Hopf") == pytest.approx([0.120866, 0.217081], abs=6e-7)
    assert parameters(folded, "fold") == pytest.approx([0.121901, 0.117015], abs=6e-7)
    # On a fold df/dp1 and the steady state give u (1 - u) p2 / (1 + p3) = 1.
    u = np.array([point.u[0] for point in folded.of_kind("fold")])
    assert u * (1.0 - u) * 17.0 / 4.0 == pytest.approx([1.0, 1.0], rel=1e-9)
    exact = u / (1.0 - u) * np.exp(-17.0 * u / 4.0)
    assert parameters(folded, "fold") == pytest.approx(exact, rel=1e-12)
    for branch in (plain, folded):
        counts = branch.column("unstable")
        regular = np.array([point.kind is None for point in branch])
        assert set(counts[regular]) == {0, 1, 2} - ({1} if branch is plain else set())
        assert (branch.column("stable") == (counts == 0)).all()


def test_predator_and_prey():
    field = vector_field(predator, {"p1": 0.0, "p2": 3.0, "p3": 5.0, "p4": 3.0}, 2)
    options = ContinuationOptions(bounds=(0.01, 1.0))
    trivial = equilibrium_branch(field, parameter="p1",
                                 options=ContinuationOptions(bounds=(0.0, 1.0)))
    assert parameters(trivial, "branch point") == pytest.approx([0.6], rel=1e-12)
    assert [point.kind for point in trivial.special] == ["branch point"]
    prey = equilibrium_branch(field, trivial.special[0], options=options)
    assert prey.column("state")[:, 1] == pytest.approx(np.zeros(len(prey)), abs=1e-12)
    assert sorted(parameters(prey, "branch point")) == pytest.approx([0.6, 0.821904], abs=6e-7)
    fold, = prey.of_kind("fold")
    assert fold.parameter == pytest.approx(0.832929, abs=6e-7)
    assert fold.u[0] == pytest.approx(0.411162, abs=6e-7)
    crossing = max(prey.of_kind("branch point"), key=lambda point: point.parameter)
    both = equilibrium_branch(field, crossing, options=options)
    hopf, = both.of_kind("Hopf")
    assert hopf.parameter == pytest.approx(0.671594, abs=6e-7)
    assert hopf.u[:2] == pytest.approx([1.0 / 3.0, 0.365762], abs=6e-7)
    alone = replace(crossing, _details={})
    with pytest.raises(InputError, match=r"p1 = 0\.821904 \(branch point\) has no other_tangent"):
        equilibrium_branch(field, alone)


def test_lorenz():
    """Pitchfork at 1; Hopf at 470/19, subcritical, with w^2 = b (sigma + rho)."""
    field = lorenz_field()
    zero = equilibrium_branch(field, [0.0, 0.0, 0.0], "rho", bounds=(0.5, 30.0), direction=-1.0,
                              both=True)
    fork, = zero.of_kind("branch point")
    assert fork.parameter == pytest.approx(1.0, rel=1e-10)
    other = equilibrium_branch(field, fork, bounds=(0.0, 30.0))
    assert len(other.of_kind("Hopf")) == 2
    assert np.sign([point.u[0] for point in other.of_kind("Hopf")]).sum() == 0.0
    for hopf in other.of_kind("Hopf"):
        assert hopf.parameter == pytest.approx(470.0 / 19.0, rel=1e-11)
        w = np.sqrt(8.0 / 3.0 * (10.0 + 470.0 / 19.0))
        assert hopf.angular_frequency == pytest.approx(w, rel=1e-11)
        assert hopf.period == pytest.approx(0.65283, abs=6e-6)
        assert hopf.criticality == "subcritical"
    x = other.column("state")
    assert x[:, 0] ** 2 == pytest.approx(8.0 / 3.0 * (other.parameter - 1.0), abs=1e-6)


def test_first_lyapunov_coefficient():
    """Guckenheimer and Holmes (3.4.11) for x' = y, y' = b + c x + x^2 - x y gives a = -1/8."""
    def quadratic(t, x, p, out):
        out[0] = x[1]
        out[1] = p[0] + p[1] * x[0] + x[0] * x[0] - x[0] * x[1]

    field = vector_field(quadratic, {"b": -0.5, "c": -1.0}, 2)
    hopf, = equilibrium_branch(field, [-0.4, 0.0], "b", bounds=(-1.0, 0.1)).of_kind("Hopf")
    assert hopf.parameter == pytest.approx(0.0, abs=1e-12)
    assert hopf.first_lyapunov == pytest.approx(2.0 * -0.125, rel=1e-8)
    assert hopf.criticality == "supercritical"
    assert hopf.first_lyapunov_error < 1e-8

    def landau(t, x, p, out):
        r = x[0] * x[0] + x[1] * x[1]
        out[0] = (p[0] + p[1] * r) * x[0] - 2.0 * x[1]
        out[1] = (p[0] + p[1] * r) * x[1] + 2.0 * x[0]

    # z' = (r + 2i) z + c |z|^2 z; along the unit eigenvector |z|^2 = 2 |zeta|^2, so l1 = 2 c / w.
    for c, kind in ((-1.0, "supercritical"), (0.7, "subcritical")):
        field = vector_field(landau, {"r": -0.5, "c": c}, 2)
        hopf, = equilibrium_branch(field, parameter="r", bounds=(-1.0, 1.0)).of_kind("Hopf")
        assert hopf.parameter == pytest.approx(0.0, abs=1e-13)
        assert hopf.first_lyapunov == pytest.approx(2.0 * c / 2.0, rel=1e-9)
        assert hopf.criticality == kind
        assert hopf.crossing_speed == pytest.approx(1.0, rel=1e-9)


def exact_hopf(v0, low, high):
    """B at which the equations of section 4.4 have a pair on the imaginary axis."""
    def growth(B):
        eigenvalues = np.linalg.eigvals(two_mass_jacobian(B, v0))
        pairs = eigenvalues[eigenvalues.imag > 0.0].real
        return pairs[np.argmin(np.abs(pairs))]
    return brentq(growth, low, high, xtol=1e-14, rtol=1e-14)


def test_two_masses_over_the_normal_force():
    """H1 at 1.1834 (the print's 1.12 seems wrong), H2 at 7.09, nothing stationary."""
    branch = equilibrium_branch(two_mass_field(0.5), parameter="B", bounds=(0.0, 12.0))
    assert [point.kind for point in branch.special] == ["Hopf", "Hopf"]
    first, second = branch.special
    assert first.parameter == pytest.approx(exact_hopf(1.0, 1.0, 1.4), rel=1e-11)
    assert second.parameter == pytest.approx(exact_hopf(1.0, 6.8, 7.3), rel=1e-11)
    assert first.parameter == pytest.approx(1.1834, abs=5e-5)
    assert second.parameter == pytest.approx(7.09, abs=5e-3)
    # Equilibrium and orbit coexist below H1, so the unstable orbit is born there.
    assert first.criticality == "subcritical"
    for point in branch.special:
        h = 1e-5
        growth = [np.min(np.abs(np.linalg.eigvals(two_mass_jacobian(B, 1.0))
                                - (1j * point.angular_frequency + 1.0)))
                  for B in (point.parameter - h, point.parameter + h)]
        slope = (growth[0] - growth[1]) / (2.0 * h)
        assert point.crossing_speed == pytest.approx(slope, rel=1e-6)
    assert branch.status is BranchStatus.BOUND
    assert len(branch) < 120


def test_two_masses_over_the_belt_speed():
    """B mu'(v_0) has the same values as at H2 and H1 of the other diagram."""
    branch = equilibrium_branch(two_mass_field(20.0, 4.5), parameter="ground.speed",
                                bounds=(1.0, 4.5), direction=-1.0)
    assert [point.kind for point in branch.special] == ["Hopf", "Hopf"]
    slopes = [20.0 * friction_slope(point.parameter) for point in branch.special]
    expected = [B * friction_slope(1.0) for B in (exact_hopf(1.0, 1.0, 1.4),
                                                  exact_hopf(1.0, 6.8, 7.3))]
    assert slopes == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize(("slope", "speed"), [(1e6, 8.336533e-3), (1e15, 8.424483793e-3)])
def test_belt(slope, speed):
    """The oscillator of section 4; unsmoothed, V = ln[N (mu_0 - mu_inf) lambda / b] / lambda."""
    field = contact_field(belt(slope), ["ground.speed"])
    branch = equilibrium_branch(field, parameter="ground.speed", bounds=(2e-3, 12e-3),
                                direction=-1.0)
    hopf, = branch.special
    assert hopf.parameter == pytest.approx(speed, rel=6e-8 if slope < 1e9 else 1e-9)
    assert hopf.angular_frequency == pytest.approx(np.sqrt(5610.0 / 5.632), rel=1e-9)
    assert hopf.criticality == "subcritical"
    if slope > 1e9:
        # q'' + w^2 q = e q'^3 grows as A' = 3/8 e w^2 A^3, e = -F mu''' / (6 m^2); the unit
        # eigenvector (1, i w) / sqrt(1 + w^2) makes A = 2 |z| / sqrt(1 + w^2), l1 = c1 / w.
        w = np.sqrt(5610.0 / 5.632)
        e = 14.0 * 0.25 * 1000.0**3 * np.exp(-1000.0 * speed) / (6.0 * 5.632**2)
        assert hopf.first_lyapunov == pytest.approx(1.5 * e * w / (1.0 + w * w),
                                                    rel=1e-6)


def test_mode_coupling_with_damping():
    """With damping c I the pair crosses at mu = 3/4 (1 + 2 c^2), w = sqrt 2."""
    c = 0.1
    field = contact_field(mode_coupling(c), ["friction.friction_coefficient"])
    branch = equilibrium_branch(field, parameter="friction.friction_coefficient", bounds=(0.0, 1.0))
    hopf, = branch.special
    assert hopf.kind == "Hopf"
    assert hopf.parameter == pytest.approx(0.75 * (1.0 + 2.0 * c * c), rel=1e-7)
    assert hopf.angular_frequency == pytest.approx(np.sqrt(2.0), rel=1e-7)
    # The equations are linear but for the smoothed sign, far from the origin.
    assert branch.column("unstable")[[0, -1]].tolist() == [0, 2]


def test_undamped_modes_are_neither_unstable_nor_crossing():
    """Pairs on the imaginary axis are round-off away from it; only their meeting counts."""
    field = contact_field(mode_coupling(), ["friction.friction_coefficient"])
    branch = equilibrium_branch(field, parameter="friction.friction_coefficient", bounds=(0.0, 1.0))
    assert [round(point.parameter, 3) for point in branch.special] in ([], [0.75])
    counts, mu = branch.column("unstable"), branch.parameter
    assert (counts[mu < 0.749] == 0).all()
    assert (counts[mu > 0.751] == 2).all()


def test_neutral_saddles_are_not_reported():
    """Two real eigenvalues of opposite sign, beside a pair whose damping changes."""
    def saddle(t, x, p, out):
        out[0] = (1.0 + p[0]) * x[0]
        out[1] = -x[1]
        out[2] = (0.1 * p[0] - 0.3) * x[2] - x[3]
        out[3] = (0.1 * p[0] - 0.3) * x[3] + x[2]

    field = vector_field(saddle, {"a": -0.5}, 4)
    assert equilibrium_branch(field, parameter="a", bounds=(-0.9, 0.9)).special == ()


def test_pairs_on_the_axis_do_not_cross_it():
    """Three undamped oscillators whose coupling depends on the parameter: all real parts zero."""
    def chain(t, x, p, out):
        for i in range(3):
            out[i] = x[3 + i]
            out[3 + i] = -(i + 1.3) * x[i]
            for j in range(3):
                out[3 + i] -= p[0] * (0.2 + 0.1 * (i + 1) * (j + 1)) * x[j]

    field = vector_field(chain, {"a": 0.1}, 6)
    branch = equilibrium_branch(field, parameter="a", bounds=(0.0, 2.0),
                                options=ContinuationOptions( step=0.005, largest_step=0.005))
    assert len(branch) > 150
    assert branch.special == ()
    assert branch.column("stable").all()


def test_pitchfork_passed_on_the_bent_branch_is_no_fold():
    def pitchfork(t, x, p, out):
        out[0] = p[0] * x[0] - x[0] * x[0] * x[0]

    field = vector_field(pitchfork, {"a": 0.49}, 1)
    branch = equilibrium_branch(field, [-0.7], "a", bounds=(-0.5, 0.5), direction=-1.0)
    assert branch.points[-1].u == pytest.approx([np.sqrt(0.5), 0.5], rel=1e-9)
    assert [point.kind for point in branch.special] == ["branch point"]
    assert branch.special[0].u == pytest.approx([0.0, 0.0], abs=1e-7)


def test_restart_at_any_point():
    branch = reactor_branch(17.0)
    field = vector_field(reactor, {"p1": 0.0, "p2": 17.0, "p3": 3.0}, 2)
    point = branch.points[len(branch) // 2]
    start = find_equilibrium(field, {"p1": point.parameter}, start=point.u[:-1])
    again = equilibrium_branch(field, start, "p1", bounds=(0.0, 0.5), both=True)
    assert sorted(parameters(again, "Hopf")) == pytest.approx(sorted(parameters(branch, "Hopf")),
                                                              rel=1e-10)
    assert sorted(parameters(again, "fold")) == pytest.approx(sorted(parameters(branch, "fold")),
                                                              rel=1e-10)


def test_body_that_is_lifted_off_has_no_equilibrium():
    """Without load the mass may float at any height; with a pull none is found."""
    rows = np.zeros((1, 3, 2))
    rows[0, 0, 0] = rows[0, 1, 1] = 1.0
    basis = basis_from_matrices(np.eye(2), np.diag([1.0, 0.0]),
                                {"contact": rows, "C": rows[0]}, damping=0.1 * np.eye(2))
    system = ContactSystem(basis, normal=LinearContact(4.0), ground=Ground(speed=1.0),
                           friction=ConstantFriction(0.3, 1e3), load=Load(1.0))
    field = contact_field(system, ["load.normal"])
    branch = equilibrium_branch(field, parameter="load.normal", bounds=(-1.0, 1.0), direction=-1.0)
    assert branch.parameter[-1] == pytest.approx(0.0, abs=1e-6)
    assert branch.parameter.min() > -1e-6
    # Normal to the ground the contact spring of 4 carries the load, or nothing does.
    height = np.array([field.displacement_row("C", "y") @ point.u[:-1] for point in branch.points])
    assert np.minimum(height, 0.0) == pytest.approx(-branch.parameter / 4.0, abs=1e-6)
    with pytest.raises(AnalysisError, match=r"No equilibrium was found for load\.normal = -1"):
        find_equilibrium(field, {"load.normal": -1.0}, start=branch.points[-1].u[:-1])


def test_parameter_leaves_its_range():
    """A coefficient cannot be negative: the branch ends there and says why."""
    field = contact_field(mode_coupling(0.1), ["friction.friction_coefficient"])
    branch = equilibrium_branch(field, parameter="friction.friction_coefficient",
                                bounds=(-1.0, 1.0), direction=-1.0)
    assert branch.status is BranchStatus.STALLED
    assert branch.parameter[-1] == pytest.approx(0.0, abs=1e-5)
    assert "friction_coefficient = " in branch.message
    with pytest.raises(InputError, match="no parameter 'mu'"):
        equilibrium_branch(field, parameter="mu")


def test_friction_with_memory():
    """LuGre's bristles: Hurwitz' condition of m l^3 + (b + m a) l^2 + (c + b a + F a g') l + c a,
    a = sigma_0 V / g(V)."""
    static, kinetic, v_s, sigma = 0.8, 0.55, 2e-3, 1e5
    law = LuGreFriction(static, kinetic, v_s, 1.0, sigma)
    field = contact_field(belt(speed=5e-3).with_(friction=law), ["ground.speed"])
    branch = equilibrium_branch(field, parameter="ground.speed", bounds=(1e-3, 40e-3))
    hopf, = branch.special
    m, b, c, F = 5.632, 0.768, 5610.0, 14.0

    def hurwitz(V):
        fall = (static - kinetic) * np.exp(-V / v_s)
        a = sigma * V / (kinetic + fall)
        return (b + m * a) * (c + b * a - F * a * fall / v_s) - m * c * a

    assert hopf.parameter == pytest.approx(brentq(hurwitz, 8e-3, 25e-3, xtol=1e-16), rel=1e-10)
    assert branch.column("unstable")[[0, -1]].tolist() == [2, 0]


def chained(t, x, p, out):
    # Nearly linear, with states of 3,000 times the parameter.
    out[0] = 3000.0 * p[0] - x[0] + 1e-3 * x[1]
    out[1] = -2.0 * x[1] + x[0] + 0.01 * x[0] ** 2 / 3000.0


def test_steps_along_straight_branches_grow():
    """Steps are measured by the parameter: 20 steps of a twentieth, and some to get there."""
    field = vector_field(chained, {"p": 0.0}, 2)
    for high in (1.0, 30.0):
        branch = equilibrium_branch(field, np.zeros(2), bounds=(0.0, high))
        assert branch.status is BranchStatus.BOUND
        assert len(branch) < 60
        assert np.diff(branch.parameter).max() <= 0.0501 * high
        assert branch.end == BranchStatus.BOUND.value
    short = equilibrium_branch(field, np.zeros(2), bounds=(0.0, 1.0),
                               options=ContinuationOptions(points=12))
    assert short.end == (f"The branch has as many points as were asked for and ends at p = "
                         f"{short.points[-1].parameter:.6g}: raise points = 12 to go on, or "
                         f"largest_step to go farther with each.")
