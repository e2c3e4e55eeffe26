"""Names of the laws in study files: ``law = "lugre"``, or a law of the user's own file."""

import importlib.util
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.tables import Kinds, register_kinds
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.excitation import Drive, Load
from fecontact.laws.ground.ground import Ground
from fecontact.laws.ground.motion import GroundMotion
from fecontact.laws.ground.profile import Profile
from fecontact.laws.signals.base import Signal


@cache
def law_names() -> Mapping[type, Mapping[str, type]]:
    """Classes by name, for each kind of law (the base class)."""
    from fecontact.laws.friction import bristle as memory
    from fecontact.laws.friction import maxwell_slip
    from fecontact.laws.friction import stribeck as friction
    from fecontact.laws.friction import stribeck as friction_minimum
    from fecontact.laws.ground import fourier_series, profile, random_roughness
    from fecontact.laws.ground import measured_profile as trace
    from fecontact.laws.ground import motion as ground_motion
    from fecontact.laws.normal import linear as normal_stop
    from fecontact.laws.normal import measured_surface as normal_measured
    from fecontact.laws.normal import power as normal_power
    from fecontact.laws.normal import rough_surface as normal
    from fecontact.laws.normal import statistical as normal_statistical
    from fecontact.laws.signals import harmonic as signals
    from fecontact.laws.signals import transient as transients

    return {
        NormalLaw: {
            "rough-surface": normal.RoughSurface,
            "parabolic-surface": normal.ParabolicSurface,
            "cosine-surface": normal.CosineSurface,
            "gaussian-surface": normal.GaussianSurface,
            "measured-surface": normal_measured.MeasuredSurface,
            "linear": normal_stop.LinearContact,
            "power": normal_power.PowerContact,
            "restitution": normal_power.RestitutionContact,
            "exponential": normal_statistical.ExponentialContact,
            "back-burdekin": normal_power.PowerLawContact,
            "greenwood-williamson": normal_statistical.GreenwoodWilliamson,
            "two-sided-stop": normal_stop.TwoSidedStop,
            "prescribed": normal_stop.PrescribedForce,
        },
        FrictionLaw: {
            "exponential": friction.ExponentialFriction,
            "gaussian": friction.GaussianFriction,
            "hyperbolic": friction.HyperbolicFriction,
            "constant": friction.ConstantFriction,
            "galvanetto": friction_minimum.GalvanettoFriction,
            "cubic": friction_minimum.CubicFriction,
            "product": friction.ProductFriction,
            "jenkins": maxwell_slip.JenkinsFriction,
            "iwan": maxwell_slip.IwanFriction,
            "dahl": memory.DahlFriction,
            "lugre": memory.LuGreFriction,
            "bouc-wen": memory.BoucWenFriction,
        },
        Profile: {
            "flat": profile.Flat,
            "sine": profile.Sine,
            "fourier-series": fourier_series.FourierSeries,
            "trace": trace.MeasuredProfile,
            "random-roughness": random_roughness.RandomRoughness,
        },
        GroundMotion: {
            "harmonic-speed": ground_motion.HarmonicSpeed,
            "speed-ramp": ground_motion.SpeedRamp,
        },
        Signal: {
            "constant": signals.Constant,
            "harmonic": signals.Harmonic,
            "harmonics": signals.Harmonics,
            "sweep": signals.SweptSine,
            "step": transients.Step,
            "pulse": transients.Pulse,
            "tabulated": transients.Tabulated,
        },
    }


# The parts of a contact system that tables describe.
PART_CLASSES: Mapping[str, type] = {
    "normal": NormalLaw, "friction": FrictionLaw, "ground": Ground, "drive": Drive, "load": Load,
}

# The law of a table that names none.
_DEFAULTS: dict[type, str] = {NormalLaw: "rough-surface", FrictionLaw: "exponential"}


def is_kind(hint: Any) -> bool:
    """Whether a type is a kind of law, whose laws are told apart by name."""
    return isinstance(hint, type) and hint in law_names()


def law_class(kind: type, name: Any, where: str) -> type:
    """The class of a law by its name, or by ``FILE.py:CLASS``; for None the default, if any.

    Raises
    ------
    InputError
        If there is no such law (with those that there are), file or class.
    """
    names = law_names()[kind]
    if name is None and kind not in _DEFAULTS:
        raise InputError(f"{where} lacks the key 'law', one of {choices(names)}.")
    name = _DEFAULTS[kind] if name is None else name
    if not isinstance(name, str) or (name not in names and ".py:" not in name):
        raise InputError(f"{where}: law = {name!r} must be one of {choices(names)}"
                         f"{nearest(str(name), names)}, or a law of your own, "
                         f"\"FILE.py:CLASS\".")
    if name in names:
        return names[name]
    return own_law(kind, name, f"{where}: law = {name!r}")


def own_law(kind: Any, name: str, where: str) -> type:
    """The class ``FILE.py:CLASS`` of a law of a kind, or of one of several.

    Raises
    ------
    InputError
        If there is no such file, it cannot be loaded, or has no such class.
    """
    path, _, title = name.rpartition(":")
    file = str(Path(path).resolve())
    trusted = _trusted.get()
    try:
        if trusted is None or file in trusted:
            found = getattr(_module(file), title, None)
        elif (found := _loaded(file, title)) is None:
            raise UntrustedError(
                f"{where} is code in a file, which is not run unadvised; if you trust {path}, say "
                f"--trust (trust=True).")
    except FileNotFoundError:
        raise InputError(f"{where}: there is no file {path}.") from None
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{where}: {path} cannot be loaded "
                         f"({type(error).__name__}: {error}).") from None
    if not (isinstance(found, type) and issubclass(found, kind)):
        kinds = kind if isinstance(kind, tuple) else (kind,)
        laws = {one.__name__ for one in chain(*map(_subclasses, kinds))
                if one.__module__ == _module_name(str(Path(path).resolve()))}
        what = "law" if len(kinds) > 1 else kind.__name__
        raise InputError(f"{where}: {path} has no {what} of that name"
                         f"{nearest(title, laws)}; it has {choices(laws)}.")
    return found


class UntrustedError(InputError):
    """A file names code that may not be run."""


_trusted: ContextVar[frozenset[str] | None] = ContextVar("trusted", default=None)


@contextmanager
def trusting(files: bool | Iterable[Path]) -> Iterator[None]:
    """Let laws be loaded from all files of Python, from none, or from those named alone.

    Others raise :class:`UntrustedError`, unless their module is loaded already.
    """
    allowed = None if files is True else frozenset(
        str(file.resolve()) for file in files or ())
    token = _trusted.set(allowed)
    try:
        yield
    finally:
        _trusted.reset(token)


def law_files(table: Any) -> set[Path]:
    """Files of Python that the laws of a table name."""
    if isinstance(table, list | tuple):
        return {file for item in table for file in law_files(item)}
    if not isinstance(table, Mapping):
        return set()
    found = {file for item in table.values() for file in law_files(item)}
    name = table.get("law")
    if isinstance(name, str) and ".py:" in name:
        found.add(Path(name.rpartition(":")[0]))
    return found


def _loaded(file: str, title: str) -> type | None:
    """A class of a module that was loaded from a file, if there is one."""
    for module in list(sys.modules.values()):
        known = getattr(module, "__file__", None)
        if isinstance(known, str) and os.path.realpath(known) == file:
            found = vars(module).get(title)
            if isinstance(found, type):
                return found
    return None


def name_of(law: Any) -> str | None:
    """The name of a law's class: None for what is no law of a kind, and for a default."""
    cls = type(law)
    for kind, names in law_names().items():
        if isinstance(law, kind):
            for name, known in names.items():
                if known is cls:
                    return None if _DEFAULTS.get(kind) == name else name
            file = getattr(sys.modules.get(cls.__module__), "__file__", None)
            if file is None or "." in cls.__qualname__:
                raise InputError(f"The law {cls.__name__} cannot be written down: define it in a "
                                 f"Python file, outside of functions.")
            return f"{file}:{cls.__name__}"
    return None


def with_folder(table: Any, folder: Path) -> Any:
    """A table in which files of laws and their data are named from the current folder."""
    if isinstance(table, list):
        return [with_folder(item, folder) for item in table]
    if not isinstance(table, Mapping):
        return table
    return {key: _located(key, with_folder(value, folder), folder) for key, value in table.items()}


def movable(table: Any, folder: Path, root: Path) -> Any:
    """A table in which files of laws below ``root`` are named from a folder, not absolutely.

    The reverse of :func:`with_folder`; ``root`` can then be moved with all that is in it.
    """
    if isinstance(table, list):
        return [movable(item, folder, root) for item in table]
    if not isinstance(table, Mapping):
        return table
    return {key: _relative(key, movable(value, folder, root), folder.resolve(), root.resolve())
            for key, value in table.items()}


def _relative(key: str, value: Any, folder: Path, root: Path) -> Any:
    if key != "law" or not isinstance(value, str) or ".py:" not in value:
        return value
    path, _, title = value.rpartition(":")
    if not Path(path).is_relative_to(root):
        return value
    return f"{Path(os.path.relpath(path, folder)).as_posix()}:{title}"


def _located(key: str, value: Any, folder: Path) -> Any:
    named = isinstance(value, str) and (key == "file" or (key == "law" and ".py:" in value))
    return str(folder.resolve() / value) if named else value


def _subclasses(kind: type[Any]) -> Iterator[type]:
    for cls in kind.__subclasses__():
        yield cls
        yield from _subclasses(cls)


def _module_name(path: str) -> str:
    return f"fecontact_user_{re.sub(r'[^0-9a-zA-Z]', '_', path)}"


@cache
def _module(path: str) -> Any:
    name = _module_name(path)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise FileNotFoundError(path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


register_kinds(Kinds(is_kind, law_class, name_of))
