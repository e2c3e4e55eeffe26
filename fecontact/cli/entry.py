"""Entry point: runs a command line; errors become one sentence and an exit code."""

import re
import sys
import warnings
from typing import Any

from cyclopts import CycloptsError, UnknownCommandError, UnusedCliTokensError

from fecontact.cli.app import app
from fecontact.cli.console import INTERRUPTED, ending_signals, fail, interrupted_code, note
from fecontact.cli.environment import prepare
from fecontact.cli.field_words import command_called
from fecontact.core.errors import FecontactError, ModelWarning
from fecontact.core.resources.memory import (
    available_memory,
    require_address_space,
    shown_memory,
)

_OVERFLOW = re.compile(r"overflow|invalid value|divide by zero")  # warnings of NumPy
_MISSING = re.compile(r"Glyph (\d+) .* missing from")  # a warning of matplotlib


def main() -> None:
    """Run the command line and exit Python with its exit code."""
    try:
        prepare()
    except FecontactError as error:
        sys.exit(fail(str(error), 1))
    sys.exit(execute(sys.argv[1:]))


def execute(tokens: list[str]) -> int:
    """Run one command line; returns the exit code.

    0 for success, 1 for an error, 2 for an invalid command line, 130 after Ctrl-C, 143 after
    SIGTERM and 129 after SIGHUP. Errors are one sentence on stderr; ``--debug`` adds the
    traceback.
    """
    with ending_signals(), warnings.catch_warnings():
        warnings.simplefilter("default", ModelWarning)
        warnings.showwarning = _show_warning(warnings.showwarning)
        code = _execute(tokens)
        return interrupted_code() if code == INTERRUPTED else code


def _show_warning(otherwise: Any) -> Any:
    """Print a warning as one line, without its place in the code.

    Characters that the font of pictures lacks are named once, and numbers that overflow.
    """
    missing: list[str] = []
    overflown: list[str] = []

    def show(message: Any, category: Any, *rest: Any, **more: Any) -> None:
        if issubclass(category, ModelWarning):
            note(f"warning: {message}")
        elif (found := _MISSING.match(str(message))) is not None:
            if not missing:
                note(f"warning: the font of pictures lacks '{chr(int(found[1]))}' and perhaps "
                     f"other characters of a name; boxes stand in their place.")
            missing.append(found[1])
        elif issubclass(category, RuntimeWarning) and _OVERFLOW.search(str(message)):
            if not overflown:
                note(f"warning: some numbers of this result are too large or not finite "
                     f"({message}); check loads, stiffnesses and the status of the run.")
            overflown.append(str(message))
        else:
            otherwise(message, category, *rest, **more)

    return show


def _execute(tokens: list[str]) -> int:
    debug = "--debug" in tokens
    if "" in tokens:
        return fail('an argument is empty (""); give it a value, or leave its option out.', 2)
    try:
        require_address_space()
        return int(app.meta(tokens, exit_on_error=False, print_error=False,
                            result_action="return_value") or 0)
    except CycloptsError as error:
        return fail(_wrong_line(error), 2)
    except FecontactError as error:
        if debug:
            raise
        return fail(str(error), 1)
    except KeyboardInterrupt:
        return fail("interrupted.", INTERRUPTED)
    except SystemExit as error:
        if isinstance(error.__context__, BrokenPipeError):
            # Raised by Rich; as below.
            sys.stdout = None
            return 1
        return fail(f"code of a law or function of your own ended the program by "
                    f"sys.exit({error.code!r}); raise an exception there instead.", 1)
    except BrokenPipeError:
        # The reader of the output pipe has ended: no message can reach it.
        sys.stdout = None
        return 1
    except OSError as error:
        if debug:
            raise
        return fail(f"{error.filename or 'a file'}: {(error.strerror or str(error)).lower()}.",
                    1)
    except MemoryError as error:
        if debug:
            raise
        detail = f" ({str(error).rstrip('.')})" if str(error) else ""
        return fail(f"the memory is not enough{detail}, {shown_memory(available_memory())} are "
                    f"free; take a coarser mesh, fewer modes, nodes or outputs, or raise the "
                    f"limit.", 1)
    except Exception as error:
        if _was_interrupted(error):
            return fail("interrupted.", INTERRUPTED)
        if debug:
            raise
        if isinstance(error, RuntimeError) and "start new thread" in str(error):
            return fail("no more threads can be started: memory (ulimit -v) or the number of "
                        "processes (ulimit -u) is limited too much; raise the limit.", 1)
        return fail(f"this should not happen ({type(error).__name__}: {error}); run it again "
                    f"with --debug and report what it prints.", 1)


def _wrong_line(error: CycloptsError) -> str:
    """Message for a wrong command line, with the command whose help explains its arguments."""
    command = " ".join(("fecontact", *(error.command_chain or ())))
    message = str(error)
    if isinstance(error, UnusedCliTokensError):
        message = f"{command} takes no more arguments: {' '.join(error.unused_tokens or ())}."
    if isinstance(error, UnknownCommandError) and not error.command_chain:
        word = next(iter(error.unused_tokens or ()), "")
        if (meant := command_called(word)) is not None:
            return f"There is no command '{word}'; `fecontact {meant}` does this."
    return f"{message} `{command} --help` lists what there is."


def _was_interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C caused an error; libraries interrupted while loading hide it."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
