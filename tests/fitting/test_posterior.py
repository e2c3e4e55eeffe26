"""Posterior distributions of fits against closed forms, and chains that go on."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import f, t, truncnorm, uniform
from test_fit_statistics import OFFSET, PLACES, RANGES, SLOPE, curve, failing, line, system

import fecontact as fc
from fecontact.core import extras
from fecontact.fitting import FunctionData, Problem, posterior
from fecontact.study import FitParameter

# Errors of the Monte Carlo means below are at most this many of their standard deviations: five in
# all for one in two million, of the seeds that are fixed here.
REACH = 5.0


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Bags of the two numbers in place of contact systems, which take milliseconds to make."""
    def bag(problem, u, model=None):
        given = {OFFSET: 0.5, SLOPE: 0.5} | {name: one.value(u[k]) for k, (name, one) in enumerate(
            zip(problem.names, problem.parameters, strict=True))}
        return SimpleNamespace(ground=SimpleNamespace(speed=given[OFFSET]),
                               friction=SimpleNamespace(friction_coefficient=given[SLOPE]))

    monkeypatch.setattr(Problem, "system", bag)


def mean_error(found):
    """Standard deviation (p,) of the means of the samples."""
    return found.samples.std(axis=0) / np.sqrt(found.effective)


def require_quantiles(found, distribution, column=0):
    """Parts of the samples below the quartiles of a distribution."""
    for part in (0.25, 0.5, 0.75):
        below = (found.samples[:, column] < distribution.ppf(part)).mean()
        assert abs(below - part) < REACH * np.sqrt(part * (1.0 - part) / found.effective)


def slope_alone(model):
    return model.friction.friction_coefficient * PLACES


def test_a_linear_model_has_the_normal_posterior_of_linear_regression():
    deviation = 0.1 + 0.05 * PLACES
    y = 0.3 + 1.2 * PLACES + deviation * np.random.default_rng(5).standard_normal(40)
    fitted = fc.fit(system(), RANGES, FunctionData(line, y, deviation, PLACES))
    X = np.column_stack([np.ones(40), PLACES]) / deviation[:, None]
    covariance = np.linalg.inv(X.T @ X)
    best = covariance @ X.T @ (y / deviation)
    found = posterior(fitted, steps=6000)
    assert found.notes == ()
    assert found.effective > 2000.0
    assert (np.abs(found.samples.mean(axis=0) - best) < REACH * mean_error(found)).all()
    # Squares of distances in standard deviations have the mean 2 and the variance 4.
    off = found.samples - best
    square = np.einsum("ki,ij,kj->k", off, np.linalg.inv(covariance), off)
    assert square.mean() == pytest.approx(2.0, abs=REACH * np.sqrt(4.0 / found.effective))
    # A normal sample of m numbers has a variance with the relative deviation sqrt(2 / m).
    rough = REACH * np.sqrt(2.0 / found.effective)
    assert np.diag(found.covariance) == pytest.approx(np.diag(covariance), rel=rough)
    assert found.correlation == pytest.approx(fitted.correlation, abs=rough)
    for name, (low, high) in fitted.intervals().items():
        assert found.intervals()[name] == pytest.approx((low, high), abs=rough * (high - low))
    (low, high), = fitted.bands()
    (below, above), = found.bands(draws=1000)
    assert above - below == pytest.approx(high - low, rel=2.0 * rough)
    assert 0.5 * (above + below) == pytest.approx(fitted.predicted, abs=rough * np.max(high - low))


def test_without_deviations_it_is_a_student_distribution():
    y = 0.3 + 1.2 * PLACES + 0.1 * np.random.default_rng(5).standard_normal(40)
    rough = PLACES[::8]
    def few(model):
        return model.friction.friction_coefficient * rough

    fitted = fc.fit(system(), {SLOPE: (-20.0, 20.0)}, FunctionData(few, y[::8] - 0.3))
    found = posterior(fitted, steps=3000)
    require_quantiles(found, t(4, fitted[SLOPE], fitted.deviations[SLOPE]))
    # The tails of four degrees of freedom, which a normal distribution does not have.
    far = np.abs(found.samples[:, 0] - fitted[SLOPE]) > 2.0 * fitted.deviations[SLOPE]
    part = 2.0 * t.sf(2.0, 4)
    assert abs(far.mean() - part) < REACH * np.sqrt(part / found.effective) < part - 0.0455


class Estimated(FunctionData):
    """Numbers whose deviations were estimated from noise with four degrees of freedom."""

    deviation_freedom = 4.0


def test_deviations_that_were_estimated_from_noise_give_a_student_distribution():
    """Multivariate one of Student, whose squares of distances over p have the distribution F."""
    y = 0.3 + 1.2 * PLACES + 0.1 * np.random.default_rng(5).standard_normal(40)
    fitted = fc.fit(system(), {OFFSET: (-20.0, 20.0), SLOPE: (-40.0, 40.0)},
                    Estimated(line, y, 0.1))
    found = posterior(fitted, steps=5000)
    for column, name in enumerate(fitted.names):
        require_quantiles(found, t(4, fitted[name], fitted.deviations[name]), column)
    off = found.samples - fitted.estimates
    ratio = 0.5 * np.einsum("ki,ij,kj->k", off, np.linalg.inv(fitted.covariance), off)
    for part in (0.5, 0.9):
        below = (ratio < f.ppf(part, 2, 4)).mean()
        assert abs(below - part) < REACH * np.sqrt(part * (1.0 - part) / found.effective)
    # With known deviations a part of exp(-F) would lie beyond, 1.3 % of it in place of a tenth.
    assert REACH * np.sqrt(0.09 / found.effective) < 0.1 - np.exp(-f.ppf(0.9, 2, 4))


@pytest.mark.parametrize("best", [0.4, 0.35])
def test_a_parameter_at_its_bound_has_a_one_sided_posterior(best):
    fitted = fc.fit(system(), {SLOPE: (0.4, 2.0)}, FunctionData(slope_alone, best * PLACES, 0.1))
    assert fitted[SLOPE] == pytest.approx(0.4, abs=1e-5)
    deviation = 0.1 / np.sqrt((PLACES**2).sum())
    found = posterior(fitted, steps=2000)
    assert found.samples.min() >= 0.4
    require_quantiles(found, truncnorm((0.4 - best) / deviation, np.inf, best, deviation))


def test_the_prior_is_flat_on_the_scale_of_a_parameter():
    """Data that say nothing leave the prior."""
    fitted = fc.fit(system(), {SLOPE: FitParameter(0.01, 1.0, scale="log"), OFFSET: (-1.0, 2.0)},
                    FunctionData(line, PLACES, 1e6))
    found = posterior(fitted, steps=3000)
    assert found.places.mean(axis=0) == pytest.approx(
        0.5, abs=REACH / np.sqrt(12.0 * found.effective))
    assert found.places.var(axis=0) == pytest.approx(1.0 / 12.0, rel=REACH / np.sqrt(
        found.effective))
    assert found.quantile(0.5)[SLOPE] == pytest.approx(0.1, rel=0.3)


def test_places_where_the_model_fails_have_no_probability():
    fitted = fc.fit(system(), {OFFSET: (-1.0, 2.0)},
                    FunctionData(failing, 0.78 + 0.5 * PLACES, 0.2))
    found = posterior(fitted, steps=2000)
    assert found.samples.max() <= 0.8
    deviation = 0.2 / np.sqrt(40.0)
    require_quantiles(found, truncnorm(-np.inf, 0.02 / deviation, 0.78, deviation))


CALLS, LAST = 0, 10**9


def counted(model):
    global CALLS
    CALLS += 1
    if CALLS > LAST:
        raise KeyboardInterrupt
    return curve(model)


def test_chains_that_were_cancelled_go_on(tmp_path, monkeypatch):
    y = 1.2 * np.exp(-0.5 * PLACES) + 0.01 * np.random.default_rng(1).standard_normal(40)
    fitted = fc.fit(system(), RANGES, FunctionData(counted, y, 0.01))
    seen = []
    with pytest.warns(fc.ModelWarning, match="shorter than 50 autocorrelation times"):
        whole = posterior(fitted, steps=30, progress=lambda *now: seen.append(now))
    assert seen[-1] == (30, 30)
    assert "take steps = " in whole.notes[0]
    monkeypatch.setitem(globals(), "CALLS", 0)
    monkeypatch.setitem(globals(), "LAST", 200)
    with pytest.raises(KeyboardInterrupt):
        posterior(fitted, steps=30, folder=tmp_path)
    monkeypatch.setitem(globals(), "LAST", 10**9)
    for steps in (20, 30, 30):
        monkeypatch.setitem(globals(), "CALLS", 0)
        with pytest.warns(fc.ModelWarning, match="shorter"):
            found = posterior(fitted, steps=steps, folder=tmp_path)
    assert CALLS == 0
    assert found.chain.tolist() == whole.chain.tolist()
    assert found.log_density.tolist() == whole.log_density.tolist()
    assert found.acceptance == whole.acceptance
    with pytest.raises(fc.InputError, match="another fit, seed or number of walkers"):
        posterior(fitted, steps=30, seed=1, folder=tmp_path)
    (tmp_path / "posterior.h5").write_bytes(b"torn")
    with pytest.raises(fc.InputError, match="was not written whole"):
        posterior(fitted, steps=30, folder=tmp_path)
    with pytest.warns(fc.ModelWarning, match="shorter"):
        posterior(fitted, steps=30, folder=tmp_path, overwrite=True)


@pytest.mark.long
def test_two_processes_give_the_same_chain():
    fitted = fc.fit(system(), {SLOPE: (0.4, 2.0)}, FunctionData(slope_alone, PLACES, 0.1))
    with pytest.warns(fc.ModelWarning, match="shorter"):
        alone = posterior(fitted, steps=20)
    with pytest.warns(fc.ModelWarning, match="shorter"):
        both = posterior(fitted, steps=20, workers=2)
    assert both.chain.tolist() == alone.chain.tolist()


def narrow(model):
    if not 1.0 <= model.friction.friction_coefficient <= 1.01:
        raise fc.AnalysisError("There is no equilibrium.")
    return slope_alone(model)


def failing_always(model):
    raise fc.AnalysisError("There is no equilibrium.")


def test_wrong_input_is_told_in_one_sentence():
    fitted = fc.fit(system(), {SLOPE: (0.4, 2.0)}, FunctionData(slope_alone, PLACES, 0.1))
    robust = fc.fit(system(), {SLOPE: (0.4, 2.0)}, FunctionData(slope_alone, PLACES, 0.1),
                    loss="huber")
    for call, told in (
            (lambda: posterior(3), "fit must be"),
            (lambda: posterior(fitted, steps=1), "steps = 1 must be a whole number, 2 or above"),
            (lambda: posterior(fitted, walkers=1), "walkers = 1 must be a whole number, 2"),
            (lambda: posterior(fitted, seed=-1), "seed = -1"),
            (lambda: posterior(fitted, workers=0), "workers = 0"),
            (lambda: posterior(robust), "loss = 'huber', which is no likelihood")):
        with pytest.raises(fc.InputError, match=told):
            call()
    with pytest.warns(fc.ModelWarning, match="shorter"):
        found = posterior(fitted, steps=10)
    for call, told in ((lambda: found.quantile(1.0), "part = 1.0 must be above 0 and below 1"),
                       (lambda: found.intervals(95), "level = 95"),
                       (lambda: found.bands(draws=1), "draws = 1")):
        with pytest.raises(fc.InputError, match=told):
            call()
    assert "95 % from" in repr(found)


def test_without_emcee_the_extra_is_named(monkeypatch):
    def missing(module):
        raise ImportError(module)

    fitted = fc.fit(system(), {SLOPE: (0.4, 2.0)}, FunctionData(slope_alone, PLACES, 0.1))
    monkeypatch.setattr(extras, "import_module", missing)
    with pytest.raises(fc.MissingLibraryError, match=r"pip install 'fecontact\[posterior\]'"):
        posterior(fitted)


def test_walkers_begin_where_the_model_runs():
    """Draws are repeated nearer to the best values, until there are none."""
    fitted = fc.fit(system(), {SLOPE: FitParameter(0.4, 2.0, 1.005)},
                    FunctionData(narrow, 1.005 * PLACES, 0.1))
    found = posterior(fitted, steps=2000)
    assert found.samples.min() >= 1.0
    assert found.samples.max() <= 1.01
    # Much narrower than the data say: uniform.
    require_quantiles(found, uniform(1.0, 0.01))
    never = replace(fitted, problem=replace(fitted.problem, data=(
        FunctionData(failing_always, PLACES, 0.1),)))
    with pytest.raises(fc.AnalysisError, match="narrow the ranges"):
        posterior(never)
