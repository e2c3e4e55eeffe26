"""The gallery: how Sphinx-Gallery orders the examples, runs them and finds what they wrote."""

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build" / "site" / "examples"  # where they run: pictures do not end in the sources
HEADER = """
Gallery
=======

Every script of ``examples``, as it stands, with what it prints and draws: squeal and stick-slip,
impacts, contact pressure, joints and dampers, wheels, solids on the move, laws of your own and
bodies of other programs.
"""
ORDER = (
    "squeal", "disc_brake", "beam_stick_slip", "friction_oscillator", "two_mass_friction",
    "beating_friction", "sliding_beam", "sliding_borders",
    "impact_oscillator", "impact_map", "impact_orbits", "million_starts", "colliding_bars",
    "line_contact", "two_bodies", "pressed_sphere", "half_space",
    "lap_joint", "clamped_layers", "bolted_panel", "brake_reuss_beam", "shaken_beam",
    "frequency_response", "friction_damper", "nonlinear_modes", "platform_damper", "bladed_wheel",
    "tipping_pad", "thrown_block",
    "own_law", "from_other_programs", "sweep")


def copied() -> str:
    """Copy the examples to where they run; the folder."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    shutil.copytree(ROOT / "examples", FOLDER, ignore=shutil.ignore_patterns("__pycache__"))
    (FOLDER / "GALLERY_HEADER.rst").write_text(HEADER, encoding="utf-8")
    return str(FOLDER)


def in_order(name: str) -> int:
    """Place of an example in the gallery."""
    return ORDER.index(Path(name).stem)


def written(block: Any, variables: dict[str, Any], settings: dict[str, Any]) -> str:
    """Take the pictures and movies that a block of an example wrote into its page."""
    pictures, shown = [], ""
    for path in sorted(FOLDER.glob("*.png"), key=lambda one: one.stat().st_mtime_ns):
        pictures.append(next(variables["image_path_iterator"]))
        shutil.move(path, pictures[-1])
    if pictures:
        shown = figure_rst(pictures, settings["src_dir"])
    for path in FOLDER.glob("*.mp4"):
        kept = Path(settings["src_dir"]) / "_static" / "gallery" / path.name
        kept.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(path, kept)
        shown += (f'\n.. raw:: html\n\n   <video src="../_static/gallery/{path.name}" controls '
                  'loop muted style="max-width: 100%"></video>\n')
    return shown


def emptied(settings: dict[str, Any], name: str) -> None:
    """Remove folders that an example before left where the next one runs."""
    for path in FOLDER.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
