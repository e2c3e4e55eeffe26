"""Rough surfaces: forces against the density of heights, curves of measured profiles."""

import math
from dataclasses import replace

import numpy as np
import pytest
from normal_conformance import force
from scipy.integrate import quad

from fecontact import InputError
from fecontact.laws import (
    CosineSurface,
    GaussianSurface,
    LinearContact,
    MeasuredSurface,
    ParabolicSurface,
    RoughSurface,
)

R = 5e-6
TRACE = np.random.default_rng(5).normal(size=400).cumsum() * 1e-7


def _gaussian(deviation):
    def density(z):
        return (math.exp(-0.5 * ((z - 0.5) / deviation) ** 2) / deviation
                / math.sqrt(2.0 * math.pi) / math.erf(0.5 / deviation / math.sqrt(2.0)))

    return density


DENSITIES = [
    (RoughSurface(1e6, R, 40.0), lambda z: 1.0),
    (ParabolicSurface(1e6, R, 40.0), lambda z: 6.0 * z * (1.0 - z)),
    (CosineSurface(1e6, R, 40.0), lambda z: 2.0 * math.sin(math.pi * z) ** 2),
    *((GaussianSurface(1e6, R, 40.0, s), _gaussian(s)) for s in (0.05, 1.0 / 6.0, 0.4, 1.0)),
]


@pytest.mark.parametrize(("law", "density"), DENSITIES)
@pytest.mark.parametrize("s", [1e-5, 1e-3, 0.01, 0.03, 0.079, 0.081, 0.2, 0.5, 0.77, 0.999, 1.0,
                               1.4, 30.0])
def test_force_is_that_of_the_density(law, density, s):
    """f and h by quadrature of p, F = c R f + d h v and its slopes c h + d p v / R and d h."""
    top = min(s, 1.0)
    options = {"epsabs": 0.0, "epsrel": 1e-12}
    f = quad(lambda z: (s - z) * density(z), 0.0, top, **options)[0]
    h = quad(density, 0.0, top, **options)[0]
    p = density(s) if s < 1.0 else 0.0
    assert force(law, s * R) == pytest.approx((1e6 * R * f, 1e6 * h, 40.0 * h), rel=1e-9)
    v = 0.02
    expected = (1e6 * R * f + 40.0 * h * v, 1e6 * h + 40.0 * p * v / R, 40.0 * h)
    assert force(law, s * R, v) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("kind", [RoughSurface, ParabolicSurface, CosineSurface, GaussianSurface,
                                  MeasuredSurface])
def test_smooth_in_the_limit(kind):
    """A surface of vanishing roughness is the linear contact."""
    smooth, rough = LinearContact(1e6, 40.0), kind(1e6, 1e-13, 40.0)
    for u in (1e-8, 3e-6, 1e-4):
        for v in (-1.0, -1e-3, 0.0, 2e-3):
            assert force(rough, u, v) == pytest.approx(force(smooth, u, v), rel=2e-5, abs=1e-6)


def test_penetration_scale_of_a_surface_is_the_smallest_roughness():
    assert GaussianSurface(1e6, (R, 2 * R), 0.0).penetration_scale == R


def test_straight_flank_is_uniform():
    law = MeasuredSurface.from_heights(np.linspace(3e-6, 8e-6, 11), stiffness=1e6, damping=40.0)
    assert law.roughness_height == pytest.approx(R, rel=1e-12)
    for s in (0.1, 0.501, 0.99, 1.7):
        assert force(law, s * R, 0.01) == pytest.approx(
            force(RoughSurface(1e6, R, 40.0), s * R, 0.01), rel=1e-12)


def test_measured_sine():
    """A sine has the bearing curve arccos(1 - 2 s) / pi."""
    x = np.linspace(0.0, 3.0, 6001)
    law = MeasuredSurface.from_heights(R / 2.0 * np.cos(2.0 * np.pi * x), x, stiffness=1e6)
    for s in (0.005, 0.02, 0.1, 0.33, 0.5, 0.8, 0.97, 1.0):
        h = math.acos(1.0 - 2.0 * s) / math.pi
        f = quad(lambda z: math.acos(1.0 - 2.0 * z) / math.pi, 0.0, s, epsrel=1e-12)[0]
        load, slope, _ = force(law, s * R)
        assert slope == pytest.approx(1e6 * h, rel=1e-4 if s > 0.01 else 1e-3)
        assert load == pytest.approx(1e6 * R * f, rel=1e-3 if s > 0.01 else 5e-3)


@pytest.mark.parametrize("abscissa", [False, True])
def test_measured_trace_against_its_own_points(abscissa):
    """The bed of asperities at many points of the trace, each with its part of the length."""
    rng = np.random.default_rng(3)
    fine = np.convolve(rng.normal(size=4200), np.hanning(200), "valid") * 1e-7
    x = np.cumsum(rng.uniform(0.5, 1.5, len(fine))) if abscissa else np.arange(len(fine)) * 1.0
    law = MeasuredSurface.from_heights(fine, x if abscissa else None, stiffness=1e6, damping=40.0)
    between = np.interp(np.arange(0.0, len(x) - 1.0, 0.01), np.arange(len(x)), x)
    x, fine = between, np.interp(between, x, fine)
    weight = np.gradient(x)
    weight[[0, -1]] /= 2.0
    weight /= weight.sum()
    depth = fine.max() - fine
    height = np.ptp(fine)
    assert law.roughness_height == pytest.approx(height, rel=1e-12)
    for s in (0.1, 0.25, 0.5, 0.75, 1.0, 1.5):
        load, slope, damping = force(law, s * height)
        touching = weight * (depth < s * height)
        assert load == pytest.approx(1e6 * (touching @ (s * height - depth)), rel=3e-3)
        assert slope == pytest.approx(1e6 * touching.sum(), abs=4e-3 * 1e6)
        assert damping == pytest.approx(40.0 * touching.sum(), abs=4e-3 * 40.0)
    # At the depths that the curve is given for it is that of the trace.
    for k in (8, 20, 40):
        touching = weight @ (depth < law.depths[k] * height)
        assert law.bearing[k] == pytest.approx(touching, abs=5e-5)
    # All asperities in contact: the mean of the trace.
    expected = 1e6 * (1.5 * height - weight @ depth)
    assert force(law, 1.5 * height)[0] == pytest.approx(expected, rel=5e-4)


def test_plateau_of_a_trace():
    """A fifth of the length is a flat top: it bears at once, within one step of depth."""
    law = MeasuredSurface.from_heights([1e-6, 1e-6, 0.0], [0.0, 0.2, 1.0], stiffness=1e6)
    assert force(law, 0.5e-6)[1] == pytest.approx(1e6 * (0.2 + 0.8 * 0.5), rel=1e-9)


def test_files(tmp_path):
    x = np.linspace(0.0, 1.0, len(TRACE))
    one, two = tmp_path / "one.txt", tmp_path / "two.csv"
    one.write_text("# heights\n\n" + "\n".join(f"{z:.17g}" for z in TRACE))
    two.write_text("\n".join(f"{a:.17g}; {z * 1e6:.17g} # um"
                             for a, z in zip(x, TRACE, strict=True)))
    expected = MeasuredSurface.from_heights(TRACE, stiffness=1e6)
    assert MeasuredSurface.from_file(one, stiffness=1e6) == expected
    assert MeasuredSurface(1e6, file=str(one)) == expected
    scaled = MeasuredSurface.from_file(two, scale=1e-6, stiffness=1e6)
    assert scaled.bearing == pytest.approx(expected.bearing, rel=1e-9, abs=1e-12)
    assert scaled.roughness_height == pytest.approx(expected.roughness_height, rel=1e-12)
    given = MeasuredSurface(2e6, file=str(two), scale=1e-6)
    assert given == MeasuredSurface.from_file(two, scale=1e-6, stiffness=2e6)
    assert (given.file, given.scale) == (None, 1.0)
    assert replace(given, damping=1.0).bearing == given.bearing


@pytest.mark.parametrize("content", [
    "x [mm];Höhe [µm]\r\n0,0;1,0\r\n1,0;3,5\r\n3,0;0,0\r\n",
    "x\tz\n0\t1\n1\t3,5\n3\t0\n", '"x","z"\n"0","1"\n"1","3.5"\n"3","0"\n',
])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_files_of_other_programs(tmp_path, content, encoding):
    file = tmp_path / "trace.csv"
    file.write_bytes(content.encode(encoding))
    expected = MeasuredSurface.from_heights([1e-6, 3.5e-6, 0.0], [0.0, 1.0, 3.0], stiffness=1e6)
    found = MeasuredSurface(1e6, file=str(file), scale=1e-6)
    assert found.bearing == pytest.approx(expected.bearing, rel=1e-12)
    assert found.roughness_height == pytest.approx(3.5e-6, rel=1e-12)


def test_header_of_one_column(tmp_path):
    file = tmp_path / "trace.txt"
    file.write_text("height / um of 2024\n1\n3.5\n0\n")
    assert MeasuredSurface.from_file(
        file, scale=1e-6, stiffness=1e6) == MeasuredSurface.from_heights(
        1e-6 * np.array([1.0, 3.5, 0.0]), stiffness=1e6)


@pytest.mark.parametrize(("values", "message"), [
    ({"bearing": (0.0, 0.2, 1.0)}, "'x.txt' cannot be combined with bearing, which it determines"),
    ({"bearing": ((0.0,), (0.2, 1.0))}, "cannot be combined with bearing"),
    ({"depths": (0.0, 0.2, 1.0)}, "cannot be combined with depths"),
    ({"roughness_height": 1e-6}, "cannot be combined with roughness_height"),
    ({"roughness_height": (1e-6, 2e-6)}, "cannot be combined with roughness_height"),
    ({"scale": 0.0}, r"MeasuredSurface: scale = 0\.0 must be"),
    ({"file": None, "scale": 1e-6}, "scale = 1e-06 has no effect without file"),
    ({"file": 3}, "file = 3 must be the name of a file"),
])
def test_what_a_file_does_not_stand_beside(values, message):
    with pytest.raises(InputError, match=message):
        MeasuredSurface(**{"stiffness": 1e6, "file": "x.txt", **values})


def test_number_of_nodes_is_not_that_of_the_curve():
    curve = {"bearing": (0.0, 0.2, 0.4, 1.0), "depths": (0.0, 0.3, 0.4, 1.0)}
    assert MeasuredSurface(1e6, R, **curve).node_count() is None
    assert MeasuredSurface((1e6, 2e6), R, **curve).node_count() == 2


@pytest.mark.parametrize(("text", "message"), [
    ("1.0\n2.0\nhigh\n", "line 3, 'high', has a value that is no finite number"),
    ("1.0\n2.0 3.0\n", "line 2, '2.0 3.0', has 2 columns; each line must hold"),
    ("1 2 3\n", "numbers abscissa and height, or height alone; it begins with '1 2 3'"),
    ("# nothing\n", "has no line of just the numbers"),
    ("0 1\n1 2\n1 3\n", r"abscissa\[2\] = 1 must be larger than the value before it, 1"),
    ("1\n1\n1\n", "all heights are 1"), ("1\n2\n", "has 2 values; at least 3 are needed"),
    ("1\nnan\n2\n", "line 2, 'nan', has a value that is no finite number"),
])
def test_files_that_are_no_profile(tmp_path, text, message):
    file = tmp_path / "trace.txt"
    file.write_text(text)
    with pytest.raises(InputError, match=rf"^MeasuredSurface: file = '.*trace\.txt'.*{message}"):
        MeasuredSurface(1e6, file=str(file))


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"none\.txt' cannot be read: No such file"):
        MeasuredSurface.from_file(tmp_path / "none.txt", stiffness=1e6)
