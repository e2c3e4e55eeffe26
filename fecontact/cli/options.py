"""Arguments and options shared by several commands."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

StudyFile = Annotated[Path, Parameter(help="Study file; fecontact init writes one.")]
RunFile = Annotated[Path, Parameter(
    help="A file written by fecontact run, its folder, or its study.")]
Trust = Annotated[bool, Parameter(
    negative=(), help="Execute user-defined laws in Python files that the run names.")]
Changes = Annotated[list[str] | None, Parameter(
    name="--set", negative=(), show_default=False,
    help="Override a key of the study, as in ground.speed=0.1. May be repeated.")]
Folder = Annotated[Path | None, Parameter(
    name=["--output", "-o"],
    help="Folder of the results; by default the folder in [output] of the study.")]
Branches = Annotated[str | None, Parameter(
    name="--branch",
    help="Name or number (from 0) of a branch in a file of branches, or of a level of a response.")]
At = Annotated[float | None, Parameter(
    help="Value at which an orbit is taken from a file of branches: the parameter (a frequency in "
    "Hz), or the amplitude [m] of a nonlinear mode. By default the orbit with the largest observed "
    "amplitude is taken.")]
Which = Annotated[int, Parameter(
    help="Number of the orbit if several have the value of --at, counted along the branch from 0.")]
All = Annotated[bool, Parameter(
    name="--all", negative=(),
    help="Show also modes above the highest frequency at which the basis is accurate.")]
