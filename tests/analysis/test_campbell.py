"""Campbell diagrams: a rotor of closed form, a disc, the command."""

from dataclasses import replace

import numpy as np
import pytest

from fecontact import ElasticBody, InputError, basis_from_matrices, generate, modal_basis
from fecontact.analysis import campbell
from fecontact.cli import execute
from fecontact.fem import Ring, Rotation
from fecontact.plot import plot_campbell
from fecontact.reduction import ModalRotation

W0 = 100.0


def rotor(damping=0.0):
    """One mass on an isotropic shaft in the frame that rotates: |w0 + W| and |w0 - W|."""
    row = np.eye(3, 2)
    still = basis_from_matrices(np.eye(2), W0**2 * np.eye(2), {"contact": row[None], "B": row},
                                damping=damping * np.eye(2))
    return replace(still, rotation=ModalRotation(
        0.0, 2.0 * np.array([[0.0, -1.0], [1.0, 0.0]]), -np.eye(2), np.zeros(2)))


def test_shaft_in_the_rotating_frame():
    speeds = np.linspace(0.0, 250.0, 101)
    diagram = campbell(rotor(), speeds)
    expected = np.sort(np.abs(np.column_stack([W0 - speeds, W0 + speeds])), axis=1)
    assert 2.0 * np.pi * np.sort(diagram.frequencies_hz, axis=1) == pytest.approx(
        expected, abs=1e-5 * W0)
    # Each line goes on straight where the lower one touches zero.
    slopes = np.diff(diagram.eigenvalues.imag, axis=0) / np.diff(speeds)[:, None]
    assert np.abs(np.abs(slopes) - 1.0).max() < 1e-6
    assert diagram.critical_speeds(0.0) == pytest.approx([W0])
    assert diagram.critical_speeds(1.0) == pytest.approx([0.5 * W0])
    assert diagram.critical_speeds(2.0) == pytest.approx([W0 / 3.0, W0])
    assert "at none" in str(diagram)


def test_damping_that_rotates_makes_the_shaft_grow_beyond_its_frequency():
    diagram = campbell(rotor(2.0), np.linspace(0.0, 150.0, 31))
    grows = (diagram.damping_ratios < -1e-9).any(axis=1)
    assert (grows == (diagram.speeds > W0 + 1e-9)).all()
    assert "from 105 rad/s" in str(diagram)


def test_disc_and_its_picture():
    """Bending modes of a clamped disc rise with c W^2 (Southwell), pairs stay together."""
    disc = ElasticBody(generate(Ring(0.2, 0.05, 0.005, element_size=0.05, layers=1)),
                       fixed={"inner": "xyz"})
    basis = modal_basis(disc, 12, contact=(), rotation=Rotation(0.0))
    diagram = campbell(basis, np.linspace(0.0, 400.0, 5), count=5)
    squares = (2.0 * np.pi * diagram.frequencies_hz) ** 2
    factor = (squares[1:] - squares[0]) / diagram.speeds[1:, None] ** 2
    # Axial motion has no Coriolis forces; k (k + 2)(3 + nu)/8 - n^2 (1 + 3 nu)/8 and the clamp's.
    assert np.ptp(factor, axis=0) == pytest.approx(np.zeros(5), abs=5e-2)
    assert (factor > 0.9).all()
    figure = plot_campbell(diagram, orders=(1, 2))
    assert len(figure.axes[0].lines) == 5 + 2 * 2


def test_bad_diagrams_are_refused():
    with pytest.raises(InputError, match="does not rotate"):
        campbell(replace(rotor(), rotation=None), [0.0, 1.0])
    for speeds in ([0.0], [1.0, 0.0], [0.0, np.inf], "a"):
        with pytest.raises(InputError, match="speeds"):
            campbell(rotor(), speeds)
    with pytest.raises(InputError, match="count = 0"):
        campbell(rotor(), [0.0, 1.0], count=0)
    with pytest.raises(InputError, match="order = -1"):
        campbell(rotor(), [0.0, 1.0]).critical_speeds(-1.0)


def test_campbell_command(tmp_path, capsys):
    path = tmp_path / "disc.toml"
    path.write_text("""
geometry = { shape = "ring", outer_radius = 0.2, inner_radius = 0.05, thickness = 0.005, \
element_size = 0.08, layers = 1 }
basis = { modes = 8, contact = [] }
body = { fixed = { inner = "xyz" }, rotation = { speed = 10.0 } }
""")
    assert execute(["campbell", str(path), "--speeds", "0", "600", "--points", "9", "--orders",
                    "1", "2", "-o", str(tmp_path)]) == 0
    assert "critical speeds" in capsys.readouterr().out
    table = np.genfromtxt(tmp_path / "disc-campbell.csv", delimiter=",", names=True)
    assert len(table) == 9
    assert (tmp_path / "disc-campbell.png").stat().st_size > 10_000
    assert execute(["campbell", str(path), "--speeds", "0", "0"]) != 0
    path.write_text(path.read_text().replace(", rotation = { speed = 10.0 }", ""))
    assert execute(["campbell", str(path), "--speeds", "0", "600"]) != 0
    assert "body.rotation" in capsys.readouterr().err
