"""One meshed sector under engine order against the whole wheel of finite elements."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from sectors import shrouded_sector, whole_wheel

from fecontact import (
    ContactSystem,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    ModelWarning,
    PointLoad,
    Rayleigh,
    basis_from_matrices,
    modal_basis,
    static_solution,
)
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    contact_field,
    frequency_response,
    nonlinear_mode,
    orbit_branch,
    wheel_motion,
    wheel_stability,
    wheel_system,
)
from fecontact.bifurcation.harmonic.starts import problem_for
from fecontact.bifurcation.nonlinear_modes.linear_start import (
    field_over_xi,
    unforced,
    with_mass_damping,
)
from fecontact.fem import CyclicSymmetry, Rotation, pair_faces
from fecontact.fem.points import place_rows
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce
from fecontact.reduction import WholeWheel, cyclic_basis
from fecontact.reduction.assembly.assembled_basis import node_frames

N = 4
SYMMETRY = CyclicSymmetry("low", "high", N)
NAME = "load.forces.0.signal.frequency_hz"
NORMAL, FRICTION, FORCE = 20.0, JenkinsFriction(2e7, 0.3), 200.0
DAMPING = Rayleigh(20.0, 1e-7)


def shroud(body):
    return pair_faces({"s": body, **SYMMETRY.next_sector({"s": body})}, "s.right", "next_s.left")


@pytest.fixture(scope="module")
def sector():
    return ElasticBody(shrouded_sector(N), thickness=0.02, degree=1, fixed={"root": "xy"})


@pytest.fixture(scope="module")
def wheel(sector):
    """With all modes of the mesh."""
    return cyclic_basis({"s": sector}, SYMMETRY, {"shroud": shroud(sector)}, modes=1000,
                        points={"s.tip": "tip"}, damping=DAMPING)


def system_of(wheel, hertz, normal=NORMAL):
    return ContactSystem(
        wheel.basis, normal=PrescribedForce(normal), friction=FRICTION, gap=wheel.gaps,
        load=Load(forces=(PointLoad("s.tip", "y", signal=Harmonic(FORCE, hertz)),)))


def first_hz(wheel, order):
    return float(np.sqrt(np.linalg.eigvalsh(wheel.of(order).stiffness)[0])) / (2.0 * np.pi)


def response(system, bounds, points=1, observe=("s.tip", "y"), harmonics=(0, 1, 3), **options):
    return frequency_response(
        system, bounds, NAME,
        observe=observe, options=ContinuationOptions(points=points, largest_step=0.1),
        method=HarmonicBalance(list(harmonics), 48, stability=None, **options))


def every_sector(sector, order, hertz, deviations=(0.0,) * N, nodes=False):
    """The wheel of finite elements with its contact rows, independent of the modes of a sector.

    All nodes are points if asked for, 'node0.5' that of number 5 of sector 0.

    The modulus of each blade deviates from that of steel; damping is that of the tuned wheel.
    """
    mesh, count = whole_wheel(sector.mesh, SYMMETRY), len(sector.mesh.cells)
    groups = {f"blade {s}": count * s + sector.mesh.cell_groups["blade"] for s in range(N)}
    groups["rest"] = np.setdiff1d(np.arange(count * N), np.concatenate(list(groups.values())))
    moduli = dict(zip(groups, (*deviations, 0.0), strict=True))
    body, tuned = (ElasticBody(
        Mesh(mesh.nodes, mesh.cells, mesh.boundaries, cell_groups=groups),
        {name: Material(2.1e11 * (1.0 + part * moduli[name])) for name in groups},
        thickness=0.02, degree=1, fixed={"root": "xy"}) for part in (1.0, 0.0))
    pairing, E = shroud(sector), body.expansion
    frames, count = node_frames(pairing.normals), len(sector.nodes)

    def rows(matrix, s):
        """Rows over a sector in its own directions, over the wheel."""
        turned = matrix @ sp.kron(sp.eye_array(count), SYMMETRY.rotation(2, s).T)
        places = SYMMETRY.turned(sector.nodes, s)
        nodes = np.linalg.norm(places[:, None] - body.nodes[None], axis=2).argmin(axis=1)
        found = np.zeros((matrix.shape[0], body.unknowns))
        found[:, (2 * nodes[:, None] + np.arange(2)).ravel()] = turned.toarray()
        return found @ E

    tip = place_rows(sector, "tip", "tip").matrix
    feet = pairing.feet @ sp.kron(sp.eye_array(count), SYMMETRY.rotation(2))
    contact = np.concatenate([
        rows(frames @ pairing.nodes, s) - rows(frames @ feet, (s + 1) % N) for s in range(N)])
    unit = np.eye(3, 2 * count)
    every = {f"node{s}.{k}": rows(sp.csr_array(np.roll(unit, 2 * k, axis=1)), s)
             for s in range(N) for k in range(count)} if nodes else {}
    mass, stiffness, steel = ((E.T @ one @ E).toarray() for one in (
        body.mass, body.stiffness, tuned.stiffness))
    basis = basis_from_matrices(
        mass, stiffness,
        {"contact": contact.reshape(-1, 3, E.shape[1]), **{
            f"tip{s}": rows(tip, s) for s in range(N)}, **every},
        damping=DAMPING.mass_factor * mass + DAMPING.stiffness_factor * steel,
        tributary=np.tile(pairing.tributary, N))
    return ContactSystem(
        basis, normal=PrescribedForce(N * NORMAL), friction=JenkinsFriction(
            N * FRICTION.stiffness, FRICTION.friction_coefficient),
        load=Load(forces=tuple(PointLoad(f"tip{s}", "y", signal=Harmonic(
            FORCE, hertz, -2.0 * np.pi * order * s / N)) for s in range(N))))


def excited(system, hertz):
    return system.with_({f"load.forces.{k}.signal.frequency_hz": hertz for k in range(N)})


def response_of_all(system, bounds, observe):
    """First point of the response of all sectors, whose forces have one frequency."""
    field = contact_field(system, {"w": (bounds[0], excited)})
    return frequency_response(field, bounds, "w", observe=observe,
                              options=ContinuationOptions(points=1),
                              method=HarmonicBalance([0, 1, 3], 48, stability=None))


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_one_sector_is_the_whole_wheel_of_finite_elements(sector, wheel, order):
    """To 1e-9, slipping: double, single, backward waves, and all alike; 34 unknowns a sector."""
    hertz = (0.9 if order == N else 1.012) * first_hz(wheel, order)
    bounds = hertz, 1.01 * hertz
    one = response(system_of(wheel, hertz), bounds, repeats=EngineOrder(wheel, order))
    every = response_of_all(every_sector(sector, order, hertz), bounds, ("tip0", "y"))
    assert one.harmonic(1)[0] == pytest.approx(every.harmonic(1)[0], rel=1e-9)
    sticking = response(system_of(wheel, hertz, 1e6), bounds, repeats=EngineOrder(wheel, order))
    # Neighbours in antiphase do not move along each other.
    if order != 2:
        assert abs(one.amplitude()[0] / sticking.amplitude()[0] - 1.0) > 1e-3
    assert one.branches[0].attributes["engine_order"] == order


def test_a_mistuned_wheel_with_friction_is_that_of_finite_elements(sector, wheel):
    """To 1e-9, slipping; blades with moduli of their own."""
    deviations = np.array([0.06, -0.04, 0.02, -0.07])
    hertz = 1.012 * first_hz(wheel, 1)
    bounds = hertz, 1.01 * hertz
    whole = WholeWheel(wheel, deviations, "s.blade")
    every, tips = every_sector(sector, 1, hertz, deviations), []
    for s in range(2):
        one = response_of_all(wheel_system(system_of(wheel, hertz), whole, 1), bounds,
                              (f"{s}.s.tip", "y")).harmonic(1)[0]
        other = response_of_all(every, bounds, (f"tip{s}", "y")).harmonic(1)[0]
        assert one == pytest.approx(other, rel=1e-9)
        tips.append(abs(one))
    assert abs(tips[0] / tips[1] - 1.0) > 1e-2
    sticking = response_of_all(wheel_system(system_of(wheel, hertz, 1e6), whole, 1), bounds,
                               ("0.s.tip", "y")).amplitude()[0]
    assert abs(tips[0] / sticking - 1.0) > 1e-3


def mode_of(wheel, order, bounds=(1e-7, 1e-4), number=1):
    return nonlinear_mode(
        system_of(wheel, 1.0), bounds, number, observe=("s.tip", "y"),
        options=ContinuationOptions(points=2000, step=0.1, largest_step=0.3, tolerance=1e-12),
        method=HarmonicBalance([0, 1, 3], 48, stability=None, repeats=EngineOrder(wheel, order)))


@pytest.mark.parametrize(("order", "number"), [(1, 1), (2, 1), (3, 1), (4, 2)])
def test_nonlinear_mode_of_a_wave_is_one_of_the_whole_wheel(sector, wheel, order, number):
    """The mode satisfies the equations of all sectors, with the same xi, to 1e-9."""
    mode = mode_of(wheel, order, number=number)
    index = int(np.argmax(mode.damping_ratio)) if order != 2 else len(mode) // 2
    point = mode.branch.points[index]
    field = EngineOrder(wheel, order).field(contact_field(system_of(wheel, 1.0), [NAME]))
    motion = wheel_motion(field, point)
    whole = contact_field(unforced(every_sector(sector, order, 1.0, nodes=True)), {
        "xi": (point.parameter, with_mass_damping)})
    basis, count = whole.system().basis, len(sector.nodes)
    T = np.concatenate([basis.T[basis.point_index(f"node{s}.{k}"), :2]
                        for s in range(N) for k in range(count)])
    X = np.zeros((7, basis.modes))
    for h in (0, 1, 3):
        shapes = np.concatenate([motion.harmonic("s", h, s).ravel() for s in range(N)])
        q, *_ = np.linalg.lstsq(T, shapes, rcond=None)
        assert T @ q == pytest.approx(shapes, abs=1e-9 * np.abs(shapes).max())
        X[max(0, 2 * h - 1)] = q.real
        if h:
            X[2 * h] = -q.imag
    problem = problem_for(whole, whole.values, 0, HarmonicBalance([0, 1, 3], 48),
                          np.ones(whole.dimension + 2))
    rest = np.zeros(whole.dimension)
    rest[: basis.modes] = X[0]
    problem = replace(problem, kept=problem.kept.left_by(rest[None]))
    u = np.concatenate([X.ravel(), [motion.period, point.parameter]])
    size = (2.0 * np.pi / motion.period) ** 2 * np.abs(X).max()
    assert np.abs(problem.linearise(u).residual[:-1]).max() < 1e-9 * size
    # The equations are not met with another damping.
    u[-1] *= 1.01
    assert np.abs(problem.linearise(u).residual[:-1]).max() > 1e-6 * size
    # Kinetic energy of the wheel is that of N sectors.
    speeds = 2.0 * np.pi / motion.period * np.repeat([0, 1, 2, 3], 2)[1:, None] * X
    assert N * point.values["mean_square_velocity"] == pytest.approx(
        0.5 * (speeds**2).sum(), rel=1e-8)


def test_nonlinear_mode_of_a_wave_begins_stuck_and_ends_free(wheel):
    """Frequencies of the sector with the contact closed and without; damping of the material."""
    mode, one = mode_of(wheel, 1, bounds=(1e-7, 1e-2)), wheel.of(1)
    nodes = one.T[2 : 2 + wheel.basis.contact_nodes, 0]
    shares = wheel.basis.tributary / wheel.basis.tributary.sum()
    stuck = one.stiffness + FRICTION.stiffness * (nodes.conj().T * shares) @ nodes
    for K, w in ((stuck, mode.angular_frequency[0]), (one.stiffness, mode.angular_frequency[-1])):
        assert w == pytest.approx(np.sqrt(np.linalg.eigvalsh(K)[0]), rel=2e-5)
    w, shapes = np.linalg.eigh(stuck)
    damping = (shapes[:, 0].conj() @ one.damping @ shapes[:, 0]).real
    assert mode.xi[0] == pytest.approx(damping, rel=1e-4)
    assert mode.damping_ratio.max() > 5.0 * mode.damping_ratio[0]
    # A slipping node with constant normal force loses 4 mu N times its slip amplitude a period.
    free = 0.5 * (DAMPING.mass_factor / mode.angular_frequency[-1]
                  + DAMPING.stiffness_factor * mode.angular_frequency[-1])
    assert mode.damping_ratio[-1] == pytest.approx(free, rel=2e-3)


def test_waves_that_run_against_each_other_are_one_mode(wheel):
    """Orders 1 and 3 of 4 sectors, without rotation; the forward wave is the backward one."""
    first, second = (mode_of(wheel, order, (1e-7, 1e-6)) for order in (1, 3))
    at = np.interp(4e-7, first.amplitude, first.frequency_hz)
    assert np.interp(4e-7, second.amplitude, second.frequency_hz) == pytest.approx(at, rel=1e-3)


def test_mode_of_a_wave_at_an_amplitude_and_a_frequency(wheel):
    """Between two points of the mode, beside which both are the same solution."""
    mode, wave = mode_of(wheel, 1, (1e-7, 2e-6)), EngineOrder(wheel, 1)
    system = system_of(wheel, 1.0)
    found = mode.at(system, amplitude=7e-7, wave=wave)
    assert found.amplitude[0] == pytest.approx(7e-7, rel=1e-6)
    place = int(np.searchsorted(mode.amplitude, 7e-7))
    ends = mode.frequency_hz[place - 1 : place + 1]
    assert ends[1] < found.frequency_hz[0] < ends[0]
    again = mode.at(system, frequency_hz=found.frequency_hz[0], wave=wave)
    assert again.amplitude[0] == pytest.approx(7e-7, rel=1e-4)


def test_modes_of_waves_refuse_what_does_not_fit(sector, wheel):
    mode, wave = mode_of(wheel, 1, (1e-7, 2e-7)), EngineOrder(wheel, 1)
    with pytest.raises(InputError, match=r"give wave=EngineOrder\(wheel, 1\)"):
        mode.at(system_of(wheel, 1.0), amplitude=1.5e-7)
    with pytest.raises(InputError, match=r"give wave=EngineOrder\(wheel, 1\)"):
        mode.at(system_of(wheel, 1.0), amplitude=1.5e-7, wave=EngineOrder(wheel, 3))
    field = wave.field(contact_field(system_of(wheel, 1.0), [NAME]))
    with pytest.raises(InputError, match="take a point of a response"):
        wheel_stability(field, mode.branch.points[0])
    with pytest.raises(InputError, match="from 1 to 34"):
        mode_of(wheel, 1, number=99)
    with pytest.raises(InputError, match="is for contact systems"):
        nonlinear_mode(field, (1e-7, 1e-6), observe=("s.tip", "y"),
                       method=HarmonicBalance([0, 1], stability=None, repeats=wave))


def test_few_modes_suffice(sector, wheel):
    """Six modes of each diameter, and residual vectors of contact nodes and tip."""
    few = cyclic_basis({"s": sector}, SYMMETRY, {"shroud": shroud(sector)}, modes=6,
                       points={"s.tip": "tip"}, damping=DAMPING, diameters=[1])
    assert len(few.of(1).stiffness) < 20
    hertz = 1.012 * first_hz(wheel, 1)
    found = [response(system_of(one, hertz), (hertz, 1.01 * hertz), harmonics=(0, 1, 3),
                      repeats=EngineOrder(one, 1)).amplitude()[0] for one in (few, wheel)]
    assert found[0] == pytest.approx(found[1], rel=1e-4)


def test_wave_over_the_wheel_and_its_stability(sector):
    """The motion of the sector, and multipliers of the whole wheel near the same orbit."""
    few = cyclic_basis({"s": sector}, SYMMETRY, {"shroud": shroud(sector)}, modes=2,
                       points={"s.tip": "tip"}, damping=DAMPING)
    hertz = first_hz(few, 1)
    system, wave = system_of(few, hertz), EngineOrder(few, 1)
    found = response(system, (0.99 * hertz, 1.04 * hertz), points=12, repeats=wave)
    field, point = wave.field(contact_field(system, [NAME])), found.peak()
    motion = wheel_motion(field, point)
    tip, times = sector.mesh.points["tip"], np.linspace(0.0, motion.period, 200)
    seen = np.array([motion.displacement("s", t)[tip, 1] for t in times]).ravel()
    assert 0.5 * np.ptp(seen) == pytest.approx(found.amplitude().max(), rel=1e-3)
    later = motion.displacement("s", 0.1 * motion.period, sector=1)
    assert later == pytest.approx(motion.displacement("s", -0.15 * motion.period), abs=1e-15)
    stability = wheel_stability(field, point)
    assert stability.stable
    assert stability.difference < 1e-8
    assert np.abs(stability.multipliers).max() < 1.0
    again = orbit_branch(field, point, options=ContinuationOptions(points=2, step=0.01))
    assert again.points[0].parameter == pytest.approx(point.parameter)


def test_whole_wheel_has_the_frequencies_of_finite_elements(sector, wheel):
    body = ElasticBody(whole_wheel(sector.mesh, SYMMETRY), thickness=0.02, degree=1,
                       fixed={"root": "xy"})
    E = body.expansion
    from scipy.linalg import eigh

    expected = eigh(*((E.T @ one @ E).toarray() for one in (body.stiffness, body.mass)),
                    eigvals_only=True)
    assert np.linalg.eigvalsh(WholeWheel(wheel).stiffness) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", [NAME, "load.forces.0.signal.amplitude", "xi"])
def test_derivatives_of_a_wave_are_differences_of_its_equations(sector, name):
    """To all coefficients, to the parameter, which changes the period or does not, and to both."""
    few = cyclic_basis({"s": sector}, SYMMETRY, {"shroud": shroud(sector)}, modes=3,
                       points={"s.tip": "tip"}, damping=DAMPING, diameters=[0, 1])
    hertz = 1.01 * first_hz(few, 1)
    system, wave = system_of(few, hertz), EngineOrder(few, 1)
    field = (field_over_xi(system, 30.0, wave) if name == "xi"
             else wave.field(contact_field(system, [name])))
    method = HarmonicBalance([0, 1, 3], 48, stability=None)
    problem = problem_for(field, field.values, 0, method, np.ones(field.dimension + 2))
    size = 1e-6 * np.random.default_rng(3).normal(size=problem.size)
    size[problem.left_out] = 0.0
    period = [1.0 / hertz] if problem.autonomous else []
    u = np.concatenate([size, period, field.values])
    unit = np.append(np.full(problem.size, 1e-11), 1e-5 * u[problem.size :])
    found, turns = problem.linearise(u).condensed, np.diag(unit)
    # Coefficients that are left out stay zero.
    assert problem.autonomous == (name == "xi")
    for k in np.delete(np.arange(len(u)), problem.left_out):
        ends = [problem.linearise(u + sign * turns[k]).residual for sign in (1.0, -1.0)]
        expected = (ends[0] - ends[1]) / (2.0 * unit[k])
        assert found[:, k] == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


def eigenvalues(stiffness, damping):
    """Eigenvalues of q'' + C q' + K q = 0."""
    n = len(stiffness)
    return np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]]))


def test_a_turning_wheel_has_the_frequencies_of_finite_elements(sector):
    """Coriolis and centrifugal terms of one sector, by diameters, and those of the whole wheel."""
    rotation = Rotation(2000.0)
    body = ElasticBody(whole_wheel(sector.mesh, SYMMETRY), thickness=0.02, degree=1,
                       fixed={"root": "xy"})
    basis = modal_basis(body, body.expansion.shape[1], contact=(), rotation=rotation)
    expected = eigenvalues(basis.stiffness, basis.damping)
    turning = cyclic_basis({"s": sector}, SYMMETRY, {"shroud": shroud(sector)}, modes=1000,
                           rotation=rotation)
    found = np.concatenate([
        turned for one in turning.diameters
        for values in [eigenvalues(one.stiffness, one.damping)]
        for turned in ([values] if SYMMETRY.is_real(one.diameter) else [values, values.conj()])])
    assert np.sort(found.imag) == pytest.approx(np.sort(expected.imag), rel=1e-7, abs=1e-2)
    still = cyclic_basis({"s": sector}, SYMMETRY, {"shroud": shroud(sector)}, modes=1000)
    assert abs(first_hz(turning, 1) / first_hz(still, 1) - 1.0) > 1e-3


def test_stress_of_a_static_state_stiffens_as_that_of_the_rotation(sector):
    """The state under the centrifugal force, in modes at rest, is the one that rotation takes."""
    def made(**given):
        return cyclic_basis({"s": sector}, SYMMETRY, {"shroud": shroud(sector)}, modes=1000,
                            **given)

    rest, plain = made(), Rotation(2000.0, stress_stiffening=False)
    load = made(rotation=plain).basis.constant_load
    q = load / rest.basis.angular_frequencies**2
    stressed = made(rotation=plain, prestress={"s": rest.fields(q, "s")})
    turning, softer = made(rotation=Rotation(2000.0)), made(rotation=plain)
    for k in range(3):
        one, other, without = (np.linalg.eigvalsh(each.of(k).stiffness)[:5]
                               for each in (stressed, turning, softer))
        assert one == pytest.approx(other, rel=1e-8)
        assert (other > without * 1.0001).any()


def test_heat_and_rotation_are_those_of_the_whole_wheel(sector):
    """Displacement and stress, and frequencies with this stress; few modes suffice for the load."""
    warm = Material(2.1e11, thermal_expansion=1.2e-5)
    plain = Rotation(2000.0, stress_stiffening=False)
    options = {"thickness": 0.02, "degree": 1, "fixed": {"root": "xy"}}
    body = ElasticBody(sector.mesh, warm, **options)
    whole = ElasticBody(whole_wheel(sector.mesh, SYMMETRY), warm, **options)

    def heat(x, y):
        return 300.0 * np.hypot(x, y) ** 2

    def made(modes, **given):
        return cyclic_basis({"s": body}, SYMMETRY, {"shroud": shroud(body)}, modes=modes,
                            rotation=plain, temperature={"s": heat}, **given)

    few = made(2)
    # The load of the wheel without deflections, as in static_solution.
    state = few.fields(few.basis.constant_load / few.basis.angular_frequencies**2, "s")
    expected = static_solution(whole, Load(), rotation=plain, temperature=heat)
    nodes = np.linalg.norm(body.nodes[:, None] - whole.nodes[None], axis=2).argmin(axis=1)
    size = np.abs(expected.displacement).max()
    assert state.displacement == pytest.approx(expected.displacement[nodes], abs=1e-8 * size)
    assert state.temperature == pytest.approx(expected.temperature[nodes])
    # At the boundaries the mean over adjacent cells lacks those of the neighbours.
    inside = np.setdiff1d(np.arange(len(nodes)), np.concatenate([
        sector.mesh.boundary(name).ravel() for name in ("low", "high")]))
    size = np.abs(expected.stress).max()
    assert state.stress[inside] == pytest.approx(expected.stress[nodes][inside], abs=1e-7 * size)
    stressed = made(1000, prestress={"s": state})
    found = np.sort(np.concatenate([
        np.repeat(np.linalg.eigvalsh(one.stiffness), 1 if SYMMETRY.is_real(one.diameter) else 2)
        for one in stressed.diameters]))
    turning = modal_basis(whole, whole.expansion.shape[1], contact=(), rotation=plain,
                          prestress=expected)
    assert found[:12] == pytest.approx(np.linalg.eigvalsh(turning.stiffness)[:12], rel=1e-7)
    cold = np.sort(np.concatenate([
        np.repeat(np.linalg.eigvalsh(one.stiffness), 1 if SYMMETRY.is_real(one.diameter) else 2)
        for one in made(1000).diameters]))
    assert np.abs(found[:12] / cold[:12] - 1.0).max() > 1e-3


def test_temperatures_that_do_nothing_are_refused(sector):
    for given, message in (({"b": 10.0}, "temperature names the body 'b'"),
                           ({"s": 10.0}, "Body 's': temperature acts through the thermal"),
                           (10.0, "temperature")):
        with pytest.raises(InputError, match=message):
            cyclic_basis({"s": sector}, SYMMETRY, temperature=given)
    warm = replace(sector, material=Material(2.1e11, thermal_expansion=1.2e-5))
    for symmetry in (SYMMETRY, replace(SYMMETRY, tied=True)):
        with pytest.raises(InputError, match=r"Body 's': temperature is .* K on 'high' at .* same"):
            cyclic_basis({"s": warm}, symmetry, modes=2, temperature={"s": lambda x, y: 300.0 * y})
        assert cyclic_basis({"s": warm}, symmetry, modes=2, diameters=[0], temperature={
            "s": lambda x, y: 300.0 * np.hypot(x, y)}).temperature["s"].max() > 1.0


@pytest.mark.parametrize("stiffening", [True, False])
def test_speeds_beyond_divergence_are_said(sector, stiffening):
    with pytest.warns(ModelWarning, match=r"Body 's': at the nodal diameters 0, 1, 2 the stiff"):
        cyclic_basis({"s": sector}, SYMMETRY, {"shroud": shroud(sector)}, modes=6,
                     rotation=Rotation(2e4, stress_stiffening=stiffening))


def test_boundaries_that_no_body_has_are_named(sector):
    with pytest.raises(InputError, match=r"no body has the boundaries 'l' and 'h'"):
        cyclic_basis({"s": sector}, CyclicSymmetry("l", "h", N))


def test_bad_wheels_are_refused(sector, wheel):
    pairing = shroud(sector)
    with pytest.raises(InputError, match=r"order = 5 must be .* acts as order 1"):
        EngineOrder(wheel, 5)
    few = cyclic_basis({"s": sector}, SYMMETRY, {"shroud": pairing}, modes=2,
                       points={"s.tip": "tip"}, diameters=[1])
    hertz = first_hz(few, 1)
    with pytest.raises(InputError, match=r"no modes of the nodal diameter 2; it has 0, 1"):
        response(system_of(few, hertz), (hertz, 1.1 * hertz), repeats=EngineOrder(few, 2))
    with pytest.raises(InputError, match=r"must be that of the basis of its wheel"):
        response(system_of(wheel, hertz), (hertz, 1.1 * hertz), repeats=EngineOrder(few, 1))
    with pytest.raises(InputError, match="lacks the nodal diameters 2;"):
        WholeWheel(few)
    with pytest.raises(InputError, match="stability = None"):
        HarmonicBalance(3, repeats=EngineOrder(few, 1))
    with pytest.raises(InputError, match=r"no group of cells 'blad'.*'blade'"):
        WholeWheel(wheel, np.zeros(N), "s.blad")
    with pytest.raises(InputError, match="must be 4 numbers above -1"):
        WholeWheel(wheel, np.zeros(3), "s.blade")
    with pytest.raises(InputError, match="give deviations and group together"):
        WholeWheel(wheel, np.zeros(N))
    for arguments, message in (
            ({"rigid": ["s"]}, "goes on into its neighbours"),
            ({"rigid": ["b"]}, r"rigid names the body 'b'"),
            ({"points": {"tip": "tip"}}, r"points names 'tip'.*such as 's\.tip'"),
            ({"modes": {}}, "modes lacks the body 's'"),
            ({"diameters": [3]}, r"cyclic_basis: diameters = \[3\] must be from 0 to N / 2 = 2")):
        with pytest.raises(InputError, match=message):
            cyclic_basis({"s": sector}, SYMMETRY, {"shroud": pairing}, **arguments)
    other = pair_faces({"a": sector, **SYMMETRY.next_sector({"a": sector})}, "a.right",
                       "next_a.left")
    with pytest.raises(InputError, match="which is no body of the sector"):
        cyclic_basis({"s": sector}, SYMMETRY, {"shroud": other})
    with pytest.raises(InputError, match="must have no dot and not begin with 'next_'"):
        cyclic_basis({"next_s": sector}, SYMMETRY)
    moving = wheel_system(system_of(wheel, hertz), WholeWheel(wheel), 1)
    assert len(moving.load.forces) == N
