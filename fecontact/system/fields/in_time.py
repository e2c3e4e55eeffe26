"""Systems that can be integrated in time: contact systems and vector fields."""

from typing import Any

from typing_extensions import TypeAliasType

from fecontact.core.errors import InputError
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField

# Systems that can be integrated in time, for annotations and for checks.
Moving = TypeAliasType("Moving", ContactSystem | VectorField)
MOVING = (ContactSystem, VectorField)


def in_time(owner: str, given: Any) -> Moving:
    """System to integrate in time: a contact system, also that of a contact field, or a field.

    InputError for anything else.
    """
    if isinstance(given, VectorField):
        return given.in_time()
    if not isinstance(given, ContactSystem):
        raise InputError(f"{owner}: system must be a ContactSystem or a VectorField, not "
                         f"{type(given).__name__}.")
    return given


def state_size(system: Moving) -> int:
    """Number of values in a state."""
    return system.size if isinstance(system, ContactSystem) else system.dimension
