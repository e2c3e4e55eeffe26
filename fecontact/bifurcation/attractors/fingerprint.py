"""Fingerprints of computations: all numbers of their systems and settings.

The code of functions and classes of the user does not count, nor what these hold: a folder of
finished runs has a name of its own for each version of them.
"""

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from numbers import Real
from typing import Any

import numpy as np

from fecontact import __version__
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import Moving, state_size
from fecontact.system.fields.vector_field import VectorField


def fingerprint(systems: Iterable[Moving], *settings: Any) -> str:
    """A text that differs for other numbers of systems or settings, the same in every process."""
    found = hashlib.sha256()
    whole = [__version__, *settings, *(
        _of_system(one) if isinstance(one, ContactSystem) else _of_field(one) for one in systems)]
    for part in _parts(whole):
        found.update(len(part).to_bytes(8, "little") + part)
    return found.hexdigest()


def _of_system(system: ContactSystem) -> list[Any]:
    """Kinds of laws and signals of a contact system, and all of its numbers."""
    groups = [(nodes.start, nodes.stop, type(law).__qualname__) for kind in ("normal", "friction")
              for nodes, _, law in system.law_groups(kind)]
    moving = [type(one).__qualname__ for one in (
        *system.drive.motions, *system.load.signals.values(), system.ground.profile,
        *system.prescribed_motion.motions)]
    # Integers are addresses of functions, and differ from process to process.
    return [groups, moving, sorted(system.parameters().items()), *(
        item for name, item in system.arrays._asdict().items()
        if np.asarray(item).dtype.kind == "f"
        or name in ("memory", "on_ground", "follows_surface"))]


def _of_field(field: VectorField) -> list[Any]:
    """Parameters of a field, and its rates at some states."""
    scales, places = field.state_scales(field.values), np.random.default_rng(0).normal(
        size=(3, state_size(field)))
    rates = field.rates(np.array([0.0, 0.1, 0.2]), places * scales, field.values)
    # Compiled code may round in another way on another processor.
    return [field.state_names, field.parameters, scales, field.forcing_period(field.values),
            [f"{rate:.9e}" for rate in rates.ravel()]]


def _parts(value: Any) -> Iterator[bytes]:
    """The numbers and texts of a value, with what holds them."""
    if isinstance(value, str | None):
        yield repr(value).encode()
    elif isinstance(value, Real):
        yield float(value).hex().encode()
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        yield repr((value.shape, value.dtype.kind)).encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, Mapping | Sequence | np.ndarray):
        items = value.items() if isinstance(value, Mapping) else value
        yield f"{len(value)} of".encode()
        for item in items:
            yield from _parts(item)
    else:
        yield type(value).__qualname__.encode()
        if is_dataclass(value):
            for field in fields(value):
                yield from _parts(getattr(value, field.name))
