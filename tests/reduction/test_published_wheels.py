"""Discs by sectors and a rotor with Coriolis forces beside CalculiX; thick rings.

Units of the tests of CalculiX are mm, N, t.
"""

import numpy as np
import pytest

from fecontact import ElasticBody, Material, Mesh
from fecontact.fem import CyclicSymmetry, Rotation
from fecontact.reduction import sector_modes

STEEL = Material(2.1e5, 0.3, 7.8e-9)


def curved_sector(radii, angles, heights, kept=lambda radius, height: True):
    """Bricks between radii, angles and heights, curved around the z axis; faces low and high.

    Those whose middle is not to be kept are left out. The point 'ends' are nodes of the second
    radius at both ends.
    """
    box = Mesh.grid(radii, angles, heights)
    middles = box.nodes[box.cells].mean(axis=1)
    cells = box.cells[[kept(r, z) for r, _, z in middles]]
    used, numbers = np.unique(cells, return_inverse=True)
    r, a, z = box.nodes[used].T

    def placed(radius, angle, height):
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])

    nodes, cells = placed(r, a, z), numbers.reshape(cells.shape)
    plain = Mesh(np.column_stack([r, a, z]), cells)
    ends = plain.edges[0]
    around = ends[(np.diff(a[ends], axis=1) != 0.0).ravel()]
    outline = plain.outline
    low, high = (outline[np.isclose(a[outline], at).all(axis=1)] for at in (angles[0], angles[-1]))
    held = np.flatnonzero(np.isclose(r, radii[1]) & np.isin(z, (heights[0], heights[-1])))
    first = around[:, 0]
    return Mesh(nodes, cells, {"low": low, "high": high}, {"ends": held}, around,
                placed(r[first], a[around].mean(axis=1), z[first]))


def test_segment_of_a_disc():
    """Deck segment: 12 x 4 x 2 bricks of 20 nodes, N = 12, nodal diameter 2."""
    sector = curved_sector(np.linspace(0.1, 1.0, 13), np.linspace(0.0, np.pi / 6.0, 5),
                           np.linspace(0.0, 0.1, 3))
    body = ElasticBody(sector, STEEL, bricks="serendipity")
    found = sector_modes(body, CyclicSymmetry("low", "high", 12), 3, diameters=[2])
    assert found.frequencies_hz[0] == pytest.approx([130230.4, 819388.7, 1130438.0], rel=3e-5)


@pytest.mark.parametrize(("integration", "expected", "tolerance"), [
    ("full", [28.2136, 1859.768, 2377.916, 3729.586, 5570.446, 6206.445, 7175.661], 5e-5),
    ("reduced", [25.1754, 1876.526, 2267.827, 3712.857, 5518.686, 6011.353, 7149.287], 3e-4)])
def test_slender_disc_on_a_long_shaft(integration, expected, tolerance):
    """Sector of a disc on a shaft beside CalculiX 2.20: the whole wheel of 704 bricks.

    CalculiX finds modes with Coriolis forces among the modes of the step before; 30 of them here.
    With ten, as in its test ``rotor``, modes 5 and 6 are 1.2e-3 and 3.7e-3 higher. Its mass of
    C3D20R at eight points accounts for the larger differences of these. The stress is that of the
    rotation at 2795.6 Hz, near which the first mode whirls: seen from the rotor it is slow, the
    small difference of large numbers.
    """
    z = np.concatenate([np.linspace(0.0, 50.0, 11), np.linspace(50.25, 100.25, 11)])
    sector = curved_sector(np.array([0.5, 0.75, 1.0, 3.0, 5.0]), np.array([0.0, np.pi / 8.0]), z,
                           lambda radius, height: radius < 1.0 or 50.0 < height < 50.25)
    speed = np.sqrt(3.0853e8)
    found = sector_modes(
        ElasticBody(sector, STEEL, fixed={"ends": "xyz"}, bricks="serendipity",
                    integration=integration),
        CyclicSymmetry("low", "high", 16), 12, diameters=[0, 1], rotation=Rotation(speed))
    seen = np.sort(np.concatenate([one.ravel() for one in found.rotation.frequencies_hz(speed)]))
    assert seen[0] == pytest.approx(expected[0], abs=0.1)
    assert seen[1:7] == pytest.approx(expected[1:], rel=tolerance)


def waves_of_a_ring(inner, outer, n, material, terms=12):
    """Frequency [Hz] of n waves in the plane of a ring of any thickness, and their splitting.

    Plane stress; displacements U(r) cos(n phi), V(r) sin(n phi) by Legendre polynomials (Ritz). The
    splitting is Bryan's factor 2 int U V r dr / int (U^2 + V^2) r dr, -2 n / (n^2 + 1) if thin.
    """
    from numpy.polynomial import legendre
    from scipy.linalg import eigh

    at, weights = legendre.leggauss(3 * terms)
    half = 0.5 * (outer - inner)
    r = 0.5 * (outer + inner) + half * at
    P = legendre.legvander(at, terms - 1)
    D = np.stack([legendre.legval(at, legendre.legder(one)) for one in np.eye(terms)], 1) / half
    zero, over = np.zeros_like(P), P / r[:, None]
    radial, hoop = np.hstack([D, zero]), np.hstack([over, n * over])
    shear = np.hstack([-n * over, D - over])
    nu, dr = material.poisson_ratio, weights * half * r

    def form(a, b):
        return (a.T * dr) @ b

    K = material.youngs_modulus / (1.0 - nu**2) * (
        form(radial, radial) + form(hoop, hoop) + nu * (form(radial, hoop) + form(hoop, radial))
        + 0.5 * (1.0 - nu) * form(shear, shear))
    mass = form(P, P)
    values, shapes = eigh(K, material.density * np.kron(np.eye(2), mass))
    U, V = shapes[:terms, 0], shapes[terms:, 0]
    return (np.sqrt(values[0]) / (2.0 * np.pi),
            2.0 * U @ mass @ V / (U @ mass @ U + V @ mass @ V))


@pytest.mark.parametrize("n", [2, 3])
def test_thick_ring_splits_waves_as_in_bryans_factor(n):
    """A solid ring, as thick as its mean radius: thin rings would split by 0.8 and 0.6."""
    inner, outer = 0.05, 0.15
    sector = curved_sector(np.linspace(inner, outer, 6), np.linspace(0.0, np.pi / 4.0, 5),
                           np.array([0.0, 0.01]))
    material = Material(2.1e11, 0.3, 7800.0)
    found = sector_modes(ElasticBody(sector, material), CyclicSymmetry("low", "high", 8), 9,
                         diameters=[n], rotation=Rotation(0.0))
    hertz, factor = waves_of_a_ring(inner, outer, n, material)
    assert waves_of_a_ring(0.099, 0.101, n, material)[1] == pytest.approx(
        -2.0 * n / (n**2 + 1), rel=1e-3)
    assert abs(factor / (2.0 * n / (n**2 + 1)) + 1.0) > 0.02
    plane = int(np.abs(found.frequencies_hz[0] - hertz).argmin())
    assert found.frequencies_hz[0, plane] == pytest.approx(hertz, rel=2e-3)
    speed = 1e-4 * 2.0 * np.pi * hertz
    forward, backward = (2.0 * np.pi * one[0] for one in found.rotation.frequencies_hz(speed))
    own = 2.0 * np.pi * hertz
    forward, backward = (one[np.abs(one - own).argmin()] for one in (forward, backward))
    assert (forward - backward) / (2.0 * speed) == pytest.approx(factor, rel=2e-3)
