"""Functions of laws: their signatures, signs and units, and how they are compiled.

A law is a frozen dataclass of its parameters with a scalar function in plain Python, which is
compiled. The functions must not allocate or raise.

===========  ==========================  =========================================================
kind         function                    returns
===========  ==========================  =========================================================
normal       ``f(u, v, p)``              F, dF/du, dF/dv: normal force on the body [N] from
                                         penetration u [m] and its rate v [m/s]; zero or above,
                                         except that a stop above the body pushes it down, F < 0
friction     ``f(v, F, p)``              R, dR/dv, dR/dF: friction force [N] that acts on the body
                                         against +x, with the sign of the slip velocity v of the
                                         body relative to the ground [m/s], from the normal
                                         force F >= 0 [N]
friction     ``f(v, F, z, p, force,      nothing; fills ``force`` (3 + s,) with R, dR/dv, dR/dF and
with memory  rates)``                    the s derivatives dR/dz, and ``rates`` (s, 3 + s) with a
                                         row z', dz'/dv, dz'/dF, dz'/dz per internal variable z
friction in  ``f(law, v1, v2, F, z, p,   nothing; fills ``force`` (2 (4 + s),) with the same for
space        force, rates)``             both components: R_i, dR_i/dv1, dR_i/dF, s derivatives
                                         dR_i/dz, dR_i/dv2; and ``rates`` (s, 4 + s) with z',
                                         dz'/dv1, dz'/dF, dz'/dz, dz'/dv2; ``law`` is the address
                                         of the function for one direction, if that is used
ground       ``f(xi, p)``                y, y', y'': height [m], or factor of the friction force,
                                         at the abscissa xi of the ground's own frame [m] and its
                                         derivatives
surface      ``f(x, y, p)``              z, z_x, z_y, z_xx, z_xy, z_yy: height of the ground [m] at
                                         a place of its own frame [m], and its derivatives
signal       ``f(t, p)``                 value and rate of a function of time: travel of the ground
                                         [m], displacement of the drive [m], load [N]
===========  ==========================  =========================================================

``p`` holds the parameters in the order of the dataclass's fields; for normal and friction laws
those of the contact node. A parameter given as one number applies to every node; an extensive one
(stiffness, damping) is then the total of the contact face, distributed by tributary length. A
parameter given as a sequence has one value per node and is not distributed. A parameter with named
choices applies to every node; ``p`` holds its index in :attr:`fecontact.laws.base.NodeLaw.choices`.

Laws without memory act in space along the slip direction, without a further function
(:mod:`fecontact.laws.friction.planar`). Internal variables of laws with memory are vectors there,
both components of each one after the other, so that s is twice their number.

Internal variables of friction with memory are states of the system. Their rates must be continuous
where R depends on them; at F = 0, where it does not, they decay to zero.
"""

import inspect
from collections.abc import Callable
from typing import Any

from fecontact.core.addresses import function_at
from fecontact.core.compiled import CompiledLaw, compile_law
from fecontact.core.errors import InputError
from fecontact.core.records import Matrix, Vector

NORMAL = Callable[[float, float, Vector], tuple[float, float, float]]
FRICTION = Callable[[float, float, Vector], tuple[float, float, float]]
MEMORY = Callable[[float, float, Vector, Vector, Vector, Matrix], None]
PLANAR = Callable[[int, float, float, float, Vector, Vector, Vector, Matrix], None]
GROUND = Callable[[float, Vector], tuple[float, float, float]]
SURFACE = Callable[[float, float, Vector], tuple[float, float, float, float, float, float]]
SIGNAL = Callable[[float, Vector], tuple[float, float]]

normal_at = function_at(NORMAL, only_reads=True)
friction_at = function_at(FRICTION, only_reads=True)
memory_at = function_at(MEMORY)
planar_at = function_at(PLANAR)
ground_at = function_at(GROUND, only_reads=True)
surface_at = function_at(SURFACE, only_reads=True)
signal_at = function_at(SIGNAL, only_reads=True)

NORMAL_FORM = "f(u, v, p) -> F, dF/du, dF/dv"
FRICTION_FORM = "f(v, F, p) -> R, dR/dv, dR/dF"
MEMORY_FORM = "f(v, F, z, p, force, rates)"


def _compiled(signature: Any, form: str, function: Any, arguments: int) -> CompiledLaw:
    """Make a law of a function after checking its number of arguments."""
    if inspect.isfunction(function) and "print" in function.__code__.co_names:
        raise InputError(f"The law {function.__name__} calls print, which waits for Python inside "
                         f"a compiled run and may never return; remove it, and print what "
                         f"fecontact.laws.check_law or the law's methods return.")
    if not inspect.isfunction(function):
        raise InputError(f"A law must be a Python function {form}, not "
                         f"{type(function).__name__}.")
    if len(names := inspect.signature(function).parameters) != arguments:
        raise InputError(f"The law {function.__name__}({', '.join(names)}) is not one of the form "
                         f"{form}.")
    return compile_law(signature, form, function)


def normal_law(function: Callable[..., Any]) -> CompiledLaw:
    """Decorator of a function ``f(u, v, p) -> F, dF/du, dF/dv``, compiled at its first use.

    The docstring of this module lists arguments, results, units and signs. InputError for a wrong
    number of arguments; at the first use, if results are wrong or the function cannot be compiled.
    """
    return _compiled(NORMAL, NORMAL_FORM, function, 3)


def friction_law(function: Callable[..., Any]) -> CompiledLaw:
    """Decorator of a function ``f(v, F, p) -> R, dR/dv, dR/dF``, compiled at its first use.

    The docstring of this module lists arguments, results, units and signs. InputError for a wrong
    number of arguments; at the first use, if results are wrong or the function cannot be compiled.
    """
    return _compiled(FRICTION, FRICTION_FORM, function, 3)


def ground_profile(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(xi, p) -> y, y', y''``."""
    return compile_law(GROUND, "f(xi, p) -> y, y', y''", function)


def memory_friction_law(function: Callable[..., Any]) -> CompiledLaw:
    """Decorator of a function ``f(v, F, z, p, force, rates)`` that fills force and rates.

    Otherwise as :func:`friction_law`.
    """
    return _compiled(MEMORY, MEMORY_FORM, function, 6)


def planar_friction_law(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(law, v1, v2, F, z, p, force, rates)``, friction in two directions."""
    return compile_law(PLANAR, "f(law, v1, v2, F, z, p, force, rates)", function)


def ground_surface(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(x, y, p) -> z, z_x, z_y, z_xx, z_xy, z_yy``."""
    return compile_law(SURFACE, "f(x, y, p) -> z, z_x, z_y, z_xx, z_xy, z_yy", function)


def signal(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``f(t, p) -> value, rate``."""
    return compile_law(SIGNAL, "f(t, p) -> value, rate", function)
