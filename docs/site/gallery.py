"""The gallery: a page for each example, with its pictures, what it prints, and its source."""

import ast
import html
import re
import shutil
from pathlib import Path

from runs import ROOT, Job, python, with_imports

EXAMPLES = ROOT / "examples"
DOCS = ROOT / "docs"
GROUPS = {
    "Squeal and stick-slip": (
        "squeal", "disc_and_pads", "disc_brake", "beam_stick_slip", "friction_oscillator",
        "two_mass_friction", "sliding_beam", "sliding_borders"),
    "Impacts": ("impact_oscillator", "impact_figures", "impact_map", "impact_orbits",
                "impact_calibration", "colliding_bars", "million_starts"),
    "Contact pressure and partial slip": (
        "line_contact", "two_bodies", "two_spheres", "pressed_sphere", "stacked_blocks",
        "contact_convergence"),
    "Joints and dampers": ("lap_joint", "bolted_plate", "bolted_panel", "clamped_layers",
                           "friction_damper",
                           "frequency_response", "blade_pair", "bladed_wheel",
                           "platform_damper", "nonlinear_modes"),
    "Solids": ("sliding_box", "thrown_block", "dithered_friction", "tipping_pad"),
    "Own laws, other programs, many computers": (
        "own_law", "from_other_programs", "sweep_on_dask"),
}
# These need files that are no part of the package.
LEFT_OUT = ("brake_reuss_beam",)
# Pictures of the long form, of what the short one shows too little.
WHOLE = {"beam_stick_slip": "beam_stick_slip.png", "impact_orbits": "impact_orbits.png",
         "two_mass_friction": "two_masses_over_B.png",
         "impact_map": "validation/impact-bifurcation.png"}
USAGE = re.compile(r"^Usage: (.*(?:\n.+)*)", re.MULTILINE)


def jobs() -> list[Job]:
    """How all examples are run."""
    return [Job(name, python(str(EXAMPLES / f"{name}.py"), "--quick"),
                with_imports(EXAMPLES / f"{name}.py"), "example")
            for group in GROUPS.values() for name in group]


def words(name: str) -> tuple[str, str]:
    """Title and description of an example, from its docstring."""
    text = ast.get_docstring(ast.parse((EXAMPLES / f"{name}.py").read_text(encoding="utf-8")))
    assert text is not None
    title, _, rest = USAGE.sub("", text).partition("\n")
    # Formulas stand indented; names such as p_0 and products a * b are no emphasis.
    rest = "\n".join(line if line.startswith("    ") else line.replace("*", r"\*")
                     for line in rest.strip().splitlines())
    return title.rstrip("."), rest


def usage(name: str) -> str:
    """How the example is called."""
    found = USAGE.search((EXAMPLES / f"{name}.py").read_text(encoding="utf-8"))
    assert found is not None
    return found[1].split('"""')[0].split("   ")[0].split("\n")[0].strip()


def made(folder: Path | None, ending: str) -> list[Path]:
    """Files of a kind that an example wrote."""
    return [] if folder is None else sorted((folder / "files").rglob(f"*.{ending}"))


def page(name: str, folder: Path | None) -> str:
    """The page of an example; without results it shows the source alone."""
    title, rest = words(name)
    parts = [f"# {title}", rest]
    pictures = made(folder, "png")
    if name in WHOLE:
        parts.append(image(name, DOCS / "images" / WHOLE[name]))
        if pictures:
            parts.append("With `--quick` the example draws")
    parts += [image(name, picture) for picture in pictures]
    for movie in made(folder, "mp4"):
        parts.append(f'<video src="../_static/gallery/{name}/{movie.name}" controls loop muted '
                     'style="max-width: 100%"></video>')
    if folder is not None:
        printed = (folder / "printed.txt").read_text(encoding="utf-8").rstrip()
        if printed:
            parts.append(f"In its short form (`--quick`) it prints\n\n```text\n{printed}\n```")
    parts.append(f"    {usage(name)}")
    parts.append(f"## Source\n\n```{{literalinclude}} ../../examples/{name}.py\n"
                 ":language: python\n```")
    return "\n\n".join(parts) + "\n"


def image(name: str, picture: Path) -> str:
    """A picture of an example within its page."""
    said = html.escape(picture.stem.replace("_", " ").replace("-", " "))
    return (f'<img src="../_static/gallery/{name}/{picture.name}" alt="{said}" loading="lazy">')


def card(name: str, folder: Path | None) -> str:
    """What the gallery shows of an example."""
    title, _ = words(name)
    pictures = made(folder, "png")
    if pictures or name in WHOLE:
        shown = (Path(WHOLE[name]) if name in WHOLE
                 else max(pictures, key=lambda path: path.stat().st_size))
        top = f'<img src="../_static/gallery/{name}/{shown.name}" alt="" loading="lazy">'
    else:
        text = "" if folder is None else (folder / "printed.txt").read_text(encoding="utf-8")
        if not text:
            text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
        lines = [line[:90] for line in text.splitlines()[:18]]
        top = f"<pre>{html.escape(chr(10).join(line or ' ' for line in lines))}</pre>"
    return (f'<a href="{name}.html">{top}<b>{html.escape(title)}</b>'
            f"<span>{name}.py</span></a>")


def index(folders: dict[str, Path]) -> str:
    """The first page of the gallery."""
    parts = ["# Gallery", "Every script of `examples/`, run in its short form as this site was "
             "built. Each takes a folder for its pictures; without `--quick` it computes the whole "
             "picture."]
    for group, names in GROUPS.items():
        cards = "\n".join(card(name, folders.get(f"example/{name}")) for name in names)
        parts.append(f'## {group}\n\n<div class="gallery">\n{cards}\n</div>')
        entries = "\n".join(f"{words(name)[0].split(':')[0]} <{name}>" for name in names)
        parts.append(f"```{{toctree}}\n:hidden:\n\n{entries}\n```")
    parts.append("## Study files\n\n[Whole studies](studies.md) for the command line.\n\n"
                 "```{toctree}\n:hidden:\n\nstudies\n```")
    return "\n\n".join(parts) + "\n"


def studies() -> str:
    """A page with the study files; tests and other examples run them."""
    parts = ["# Study files", "Each is a whole study for the command line; comments say what it "
             "is and which command suits it. All keys are in the [reference](../study.md)."]
    parts += [f"## {path.stem.replace('_', ' ').capitalize()}\n\n"
              f"```{{literalinclude}} ../../examples/{path.name}\n:language: toml\n```"
              for path in sorted(EXAMPLES.glob("*.toml"))]
    return "\n\n".join(parts) + "\n"


def copy_pictures(folders: dict[str, Path], static: Path) -> None:
    """Copy pictures and movies to where the pages look for them."""
    shutil.rmtree(static / "gallery", ignore_errors=True)
    for names in GROUPS.values():
        for name in names:
            folder, target = folders.get(f"example/{name}"), static / "gallery" / name
            target.mkdir(parents=True)
            for path in (*made(folder, "png"), *made(folder, "mp4")):
                shutil.copy2(path, target / path.name)
            if name in WHOLE:
                shutil.copy2(DOCS / "images" / WHOLE[name], target / Path(WHOLE[name]).name)
