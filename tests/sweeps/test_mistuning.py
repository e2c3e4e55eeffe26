"""Mistuned wheels in cyclic modes against finite elements, Whitehead's bound, Monte Carlo."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial import cKDTree
from sectors import shrouded_sector, whole_wheel

from fecontact import AnalysisError, ElasticBody, InputError, Material, Mesh, Rayleigh
from fecontact.analysis import amplification, mistuned_response, whitehead_bound
from fecontact.fem import CyclicSymmetry
from fecontact.fem.points import place_rows
from fecontact.reduction import WholeWheel, cyclic_basis
from fecontact.sweeps import mistuning, mistuning_sweep

N = 5
SYMMETRY = CyclicSymmetry("low", "high", N)
TIP = ("s.tip", "y")
DEVIATIONS = np.array([0.05, -0.03, 0.0, 0.02, -0.06])
DAMPING = Rayleigh(10.0, 1e-8)


def wheel_of(modes, damping=DAMPING, **options):
    body = ElasticBody(shrouded_sector(N), thickness=0.02, degree=1, fixed={"root": "xy"})
    return cyclic_basis({"s": body}, SYMMETRY, modes=modes, points={"s.tip": "tip"},
                        damping=damping, **options)


@pytest.fixture(scope="module")
def complete():
    return wheel_of(1000)


def test_response_is_that_of_finite_elements(complete):
    """Each blade with its own modulus, assembled directly; with few modes nearly the same."""
    sector = complete.bodies["s"]
    mesh = whole_wheel(sector.mesh, SYMMETRY)
    M = len(sector.mesh.cells)
    groups = {f"blade {s}": M * s + sector.mesh.cell_groups["blade"] for s in range(N)}
    groups["rest"] = np.setdiff1d(np.arange(M * N), np.concatenate(list(groups.values())))
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, cell_groups=groups)
    materials = {name: Material(2.1e11 * (1.0 + (DEVIATIONS[int(name[6:])] if "blade" in name
                                                else 0.0))) for name in groups}
    body = ElasticBody(mesh, materials, thickness=0.02, degree=1, fixed={"root": "xy"})
    tuned = ElasticBody(Mesh(mesh.nodes, mesh.cells, mesh.boundaries), thickness=0.02, degree=1,
                        fixed={"root": "xy"})
    E, hertz, order = body.expansion, 1840.0, 2
    K, K_tuned, mass = ((E.T @ one @ E).toarray() for one in (
        body.stiffness, tuned.stiffness, body.mass))
    row = place_rows(sector, "tip", "tip").matrix[1].toarray().reshape(-1, 2)
    tree, rows = cKDTree(body.nodes), np.zeros((N, body.unknowns))
    for s in range(N):
        nodes = tree.query(SYMMETRY.turned(sector.nodes, s))[1]
        rows[s, (2 * nodes[:, None] + np.arange(2)).ravel()] = (
            row @ SYMMETRY.rotation(2, s).T).ravel()
    rows, w = rows @ E, 2.0 * np.pi * hertz
    C = 10.0 * mass + 1e-8 * K_tuned
    force = np.exp(-2j * np.pi * order * np.arange(N) / N) @ rows
    expected = rows @ np.linalg.solve(K - w**2 * mass + 1j * w * C, force)
    for basis, error in ((complete, 1e-9), (wheel_of(6), 5e-2)):
        found = mistuned_response(WholeWheel(basis, DEVIATIONS, "s.blade"), order, hertz, TIP)[0]
        assert np.abs(found - expected).max() < error * np.abs(expected).max()
    assert np.ptp(np.abs(expected)) > 0.2 * np.abs(expected).max()


def test_amplification_is_below_whiteheads_bound_and_reaches_it():
    """One mode of each blade, but for residual vectors, which add half a per cent."""
    basis, band = wheel_of(1, 2e-5), (1500.0, 2100.0)
    found = mistuning_sweep(basis, "s.blade", 0.02, 0, band, TIP, samples=60, seed=3)
    bound = whitehead_bound(N)
    assert bound == pytest.approx(0.5 * (1.0 + np.sqrt(5.0)))
    assert 1.2 < found.amplifications.max() < 1.005 * bound
    assert found.statistics()["mean"].value == pytest.approx(found.amplifications.mean())
    adverse = minimize(lambda x: -amplification(WholeWheel(basis, x, "s.blade"), 0, band, TIP),
                       [-0.0023, -0.0127, -0.0061, -0.0061, -0.0124], method="Nelder-Mead",
                       options={"maxfev": 60})
    assert 0.95 * bound < -adverse.fun < 1.005 * bound


def test_equal_blades_are_not_amplified(complete):
    equal = WholeWheel(complete, np.full(N, 0.04), "s.blade")
    assert amplification(WholeWheel(complete, np.zeros(N), "s.blade"), 1, (1500.0, 2100.0),
                         TIP) == pytest.approx(1.0)
    response = np.abs(mistuned_response(equal, 1, 1850.0, TIP)[0])
    assert response == pytest.approx(np.full(N, response[0]))
    with pytest.raises(AnalysisError, match="no natural frequency"):
        amplification(equal, 1, (10.0, 20.0), TIP)
    with pytest.raises(InputError, match="order = 6 must be from 0"):
        mistuned_response(equal, 6, 1850.0, TIP)
    with pytest.raises(InputError, match="samples = 2 must be three or more"):
        mistuning_sweep(complete, "s.blade", 0.01, 1, (1500.0, 2100.0), TIP, samples=2)


def test_an_interrupted_sweep_goes_on(tmp_path, monkeypatch):
    """Finished wheels are kept and not computed again; other ones do not count."""
    basis, computed = wheel_of(1), []
    largest = mistuning._largest

    def counted(wheels):
        if len(computed) == 1:
            computed.append(0)
            raise KeyboardInterrupt
        computed.append(len(wheels.cases))
        return largest(wheels)

    def swept(spread=0.01, **options):
        return mistuning_sweep(basis, "s.blade", spread, 2, (1500.0, 2100.0), TIP, samples=60,
                               folder=tmp_path / "wheels", **options)

    monkeypatch.setattr(mistuning, "_largest", counted)
    with pytest.raises(KeyboardInterrupt):
        swept()
    with pytest.raises(InputError, match="holds a sweep; go on with"):
        swept()
    found = swept(resume=True)
    assert sum(computed) == 60
    plain = mistuning_sweep(basis, "s.blade", 0.01, 2, (1500.0, 2100.0), TIP, samples=60)
    assert (found.amplifications == plain.amplifications).all()
    other = swept(spread=0.02, resume=True)
    assert (other.amplifications != plain.amplifications).all()


@pytest.mark.slow
def test_workers_find_the_same():
    basis = wheel_of(1)
    one, two = (mistuning_sweep(basis, "s.blade", 0.01, 2, (1500.0, 2100.0), TIP, samples=30,
                                workers=workers) for workers in (1, 2))
    assert (one.deviations == two.deviations).all()
    assert one.amplifications == pytest.approx(two.amplifications, rel=1e-9)
