"""The page and the pictures of a fit: what they show is what the fit holds."""

import numpy as np
import pytest
from report_reading import Shown
from scipy.stats import chi2
from test_fit_statistics import OFFSET, PLACES, RANGES, SLOPE, line, system

import fecontact as fc
from fecontact.fitting import FrequencyData, FunctionData, posterior, profile_likelihood
from fecontact.fitting.diagrams import fit_diagrams, marginal_diagrams, pair_diagrams
from fecontact.io import report_fit
from fecontact.plot import plot_fit, plot_posterior

EVIL = "</script><img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def found():
    y = 0.3 + 1.2 * PLACES + 0.1 * np.random.default_rng(5).standard_normal(40)
    return fc.fit(system(), RANGES, FunctionData(line, y, 0.1, PLACES, ("place [m]", "u [m]"),
                                                 name=EVIL), starts=2)


@pytest.fixture(scope="module")
def chains(found):
    with pytest.warns(fc.ModelWarning, match="shorter than 50 autocorrelation times"):
        return posterior(found, steps=150)


def test_the_page_holds_the_fit(found, chains, tmp_path):
    profile = profile_likelihood(found, SLOPE, points=5)
    path = report_fit(found, tmp_path / "fit.html", profiles=[profile], posterior=chains)
    assert "<img" not in path.read_text(encoding="utf-8")
    shown = Shown(path)
    page = shown.header
    values, residuals = page["curves"][0]
    assert (values["title"], values["unit"], values["xLabel"]) == (f"{EVIL}: u", "m", "place [m]")
    fitted, measured = (shown.array("curves", 0, 0, "lines", k, "y") for k in range(2))
    assert measured == pytest.approx(found.data[0].measured, abs=1e-4)
    assert fitted == pytest.approx(found.predicted, abs=1e-4)
    for end, band in enumerate(found.bands()[0]):
        assert shown.array("curves", 0, 0, "lines", 0, "limits", end) == pytest.approx(
            band, abs=1e-4)
    assert shown.array("curves", 0, 0, "lines", 1, "bars", 1) - measured == pytest.approx(
        0.196, abs=1e-4)
    assert shown.array("curves", 0, 1, "lines", 0, "y") == pytest.approx(found.residuals, abs=1e-3)
    assert residuals["levels"] == [["y", -2.0], ["y", 2.0]]
    rows = [dict(zip(page["headings"], row, strict=True)) for row in page["parameters"]]
    assert [row["parameter"] for row in rows] == [OFFSET, SLOPE]
    for row, (low, high) in zip(rows, found.intervals().values(), strict=True):
        assert row["95 % of the fit"] == f"{low:.5g} ... {high:.5g}"
    assert rows[0]["95 % by profile likelihood"] == ""
    ends = [float(one) for one in rows[1]["95 % by profile likelihood"].split(" ... ")]
    assert ends == pytest.approx(profile.interval, rel=1e-4)
    assert page["correlation"][0][2] == f"{found.correlation[0, 1]:.3f}"
    deviation, combination = page["combinations"][-1]
    assert float(deviation) == pytest.approx(1.0 / found.singular_values[-1], rel=1e-2)
    assert f"{found.directions[-1, 0]:+.2f} {OFFSET}" in combination
    assert page["profiles"][0]["levels"][0] == ["y", pytest.approx(chi2.ppf(0.95, 1))]
    assert (len(page["marginals"]), len(page["pairs"]), len(page["starts"])) == (2, 1, 2)
    assert [row[:2] for row in page["derivatives"]] == [[EVIL, OFFSET], [EVIL, SLOPE]]
    assert page["notes"] == list(chains.notes)
    assert not page["good"]


def test_a_page_says_what_the_data_do_not_determine(tmp_path):
    def alone(model):
        return line(model)[:1] * np.ones(3)

    lost = fc.fit(system(), RANGES, FunctionData(alone, [0.4, 0.5, 0.6]))
    page = Shown(report_fit(lost, tmp_path / "fit.html", title="lost")).header
    assert page["title"] == "lost"
    assert SLOPE in dict(page["facts"])["not determined"]
    assert page["correlation"][1][1] == "unknown"
    assert page["combinations"][1][0] == "unbounded"
    assert dict(zip(page["headings"], page["parameters"][1], strict=True))[
        "95 % of the fit"] == "unbounded ... unbounded"
    assert page["curves"][0][1]["levels"] == []


def test_ellipses_hold_the_part_of_samples_that_they_name(found, chains):
    diagram = pair_diagrams(chains)[0, 1]
    samples, ellipse = diagram.curves
    off = np.array([ellipse.x, ellipse.y]).T - found.estimates
    distance = np.einsum("ki,ij,kj->k", off, np.linalg.inv(found.covariance), off)
    assert distance == pytest.approx(np.full(len(off), chi2.ppf(0.95, 2)))
    assert set(samples.x) <= set(chains.samples[:, 0])
    # The best of linear models is the middle of the ellipse.
    assert (ellipse.x.min() + ellipse.x.max()) / 2.0 == pytest.approx(found[OFFSET], rel=1e-3)


def test_marginals_are_densities_between_their_ends(chains):
    for diagram, (low, high), values in zip(marginal_diagrams(chains), chains.intervals().values(),
                                            chains.samples.T, strict=True):
        curve, = diagram.curves
        assert [one.value for one in diagram.levels] == [low, high]
        area = np.sum(np.diff(curve.x) * curve.y[1:])
        inside = np.sum(np.diff(np.clip(curve.x, low, high)) * curve.y[1:])
        width = (values.max() - values.min()) / 40
        # Bins at the ends of the interval hold a few samples more or less.
        assert inside / area == pytest.approx(0.95, abs=2.0 * width * curve.y.max() / area)


def test_the_picture_of_a_posterior(chains, tmp_path):
    figure = plot_posterior(chains, path=tmp_path / "posterior.png")
    assert (tmp_path / "posterior.png").stat().st_size > 5000
    upper, pair, lower = figure.axes
    assert (pair.get_xlabel(), pair.get_ylabel()) == (OFFSET, SLOPE)
    assert (upper.get_ylabel(), lower.get_xlabel()) == ("density", SLOPE)
    assert [one.get_text() for one in figure.legends[0].get_texts()] == [
        "samples", "95 % of the fit"]


def test_frequencies_are_not_joined_by_a_line():
    model = system()
    hertz = FrequencyData([1.0]).predicted(model.with_({"drive.stiffness_x": 0.3}))
    data = FrequencyData(hertz, 1e-3, name="hammer")
    fitted = fc.fit(model, {"drive.stiffness_x": (0.0, 1.0)}, data)
    (values, residuals), = fit_diagrams(fitted)
    assert (values.curves[0].width, values.curves[0].marker > 0.0) == (0.0, True)
    assert (values.title, residuals.y_label) == ("hammer: frequency", "residual / deviation")
    assert len(plot_fit(fitted).axes) == 2


@pytest.mark.parametrize(("how", "told"), [
    ({"path": "fit.csv"}, r"must end in \.html"),
    ({"profiles": [3]}, "profiles must be"),
    ({"posterior": 3}, "posterior must be"),
    ({"level": 1.0}, "level = 1.0 must be above 0"),
])
def test_what_is_wrong_is_told(how, told, found, tmp_path):
    path = tmp_path / how.pop("path", "fit.html")
    with pytest.raises(fc.InputError, match=told):
        report_fit(found, path, **how)
