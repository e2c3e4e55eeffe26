"""Names of the laws in study files: ``law = "lugre"``, or a law from a user's file."""

import os
import sys
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.tables import Kinds, register_kinds
from fecontact.core.user_code import user_module
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.excitation import Drive, Load
from fecontact.laws.ground.ground import Ground
from fecontact.laws.ground.motion import GroundMotion
from fecontact.laws.ground.profile import Profile
from fecontact.laws.own_files import UntrustedError, trusted_files
from fecontact.laws.signals.base import Signal
from fecontact.laws.synonyms import laws_called


@cache
def law_names() -> Mapping[type, Mapping[str, type]]:
    """Classes by name, for each kind of law (the base class)."""
    from fecontact import laws

    return {
        NormalLaw: {
            "rough-surface": laws.RoughSurface,
            "parabolic-surface": laws.ParabolicSurface,
            "cosine-surface": laws.CosineSurface,
            "gaussian-surface": laws.GaussianSurface,
            "measured-surface": laws.MeasuredSurface,
            "linear": laws.LinearContact,
            "power": laws.PowerContact,
            "restitution": laws.RestitutionContact,
            "exponential": laws.ExponentialContact,
            "back-burdekin": laws.BackBurdekinContact,
            "greenwood-williamson": laws.GreenwoodWilliamson,
            "asperity": laws.AsperityContact,
            "two-sided-stop": laws.TwoSidedStop,
            "rigid-stop": laws.RigidStop,
            "prescribed-force": laws.PrescribedForce,
            "friction-contact-3d": laws.FrictionContact3D,
            "bilateral-polynomial": laws.BilateralPolynomial,
            "bilateral-play": laws.BilateralPlay,
            "bilateral-piecewise": laws.BilateralPiecewise,
        },
        FrictionLaw: {
            "exponential": laws.ExponentialFriction,
            "gaussian": laws.GaussianFriction,
            "hyperbolic": laws.HyperbolicFriction,
            "constant": laws.ConstantFriction,
            "frictionless": laws.Frictionless,
            "galvanetto": laws.GalvanettoFriction,
            "cubic": laws.CubicFriction,
            "product": laws.ProductFriction,
            "jenkins": laws.JenkinsFriction,
            "iwan": laws.IwanFriction,
            "four-parameter-iwan": laws.FourParameterIwanFriction,
            "parallel-sliders": laws.ParallelSliders,
            "dahl": laws.DahlFriction,
            "lugre": laws.LuGreFriction,
            "bouc-wen": laws.BoucWenFriction,
        },
        Profile: {
            "flat": laws.Flat,
            "sine": laws.Sine,
            "fourier-series": laws.FourierSeries,
            "measured-profile": laws.MeasuredProfile,
            "random-roughness": laws.RandomRoughness,
        },
        GroundMotion: {
            "harmonic-speed": laws.HarmonicSpeed,
            "speed-ramp": laws.SpeedRamp,
        },
        Signal: {
            "constant": laws.Constant,
            "harmonic": laws.Harmonic,
            "harmonics": laws.Harmonics,
            "swept-sine": laws.SweptSine,
            "step": laws.Step,
            "pulse": laws.Pulse,
            "tabulated": laws.Tabulated,
        },
    }


# Parts of a contact system that are described by tables.
PART_CLASSES: Mapping[str, type] = {
    "normal": NormalLaw, "friction": FrictionLaw, "ground": Ground, "drive": Drive, "load": Load,
}

# The law of a table without a name.
_DEFAULTS: dict[type, str] = {NormalLaw: "rough-surface", FrictionLaw: "exponential"}


def is_kind(hint: Any) -> bool:
    """Whether a type is a kind of law, whose laws are selected by name."""
    return isinstance(hint, type) and hint in law_names()


def law_class(kind: type, name: Any, where: str) -> type:
    """The class of a law by its name, or by ``FILE.py:CLASS``; for None the default, if any.

    InputError if there is no such law, file or class; the message lists the laws.
    """
    names = law_names()[kind]
    if name is None and kind not in _DEFAULTS:
        raise InputError(f"{where} lacks the key 'law', one of {choices(names)}.")
    name = _DEFAULTS[kind] if name is None else name
    if not isinstance(name, str) or (name not in names and ".py:" not in name):
        meant = laws_called(str(name), names.values())
        hint = (nearest(str(name), names, likeness=0.7) or _meant(str(name), names, meant)
                or nearest(str(name), names))
        raise InputError(f"{where}: law = {name!r} must be one of {choices(names)}{hint}, or a law "
                         f"of your own, \"FILE.py:CLASS\".")
    if name in names:
        return names[name]
    return own_law(kind, name, f"{where}: law = {name!r}")


def foreign_keys(table: Mapping[str, Any], name: Any) -> list[str]:
    """Keys of the table of a law that the law ``name`` does not have; none for unknown names.

    Those of a table for another law, whose name is replaced.
    """
    found = [names[name] for names in law_names().values()
             if isinstance(name, str) and name in names]
    known = {entry.name for law in found for entry in fields(law)} | {"law"}
    return [key for key in table if found and key not in known]


def _meant(name: str, names: Mapping[str, type], meant: list[type]) -> str:
    found = [law for law, cls in names.items() if cls in meant]
    return f" ({name} is {' or '.join(map(repr, found))})" if found else ""


def own_law(kind: Any, name: str, where: str) -> type:
    """The class ``FILE.py:CLASS`` of a law of a kind, or of one of several.

    InputError if there is no such file, it cannot be loaded, or has no such class.
    """
    path, _, title = name.rpartition(":")
    file = str(Path(path).resolve())
    trusted = trusted_files()
    if trusted is not None and file not in trusted:
        if (loaded := _loaded(file, title)) is not None and issubclass(loaded, kind):
            return loaded
        raise UntrustedError(
            f"{where} is code in a file, which is not run without permission; if you trust {path}, "
            f"say --trust (trust=True).")
    module = user_module(path, f"{where}: ")
    laws = {cls.__name__: cls for cls in vars(module).values()
            if isinstance(cls, type) and issubclass(cls, kind)
            and cls.__module__ == module.__name__}
    if title not in laws:
        what = "law" if isinstance(kind, tuple) else kind.__name__
        raise InputError(f"{where}: {path} has no {what} of that name"
                         f"{nearest(title, laws)}; it has {choices(laws)}.")
    return laws[title]


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
    """The name of a law's class; None for a default, and for objects that are not laws."""
    cls = type(law)
    for kind, names in law_names().items():
        if isinstance(law, kind):
            for name, known in names.items():
                if known is cls:
                    return None if _DEFAULTS.get(kind) == name else name
            file = getattr(sys.modules.get(cls.__module__), "__file__", None)
            if file is None or "." in cls.__qualname__:
                raise InputError(f"The law {cls.__name__} cannot be stored: define it at the top "
                                 f"level of a Python file.")
            return f"{file}:{cls.__name__}"
    return None


register_kinds(Kinds(is_kind, law_class, name_of, _DEFAULTS.get))
