"""Makes the pictures in docs/images again: ``python docs/site/page_images.py [NAME ...]``.

Names are those of the files without ending; by default all, in twenty minutes on two cores. Those
of docs/images/validation belong to ``make validation``.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs" / "validation"))

from pictures import shrink  # noqa: E402

IMAGES = ROOT / "docs" / "images"
EXAMPLES = ROOT / "examples"
CASES = ROOT / "docs" / "validation" / "cases"
LARGEST = 200_000  # bytes
SHOWN_AT = 0.1047  # s, of the beam on wavy ground


def command(folder: Path, *arguments: str) -> None:
    """Run fecontact in a folder."""
    subprocess.run([sys.executable, "-m", "fecontact", *arguments], cwd=folder, check=True)


def example(folder: Path, name: str, count: int | None = None) -> None:
    """Run an example in a folder, or with another ``count`` than it has."""
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    if count is not None:
        text, changed = re.subn(r"^count = \d+$", f"count = {count}", text, flags=re.MULTILINE)
        assert changed == 1
    _written(folder / f"{name}.py", text)
    subprocess.run([sys.executable, f"{name}.py"], cwd=folder, check=True)


def case(folder: Path, name: str, *arguments: str) -> None:
    """Run a case of the validation page in a folder."""
    subprocess.run([sys.executable, str(CASES / f"{name}.py"), *arguments], cwd=folder, check=True)


def studied(folder: Path, name: str, *arguments: str) -> Path:
    """Run a command with an example's study in a folder; the folder of its results."""
    shutil.copy2(EXAMPLES / f"{name}.toml", folder)
    command(folder, *arguments, f"{name}.toml")
    return folder / "results"


def beam(folder: Path) -> dict[str, Path]:
    """The demonstration's beam: a picture, its contact map, its report."""
    from fecontact import Study
    from fecontact.cli.templates import TEMPLATES, template
    from fecontact.io import report
    from fecontact.plot import picture, plot_contact_map

    study = Study.read(_written(folder / f"{TEMPLATES['beam']}.toml", template("beam")))
    run, how = study.run(), study.render
    made = {name: folder / f"{name}.png" for name in ("beam_on_wavy_ground", "contact_map",
                                                      "report")}
    picture(run, made["beam_on_wavy_ground"], time=SHOWN_AT, size=how.size, colour=how.colour,
            scale=how.scale, title=how.title)
    plot_contact_map(run, path=made["contact_map"])
    page = report(run, folder / "run.html", title=how.title, study=study.to_toml(defaults=False))
    if not _photographed(page, made["report"]):
        del made["report"]
    return made


def solid(folder: Path) -> dict[str, Path]:
    """The solid pad on a belt: a picture, and its report seen from below."""
    from fecontact import Study
    from fecontact.cli.templates import TEMPLATES, template
    from fecontact.io import report
    from fecontact.plot import picture

    study = Study.read(_written(folder / f"{TEMPLATES['solid']}.toml", template("solid")))
    run, how = study.run(), study.render
    made = {name: folder / f"{name}.png" for name in ("solid_on_belt", "report-solid")}
    picture(run, made["solid_on_belt"], time=0.45 * run.time[-1], size=how.size,
            colour="von_mises", scale=how.scale, title=how.title)
    page = report(run, folder / "run.html", title=how.title, study=study.to_toml(defaults=False))
    if not _photographed(page, made["report-solid"], "below"):
        del made["report-solid"]
    return made


def _written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def _photographed(page: Path, path: Path, view: str = "") -> bool:
    """Screenshot of a report, without a browser none."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        print("report: there is no Chromium; its picture is left as it is", file=sys.stderr)
        return False
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=[
            "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        shown = browser.new_page(viewport={"width": 1400, "height": 920})
        shown.goto(page.as_uri())
        shown.wait_for_selector("html[data-ready]", state="attached", timeout=60_000)
        shown.evaluate("() => { const one = document.querySelector('.scrub');"
                       "one.value = 430; one.oninput(); }")
        if view:
            shown.get_by_label("view").select_option(view)
        shown.wait_for_timeout(500)
        shown.screenshot(path=path)
        browser.close()
    return True


def squeal(folder: Path) -> dict[str, Path]:
    """The flutter of a beam on a belt."""
    example(folder, "squeal")
    return {"flutter_modes": folder / "squeal_modes.png"}


def half_space(folder: Path) -> dict[str, Path]:
    """A rough surface pressed and sheared."""
    example(folder, "half_space")
    return {"half_space": folder / "half_space.png"}


def tori(folder: Path) -> dict[str, Path]:
    """Tori and orbits of a block on a wavy belt."""
    example(folder, "beating_friction")
    return {"tori": folder / "tori.png"}


def block(folder: Path) -> dict[str, Path]:
    """Stick-slip of a block over the speed of its belt."""
    results = studied(folder, "friction_branch", "branch")
    return {"block_over_speed": results / "friction_branch-branch.png"}


def sweep(folder: Path) -> dict[str, Path]:
    """A map of that over speed and friction."""
    results = studied(folder, "sweep_stick_slip", "sweep")
    return {"sweep_map": results / "sweep_stick_slip-sweep" / "amplitude_x.png"}


def stick_slip(folder: Path) -> dict[str, Path]:
    """Stick-slip of a beam."""
    case(folder, "beam_stick_slip", "beam_stick_slip.png")
    return {"beam_stick_slip": folder / "beam_stick_slip.png"}


def orbits(folder: Path) -> dict[str, Path]:
    """The orbits of the impact oscillator, and a part of them."""
    case(folder, "impact_orbits", ".")
    return {name: folder / f"{name}.png" for name in ("impact_orbits", "impact_doublings")}


def two_masses(folder: Path) -> dict[str, Path]:
    """Branches of two masses on a belt."""
    example(folder, "two_mass_friction")
    return {"two_masses_over_B": folder / "two_masses_over_B.png"}


def responses(folder: Path) -> dict[str, Path]:
    """Frequency responses of a friction damper and of a hardening spring."""
    example(folder, "frequency_response")
    return {name: folder / f"{name}.png" for name in ("friction_damper_response",
                                                      "hardening_response")}


def blades(folder: Path) -> dict[str, Path]:
    """Responses of two blades with a damper between them."""
    case(folder, "blade_pair", ".")
    case(folder, "platform_damper", ".")
    return {name: folder / f"{name}.png" for name in ("blade_pair", "platform_damper")}


def many_runs(folder: Path) -> dict[str, Path]:
    """A million starts and a hundred thousand frequencies of an impact oscillator."""
    example(folder, "million_starts", 1000)
    example(folder, "impact_map", 100_000)
    return {"million_starts": folder / "million_starts.png",
            "hundred_thousand_frequencies": folder / "impact_map.png"}


def modes(folder: Path) -> dict[str, Path]:
    """Nonlinear modes of a beam with a damper, and of two masses."""
    case(folder, "nonlinear_modes", ".")
    return {name: folder / f"{name}.png" for name in ("damped_beam_mode", "damped_beam_responses",
                                                      "internal_resonance")}


def panel(folder: Path) -> dict[str, Path]:
    """Nonlinear mode of a thin panel between bolted ends."""
    example(folder, "bolted_panel")
    return {"bolted_panel": folder / "bolted_panel.png"}


def joint(folder: Path) -> dict[str, Path]:
    """Responses of a bolted joint, by the code of its page."""
    page = (ROOT / "docs" / "bolted-joint.md").read_text(encoding="utf-8")
    _written(folder / "page.py", "\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL)))
    subprocess.run([sys.executable, "page.py"], cwd=folder, check=True)
    return {"bolted_joint": folder / "response.png"}


MAKERS: dict[Callable[[Path], dict[str, Path]], tuple[str, ...]] = {
    beam: ("beam_on_wavy_ground", "contact_map", "report"),
    solid: ("solid_on_belt", "report-solid"), squeal: ("flutter_modes",), tori: ("tori",),
    half_space: ("half_space",),
    block: ("block_over_speed",), sweep: ("sweep_map",), stick_slip: ("beam_stick_slip",),
    orbits: ("impact_orbits", "impact_doublings"), two_masses: ("two_masses_over_B",),
    responses: ("friction_damper_response", "hardening_response"),
    blades: ("blade_pair", "platform_damper"),
    many_runs: ("million_starts", "hundred_thousand_frequencies"),
    panel: ("bolted_panel",), joint: ("bolted_joint",),
    modes: ("damped_beam_mode", "damped_beam_responses", "internal_resonance")}


def main(names: set[str]) -> None:
    """Make the pictures of these names."""
    known = {name for made in MAKERS.values() for name in made}
    if names - known:
        raise SystemExit(f"There is no picture {min(names - known)}; choose from "
                         f"{', '.join(sorted(known))}.")
    os.environ.setdefault("PYTHONPATH", str(ROOT))
    for make, made in MAKERS.items():
        if names and not names & set(made):
            continue
        with tempfile.TemporaryDirectory() as folder:
            for name, path in make(Path(folder)).items():
                if not names or name in names:
                    shrink(path, IMAGES / f"{name}.png", LARGEST, (None, 256, 128, 64))
                    print(f"{name}: {(IMAGES / f'{name}.png').stat().st_size} bytes", flush=True)


if __name__ == "__main__":
    main(set(sys.argv[1:]))
