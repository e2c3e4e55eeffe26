"""The contact system of a study, with errors that name the section of the file."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.tables import located
from fecontact.laws.friction.stribeck import ConstantFriction
from fecontact.laws.registry import PART_CLASSES
from fecontact.laws.soundness import require_sound
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import (
    NO_FRICTION_LAW,
    NO_NORMAL_LAW,
    ContactSystem,
    needs_friction,
)
from fecontact.system.gap import Crown, gap_values

if TYPE_CHECKING:
    from fecontact.study.study import Study

LAWS = ("normal", "friction")


def contact_system(study: "Study", basis: ModalBasis, title: str) -> ContactSystem:
    """The contact system of a study on its basis; ``title`` names the study in messages.

    Raises
    ------
    InputError
        For laws, loads or a gap that do not go with the basis, with their section.
    """
    groups = dict(basis.groups)
    for name in study.contact:
        if name not in groups:
            raise InputError(f"{title}: [contact.{name}]: the basis has no contact group '{name}'"
                             f"{nearest(name, groups)}; its groups are: {choices(groups)}.")
    if study.normal is None and len(_own(study, "normal")) < len(groups):
        raise InputError(NO_NORMAL_LAW.format(f"{title} lacks the section [normal]"))
    if study.friction is None and len(_own(study, "friction")) < len(groups) and (
            needs_friction(basis)):
        raise InputError(NO_FRICTION_LAW.format(f"{title} lacks the section [friction]"))
    for section, law, count in _laws(study, groups):
        with located(f"{title}: [{section}]:", type(law).__name__):
            law.table(np.full(count, 1.0 / count))
            require_sound(law)
    for force in study.load.forces:
        with located(f"{title}: [load.forces]:"):
            basis.point_index(force.point)
    with located(f"{title}: [gap]:" if isinstance(study.gap, Crown) else f"{title}:", "Crown"):
        gap = gap_values(study.gap, basis.contact_x)
    parts: dict[str, Any] = {part: getattr(study, part) for part in PART_CLASSES}
    for part in LAWS:
        own = _own(study, part)
        if own:
            usual = parts[part] or ConstantFriction(0.0)
            parts[part] = dict.fromkeys(groups, usual) | own
    with located(f"{title}:", "ContactSystem"):
        return ContactSystem(basis, gap=gap, **parts)


def _own(study: "Study", part: str) -> dict[str, Any]:
    """Laws of the contact groups that have one of their own."""
    return {group: law for group, laws in study.contact.items()
            if (law := getattr(laws, part)) is not None}


def _laws(study: "Study", groups: Mapping[str, int]) -> Iterator[tuple[str, Any, int]]:
    """Section of each law, the law, and the number of nodes that have it."""
    for part in LAWS:
        own = _own(study, part)
        for group, law in own.items():
            yield f"contact.{group}.{part}", law, groups[group]
        for count in [sum(groups.values())] if not own else [
                count for group, count in groups.items() if group not in own]:
            if getattr(study, part) is not None:
                yield part, getattr(study, part), count
