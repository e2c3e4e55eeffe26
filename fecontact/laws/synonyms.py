"""Other names of the laws, for searches by word: 'stribeck' finds the laws with that curve."""

import re
from collections.abc import Iterable, Mapping
from itertools import pairwise

from fecontact.core.docstrings import summary

_STRIBECK = ("ExponentialFriction", "GaussianFriction", "HyperbolicFriction", "CubicFriction",
             "GalvanettoFriction", "LuGreFriction")
_IWAN = ("IwanFriction", "FourParameterIwanFriction", "ParallelSliders")
_HERTZ = ("PowerContact", "RestitutionContact")
_ROUGH = ("RoughSurface", "ParabolicSurface", "CosineSurface", "GaussianSurface",
          "GreenwoodWilliamson", "AsperityContact", "ExponentialContact", "MeasuredSurface")

# Words, without spaces, hyphens and accents, and the classes that they stand for.
_WORDS: Mapping[str, tuple[str, ...]] = {
    "stribeck": _STRIBECK, "velocityweakening": _STRIBECK, "falling": _STRIBECK,
    "negativeslope": _STRIBECK, "stickslip": _STRIBECK, "statickinetic": _STRIBECK,
    "coulomb": ("ConstantFriction",), "amontons": ("ConstantFriction",),
    "dry": ("ConstantFriction",), "regularised": ("ConstantFriction", "JenkinsFriction"),
    "regularized": ("ConstantFriction", "JenkinsFriction"),
    "none": ("Frictionless",), "nofriction": ("Frictionless",),
    "bristle": ("LuGreFriction", "DahlFriction"), "hysteresis": (*_IWAN, "BoucWenFriction",
                                                                 "JenkinsFriction"),
    "maxwell": ("IwanFriction", "JenkinsFriction"), "maxwellslip": ("IwanFriction",),
    "masing": (*_IWAN, "JenkinsFriction"), "elastoplastic": ("JenkinsFriction", *_IWAN),
    "elasticslider": ("JenkinsFriction",), "elasticcoulomb": ("JenkinsFriction",
                                                             "FrictionContact3D"),
    "platform": ("FrictionContact3D",), "underplatform": ("FrictionContact3D",),
    "shroud": ("FrictionContact3D",), "bladeroot": ("FrictionContact3D",),
    "prandtl": ("JenkinsFriction", "IwanFriction"),
    "microslip": (*_IWAN, "BoucWenFriction"), "partialslip": (*_IWAN, "BoucWenFriction"),
    "segalman": ("FourParameterIwanFriction",), "jointmodel": _IWAN,
    "hertz": _HERTZ, "huntcrossley": _HERTZ, "lankaraninikravesh": ("RestitutionContact",),
    "coefficientofrestitution": ("RestitutionContact",), "impact": ("RestitutionContact",
                                                                   "PowerContact"),
    "penalty": ("LinearContact",), "spring": ("LinearContact", "BilateralPiecewise"),
    "kelvinvoigt": ("LinearContact",), "abbott": ("RoughSurface", "MeasuredSurface"),
    "firestone": ("RoughSurface", "MeasuredSurface"), "bearingarea": ("RoughSurface",
                                                                     "MeasuredSurface"),
    "roughness": _ROUGH, "asperities": _ROUGH, "asperity": _ROUGH, "gw": ("GreenwoodWilliamson",),
    "duffing": ("BilateralPolynomial",), "quintic": ("BilateralPolynomial",),
    "quadraticdamping": ("BilateralPolynomial",), "backlash": ("BilateralPlay",),
    "clearance": ("BilateralPlay", "TwoSidedStop"),
    "freeplay": ("BilateralPlay",), "stop": ("RigidStop", "TwoSidedStop"),
    "signorini": ("RigidStop",), "unilateral": ("RigidStop",), "rigid": ("RigidStop",),
    "wave": ("Sine",), "waviness": ("Sine", "FourierSeries"), "psd": ("RandomRoughness",),
    "chirp": ("SweptSine",), "sweep": ("SweptSine",), "ramp": ("SpeedRamp", "Tabulated"),
    "table": ("Tabulated",), "halfsine": ("Pulse",), "shock": ("Pulse",),
}


def laws_called(word: str, laws: Iterable[type]) -> list[type]:
    """Laws that a word stands for, or whose summary contains the word.

    Case, spaces, hyphens and a trailing "law", "friction", "contact", "model" or "curve" do not
    matter: ``Hunt-Crossley model`` is looked up as ``huntcrossley``.
    """
    bare = re.sub(r"[\W_]+", "", word.lower())
    short = re.sub(r"(friction|contact|law|model|curve)+$", "", bare) or bare
    known = _WORDS.get(short, _WORDS.get(bare, ()))
    given = list(laws)
    by_name = {cls.__name__: cls for cls in given}
    found = [by_name[name] for name in known if name in by_name]
    return found or [cls for cls in given if len(short) > 2 and short in _words(summary(cls))]


def _words(text: str) -> set[str]:
    """The words of a text, alone and two by two."""
    words = re.findall(r"[^\W_]+", text.lower())
    return {*words, *("".join(two) for two in pairwise(words))}
