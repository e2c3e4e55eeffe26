"""Cases of a sweep: grids, lists and drawn samples of the distributions that were asked for."""

import numpy as np
import pytest
from scipy import stats

from fecontact import InputError, Study
from fecontact.study import Distribution, Span, SweepSettings
from fecontact.sweeps.plan import frozen, plan

D = Distribution
STUDY = """
geometry = { shape = "block" }
body = { thickness = 0.1 }
normal = { stiffness = 1e6, roughness_height = 1e-6 }
"""


def drawn(method, samples, seed=0, **axes):
    return np.array(plan(SweepSettings(axes=axes, method=method, samples=samples, seed=seed)).rows)


def test_grids_and_lists():
    axes = {"a": (1, 2), "b": Span(0.0, 1.0, 3), "c": Span(1.0, 100.0, 3, "log")}
    grid = plan(SweepSettings(axes=axes))
    assert grid.shape == (2, 3, 3)
    assert len(grid.rows) == 18
    assert grid.rows[:4] == ((1, 0.0, 1.0), (1, 0.0, 10.0), (1, 0.0, 100.0), (1, 0.5, 1.0))
    assert plan(SweepSettings(axes={"a": Span(0.6, 0.9, 16)})).rows[12] == (0.84,)
    both = plan(SweepSettings(axes={"a": (1, 2, 3), "b": ("x", "y", "z")}, method="list"))
    assert both.rows == ((1, "x"), (2, "y"), (3, "z"))
    assert both.shape is None
    with pytest.raises(InputError, match="8,000,000,000 cases"):
        plan(SweepSettings(axes={name: Span(0.0, 1.0, 2000) for name in ("a", "b")} | {
            "c": Span(0.0, 1.0, 2000)}))


def test_listed_cases():
    """Each as it is written, in their order; dotted keys are nested tables in TOML."""
    study = Study.from_toml(STUDY + """
[[sweep.cases]]
ground.speed = 0.1
friction.law = "constant"
[[sweep.cases]]
friction.law = "exponential"
ground.speed = 0.3
""")
    found = plan(study.sweep)
    assert found.names == ("ground.speed", "friction.law")
    assert found.rows == ((0.1, "constant"), (0.3, "exponential"))
    assert found.shape is None
    assert Study.from_toml(study.to_toml()).sweep == study.sweep


@pytest.mark.parametrize(("settings", "message"), [
    ({"cases": ({"a": 1.0}, {"b": 1.0})}, "cases 0 and 1 differ in the keys"),
    ({"cases": ({"a": 1.0},), "axes": {"a": (1.0,)}}, "give one of both"),
    ({"cases": ({"a": 1.0},), "method": "sobol"}, "'sobol' draws cases from axes"),
    ({"cases": ({},)}, "give all cases the same keys, at least one"),
])
def test_listed_cases_that_cannot_be(settings, message):
    with pytest.raises(InputError, match=message):
        SweepSettings(**settings)


@pytest.mark.parametrize(("axis", "mean", "std"), [
    (D("normal", mean=3.0, std=0.5), 3.0, 0.5),
    (D("lognormal", mean=3.0, std=2.0), 3.0, 2.0),
    (D("gamma", mean=3.0, std=2.0), 3.0, 2.0),
    (D("uniform", low=1.0, high=4.0), 2.5, 3.0 / 12.0**0.5),
    (D("loguniform", low=1.0, high=np.e), np.e - 1.0,
     (0.5 * (np.e**2 - 1.0) - (np.e - 1.0) ** 2) ** 0.5),
    (D("triangular", low=1.0, mode=2.0, high=6.0), 3.0, (21.0 / 18.0) ** 0.5),
    (D("beta", a=2.0, b=3.0, low=1.0, high=6.0), 3.0, 1.0),
    (D("weibull", shape=1.0, scale=2.0), 2.0, 2.0),
    # cut at one standard deviation: 1 - 2 phi(1) / (2 Phi(1) - 1)
    (D("truncated-normal", mean=3.0, std=0.5, low=2.5, high=3.5), 3.0,
     0.5 * (1.0 - 2.0 * 0.24197072451914337 / 0.6826894921370859) ** 0.5),
    (Span(1.0, 4.0), 2.5, 3.0 / 12.0**0.5),
    (Span(1.0, np.e, spacing="log"), np.e - 1.0,
     (0.5 * (np.e**2 - 1.0) - (np.e - 1.0) ** 2) ** 0.5),
])
def test_distributions_have_the_moments_of_their_definition(axis, mean, std):
    values = drawn("latin-hypercube", 4000, a=axis)[:, 0]
    assert values.mean() == pytest.approx(mean, rel=5e-4)
    assert values.std() == pytest.approx(std, rel=8e-3)
    if isinstance(axis, D):
        assert frozen(axis).std() == pytest.approx(std, rel=1e-6)
        assert stats.kstest(drawn("random", 4000, a=axis)[:, 0],
                            frozen(axis).cdf).pvalue > 0.01


def test_hypercubes_sequences_seeds():
    cube = drawn("latin-hypercube", 50, a=Span(0.0, 1.0), b=Span(0.0, 1.0))
    assert (np.sort((cube * 50).astype(int), axis=0) == np.arange(50)[:, None]).all()
    sequence = drawn("sobol", 64, a=Span(0.0, 1.0), b=Span(0.0, 1.0))
    cells = (sequence * 8).astype(int) @ [8, 1]
    assert sorted(cells.tolist()) == list(range(64))  # one point in each of 8 x 8 squares
    assert len(drawn("sobol", 50, a=Span(0.0, 1.0))) == 50
    again = drawn("random", 20, seed=3, a=Span(0.0, 1.0))
    assert (again == drawn("random", 20, seed=3, a=Span(0.0, 1.0))).all()
    assert (again != drawn("random", 20, seed=4, a=Span(0.0, 1.0))).all()
    numbers = drawn("latin-hypercube", 30, a=(1, 2, 5))[:, 0]
    assert [(numbers == k).sum() for k in (1, 2, 5)] == [10, 10, 10]


def test_samples_for_sensitivities():
    rows = drawn("sensitivity", 16, a=Span(0.0, 1.0), b=Span(0.0, 1.0)).reshape(4, 16, 2)
    A, B, first, second = rows
    assert (first == np.column_stack([B[:, 0], A[:, 1]])).all()
    assert (second == np.column_stack([A[:, 0], B[:, 1]])).all()
    assert abs(np.corrcoef(A[:, 0], B[:, 0])[0, 1]) < 0.5


def test_study_files_hold_sweeps():
    text = """
geometry = { shape = "block" }
[sweep]
method = "latin-hypercube"
samples = 8
seed = 5
[sweep.axes]
ground.speed = [0.1, 2]
"load.normal" = { start = 1, end = 9, spacing = "log" }
friction.static_coefficient = { distribution = "normal", mean = 0.5, std = 0.05 }
friction.law = ["exponential", "constant"]
"""
    study = Study.from_toml(text)
    assert study.sweep.axes == {
        "ground.speed": (0.1, 2), "load.normal": Span(1.0, 9.0, spacing="log"),
        "friction.static_coefficient": D("normal", mean=0.5, std=0.05),
        "friction.law": ("exponential", "constant")}
    assert Study.from_toml(study.to_toml()) == study
    assert study.with_(**{"sweep.samples": 16}).sweep.samples == 16
    assert "sweep" not in Study.from_toml('geometry = { shape = "block" }').tables()


@pytest.mark.parametrize(("axis", "message"), [
    ({"distribution": "norml", "mean": 1.0}, "distribution = 'norml' must be one of 'beta'"),
    ({"distribution": "normal", "mean": 1.0}, "'normal' takes the keys 'mean', 'std', not 'mean'"),
    ({"distribution": "normal", "mean": 1.0, "std": 0.0}, "std = 0.0 must be a finite number abo"),
    ({"distribution": "uniform", "low": 1.0, "high": 1.0}, "high = 1.0 must lie above low = 1.0"),
    ({"distribution": "triangular", "low": 1.0, "high": 2.0, "mode": 3.0}, "mode = 3.0 must lie"),
    ({"start": 0.0, "end": 1.0, "spacing": "log"}, "must be above zero for spacing = 'log'"),
    ({"start": 0.0, "end": 1.0, "count": 0}, "count = 0 must be at least 1"),
    ({"start": 0.0, "end": 1.0, "counts": 3}, r"no key 'counts' \(did you mean 'count'\?\)"),
])
def test_axes_that_cannot_be_used(axis, message):
    import tomli_w

    text = tomli_w.dumps({"geometry": {"shape": "block"},
                          "sweep": {"axes": {"ground.speed": axis}}})
    with pytest.raises(InputError, match=message) as caught:
        Study.from_toml(text)
    assert str(caught.value).startswith("The study: [sweep")
