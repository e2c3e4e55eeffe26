"""The contact system of a study, with messages that name the section."""

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

import numpy as np

from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.tables import located, plain, shown
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.check import require_sound
from fecontact.laws.excitation import Drive, Load
from fecontact.laws.friction.stribeck import ConstantFriction
from fecontact.laws.friction_contact import separated
from fecontact.laws.ground.ground import Ground
from fecontact.laws.ground.height_map import HeightMap
from fecontact.laws.registry import PART_CLASSES
from fecontact.reduction.assembly.links import NonlinearSpring
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.study.bodies_section import InterfaceSettings, Reduced
from fecontact.study.dimension import require_dimension
from fecontact.study.links_section import LinkSettings
from fecontact.system.contact_system import (
    NO_FRICTION_LAW,
    NO_NORMAL_LAW,
    ContactSystem,
)
from fecontact.system.gap import Crown, gap_values


class Described(Protocol):
    """Sections of a study that make a contact system."""

    @property
    def normal(self) -> NormalLaw | None:
        """Law of the normal force of all faces."""

    @property
    def friction(self) -> FrictionLaw | None:
        """Law of friction of all faces."""

    @property
    def interfaces(self) -> Mapping[str, InterfaceSettings]:
        """Laws of single interfaces."""

    @property
    def links(self) -> Mapping[str, LinkSettings]:
        """Links between bodies."""

    @property
    def ground(self) -> Ground:
        """The ground."""

    @property
    def drive(self) -> Drive:
        """Drive at B."""

    @property
    def load(self) -> Load:
        """Loads."""

    @property
    def gap(self) -> float | tuple[float, ...] | Crown | HeightMap | None:
        """Initial gap; None for that of the mesh."""


LAWS = ("normal", "friction")


def contact_system(study: Described, reduced: Reduced, title: str) -> ContactSystem:
    """Contact system of a study on a modal basis; ``title`` names the study in messages.

    That of several bodies equals ``ContactSystem(bodies=, interfaces=, links=, ...)``.

    Raises
    ------
    InputError
        For laws, loads or a gap that do not fit the basis; the message names the section.
    """
    basis, several = reduced.basis, reduced.gaps is not None
    require_dimension(study, basis, title)
    springs = {name: one for name, one in study.links.items()
               if isinstance(one, NonlinearSpring)}
    groups = {name: count for name, count in basis.groups if name not in springs}
    if not groups and not springs:
        for section in LAWS:
            if getattr(study, section) is not None:
                where = ("name the faces that touch in [interfaces.NAME]" if several else
                         "name the boundary that touches the ground, [basis] contact")
                raise InputError(f"{title}: [{section}] is a law of contact nodes, but there are "
                                 f"no contact nodes; {where}, or leave out [{section}] for a "
                                 f"linear system.")
    for name in study.interfaces:
        if name not in groups:
            raise InputError(f"{title}: [interfaces.{name}]: the basis has no interface '{name}'"
                             f"{nearest(name, groups)}; its interfaces are: {choices(groups)}.")
    usual = {part: law for part, law in zip(LAWS, separated(
        study.normal, study.friction, f"{title}: [normal]"), strict=True) if law is not None}
    if "normal" not in usual and len(_own(study, "normal")) < len(groups):
        raise InputError(NO_NORMAL_LAW.format(f"{title} lacks the section [normal]"))
    if "friction" not in usual and _has_friction(study, basis):
        raise InputError(NO_FRICTION_LAW.format(f"{title} lacks the section [friction]"))
    for section, law, count in _laws(study, groups):
        with located(f"{title}: [{section}]:", type(law).__name__):
            law.table(np.full(count, 1.0 / count))
            require_sound(law)
    for force in study.load.forces:
        with located(f"{title}: [load.forces]:"):
            if not isinstance(force.point, tuple):
                basis.point_index(force.point)
    for load in study.load.boundaries:
        with located(f"{title}: [load.boundaries]:"):
            basis.boundary_row(load.boundary)
    gap: Any = None
    if several:
        gap = _gaps(study, reduced, title)
    elif study.gap is not None:
        of_table = isinstance(study.gap, Crown | HeightMap)
        with located(f"{title}: [gap]:" if of_table else f"{title}:", "Crown", "gap"):
            gap = gap_values(study.gap, basis.contact_places)
    parts: dict[str, Any] = {part: getattr(study, part) for part in PART_CLASSES}
    parts |= {part: usual.get(part) for part in LAWS}
    for part in LAWS:
        own = _own(study, part)
        if own or several:
            parts[part] = dict.fromkeys(groups, parts[part] or ConstantFriction(0.0)) | own | {
                name: one.law if part == "normal" else ConstantFriction(0.0)
                for name, one in springs.items()}
    parts["sliding"] = {name: one.sliding for name, one in study.interfaces.items()
                        if one.sliding is not None}
    with located(f"{title}:", "ContactSystem"):
        return ContactSystem(basis, gap=gap, **parts)


def _has_friction(study: Described, basis: ModalBasis) -> bool:
    """True if a node of an interface without own friction law can move along its other side."""
    own, first = _own(study, "friction"), 0
    for name, count in basis.groups:
        moves = basis.contact_T[first : first + count, 0].any()
        if moves and name not in own and name not in basis.springs:
            return True
        first += count
    return False


def _gaps(study: Described, reduced: Reduced, title: str) -> Any:
    """Gaps of the geometry and those added to single interfaces."""
    if study.gap is not None:
        raise InputError(f"{title}: gap = {shown(plain(study.gap))} is for a single body; give it "
                         f"in [interfaces.NAME].")
    gaps, first = np.array(reduced.gaps), 0
    for name, count in reduced.basis.groups:
        nodes = slice(first, first + count)
        first += count
        if name in reduced.basis.springs:
            continue
        with located(f"{title}: [interfaces.{name}]:", "Crown"):
            gaps[nodes] += np.asarray(gap_values(study.interfaces[name].gap,
                                                 reduced.basis.contact_places[nodes]))
    return gaps


def _own(study: Described, part: str) -> dict[str, Any]:
    """Laws given for single interfaces."""
    return {group: law for group, one in study.interfaces.items()
            if (law := separated(one.normal, one.friction, f"[interfaces.{group}]")[
                LAWS.index(part)]) is not None}


def _laws(study: Described, groups: Mapping[str, int]) -> Iterator[tuple[str, Any, int]]:
    """Section of each law, the law, and the number of nodes that use it."""
    for part in LAWS:
        own = _own(study, part)
        for group, law in own.items():
            yield f"interfaces.{group}.{part}", law, groups[group]
        for count in [sum(groups.values())] if not own else [
                count for group, count in groups.items() if group not in own]:
            if getattr(study, part) is not None and count:
                yield part, getattr(study, part), count
