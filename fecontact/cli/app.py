"""The commands of ``fecontact``, in the order of their use.

Slow libraries are imported inside the commands, so that help appears at once.
"""

from collections.abc import Callable
from inspect import cleandoc
from typing import Annotated, Any, Literal

from cyclopts import App, Parameter

from fecontact.cli.commands import (
    about,
    branch,
    compare,
    data,
    fit,
    response,
    run,
    study,
    sweep,
    turning,
)
from fecontact.core.errors import InputError


def completion(
    shell: Annotated[Literal["bash", "zsh", "fish", "powershell"], Parameter(
        help="The shell to write for.")],
    /,
) -> None:
    """Print a shell script that completes commands and options, to be loaded by your shell."""
    try:
        script = app.generate_completion(shell=shell)
    except ValueError as error:
        raise InputError(f"the installed cyclopts writes no completion for {shell}; install a "
                         f"newer one with pip install --upgrade cyclopts.") from error
    print(script, end="")


COMMANDS: tuple[Callable[..., int | None], ...] = (
    study.init,
    study.import_,
    study.mesh,
    study.modes,
    turning.buckling,
    turning.campbell,
    turning.diameters,
    turning.mistuning,
    study.preload,
    study.run,
    study.wear,
    sweep.sweep,
    branch.branch,
    response.response,
    compare.compare,
    data.data,
    data.measure,
    fit.fit,
    run.report,
    run.render,
    run.plot,
    run.export,
    run.open,
    about.keys,
    about.laws,
    about.demo,
    about.doctor,
    about.compile_,
    completion,
)


def _version() -> str:
    from fecontact import __version__

    return __version__


app = App(
    name="fecontact",
    help="Elastic bodies in contact with friction: from a study file to modes, motion and movies.",
    version=_version,
    help_format="plaintext",
    suppress_keyboard_interrupt=False,
    default_parameter=Parameter(negative=()),
)
app.meta.suppress_keyboard_interrupt = False


def _plain(docstring: str) -> str:
    """Paragraphs of one line each, as plain text is shown; Markdown takes long to load."""
    return "\n\n".join(text.replace("\n", " ") for text in cleandoc(docstring).split("\n\n"))


for _place, _command in enumerate(COMMANDS):
    app.command(_command, name=_command.__name__.rstrip("_"), sort_key=_place,
                help=_plain(_command.__doc__ or ""))


@app.meta.default
def _launch(
    *tokens: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
    debug: Annotated[bool, Parameter(negative=(), help="Show where an error comes from.")] = False,
) -> Any:
    return app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
