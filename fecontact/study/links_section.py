"""Sections of links between bodies: ``[links.NAME]``."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.tables import convert_fields, from_table, located, shown, to_table
from fecontact.core.units import Unit
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.pairing import pair_faces
from fecontact.measured.shaker import Shaker
from fecontact.reduction.assembly.face_weld import FaceWeld
from fecontact.reduction.assembly.links import (
    Bushing,
    Hinge,
    Link,
    NonlinearSpring,
    Spring,
    Weld,
)
from fecontact.reduction.assembly.nonlinear_springs import (
    PiecewiseSpring,
    PlaySpring,
    PolynomialSpring,
)
from fecontact.reduction.modal_basis import ModalBasis


@dataclass(frozen=True)
class FaceWeldSettings:
    """A face of one body welded to a face of another, whose meshes need not match.

    Parameters
    ----------
    first, second : str
        'BODY.BOUNDARY', the two faces, which touch each other.
    nodes : int or 'all'
        Welds at every displacement node of the finer face, or in the mean over so many segments.
    reach : float, optional
        Largest distance between welded places [m]: shorter for faces that part; by default the
        extent of the larger face.
    """

    first: str
    second: str
    nodes: int | Literal["all"] = "all"
    reach: Annotated[float | None, Unit("m")] = None

    def __post_init__(self) -> None:
        convert_fields(self)


@dataclass(frozen=True, kw_only=True)
class ShakerSettings(Shaker):
    """Electrodynamic shaker, a further body NAME, whose stinger drives a point of a body.

    A load at its point ``NAME.coil`` with component = "x" is the current [A], or the voltage [V] of
    a shaker with a resistance. Force gauges name the stinger by ``link = "NAME"``.

    Parameters
    ----------
    first : str
        'BODY.POINT', the point that is driven.
    armature_mass : float
        Mass of armature and coil [kg].
    suspension_stiffness, suspension_damping : float
        Suspension of the armature in the frame, which stands [N/m], [N s/m].
    stinger_stiffness, stinger_damping : float
        Stinger along ``direction``, without bending moments [N/m], [N s/m].
    direction : list
        Direction of the force, [x, y] or [x, y, z].
    force_factor : float
        Force per current [N/A]; 1 for a drive that is a force in N.
    resistance : float, optional
        Resistance of the coil [Ohm]: the drive is a voltage.
    inductance : float
        Inductance of the coil [H].
    """

    first: str

    def __post_init__(self) -> None:
        convert_fields(self)
        super().__post_init__()

    @property
    def second(self) -> None:
        """No further body of the study: the other end of the stinger is the armature."""


SimpleLink = Spring | Bushing | Hinge | NonlinearSpring
LinkSettings = SimpleLink | FaceWeldSettings | ShakerSettings

LINKS: Mapping[str, type] = {
    "spring": Spring, "bushing": Bushing, "hinge": Hinge, "weld": Weld,
    "face-weld": FaceWeldSettings, "shaker": ShakerSettings,
    "polynomial-spring": PolynomialSpring,
    "play-spring": PlaySpring, "piecewise-spring": PiecewiseSpring}


def links_from_tables(tables: Any, title: str) -> dict[str, LinkSettings]:
    """All links from ``[links]``; the key ``kind`` names the class of each."""
    if not isinstance(tables, Mapping):
        raise InputError(f"{title}: [links] must be a table of links, [links.NAME], not "
                         f"{shown(tables)}.")
    found: dict[str, LinkSettings] = {}
    for name, table in tables.items():
        where = f"{title}: [links.{name}]"
        kind = table.get("kind") if isinstance(table, Mapping) else None
        if not isinstance(kind, str) or kind not in LINKS:
            raise InputError(f"{where}: kind = {shown(kind)} must be one of {choices(LINKS)}"
                             f"{nearest(str(kind), LINKS)}.")
        found[name] = from_table(LINKS[kind], {key: value for key, value in table.items()
                                               if key != "kind"}, where)
    return found


def link_table(link: LinkSettings, *, defaults: bool = True) -> dict[str, Any]:
    """Table of a link; the inverse of :func:`links_from_tables`."""
    kind = {cls: name for name, cls in LINKS.items()}[type(link)]
    return {"kind": kind, **to_table(link, defaults=defaults)}


def made_links(
    links: Mapping[str, LinkSettings], bodies: Mapping[str, ElasticBody], title: str
) -> dict[str, Link]:
    """The links of a study; faces that are welded are paired.

    Raises
    ------
    InputError
        For faces that cannot be welded, naming the section.
    """
    found: dict[str, Link] = {}
    for name, one in with_stingers(links).items():
        if isinstance(one, FaceWeldSettings):
            with located(f"{title}: [links.{name}]:", "FaceWeld", "pair_faces"):
                found[name] = FaceWeld(pair_faces(bodies, one.first, one.second, nodes=one.nodes,
                                                  reach=one.reach))
        else:
            found[name] = one
    return found


def with_stingers(links: Mapping[str, LinkSettings]) -> dict[str, FaceWeldSettings | SimpleLink]:
    """Links with the stinger, a spring, in place of each shaker."""
    return {name: one.stinger(one.first, name) if isinstance(one, ShakerSettings) else one
            for name, one in links.items()}


def shaker_bases(
    links: Mapping[str, LinkSettings], dimension: int, title: str
) -> dict[str, ModalBasis]:
    """Bodies of the shakers by the names of their links.

    Raises
    ------
    InputError
        For a direction that is not one of the bodies, naming the section.
    """
    shakers = {name: one for name, one in links.items() if isinstance(one, ShakerSettings)}
    for name, one in shakers.items():
        if len(one.direction) != dimension:
            raise InputError(f"{title}: [links.{name}]: direction = {shown(list(one.direction))} "
                             f"must have {dimension} components, as the bodies have.")
    return {name: one.basis() for name, one in shakers.items()}
