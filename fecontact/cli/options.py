"""Arguments and options shared by several commands."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

StudyFile = Annotated[Path, Parameter(help="Study file; `fecontact init` writes one.")]
RunFile = Annotated[Path, Parameter(help="What `fecontact run` wrote, or the study it ran.")]
Trust = Annotated[bool, Parameter(
    negative=(), help="Run the code of laws in files of Python that the run names.")]
Changes = Annotated[list[str] | None, Parameter(
    name="--set", negative=(), show_default=False,
    help="A key of the study and its value, `ground.speed=0.1`; may be given several times.")]
Folder = Annotated[Path | None, Parameter(
    name=["--output", "-o"], help="Folder for the results, instead of that of the study.")]
