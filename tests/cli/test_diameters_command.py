"""``fecontact diameters``: the wheel of a study's sector, files, messages."""

import numpy as np
from sectors import ring_sector

from fecontact import write_mesh
from fecontact.cli import execute

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
