"""Python code of the user: files with laws and functions of runs, functions that make systems."""

import importlib.util
import inspect
import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from fecontact.core.checks import require_regular_file
from fecontact.core.errors import InputError, nearest

_System = TypeVar("_System")


def user_module(file: str | Path, where: str = "") -> ModuleType:
    """Load a Python file as a module.

    The module is reloaded when the file has changed; pickle finds it under :func:`module_name`.

    Parameters
    ----------
    file : path
        The file.
    where : str
        Prefix of messages: ``study.toml: [friction]: ``.

    Raises
    ------
    InputError
        If there is no such file, or it cannot be loaded.
    """
    path = Path(file).resolve()
    require_regular_file(path, "Python code", where)
    try:
        written = path.stat().st_mtime_ns
    except FileNotFoundError:
        raise InputError(f"{where}there is no file {file}.") from None
    except OSError as error:
        raise InputError(f"{where}{file} cannot be loaded "
                         f"({(error.strerror or str(error)).lower()}).") from None
    try:
        return _module(path, written)
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise InputError(f"{where}{file} cannot be loaded "
                         f"({type(error).__name__}: {error}).") from None


def user_function(file: Path, name: str) -> Callable[[Any], float]:
    """A function of a Python file.

    Raises
    ------
    InputError
        As in :func:`user_module`, or if the file has no such function.
    """
    module = user_module(file)
    function = getattr(module, name, None)
    if not callable(function):
        raise InputError(f"{file} has no function '{name}'{nearest(name, vars(module))}.")
    return function


def made_by(function: Callable[[_System, float], _System], system: _System,
            value: float) -> _System:
    """System that a function of the user makes from a system and a value.

    Raises
    ------
    InputError
        If the function takes other arguments, or returns something else.
    """
    name = getattr(function, "__name__", type(function).__name__)
    try:
        inspect.signature(function).bind(system, value)
    except TypeError as error:
        raise InputError(f"The function {name} must take two arguments, a system and a value "
                         f"({error}).") from None
    except ValueError:
        # Some functions of C have no signature.
        pass
    made = function(system, value)
    if not isinstance(made, type(system)):
        raise InputError(f"The function {name} of a system and a value must return a "
                         f"{type(system).__name__}, such as that of system.with_, not "
                         f"{type(made).__name__}.")
    return made


def module_name(file: str | Path) -> str:
    """Name of the module of a file in ``sys.modules``."""
    return f"fecontact_user_{re.sub(r'[^0-9a-zA-Z]', '_', str(Path(file).resolve()))}"


@cache
def _module(path: Path, written: int) -> ModuleType:
    """The module as it was written then: processes may outlive a change of the file."""
    name = module_name(path)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError("a Python file ends with .py")
    module = importlib.util.module_from_spec(spec)
    before = sys.modules.get(name)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        if before is not None:
            sys.modules[name] = before
        raise
    return module
