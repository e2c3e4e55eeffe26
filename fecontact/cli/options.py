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
    help="Override a key of the study, ground.speed=0.1; may be repeated.")]
Folder = Annotated[Path | None, Parameter(
    name=["--output", "-o"], help="Folder of the results; by default that of the study.")]
Branches = Annotated[str | None, Parameter(
    name="--branch", help="Of a file of branches: name of one, or its number from 0; of a level.")]
At = Annotated[float | None, Parameter(
    help="Of a file of branches: the orbit at this value of the parameter, a frequency in Hz; of a "
    "nonlinear mode that of this amplitude [m]; by default that of the largest observed "
    "amplitude.")]
Which = Annotated[int, Parameter(
    help="Which of several orbits at this value, counted along the branch from 0.")]
All = Annotated[bool, Parameter(
    name="--all", negative=(), help="Beyond the frequency up to which the basis is usable, too.")]
