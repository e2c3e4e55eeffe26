"""Commands about fecontact itself: ``compile``, ``demo``, ``doctor``, ``keys``, ``laws``."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from fecontact.cli.console import echo, show
from fecontact.core.errors import InputError


def doctor() -> int:
    """Check that all libraries are installed and work; print how to install missing ones."""
    from fecontact.cli.console import waiting
    from fecontact.cli.doctor import examine
    from fecontact.cli.tables import table

    with waiting("Looking"):
        found = examine()
    rows = [(finding.what if finding.works else f"MISSING {finding.what}", finding.detail)
            for finding in found]
    show(table("", "", left=2, rows=rows))
    remedies = dict.fromkeys(finding.remedy for finding in found if not finding.works)
    for remedy in filter(None, remedies):
        echo(f"To repair: {remedy}")
    if remedies:
        return 1
    echo("All is well.")
    return 0


def laws(
    name: Annotated[str | None, Parameter(help=(
        "A law to explain, or a word to find some, like Stribeck; your own law, FILE.py:CLASS, is "
        "also checked."))]
    = None,
    /,
) -> None:
    """List the laws of contact, friction, ground and drive, or explain one."""
    from rich import print as show

    from fecontact.cli.law_help import law_help, laws_meant, laws_table

    meant = [] if name is None else laws_meant(name)
    if name is None:
        show(laws_table())
    elif meant:
        show(laws_table(meant))
        print("`fecontact laws LAW` explains one of them.")
    else:
        print(law_help(name))


def keys(
    section: Annotated[str | None, Parameter(
        help="A section, such as ground.profile, or a word to find keys, like speed.")] = None, /,
) -> None:
    """Print the sections and keys of study files: types, defaults, units and meaning."""
    from fecontact.cli.console import loading

    with loading():
        from fecontact.study.reference_page import study_keys
        from fecontact.sweeps.summaries import summaries_table
    print(study_keys(section, {"sweep": summaries_table()}), end="")


def compile_(
    *,
    everything: Annotated[bool, Parameter(name="--all", help=(
        "All kernels, also those of branches, responses and set-valued friction."))] = False,
    wheel: Annotated[Path | None, Parameter(help=(
        "Write a wheel of all kernels for other machines to this folder instead."))] = None,
    cpu: Annotated[list[str] | None, Parameter(negative=(), help=(
        "Processors of the wheel: x86-64-v3, x86-64-v2, arm64; by default all of the kind of "
        "this machine."
    ))] = None,
) -> int:
    """Compile the kernels of runs in advance, once on a machine; the first run then starts at once.

    Not needed after pip install 'fecontact[kernels]', which installs compiled kernels.
    """
    from fecontact.cli.kernels import build_package, compile_kernels

    if wheel is not None:
        from fecontact.core.stored_code import own_families

        echo(str(build_package(wheel, cpu or own_families())))
        return 0
    if cpu:
        raise InputError("--cpu is for a package of kernels; give --wheel FOLDER too.")
    count, size = compile_kernels("all" if everything else "runs")
    echo(f"{count} kernels are compiled; the cache has {size / 1e6:.0f} MB.")
    return 0


def demo(
    folder: Annotated[Path, Parameter(help="Folder of the results.")] = Path("demo-output"), /,
) -> int:
    """Run three studies, geometry to movie: a beam on wavy ground, a pendulum, a solid pad."""
    from fecontact.cli.demo import run_demo

    return run_demo(folder)
