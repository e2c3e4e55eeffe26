"""Statistics of fits against closed forms: linear models, coverage, what cannot be found."""

import numpy as np
import pytest
from scipy.stats import binom, chi2, f, norm, t

import fecontact as fc
from fecontact.fitting import DecayData, FunctionData, profile_likelihood
from fecontact.laws import ConstantFriction, PrescribedForce
from fecontact.measured import AmplitudeCurve
from fecontact.plot import plot_fit, plot_profile
from fecontact.study import FitParameter

ROW = np.array([[1.0], [0.0], [0.0]])
PLACES = np.linspace(0.0, 1.0, 40)
OFFSET, SLOPE = "ground.speed", "friction.friction_coefficient"


def system(speed=0.5, coefficient=0.5, force=2.0):
    """A contact system that serves as a bag of named numbers."""
    body = fc.basis_from_matrices([[1.0]], [[1.0]], {"contact": ROW[None], "B": ROW, "C": ROW})
    return fc.ContactSystem(body, normal=PrescribedForce(force),
                            friction=ConstantFriction(coefficient), ground=fc.Ground(speed=speed))


def line(model):
    return model.ground.speed + model.friction.friction_coefficient * PLACES


def curve(model):
    return model.friction.friction_coefficient * np.exp(-model.ground.speed * PLACES)


def product(model):
    return model.friction.friction_coefficient * model.normal.force * PLACES


RANGES = {OFFSET: (-1.0, 2.0), SLOPE: (0.0, 2.0)}


def test_a_straight_line_has_the_covariance_of_linear_regression():
    deviation = 0.1 + 0.05 * PLACES
    rng = np.random.default_rng(5)
    y = 0.3 + 1.2 * PLACES + deviation * rng.standard_normal(40)
    found = fc.fit(system(), RANGES, FunctionData(line, y, deviation, PLACES))
    X = np.column_stack([np.ones(40), PLACES]) / deviation[:, None]
    covariance = np.linalg.inv(X.T @ X)
    best = covariance @ X.T @ (y / deviation)
    assert found.estimates == pytest.approx(best, rel=1e-8)
    assert found.covariance == pytest.approx(covariance, rel=1e-8)
    assert found.correlation[0, 1] == pytest.approx(
        covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]), rel=1e-8)
    low, high = found.intervals()[SLOPE]
    assert (high - low) / 2.0 == pytest.approx(1.959964 * np.sqrt(covariance[1, 1]), rel=1e-6)
    r = (y - best[0] - best[1] * PLACES) / deviation
    assert found.chi_square == pytest.approx(r @ r, rel=1e-10)
    below, above = found.bands()[0]
    rows = np.column_stack([np.ones(40), PLACES])
    half = 1.959964 * np.sqrt(np.einsum("ni,ij,nj->n", rows, covariance, rows))
    assert 0.5 * (above - below) == pytest.approx(half, rel=1e-6)
    # Of a linear model the profile is a parabola with the same interval.
    profile = profile_likelihood(found, SLOPE, points=41)
    assert profile.interval == pytest.approx((low, high), rel=2e-3)
    assert profile.limit == pytest.approx(chi2.ppf(0.95, 1))
    assert found.system.ground.speed == pytest.approx(best[0])
    assert found.not_found == found.on_bounds == found.kinks == found.notes == ()
    assert set(found.derivatives.values()) == {"differences"}


class Linear(DecayData):
    """Frequency a + b ln A and damping ratio b / 10 - a ln A / 10 over the amplitude A."""

    def at(self, system, amplitude):
        a, b, level = (system.ground.speed, system.friction.friction_coefficient,
                       np.log(amplitude))
        return np.concatenate([a + b * level, 0.1 * b - 0.1 * a * level])


def linear_curve(rng, truth=(0.3, 1.2)):
    """A curve with correlated errors of log amplitude, frequency and damping ratio."""
    level = np.linspace(1.0, 3.0, 30)
    deviation = np.array([0.05, 0.03, 0.01])
    correlation = np.array([[1.0, 0.5, -0.4], [0.5, 1.0, 0.3], [-0.4, 0.3, 1.0]])
    e = deviation * (rng.standard_normal((30, 3)) @ np.linalg.cholesky(correlation).T)
    A = np.exp(level + e[:, 0])
    return AmplitudeCurve(
        A, truth[0] + truth[1] * level + e[:, 1], 0.1 * truth[1] - 0.1 * truth[0] * level + e[:, 2],
        np.full(30, 0.03), np.full(30, 0.01), amplitude_deviation=0.05 * A,
        correlation=np.tile(correlation, (30, 1, 1))), correlation * np.outer(deviation, deviation)


def test_errors_of_the_amplitude_count_by_the_slopes_of_the_model():
    """Generalised least squares with the covariance of both errors at the fitted slopes."""
    measured, errors = linear_curve(np.random.default_rng(8))
    found = fc.fit(system(), RANGES, Linear(measured, None, 1.0))
    a, b = found.estimates
    turned = np.array([[-b, 1.0, 0.0], [0.1 * a, 0.0, 1.0]])
    weight = np.linalg.inv(turned @ errors @ turned.T)
    X = np.array([[[1.0, level], [-0.1 * level, 0.1]] for level in np.log(measured.amplitude)])
    y = np.stack([measured.frequency_hz, measured.damping_ratio], axis=1)
    covariance = np.linalg.inv(np.einsum("nki,kl,nlj->ij", X, weight, X))
    best = covariance @ np.einsum("nki,kl,nl->i", X, weight, y)
    assert (a, b) == pytest.approx(best, rel=1e-4)
    assert found.covariance == pytest.approx(covariance, rel=1e-4)
    r = y - X @ best
    assert found.chi_square == pytest.approx(np.einsum("nk,kl,nl->", r, weight, r), rel=1e-4)
    below, above = found.bands()[0]
    rows = np.concatenate([X[:, 0], X[:, 1]])
    half = 1.959964 * np.sqrt(np.einsum("ni,ij,nj->n", rows, covariance, rows))
    assert 0.5 * (above - below) == pytest.approx(half, rel=1e-4)


@pytest.mark.slow
def test_intervals_of_correlated_curves_cover_the_truth():
    inside = []
    for seed in range(60):
        found = fc.fit(system(), RANGES, Linear(
            linear_curve(np.random.default_rng(seed))[0], None, 1.0))
        inside += [low <= value <= high for (low, high), value in zip(
            found.intervals().values(), (0.3, 1.2), strict=True)]
    assert binom.cdf(sum(inside), 120, 0.95) > 1e-3
    assert binom.sf(sum(inside) - 1, 120, 0.95) > 1e-3


def test_without_deviations_they_follow_from_the_residuals():
    y = 0.3 + 1.2 * PLACES + 0.2 * np.random.default_rng(5).standard_normal(40)
    found = fc.fit(system(), RANGES, FunctionData(line, y))
    X = np.column_stack([np.ones(40), PLACES])
    covariance = np.linalg.inv(X.T @ X)
    best = covariance @ X.T @ y
    s = np.sqrt(((y - X @ best) ** 2).sum() / 38.0)
    assert found.covariance == pytest.approx(s**2 * covariance, rel=1e-7)
    low, high = found.intervals(0.9)[OFFSET]
    assert (high - low) / 2.0 == pytest.approx(
        t.ppf(0.95, 38) * s * np.sqrt(covariance[0, 0]), rel=1e-6)
    profile = profile_likelihood(found, OFFSET, points=41, level=0.9)
    assert profile.interval == pytest.approx((low, high), rel=3e-3)
    rise = ((profile.values - best[0]) / (s * np.sqrt(covariance[0, 0]))) ** 2
    assert profile.chi_square - profile.best == pytest.approx(rise, rel=1e-4, abs=1e-6)


def test_the_scale_of_a_parameter_does_not_change_the_estimate():
    y = 1.2 * np.exp(-0.5 * PLACES) + 0.01 * np.random.default_rng(1).standard_normal(40)
    plain = fc.fit(system(), RANGES, FunctionData(curve, y, 0.01))
    logarithmic = fc.fit(system(), {
        OFFSET: FitParameter(0.01, 10.0, scale="log"), SLOPE: FitParameter(0.1, 10.0, 1.0, "log"),
    }, FunctionData(curve, y, 0.01))
    assert logarithmic.estimates == pytest.approx(plain.estimates, rel=1e-5)
    assert logarithmic.covariance == pytest.approx(plain.covariance, rel=1e-4)
    low, high = logarithmic.intervals()[OFFSET]
    assert low * high == pytest.approx(logarithmic[OFFSET] ** 2)


@pytest.mark.parametrize(("known", "trials"), [
    (True, 30), pytest.param(True, 300, marks=pytest.mark.slow),
    pytest.param(False, 300, marks=pytest.mark.slow)])
def test_intervals_cover_the_truth(known, trials):
    """Within the limits of the binomial distribution at 0.1 %."""
    inside = np.zeros(2)
    rng = np.random.default_rng(11)
    for _ in range(trials):
        y = 1.2 * np.exp(-0.5 * PLACES) + 0.03 * rng.standard_normal(40)
        found = fc.fit(system(), RANGES, FunctionData(curve, y, 0.03 if known else None))
        for k, (name, truth) in enumerate(((OFFSET, 0.5), (SLOPE, 1.2))):
            low, high = found.intervals()[name]
            inside[k] += low <= truth <= high
    for count in inside:
        assert binom.ppf(5e-4, trials, 0.95) <= count <= binom.ppf(1.0 - 5e-4, trials, 0.95)


def test_parameters_that_appear_as_a_product_are_named():
    y = 2.0 * PLACES + 0.01 * np.random.default_rng(2).standard_normal(40)
    both = {SLOPE: FitParameter(0.1, 10.0, 1.0, "log"),
            "normal.force": FitParameter(0.1, 10.0, 1.0, "log")}
    found = fc.fit(system(), both, FunctionData(product, y, 0.01))
    assert len(found.not_found) == 1
    assert SLOPE in found.not_found[0]
    assert "normal.force" in found.not_found[0]
    assert "growing while" in found.not_found[0]
    assert found[SLOPE] * found["normal.force"] == pytest.approx(2.0, rel=5e-3)
    assert not np.isfinite(list(found.deviations.values())).any()
    assert found.intervals()[SLOPE] == (0.0, np.inf)
    assert found.singular_values[1] < 1e-6 * found.singular_values[0]
    assert np.abs(found.directions[1]) == pytest.approx(np.sqrt([0.5, 0.5]), rel=1e-3)
    # The bands of what was measured are finite: only the product counts.
    below, above = found.bands()[0]
    assert np.isfinite(above).all()
    assert (above - below)[-1] == pytest.approx(
        2.0 * 1.96 * 0.01 / np.sqrt((PLACES**2).sum()), rel=1e-2)
    alone = fc.fit(system(), {SLOPE: both[SLOPE]}, FunctionData(product, y, 0.01))
    assert alone.not_found == ()


def test_outliers_count_less_with_a_robust_loss():
    rng = np.random.default_rng(3)
    y = 0.3 + 1.2 * PLACES + 0.02 * rng.standard_normal(40)
    y[::10] += 1.0
    plain = fc.fit(system(), RANGES, FunctionData(line, y, 0.02))
    robust = fc.fit(system(), RANGES, FunctionData(line, y, 0.02), loss="soft_l1")
    assert abs(plain[OFFSET] - 0.3) > 0.05
    assert abs(robust[OFFSET] - 0.3) < 0.05
    assert "times the stated deviations" in " ".join(plain.notes)


def failing(model):
    if model.ground.speed > 0.8:
        raise fc.AnalysisError("There is no equilibrium.")
    return line(model)


def test_failed_runs_of_the_model_do_not_end_the_fit():
    y = 0.3 + 1.2 * PLACES
    data = FunctionData(failing, y, 0.01)
    found = fc.fit(system(), RANGES, data, starts=8, seed=1)
    assert found.estimates == pytest.approx([0.3, 1.2], abs=1e-6)
    failed = [one for one in found.starts if one.failed]
    assert 0 < len(failed) < 8
    assert f"{len(failed)} of 8 starts failed: There is no equilibrium." in found.notes
    with pytest.raises(fc.AnalysisError, match=r"fails at the start: There is no equilibrium\."):
        fc.fit(system(), {OFFSET: FitParameter(0.0, 2.0, 1.5), SLOPE: (0.0, 2.0)}, data)
    # A first step into what fails is shortened.
    near = fc.fit(system(), {OFFSET: FitParameter(-1.0, 2.0, 0.1), SLOPE: (0.0, 2.0)},
                  FunctionData(failing, 0.79 + 1.2 * PLACES, 0.01))
    assert near[OFFSET] == pytest.approx(0.79, abs=1e-6)


def bent(model):
    return line(model) + np.maximum(model.ground.speed - 0.3, 0.0) * PLACES * 5.0


def test_bounds_and_kinks_are_named():
    found = fc.fit(system(), {OFFSET: (0.4, 2.0), SLOPE: (0.0, 2.0)},
                   FunctionData(line, 0.3 + 1.2 * PLACES, 0.01))
    assert found.on_bounds == (OFFSET,)
    assert "lies on its bound, 0.4" in " ".join(found.notes)
    kinked = fc.fit(system(), {OFFSET: (0.0, 2.0)}, FunctionData(bent, 0.3 + 0.5 * PLACES, 0.01))
    assert kinked.kinks == (OFFSET,)
    assert "a contact changes its state there" in " ".join(kinked.notes)


def test_several_starts_find_the_best_of_several_minima():
    def waves(model):
        return np.sin(9.0 * model.ground.speed * PLACES)

    y = waves(system(1.7))
    few = fc.fit(system(), {OFFSET: FitParameter(0.05, 2.0, 0.2)}, FunctionData(waves, y, 0.01))
    many = fc.fit(system(), {OFFSET: FitParameter(0.05, 2.0, 0.2)}, FunctionData(waves, y, 0.01),
                  starts=8)
    assert many.chi_square < 1e-8 < few.chi_square
    assert many[OFFSET] == pytest.approx(1.7)
    assert [one.chi_square for one in many.starts] == sorted(
        one.chi_square for one in many.starts)


CALLS = 0


def counted(model):
    global CALLS
    CALLS += 1
    return curve(model)


def cancelled(model):
    if CALLS >= 14:
        raise KeyboardInterrupt
    return counted(model)


def test_a_fit_that_was_cancelled_goes_on(tmp_path):
    global CALLS
    y = 1.2 * np.exp(-0.5 * PLACES) + 0.01 * np.random.default_rng(1).standard_normal(40)
    whole = fc.fit(system(), RANGES, FunctionData(counted, y, 0.01), starts=2)
    all_calls, CALLS = CALLS, 0
    with pytest.raises(KeyboardInterrupt):
        fc.fit(system(), RANGES, FunctionData(cancelled, y, 0.01), starts=2, folder=tmp_path)
    before, CALLS = CALLS, 0
    # The last line may be torn.
    file = tmp_path / "start-0.jsonl"
    text = file.read_text()
    file.write_text(text + text.splitlines()[-1][:30])
    found = fc.fit(system(), RANGES, FunctionData(counted, y, 0.01), starts=2, folder=tmp_path)
    assert found.estimates.tolist() == whole.estimates.tolist()
    assert found.covariance.tolist() == whole.covariance.tolist()
    assert 0 < CALLS <= all_calls - before + 1
    CALLS = 0
    fc.fit(system(), RANGES, FunctionData(counted, y, 0.01), starts=2, folder=tmp_path)
    assert CALLS == 0
    with pytest.raises(fc.InputError, match="of a fit of another model or of other data"):
        fc.fit(system(), RANGES, FunctionData(counted, y, 0.02), starts=2, folder=tmp_path)
    fc.fit(system(), RANGES, FunctionData(counted, y, 0.02), starts=1, folder=tmp_path,
           overwrite=True)


def test_deviations_that_were_estimated_widen_intervals_as_student_says():
    """Ratios of a normal number and an estimated deviation have Student's distribution."""
    class Estimated(FunctionData):
        deviation_freedom = 8.0

    y = 0.3 + 1.2 * PLACES
    known, estimated = (fc.fit(system(), RANGES, kind(line, y, 0.1, PLACES))
                        for kind in (FunctionData, Estimated))
    widths = [np.ptp(one.intervals(0.9)[SLOPE]) for one in (known, estimated)]
    assert widths[1] / widths[0] == pytest.approx(t.ppf(0.95, 8.0) / norm.ppf(0.95))
    assert estimated.reach(0.9, 2) ** 2 == pytest.approx(2.0 * f.ppf(0.9, 2, 8.0))
    profile = profile_likelihood(estimated, SLOPE, points=5)
    assert profile.limit == pytest.approx(t.ppf(0.975, 8.0) ** 2)
    assert np.ptp(profile.values) == pytest.approx(1.5 * np.ptp(estimated.intervals()[SLOPE]))
    assert np.ptp(estimated.bands()[0], axis=0) == pytest.approx(
        np.ptp(known.bands()[0], axis=0) * t.ppf(0.975, 8.0) / norm.ppf(0.975))


def test_pictures(tmp_path):
    y = 0.3 + 1.2 * PLACES + 0.1 * np.random.default_rng(5).standard_normal(40)
    found = fc.fit(system(), RANGES, FunctionData(line, y, 0.1, PLACES, ("place [m]", "u [m]")))
    figure = plot_fit(found, path=tmp_path / "fit.png")
    assert [axis.get_ylabel() for axis in figure.axes] == ["u [m]", "residual /\ndeviation"]
    band = figure.axes[0].collections[0].get_paths()[0].vertices[:, 1]
    below, above = found.bands()[0]
    assert (band.min(), band.max()) == pytest.approx((below.min(), above.max()))
    profile = profile_likelihood(found, SLOPE)
    assert plot_profile(profile).axes[0].get_xlabel() == SLOPE
    assert "interval of 95 %" in repr(profile)
    assert found.table()["parameters"][SLOPE]["value"] == found[SLOPE]


GOOD = FunctionData(line, 0.3 + PLACES, 0.1)


@pytest.mark.parametrize(("call", "told"), [
    (lambda: fc.fit(3, RANGES, GOOD), "model must be"),
    (lambda: fc.fit(system(), {}, GOOD), "parameters is empty"),
    (lambda: fc.fit(system(), {"friction.coefficient": (0.0, 1.0)}, GOOD), "did you mean"),
    (lambda: fc.fit(system(), {OFFSET: 3.0}, GOOD), "must be a range"),
    (lambda: fc.fit(system(), {OFFSET: (1.0, 0.0)}, GOOD), "must lie above low"),
    (lambda: fc.fit(system(), {OFFSET: {"low": 0.0, "hgih": 1.0}}, GOOD), "did you mean 'high'"),
    (lambda: fc.fit(system(), RANGES, []), "data is empty"),
    (lambda: fc.fit(system(), RANGES, 3), "data must be"),
    (lambda: fc.fit(system(), RANGES, [GOOD, GOOD]), "are called 'function'"),
    (lambda: fc.fit(system(), RANGES, [GOOD, FunctionData(line, PLACES, name="b")]),
     "the data 'b' have no deviation"),
    (lambda: fc.fit(system(), RANGES, FunctionData(line, [1.0])), "cannot be found from 1 numbers"),
    (lambda: fc.fit(system(), RANGES, GOOD, starts=0), "starts = 0"),
    (lambda: fc.fit(system(), RANGES, GOOD, loss="l2"), "loss = 'l2' must be one of"),
    (lambda: fc.fit(system(), RANGES, GOOD, workers=0), "workers = 0"),
    (lambda: fc.fit(system(), RANGES, FunctionData(lambda m: m, PLACES), workers=2),
     "cannot be sent to other processes"),
    (lambda: FunctionData(3, [1.0]), "must be a function"),
    (lambda: FunctionData(line, [1.0, np.nan]), "no finite numbers, the first in place 1"),
    (lambda: FunctionData(line, [1.0], 0.0), "must be a finite number above zero"),
    (lambda: FunctionData(line, [1.0], [1.0, 2.0]), "give one number, or 1"),
    (lambda: FitParameter(0.0, 1.0, scale="log"), "must be above zero for scale"),
    (lambda: FitParameter(0.0, 1.0, 2.0), "start = 2 must lie from"),
    (lambda: FitParameter(0.0, np.inf), "must be a finite number"),
])
def test_wrong_input_is_told_in_one_sentence(call, told):
    with pytest.raises(fc.InputError, match=told):
        call()
