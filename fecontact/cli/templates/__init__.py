"""Template study files; the demonstration runs three of them."""

from importlib.resources import files

TEMPLATES = {"beam": "beam_on_wavy_ground", "pendulum": "pendulum_on_stop",
             "block": "block_on_belt", "pad": "pad_on_block", "solid": "pad_on_belt",
             "mesh": "own_mesh", "sweep": "sweep_of_block", "response": "response_of_block"}


def template(shape: str) -> str:
    """Text of a template by the name that ``fecontact init --shape`` takes."""
    return files(__name__).joinpath(f"{TEMPLATES[shape]}.toml").read_text(encoding="utf-8")
