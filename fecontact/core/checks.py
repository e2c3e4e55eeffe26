"""Checks of arguments, shared by all public functions."""

import os
import stat
from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any, cast

import numpy as np

from fecontact.core.errors import LARGEST, InputError, require_positive, shown
from fecontact.core.resources.memory import available_memory, shown_memory
from fecontact.core.types import Array, ComplexArray, Coordinates, Integers

_SLOWEST, _FASTEST = 0.01, 1000.0  # [1/s]; the encoder takes two decimals
_LARGEST = 1e12  # factor of displacements, which are drawn in single precision


def require_kind(owner: str, kind: type | tuple[type, ...], **values: Any) -> None:
    """Raise :class:`InputError` unless the named arguments are instances of a class.

    Parameters
    ----------
    owner : str
        The function or class, for the message.
    kind : type or tuple of types
        The class, or several of which any will do.
    **values
        Arguments by name.
    """
    kinds = kind if isinstance(kind, tuple) else (kind,)
    for name, value in values.items():
        if not isinstance(value, kinds):
            wanted = " or ".join(_NAMES.get(one, f"a {one.__name__}") for one in kinds)
            raise InputError(f"{owner}: {name} must be {wanted}, not {type(value).__name__}.")


_NAMES: dict[Any, str] = {Mapping: "a mapping of names", Sequence: "a sequence", str: "a text",
                          int: "a whole number", Integral: "a whole number",
                          Real: "a number", type(None): "None", Callable: "a function",
                          bool: "true or false"}


def require_flags(owner: str, **values: Any) -> None:
    """Raise :class:`InputError` unless the named arguments are True or False."""
    for name, value in values.items():
        if not isinstance(value, bool | np.bool_):
            raise InputError(f"{owner}: {name} = {shown(value)} must be True or False.")


def as_several(values: Any, kind: type, owner: str, name: str) -> list[Any]:
    """One instance of a class, or several, as a list; InputError for anything else."""
    if isinstance(values, kind):
        return [values]
    require_kind(owner, (kind, Sequence), **{name: values})
    for one in values:
        require_kind(owner, kind, **{name: one})
    return list(values)


def as_texts(values: Any, what: str) -> tuple[str, ...]:
    """Convert one text or several to a tuple; ``what`` is their name in the InputError."""
    given = (values,) if isinstance(values, str) else values
    if not (isinstance(given, Iterable) and not isinstance(given, bytes)):
        raise InputError(f"{what} = {shown(values)} must be a text or several.")
    found = tuple(given)
    for one in found:
        if not isinstance(one, str):
            raise InputError(f"{what}: {shown(one)} must be a text, not {type(one).__name__}.")
    return found


def as_path(path: Any, what: str) -> Path:
    """Convert to a path; InputError if it is none or contains a null character.

    ``what`` names the content in the message: 'a mesh'.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"The path of {what} must be a text or Path, not {type(path).__name__}.")
    found = Path(path)
    if "\0" in str(found):
        raise InputError(f"The path of {what}, {str(found)!r}, contains a null character; "
                         f"remove it.")
    return found


def require_file(path: Path, what: str, where: str = "") -> None:
    """Raise :class:`InputError` if a path is a folder, or a pipe or device, which may never end.

    Call it before the file is opened; ``what`` is its role in the message, 'a study', and ``where``
    its beginning.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return  # said when it is opened
    begin = f"{where}{path} cannot be read as {what}"
    if stat.S_ISDIR(mode):
        raise InputError(f"{begin}: it is a folder; give a file.")
    if not stat.S_ISREG(mode):
        raise InputError(f"{begin}: it is a pipe or device, not a file; store its content in a "
                         f"file first.")


def require_regular_file(path: Path, what: str, where: str = "") -> None:
    """Apply :func:`require_file`, also to the size: the file must fit into memory."""
    require_file(path, what, where)
    try:
        size = path.stat().st_size
    except (OSError, ValueError):
        return
    if size > (free := available_memory()):
        raise InputError(f"{where}{path} cannot be read as {what}: it has {shown_memory(size)}, "
                         f"where {shown_memory(free)} of memory are free; take a smaller one.")


def as_count(value: Any, what: str, least: int = 1) -> int:
    """Convert to an int of at least ``least``; ``what`` is its name in the InputError."""
    if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
        raise InputError(f"{what} = {shown(value)} must be a whole number, {least} or above.")
    return int(value)


def require_rtol(rtol: float, name: str = "rtol", most: float = 1e-2) -> None:
    """Raise :class:`InputError` unless a tolerance is a number from 1e-13 to ``most``."""
    if not (isinstance(rtol, Real) and 1e-13 <= rtol <= most):
        raise InputError(f"{name} = {rtol!r} must be a number from 1e-13 to {most:g}.")


def whole_number(text: str) -> int | None:
    """The number that a text of decimal digits stands for, None for any other text."""
    # Superscripts are digits too, and thousands of digits are not converted.
    return int(text) if text.isdecimal() and len(text) < 20 else None


def as_floats(values: Any, what: str) -> Array:
    """Convert to an array of floats; ``what`` is its name in messages.

    Raises
    ------
    InputError
        For complex numbers, booleans, strings, None and lists of unequal lengths.
    """
    try:
        given = np.asarray(values)
        if isinstance(values, list | tuple) and any(isinstance(item, bool) for item in values):
            given = np.empty(0, bool)  # NumPy converts booleans among numbers to 0 and 1
        if given.dtype.kind in "iuf":
            return np.asarray(given, dtype=float)
        if given.dtype.kind == "O" and all(isinstance(item, Real) and not isinstance(item, bool)
                                           for item in given.flat):
            return np.asarray(given, dtype=float)  # fractions, integers beyond 64 bits
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(f"{what} must be real numbers, not {shown(values)}; give a number, or lists "
                     f"of numbers of equal length.")


def as_numbers(values: Any, what: str) -> Array | ComplexArray:
    """Convert to an array of floats or, if one is complex, of complex numbers; InputError."""
    try:
        given = np.asarray(values)
        if given.dtype.kind == "c":
            return np.asarray(given, dtype=complex)
    except (TypeError, ValueError, OverflowError):
        pass
    return as_floats(values, what)


def is_numeric(values: Any) -> bool:
    """Whether :func:`as_floats` accepts the values."""
    try:
        as_floats(values, "")
    except InputError:
        return False
    return True


def require_state(state: Array, largest: float = LARGEST) -> None:
    """Raise :class:`InputError` for an initial state with values beyond +-1e60, or ``largest``."""
    for wrong, remedy in ((~np.isfinite(state), "be finite"),
                          (np.abs(state) > largest, f"be from {-largest:g} to {largest:g}")):
        if wrong.any():
            index = int(np.argmax(wrong))
            raise InputError(f"The initial state holds {state[index]:g} (value {index} of "
                             f"{len(state)}); every value must {remedy}.")


def as_pair(values: Any, what: str) -> tuple[float, float]:
    """Convert to two finite coordinates; InputError otherwise."""
    place = as_floats(values, what)
    if place.shape != (2,) or not np.isfinite(place).all():
        raise InputError(f"{what} = {shown(values)} must be a pair of coordinates x, y [m].")
    return float(place[0]), float(place[1])


def as_place(values: Any, what: str, dimension: int | None = None) -> Coordinates:
    """Convert to finite coordinates, two or three, or as many as the dimension; InputError."""
    if dimension == 2:
        return as_pair(values, what)
    place = as_floats(values, what)
    allowed = ((2,), (3,)) if dimension is None else ((3,),)
    if place.shape not in allowed or not np.isfinite(place).all():
        either = "x, y (in a solid x, y, z)" if dimension is None else "x, y, z"
        raise InputError(f"{what} = {shown(values)} must be coordinates {either} [m].")
    return cast(Coordinates, tuple(place.tolist()))


def as_direction(values: Any, what: str) -> Coordinates:
    """A direction (x, y) or (x, y, z) of length one; InputError for one of length zero."""
    direction = np.array(as_place(values, what))
    length = float(np.hypot(*direction) if len(direction) == 2 else np.linalg.norm(direction))
    if not 0.0 < length < np.inf:
        raise InputError(f"{what} = {shown(values)} must be longer than zero.")
    # A vector of length one within rounding stays unchanged when it is written and read back.
    unit = direction if abs(length - 1.0) <= 1e-12 else direction / length
    return cast(Coordinates, tuple(unit.tolist()))


def as_integers(values: Any, what: str) -> Integers:
    """Convert to an array of integers; InputError if a value is not a whole number."""
    found = as_floats(values, what)
    if not (np.isfinite(found) & (found == np.round(found))).all():
        raise InputError(f"{what} must be whole numbers.")
    return np.asarray(values).astype(np.int64)


def require_frame_rate(owner: str, fps: float) -> None:
    """Raise :class:`InputError` unless ``fps`` is a possible frame rate of a movie."""
    if not (isinstance(fps, Real) and not isinstance(fps, bool) and _SLOWEST <= fps <= _FASTEST):
        raise InputError(f"{owner}: fps = {fps!r} must be a number from {_SLOWEST:g} to "
                         f"{_FASTEST:g} frames a second.")


def require_scale(owner: str, scale: float) -> None:
    """Raise :class:`InputError` unless displacements can be drawn enlarged by ``scale``."""
    require_positive(owner, scale=scale)
    if scale > _LARGEST:
        raise InputError(f"{owner}: scale = {scale!r} must be at most {_LARGEST:g}.")


def merged(given: object, by_name: Mapping[str, Any]) -> dict[str, Any]:
    """Changes of ``with_`` from a mapping, or None, and from keywords.

    Raises
    ------
    InputError
        If what is given is no mapping, or a name is no text.
    """
    require_kind("with_", (Mapping, type(None)), changes=given)
    as_texts(tuple(given or ()), "with_: names of parameters")  # type: ignore[arg-type]
    return {**(given or {}), **by_name}  # type: ignore[dict-item]


class _BeyondError(IndexError):
    """Raised where a function of the user reaches beyond its own arrays."""


class _Guarded(np.ndarray):
    """Array whose errors of indices differ from those of other arrays."""

    def __getitem__(self, key: Any) -> Any:
        try:
            return super().__getitem__(key)
        except IndexError as error:
            raise _BeyondError(str(error)) from None

    def __setitem__(self, key: Any, value: Any) -> None:
        try:
            super().__setitem__(key, value)
        except IndexError as error:
            raise _BeyondError(str(error)) from None


def require_within(
    owner: str, function: Callable[..., Any], held: str, *arguments: float | Array
) -> bool:
    """Raise InputError if a function of the user, called in Python, reaches beyond its arrays.

    Compiled code does not check indices. Whatever else is wrong with these arguments, such as a
    division by zero or a table that ends before them, is no matter. ``held`` says what the arrays
    hold. Return True if the call came to its end without an error.
    """
    guarded = [one.view(_Guarded) if isinstance(one, np.ndarray) else one for one in arguments]
    try:
        with np.errstate(all="ignore"):
            getattr(function, "py_func", function)(*guarded)
    except _BeyondError as error:
        raise InputError(f"{owner} {function.__name__} uses an entry beyond its arrays ({error}), "
                         f"which hold {held}; give as many as it uses.") from None
    except Exception:
        return False
    return True
