"""Half-spaces beside Hertz, Westergaard, punches, Cattaneo and Mindlin, and another program."""

import importlib.util

import numpy as np
import pytest

from fecontact import AnalysisError, Material
from fecontact.core.errors import InputError, ModelWarning
from fecontact.half_space import half_space_contact, half_space_friction
from fecontact.half_space.influence import (
    ACROSS,
    ALONG,
    CROSS,
    DIRECT,
    ODD_X,
    ODD_Y,
    Convolution,
    influence,
)

STEEL, SOFT = Material(2.1e11, 0.3), Material(2.1e11, 0.0)
RADIUS, WIDTH, MU = 0.05, 1e-3, 0.3
KERNELS = {"direct": DIRECT, "along": ALONG, "across": ACROSS, "cross": CROSS, "odd x": ODD_X,
           "odd y": ODD_Y}


def modulus(material):
    return material.youngs_modulus / (1.0 - material.poisson_ratio**2)


def sphere(pixels, material, extent=2.2, **how):
    """A rigid sphere on a half-space, of contact radius WIDTH under ``load``, and the load."""
    side = extent * WIDTH / pixels
    x = (np.arange(pixels) + 0.5) * side - 0.5 * extent * WIDTH
    load = 4.0 * modulus(material) * WIDTH**3 / (3.0 * RADIUS)
    gap = (x[:, None] ** 2 + x**2) / (2.0 * RADIUS)
    return half_space_contact(gap, side, material, **(how or {"force": load})), load


@pytest.mark.parametrize("name", KERNELS)
def test_influence_is_the_mean_of_the_kernel(name):
    """Quadrature of the point force, near and far; closed form and quadrature meet smoothly."""
    kernel, sides = KERNELS[name], (1.0, 0.7)
    t = (np.arange(400) + 0.5) / 200.0 - 1.0
    weight = np.outer(1.0 - np.abs(t), 1.0 - np.abs(t)) / 200.0**2
    for x, y in ((2.0, 1.0), (-2.0, 1.5), (3.0, 0.0), (0.0, -2.5), (19.0, 13.3), (25.0, -3.0)):
        X, Y = np.meshgrid(x + sides[0] * t, y + sides[1] * t, indexing="ij")
        expected = float((kernel.point(X, Y) * weight).sum())
        assert influence(kernel, x, y, sides) == pytest.approx(expected, rel=3e-5, abs=1e-8)


@pytest.mark.parametrize("name", KERNELS)
def test_patches_add_up(name):
    """Sixteen pixels of a quarter of the side have the mean of the large ones, at any place."""
    part = np.arange(4) * 0.25
    apart = part[:, None] - part
    for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (30.0, 1.0)):
        small = influence(KERNELS[name], x + apart[:, :, None, None], y + apart, (0.25, 0.25))
        assert small.mean() == pytest.approx(float(influence(KERNELS[name], x, y, (1.0, 1.0))),
                                             rel=1e-8, abs=1e-9)


def test_mean_displacement_of_a_square():
    """4 (ln(1 + sqrt 2) - (sqrt 2 - 1) / 3) for a square of side one (Love, 1929)."""
    exact = 4.0 * (np.log(1.0 + np.sqrt(2.0)) - (np.sqrt(2.0) - 1.0) / 3.0)
    assert influence(DIRECT, 0.0, 0.0, (1.0, 1.0)) == pytest.approx(exact, rel=1e-13)


def test_convolution_is_the_sum():
    rng = np.random.default_rng(2)
    forces = rng.standard_normal((6, 9))
    sides = (0.5, 0.2)
    x, y = (side * np.arange(count) for side, count in zip(sides, forces.shape, strict=True))
    for kernel in (DIRECT, CROSS, ODD_X):
        matrix = influence(kernel, x[:, None, None, None] - x[:, None], y[:, None, None] - y, sides)
        assert Convolution([(2.0, kernel)], forces.shape, sides, periodic=False)(
            forces) == pytest.approx(2.0 * np.einsum("ijkl,kl->ij", matrix, forces), rel=1e-10)


@pytest.mark.parametrize("name", KERNELS)
def test_periodic_kernels_are_those_of_free_ones(name):
    """Differences of displacements by one force on a large period, near the force."""
    count, sides = 512, (1.0, 1.0)
    # Smooth loads have the same displacement by points and by pixels.
    t = np.arange(count) - count // 2
    force = np.exp(-(t[:, None] ** 2 + t**2) / 32.0)
    free, periodic = (Convolution([(1.0, KERNELS[name])], force.shape, sides, kind)(force)
                      for kind in (False, True))
    near = slice(count // 2 - 20, count // 2 + 21)
    free, periodic = free[near, near], periodic[near, near]
    apart = free - periodic
    assert np.ptp(apart) < 0.02 * np.ptp(free)


@pytest.mark.parametrize(("pixels", "approach", "pressure"), [(32, 6e-4, 2e-3), (64, 2e-4, 5e-4)])
def test_hertz(pixels, approach, pressure):
    found, load = sphere(pixels, STEEL)
    assert found.force == pytest.approx(load, rel=1e-9)
    assert found.approach == pytest.approx(WIDTH**2 / RADIUS, rel=approach)
    assert found.pressure.max() == pytest.approx(1.5 * load / (np.pi * WIDTH**2), rel=pressure)
    assert found.contact_area == pytest.approx(np.pi * WIDTH**2, rel=2.0 / pixels)
    assert found.gap.min() > -1e-8 * found.approach
    assert np.abs(found.gap[found.touching]).max() < 1e-7 * found.approach
    assert sphere(pixels, STEEL, approach=found.approach)[0].force == pytest.approx(load, rel=1e-6)


def test_two_bodies_are_softer_than_one():
    """Two equal half-spaces approach twice as far under the same pressures."""
    one, load = sphere(32, STEEL)
    side, x = one.sides[0], (np.arange(32) + 0.5) * one.sides[0] - 1.1 * WIDTH
    both = half_space_contact((x[:, None] ** 2 + x**2) / RADIUS, side, (STEEL, STEEL), force=load)
    assert both.pressure == pytest.approx(one.pressure, rel=1e-5, abs=1e-5 * one.pressure.max())
    assert both.approach == pytest.approx(2.0 * one.approach, rel=1e-6)
    assert both.compliance.coupling == 0.0


def test_round_punch():
    """Force ``2 E* a d`` of a flat rigid punch; pixels at its edge err in its radius."""
    pixels, radius = 64, 1.0
    x = (np.arange(pixels) + 0.5) * 2.0 / pixels - 1.0
    outside = x[:, None] ** 2 + x**2 > radius**2
    area = float((~outside).mean()) * 4.0
    found = half_space_contact(np.where(outside, 1.0, 0.0), 2.0 / pixels, STEEL, approach=1e-5)
    exact = 2.0 * modulus(STEEL) * np.sqrt(area / np.pi) * 1e-5
    assert found.force == pytest.approx(exact, rel=0.01)


def test_square_punch_that_fills_its_grid():
    """By force and by approach; the stiffness is about ``1.15 E* side``."""
    gap = np.full((32, 32), 1e-3)
    found = half_space_contact(gap, 0.1 / 32, STEEL, force=1e3)
    assert found.touching.all()
    assert found.force == pytest.approx(1e3)
    other = half_space_contact(gap, 0.1 / 32, STEEL, approach=found.approach)
    assert other.force == pytest.approx(1e3, rel=1e-5)
    stiffness = 1e3 / (found.approach - 1e-3)
    assert stiffness == pytest.approx(1.15 * modulus(STEEL) * 0.1, rel=0.01)


def wavy(part, pixels=128):
    """Contact of a surface ``h (1 - cos(2 pi x / l))`` at a part of the pressure that closes it."""
    length, height = 1e-3, 1e-6
    closing = np.pi * modulus(STEEL) * height / length
    x = np.arange(pixels) / pixels * length
    gap = np.tile(height * (1.0 - np.cos(2.0 * np.pi * x / length))[:, None], (1, 2))
    return half_space_contact(gap, (length / pixels, 0.5 * length), STEEL,
                              force=part * closing * length**2, periodic=True), closing, x / length


@pytest.mark.parametrize("part", [0.05, 0.2, 0.5, 0.8, 0.95])
def test_westergaard(part):
    """``p / p* = sin^2(pi a / l)`` of a contact of width 2 a, and its pressures."""
    found, closing, x = wavy(part)
    width = 2.0 / np.pi * np.arcsin(np.sqrt(part))
    assert abs(found.touching[:, 0].mean() - width) < 1.5 / 128
    inside = np.sin(0.5 * np.pi * width) ** 2 - np.sin(np.pi * x) ** 2
    exact = 2.0 * closing * np.abs(np.cos(np.pi * x)) * np.sqrt(np.maximum(inside, 0.0))
    assert np.abs(found.pressure[:, 0] - exact).mean() < 0.01 * closing


def test_westergaard_closed():
    """Full contact from the pressure p* on: ``p = p_mean + p* cos``."""
    found, closing, x = wavy(1.2)
    exact = closing * (1.2 + np.cos(2.0 * np.pi * x))
    assert found.touching.all()
    assert found.pressure[:, 0] == pytest.approx(exact, rel=1e-6)
    assert not wavy(0.98)[0].touching.all()


def test_waves_in_two_directions_close_at_their_pressure():
    """``sqrt 2 pi E* h / l`` (Johnson, Greenwood and Higginson, 1985)."""
    length, height, pixels = 1e-3, 1e-6, 32
    x = 2.0 * np.pi * np.arange(pixels) / pixels
    gap = height * (1.0 - np.cos(x[:, None]) * np.cos(x))
    closing = np.sqrt(2.0) * np.pi * modulus(STEEL) * height / length
    for part, closed in ((0.99, False), (1.01, True)):
        found = half_space_contact(gap, length / pixels, STEEL, periodic=True,
                                   force=part * closing * length**2)
        assert found.touching.all() == closed


@pytest.mark.parametrize(("material", "error"), [(SOFT, 1.5e-3), (STEEL, 2e-3)])
def test_cattaneo_and_mindlin(material, error):
    """Displacement, circle that sticks and loss of a sphere; friction across the load is small."""
    contact, load = sphere(32, material)
    nu, full = material.poisson_ratio, MU * load
    shear = 0.5 * material.youngs_modulus / (1.0 + nu)
    parts = np.array([0.3, 0.6, 0.9, 0.45, 0.0, -0.45, -0.9, -0.45, 0.0, 0.45, 0.9])
    found = half_space_friction(contact, MU, forces=full * np.outer(parts, [1.0, 0.0]))
    scale = 3.0 * full * (2.0 - nu) / (16.0 * WIDTH * shear)
    assert found.force[:, 0] == pytest.approx(full * parts, abs=1e-9 * full)
    assert found.displacement[:3, 0] == pytest.approx(
        scale * (1.0 - (1.0 - parts[:3]) ** (2.0 / 3.0)), rel=error)
    # Masing's rule on the way back.
    assert found.displacement[6, 0] == pytest.approx(
        found.displacement[2, 0] - 2.0 * found.displacement[2, 0], rel=1e-3)
    stuck = np.sqrt(found.sticking[2].sum() * contact.pixel_area / np.pi)
    assert stuck == pytest.approx(0.1 ** (1.0 / 3.0) * WIDTH, rel=0.03)
    # Area of the loop: Mindlin and Deresiewicz, 1953.
    k = 0.9
    loop = 9.0 * (2.0 - nu) * full**2 / (10.0 * WIDTH * shear) * (
        1.0 - (1.0 - k) ** (5.0 / 3.0) - 5.0 * k / 6.0 * (1.0 + (1.0 - k) ** (2.0 / 3.0)))
    assert found.loss[10] - found.loss[2] == pytest.approx(loop, rel=0.01)
    limit = MU * contact.pressure
    assert (np.linalg.norm(found.traction, axis=-1) <= limit * (1.0 + 1e-9)).all()
    back = half_space_friction(contact, MU, displacements=found.displacement[:3])
    assert back.force[:, 0] == pytest.approx(full * parts[:3], rel=1e-5)


def test_forces_too_close_to_sliding_for_the_grid_are_an_error():
    contact, load = sphere(16, STEEL)
    with pytest.raises(AnalysisError, match=r"no pixel sticks; take smaller forces"):
        half_space_friction(contact, MU, forces=[((1.0 - 1e-7) * MU * load, 0.0)])


def test_gross_slip():
    """All slides from the displacement ``3 mu P (2 - nu) / (16 a G)`` on, along the motion."""
    contact, load = sphere(32, SOFT)
    most = 3.0 * MU * load * 2.0 / (16.0 * WIDTH * 0.5 * SOFT.youngs_modulus)
    way = np.array([0.6, 0.8])
    found = half_space_friction(contact, MU, displacements=np.outer([0.97, 1.05], most * way))
    assert found.sticking.any(axis=(1, 2)).tolist() == [True, False]
    assert found.force[1] == pytest.approx(MU * load * way, rel=1e-6)


def rough(pixels=64):
    rng = np.random.default_rng(1)
    q = pixels * np.hypot(np.fft.fftfreq(pixels)[:, None], np.fft.fftfreq(pixels))
    size = np.where((q >= 2.0) & (q <= 12.0), np.maximum(q, 1.0) ** -1.8, 0.0)
    z = np.fft.ifft2(size * np.exp(2.0j * np.pi * rng.random((pixels, pixels)))).real
    return np.ascontiguousarray(1e-6 * z / z.std())


def test_superposition_of_shear():
    """Tractions ``mu (p(P) - p(P - Q / mu))`` of nu = 0 (Jaeger, 1998; Ciavarella, 1998)."""
    gap, side, part = -rough(32), 1e-3 / 32, 0.6
    whole, rest = (half_space_contact(gap, side, SOFT, force=force, periodic=True, rtol=1e-10)
                   for force in (60.0, (1.0 - part) * 60.0))
    found = half_space_friction(whole, MU, forces=[(part * MU * 60.0, 0.0)], rtol=1e-8)
    exact = MU * (whole.pressure - rest.pressure)
    assert found.traction[0, ..., 0] == pytest.approx(exact, abs=1e-5 * exact.max())
    assert found.traction[0, ..., 1] == pytest.approx(0.0, abs=1e-6 * exact.max())
    assert found.sticking[0].sum() == pytest.approx(rest.touching.sum(), abs=1.0)


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("tamaas") is None, reason="tamaas is not installed")
def test_rough_surface_beside_tamaas():
    import tamaas

    z, length = rough(), 1e-3
    found = half_space_contact(-z, length / 64, STEEL, force=60.0, periodic=True, rtol=1e-10)
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [length] * 2, [64, 64])
    model.E, model.nu = STEEL.youngs_modulus, STEEL.poisson_ratio
    tamaas.PolonskyKeerRey(model, z, 1e-14).solve(60.0 / length**2)
    pressure = np.asarray(model.traction)
    assert 0.02 < found.touching.mean() < 0.5
    assert found.pressure == pytest.approx(pressure, abs=1e-5 * pressure.max())
    assert (found.touching == (pressure > 0.0)).mean() > 0.999


def test_contact_at_the_edge_of_the_grid_is_a_warning():
    whole, load = sphere(16, STEEL)
    assert not whole.touching[0].any()
    with pytest.warns(ModelWarning, match="reaches the edge of the grid of 16 x 16 pixels"):
        sphere(16, STEEL, extent=1.5, force=load)


@pytest.mark.parametrize("one", [np.int64, np.float32])
def test_spacing_may_be_a_number_of_numpy(one):
    gap = np.zeros((4, 4))
    assert half_space_contact(gap, one(1), STEEL, force=1e3).approach == half_space_contact(
        gap, 1.0, STEEL, force=1e3).approach


@pytest.mark.parametrize(("call", "words"), [
    (lambda: half_space_contact(np.zeros(4), 1.0, STEEL, force=1.0), r"a grid \(N, M\)"),
    (lambda: half_space_contact([[np.nan, 0.0]], 1.0, STEEL, force=1.0), "fill missing heights"),
    (lambda: half_space_contact(np.zeros((4, 4)), 1.0, STEEL), "either force .N. or approach"),
    (lambda: half_space_contact(np.zeros((4, 4)), 1.0, "steel", force=1.0), "must be a Material"),
    (lambda: half_space_contact(np.zeros((4, 4)), 1.0, STEEL, approach=1.0, periodic=True),
     "give force"),
    (lambda: half_space_contact(np.zeros((4, 4)), -1.0, STEEL, force=1.0), "spacing"),
    (lambda: half_space_friction(sphere(16, STEEL)[0], 0.3, forces=[(1e9, 0.0)]),
     "prescribe displacements"),
    (lambda: half_space_friction(sphere(16, STEEL)[0], 0.3), "either forces"),
    (lambda: half_space_friction(sphere(16, STEEL)[0], 0.3, forces=[1.0, 0.0]), r"path \(K, 2\)"),
])
def test_errors(call, words):
    with pytest.raises(InputError, match=words):
        call()
