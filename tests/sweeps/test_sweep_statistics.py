"""Statistics of sweeps: intervals that hold the truth as often as they say, known Sobol indices."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from fecontact import InputError
from fecontact.study import Span, SweepSettings
from fecontact.sweeps import SweepTable, sobol_indices, statistics
from fecontact.sweeps.plan import plan
from fecontact.sweeps.statistics import indices_of


def test_moments_and_quantiles():
    x = np.array([1.0, 2.0, 4.0, 9.0, np.nan, -1.0, 3.0])
    found = statistics(x)
    assert found["mean"].value == pytest.approx(3.0)
    assert found["std"].value == pytest.approx((58.0 / 5.0) ** 0.5)
    half = 2.570581835636314 * (58.0 / 5.0 / 6.0) ** 0.5  # Student's t, 5 degrees, 97.5 %
    assert found["mean"].low == pytest.approx(3.0 - half)
    assert found["50 %"].value == 2.5
    assert found["5 %"].low == -np.inf
    assert found["95 %"].high == np.inf
    assert statistics(np.full(5, 2.0))["std"].high == 0.0
    with pytest.raises(InputError, match="at least 3 successful cases, not 2"):
        statistics([1.0, 2.0, np.nan])
    with pytest.raises(InputError, match=r"confidence = 1\.0 must lie between 0 and 1"):
        statistics(x, confidence=1.0)


def test_intervals_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(1)
    truth = {"mean": 2.0, "std": 0.5, "5 %": 2.0 + 0.5 * stats.norm.ppf(0.05), "50 %": 2.0,
             "95 %": 2.0 + 0.5 * stats.norm.ppf(0.95)}
    held = dict.fromkeys(truth, 0)
    for repeat in range(150):
        found = statistics(rng.normal(2.0, 0.5, 120), confidence=0.9, seed=repeat)
        for name, value in truth.items():
            held[name] += found[name].low <= value <= found[name].high
    # binomial: 135 +- 3.7; intervals between order statistics hold it somewhat more often
    assert all(122 <= held[name] <= 148 for name in truth), held
    assert 122 <= held["mean"] <= 146


def ishigami(x):
    """Sobol indices 0.3139, 0.4424, 0 alone and 0.5576, 0.4424, 0.2437 with others."""
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def ishigami_table(samples, seed=2):
    angle = Span(-np.pi, np.pi)
    found = plan(SweepSettings(axes={"a": angle, "b": angle, "c": angle}, method="sensitivity",
                               samples=samples, seed=seed))
    x = np.array(found.rows)
    return SweepTable({name: tuple(x[:, k]) for k, name in enumerate(found.names)},
                      {"f": ishigami(x)}, [str(k) for k in range(len(x))], [""] * len(x))


def test_sobol_indices_of_the_function_of_ishigami():
    table = ishigami_table(8192)
    found = sobol_indices(table, "f")
    V1, V13, V2 = (1.0 + 0.1 * np.pi**4 / 5.0) ** 2 / 2.0, 0.01 * np.pi**8 * 8.0 / 225.0, 49.0 / 8.0
    total = V1 + V2 + V13
    assert [found.first[name].value for name in "abc"] == pytest.approx(
        [V1 / total, V2 / total, 0.0], abs=0.01)
    assert [found.total[name].value for name in "abc"] == pytest.approx(
        [(V1 + V13) / total, V2 / total, V13 / total], abs=0.01)
    blocks = table.values["f"].reshape(5, 8192)
    scipy = stats.sobol_indices(
        func={"f_A": blocks[:1], "f_B": blocks[1:2], "f_AB": blocks[2:, None, :]}, n=8192)
    assert [found.first[name].value for name in "abc"] == pytest.approx(scipy.first_order,
                                                                        abs=1e-12)
    assert [found.total[name].value for name in "abc"] == pytest.approx(scipy.total_order,
                                                                        abs=1e-12)
    for kind in (found.first, found.total):
        assert all(kind[name].low < kind[name].value < kind[name].high for name in "abc")
        assert all(kind[name].high - kind[name].low < 0.2 for name in "abc")
    assert found.samples == 8192


def test_failed_cases_are_left_out_of_sobol_indices():
    table = ishigami_table(1024)
    values = table.values["f"].copy()
    values[[3, 1024 + 7, 4000]] = np.nan
    table = replace(table, values={**table.values, "f": values})
    found = sobol_indices(table, "f")
    assert found.samples == 1021
    assert found.first["b"].value == pytest.approx(0.4424, abs=0.03)
    assert indices_of(np.ones(40), 3)[0][0].value == 0.0
    with pytest.raises(InputError, match="need samples in blocks of 5"):
        indices_of(np.ones(41), 3)
    with pytest.raises(InputError, match="at least 8 successful base samples, not 4"):
        indices_of(np.ones(20), 3)
