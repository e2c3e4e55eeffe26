"""``fecontact diameters``: the wheel of a study's sector, files, messages."""

import numpy as np
import pytest
from sectors import ring_sector

from fecontact import ElasticBody, InputError, write_mesh
from fecontact.cli import execute
from fecontact.fem import CyclicSymmetry, Rotation
from fecontact.plot import plot_diameters
from fecontact.reduction import sector_modes

SECTOR = """
geometry = { file = "sector.msh" }
basis = { contact = [] }
symmetry = { low = "bottom", high = "top", sectors = 5 }
[body]
thickness = 0.1
"""


def test_diameters_of_a_ring(tmp_path, capsys):
    write_mesh(ring_sector(5), tmp_path / "sector.msh")
    path = tmp_path / "ring.toml"
    path.write_text(SECTOR)
    assert execute(["diameters", str(path), "--modes", "3", "--speed", "500",
                    "-o", str(tmp_path)]) == 0
    assert "diameter" in capsys.readouterr().out
    table = np.genfromtxt(tmp_path / "ring-diameters.csv", delimiter=",", names=True)
    assert table["diameter"].tolist() == [0.0, 1.0, 2.0]
    assert table["frequency_hz_1"][2] > 0.0
    assert execute(["diameters", str(path), "--modes", "3", "-o", str(tmp_path), "--set",
                    "body.rotation.speed=50.0"]) == 0
    assert "backwards at 50 rad/s" in capsys.readouterr().out
    turning = np.genfromtxt(tmp_path / "ring-diameters.csv", delimiter=",", names=True)
    assert turning["frequency_hz_3"] == pytest.approx(table["frequency_hz_3"], rel=1e-9)
    forwards, backwards = sector_modes(
        ElasticBody(ring_sector(5), thickness=0.1), CyclicSymmetry("bottom", "top", 5), 3,
        rotation=Rotation(50.0)).rotation.frequencies_hz(50.0)
    assert turning["forwards_hz_2"] == pytest.approx(forwards[:, 1], rel=1e-6)
    assert turning["backwards_hz_3"] == pytest.approx(backwards[:, 2], rel=1e-6, nan_ok=True)
    for speed in ("0.0", "-50.0"):
        assert execute(["diameters", str(path), "--modes", "3", "-o", str(tmp_path), "--set",
                        f"body.rotation.speed={speed}"]) == 0
    for kind in ("diameters", "wheel"):
        assert (tmp_path / f"ring-{kind}.png").stat().st_size > 10_000


def test_sectors_that_do_not_close_the_circle(tmp_path, capsys):
    write_mesh(ring_sector(5), tmp_path / "sector.msh")
    path = tmp_path / "ring.toml"
    path.write_text(SECTOR.replace("5", "6"))
    assert execute(["diameters", str(path)]) != 0
    message = capsys.readouterr().err
    assert "[symmetry]" in message
    assert "give sectors = 5" in message
    assert execute(["modes", str(path)]) != 0
    assert "fecontact diameters" in capsys.readouterr().err
    path.write_text(SECTOR.replace("symmetry", "# symmetry"))
    assert execute(["diameters", str(path)]) != 0
    assert "one sector of a wheel" in capsys.readouterr().err


def test_the_picture_of_a_wheel_at_speed_shows_its_frequencies_there():
    ring = ElasticBody(ring_sector(5), thickness=0.1)
    found = sector_modes(ring, CyclicSymmetry("bottom", "top", 5), 3, rotation=Rotation(300.0))
    axis, = plot_diameters(found, speed=300.0).axes
    at_speed = np.hstack(found.rotation.frequencies_hz(300.0)).T
    assert len(axis.lines) == len(at_speed) + 1
    drawn = [line.get_ydata() for line in axis.lines[: len(at_speed)]]
    assert np.array(drawn) == pytest.approx(at_speed, nan_ok=True)
    axis, = plot_diameters(found, speed=-300.0).axes
    other_way = np.hstack(found.rotation.frequencies_hz(300.0)[::-1]).T
    drawn = [line.get_ydata() for line in axis.lines[: len(other_way)]]
    assert np.array(drawn) == pytest.approx(other_way, nan_ok=True)
    assert axis.lines[-1].get_ydata().min() == 0.0
    axis, = plot_diameters(found).axes
    drawn = [line.get_ydata() for line in axis.lines[:3]]
    assert np.array(drawn) == pytest.approx(found.frequencies_hz.T, nan_ok=True)
    with pytest.raises(InputError, match="leave it out for the frequencies at rest"):
        plot_diameters(found, speed=0.0)
