"""A run that ends at an event chosen by the user."""

from fecontact import Status, read_case
from fecontact.cli import execute

FALLING = """
geometry = { shape = "beam", length = 0.1, height = 0.01, element_size = 0.01 }
body = { material = "steel", thickness = 0.02 }
basis = { modes = 3, contact_nodes = 4 }
normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
load = { normal = 10.0 }
output = { frames = 0 }

[simulation]
t_end = 0.1
outputs = 11
events = true
stop = ["touch-down"]
initial = { displacement = [0.0, 1e-3, 0.0] }
"""


def test_a_run_that_ends_at_its_event_succeeds(tmp_path, monkeypatch, capsys):
    """From 1 mm above the ground the load reaches it after sqrt(2 h m / N)."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "falling.toml").write_text(FALLING)
    assert execute(["run", "falling.toml"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "The run ended at an event." in said.out
    run = read_case("results/falling.vtkhdf").trajectory
    assert run.status is Status.EVENT
    mass = 7850.0 * 0.1 * 0.01 * 0.02
    assert abs(run.time[-1] / (2.0 * 1e-3 * mass / 10.0) ** 0.5 - 1.0) < 1e-3
