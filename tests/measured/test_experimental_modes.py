"""Modes found in frequency responses of systems whose modes are known."""

from dataclasses import replace

import numpy as np
import pytest

import fecontact as fc
from fecontact.core import extras
from fecontact.measured import (
    Channel,
    ExperimentalModes,
    Measurement,
    experimental_modes,
    modal_assurance,
)

# A chain of three masses on springs with damping in proportion to the stiffness, fixed at one end.
M = np.diag([2.0, 1.5, 1.0])
K = 1e5 * np.array([[6.0, -2.0, 0.0], [-2.0, 5.0, -3.0], [0.0, -3.0, 3.0]])
D = 2e-5 * K
SQUARES, SHAPES = np.linalg.eig(np.linalg.inv(M) @ K)
W = np.sqrt(np.sort(SQUARES))
SHAPES = SHAPES[:, SQUARES.argsort()]
SHAPES = SHAPES / np.sqrt(np.einsum("ik,ij,jk->k", SHAPES, M, SHAPES))
HERTZ = W / (2.0 * np.pi)
RATIOS = 0.5 * 2e-5 * W
UNITS = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s^2/N"}


def responses(kind="receptance", noise=0.0, low=20.0):
    """Responses of the three masses to a force on the last one."""
    f = np.arange(low, 200.0, 0.25)
    w = 2.0 * np.pi * f
    H = np.linalg.solve(K - w[:, None, None]**2 * M + 1j * w[:, None, None] * D,
                        np.array([0.0, 0.0, 1.0])[:, None])[..., 0]
    H = H * (1j * w[:, None]) ** list(UNITS).index(kind)
    rng = np.random.default_rng(3)
    H = H + noise * np.abs(H).mean() * (rng.standard_normal(H.shape)
                                        + 1j * rng.standard_normal(H.shape))
    return Measurement(f, H, tuple(Channel(f"H{k}", UNITS[kind]) for k in range(3)), "frequency")


@pytest.mark.parametrize("kind", list(UNITS))
def test_modes_of_a_chain_are_found(kind):
    measured = responses(kind)
    found = experimental_modes(measured, HERTZ * [1.02, 0.98, 1.01])
    assert found.frequencies_hz == pytest.approx(HERTZ, rel=1e-6)
    assert found.damping_ratios == pytest.approx(RATIOS, rel=1e-4)
    assert np.diag(modal_assurance(found.shapes, SHAPES)) == pytest.approx(1.0, abs=1e-6)
    # Of a system with proportional damping R = x x_r / (2 i w sqrt(1 - D^2)).
    exact = SHAPES * SHAPES[2] / (2j * W * np.sqrt(1.0 - RATIOS**2))
    assert np.abs(found.residues - exact).max() < 1e-5 * np.abs(exact).max()
    known = np.isfinite(found.synthesised).all(axis=1)
    assert known.sum() == len(measured) - 1
    off = np.abs(found.synthesised - measured.values)[known]
    assert off.max() < 1e-5 * np.abs(measured.values).max()
    assert len(found.rows()) == 3


def test_noise_is_borne():
    found = experimental_modes(responses("accelerance", noise=0.02), HERTZ)
    assert found.frequencies_hz == pytest.approx(HERTZ, rel=2e-3)
    assert found.damping_ratios == pytest.approx(RATIOS, rel=0.2)
    assert np.diag(modal_assurance(found.shapes, SHAPES)).min() > 0.98
    assert (found.stable >= 3).all()
    assert (found.scatter < 0.2).all()
    assert "damping" in repr(found)
    assert isinstance(found, ExperimentalModes)


GOOD = responses()


@pytest.mark.parametrize(("call", "told"), [
    (lambda: experimental_modes(3, HERTZ), "measured must be"),
    (lambda: experimental_modes(replace(GOOD, axis="time"), HERTZ), "must be frequency responses"),
    (lambda: experimental_modes(GOOD, [300.0]), "must lie between 20 and"),
    (lambda: experimental_modes(GOOD, []), "must lie between"),
    (lambda: experimental_modes(GOOD, HERTZ, order=2), "order = 2"),
    (lambda: experimental_modes(replace(GOOD, abscissa=GOOD.abscissa + 0.1), HERTZ),
     "multiples of one step"),
    (lambda: experimental_modes(replace(GOOD, values=GOOD.values * np.nan), HERTZ), "not finite"),
    (lambda: experimental_modes(replace(GOOD, channels=tuple(
        replace(one, unit=unit) for one, unit in zip(GOOD.channels, UNITS.values(),
                                                     strict=True))), HERTZ), "have the units"),
])
def test_wrong_input_is_told_in_one_sentence(call, told):
    with pytest.raises(fc.InputError, match=told):
        call()


def test_frequencies_without_a_mode_are_named(monkeypatch):
    with pytest.raises(fc.AnalysisError, match="no stable pole near 180 Hz"):
        experimental_modes(GOOD, [180.0])
    with pytest.raises(fc.AnalysisError, match="the same pole"):
        experimental_modes(GOOD, [HERTZ[0], 1.01 * HERTZ[0]])

    def missing(module):
        raise ImportError(module)

    monkeypatch.setattr(extras, "import_module", missing)
    with pytest.raises(fc.MissingLibraryError, match=r"fecontact\[modal\]"):
        experimental_modes(GOOD, HERTZ)
