"""Sections of several bodies: ``[bodies.NAME]``, ``[interfaces.NAME]`` and ``[links.NAME]``."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

import numpy as np

from fecontact.core.docstrings import inherit_documentation
from fecontact.core.errors import InputError, choices, nearest, require_finite
from fecontact.core.tables import (
    convert_fields,
    from_table,
    located,
    plain,
    require_known,
    shown,
    to_table,
)
from fecontact.core.types import Array, Coordinates
from fecontact.core.units import Unit
from fecontact.fem.cyclic_symmetry import NEXT, CyclicSymmetry
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.mesh import Mesh
from fecontact.fem.pairing import Pairing, TwoPassPairing, pair_both_faces, pair_faces
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.ground.height_map import HeightMap
from fecontact.laws.ground.sliding import SlidingRotation, SlidingTranslation
from fecontact.reduction.assembly.assembled_basis import assembled_basis
from fecontact.reduction.assembly.nonlinear_springs import nonlinear_springs
from fecontact.reduction.half_space_compliance import with_half_space
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.reduce_body import reduce_bodies
from fecontact.study.geometry_section import (
    Geometry,
    body_table,
    geometry_from_table,
    geometry_mesh,
    geometry_table,
)
from fecontact.study.links_section import LinkSettings, made_links, shaker_bases
from fecontact.study.sections import BasisSettings, BodySettings
from fecontact.system.gap import Crown

Gap = float | tuple[float, ...] | Crown | HeightMap

# Keys of an interface on which the modal bases of its bodies depend.
PAIRING_KEYS = ("face", "other", "passes", "nodes", "nodes_on", "reach", "overlap")


@dataclass(frozen=True)
class Placement:
    """``[bodies.NAME.placement]``: where the body stands; mirrored, then turned, then shifted.

    Parameters
    ----------
    shift : (float, float), of solids three floats
        Displacement along x, y (, z) [m].
    rotation : float, of solids also three floats
        Angle about the origin [degrees], counter-clockwise (of solids about z); or angles about
        x, then y, then z.
    mirror : 'x', 'y' or, of solids, 'z', optional
        The coordinate that changes its sign.
    """

    shift: Annotated[Coordinates, Unit("m")] = (0.0, 0.0)
    rotation: Annotated[float | tuple[float, float, float], Unit("degrees")] = 0.0
    mirror: Literal["x", "y", "z"] | None = None

    def __post_init__(self) -> None:
        convert_fields(self)
        angles = self.rotation if isinstance(self.rotation, tuple) else (self.rotation,)
        require_finite("Placement", **dict(zip("xyz", self.shift, strict=False)))
        for angle in angles:
            require_finite("Placement", rotation=angle)

    def placed(self, mesh: Mesh) -> Mesh:
        """The mesh in its place."""
        shift = self.shift if any(self.shift) else None
        return mesh if self == Placement() else mesh.placed(shift, self.rotation, self.mirror)


@dataclass(frozen=True)
class BodyBasisSettings(BasisSettings):
    """``[bodies.NAME.basis]``: as ``[basis]``, but for one of several bodies.

    Places are those of the placed body.

    Parameters
    ----------
    contact, contact_nodes : str, int
        Not for several bodies, of which interfaces name the faces.
    prestress : bool
        Not for several bodies, which press each other.
    B, C : place, optional
        Excitation and load point, which one body alone can have: name of a point or boundary,
        [x, y], of solids [x, y, z], or a patch ``{at = name or place, radius = r}``. By default
        the points of these names of the only mesh that has them.
    reduction : 'vibration', 'residual' or 'craig-bampton'
        Static shapes added to the vibration modes; by default those of forces at the interfaces.
    rigid : bool
        Whether the body is rigid; for bodies of one sector of a wheel, such as dampers.
    """

    reduction: Literal["vibration", "residual", "craig-bampton"] = "residual"
    rigid: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        usual = BasisSettings()
        for key in ("contact", "contact_nodes"):
            if getattr(self, key) != getattr(usual, key):
                raise InputError(f"BodyBasisSettings: {key} is for a single body; name the face in "
                                 f"[interfaces.NAME] instead.")
        if self.prestress:
            raise InputError("BodyBasisSettings: prestress = true is for a single body; in Python "
                             "give modal_basis the state of each body, basis.fields(q, body).")


inherit_documentation(BodyBasisSettings)


@dataclass(frozen=True)
class BodySections:
    """``[bodies.NAME]``: one of several bodies.

    Parameters
    ----------
    geometry : Beam, Pendulum, Block, a solid or MeshFile
        ``[bodies.NAME.geometry]``: as ``[geometry]`` of a single body, in its own coordinates.
    placement : Placement
        ``[bodies.NAME.placement]``: shift, rotation and mirror.
    body : BodySettings
        ``[bodies.NAME.body]``: as ``[body]``.
    basis : BodyBasisSettings
        ``[bodies.NAME.basis]``: modes and points.
    """

    geometry: Geometry
    placement: Placement = field(default_factory=Placement)
    body: BodySettings = field(default_factory=BodySettings)
    basis: BodyBasisSettings = field(default_factory=BodyBasisSettings)

    def table(self, *, defaults: bool = True) -> dict[str, Any]:
        """The section as a table for TOML."""
        parts = {"placement": to_table(self.placement, defaults=defaults),
                 "body": body_table(self.body, self.geometry, defaults=defaults),
                 "basis": to_table(self.basis, defaults=defaults)}
        for key in ("contact", "contact_nodes"):
            parts["basis"].pop(key, None)
        return {"geometry": geometry_table(self.geometry, defaults=defaults),
                **{name: table for name, table in parts.items() if table}}


@dataclass(frozen=True)
class InterfaceSettings:
    """``[interfaces.NAME]``: laws of the interface NAME; of several bodies, its faces too.

    Parameters
    ----------
    normal, friction : law, optional
        ``[interfaces.NAME.normal]``, ``[interfaces.NAME.friction]``; total values refer to the
        face of the interface. By default those of ``[normal]`` and ``[friction]``.
    face : str, optional
        'BODY.BOUNDARY', one of the two faces; required for several bodies. The keys below are for
        several bodies only.
    other : str
        'BODY.BOUNDARY' of the other face, or 'ground'; with ``[symmetry]`` also
        'next_BODY.BOUNDARY' of the next sector.
    passes : 1 or 2
        One pass has contact nodes on one of the faces; two have them on both, which loads them more
        evenly. Totals refer to both passes together. For compliant laws, not on the ground and not
        where the other side slides.
    nodes : int or 'all', of solids also two integers
        Every displacement node, or so many segments of equal length. Of solids every facet, so many
        patches of about equal area, or ``[n, m]`` along the first and second tangent, or around and
        across a ring, bore or shaft.
    nodes_on : 'finer' or 'face', optional
        Face with the contact nodes: the finer of the two, or ``face``; by default the finer
        one, and ``face`` where the other side slides.
    reach : float, optional
        Largest distance between partners [m]; by default the extent of the larger face.
    overlap : float
        Depth up to which faces inside each other are set to zero gap, in mean edges of the finer
        face.
    gap : float, list, Crown or HeightMap
        Added to the gaps of the geometry [m].
    sliding : SlidingTranslation or SlidingRotation, optional
        Steady motion of the other side: ``{speed, direction}``, or ``{speed, centre}`` and, of
        solids, ``axis``.
    """

    normal: NormalLaw | None = None
    friction: FrictionLaw | None = None
    face: str | None = None
    other: str = "ground"
    passes: Literal[1, 2] = 1
    nodes: int | Literal["all"] | tuple[int, int] = "all"
    nodes_on: Literal["finer", "face"] | None = None
    reach: Annotated[float | None, Unit("m")] = None
    overlap: float = 0.01
    gap: Annotated[Gap, Unit("m")] = 0.0
    sliding: SlidingTranslation | SlidingRotation | None = None

    @property
    def pairing_keys(self) -> tuple[Any, ...]:
        """Values on which the pairing of the faces depends."""
        return (*(getattr(self, key) for key in PAIRING_KEYS), self.side_of_nodes)

    @property
    def side_of_nodes(self) -> Literal["finer", "face"]:
        """``nodes_on``, or its default."""
        return self.nodes_on or ("finer" if self.sliding is None else "face")


class Bodies(Protocol):
    """Sections of a study that describe several bodies."""

    @property
    def bodies(self) -> Mapping[str, BodySections]:
        """The bodies."""

    @property
    def interfaces(self) -> Mapping[str, InterfaceSettings]:
        """Interfaces at which bodies may touch."""

    @property
    def links(self) -> Mapping[str, LinkSettings]:
        """Links between bodies."""

    @property
    def symmetry(self) -> CyclicSymmetry | None:
        """Wheel of which they are one sector."""

    @property
    def folder(self) -> Path:
        """Folder of the study file."""


@dataclass(frozen=True, eq=False)
class Reduced:
    """Modal basis of a study, and of several bodies the gaps (n,) of their geometry [m]."""

    basis: ModalBasis
    gaps: Array | None = None


def _body(table: Any, where: str) -> BodySections:
    if not isinstance(table, Mapping):
        raise InputError(f"{where} must be a table of sections, not {shown(table)}.")
    kinds: dict[str, Any] = {"geometry": None, "placement": Placement, "body": BodySettings,
             "basis": BodyBasisSettings}
    for key in table:
        require_known(key, kinds, where)
    inner = {name: f"{where[:-1]}.{name}]" for name in kinds}
    if "geometry" not in table:
        raise InputError(f"{where} lacks the section {inner['geometry'].partition(': ')[2]}; give "
                         f"a shape and its dimensions, or the file of a mesh.")
    if isinstance(basis := table.get("basis"), Mapping):
        for key in ("contact", "contact_nodes"):
            if key in basis:
                raise InputError(f"{inner['basis']}: {key} = {shown(basis[key])} is for a single "
                                 f"body; name the face in [interfaces.NAME] instead.")
    parts: dict[str, Any] = {name: from_table(kind, table[name], inner[name])
                             for name, kind in kinds.items() if kind and name in table}
    return BodySections(geometry_from_table(table["geometry"], inner["geometry"]), **parts)


def bodies_from_tables(tables: Any, title: str) -> dict[str, BodySections]:
    """All bodies from ``[bodies]``."""
    if not isinstance(tables, Mapping) or not tables:
        raise InputError(f"{title}: [bodies] must be a table of bodies, [bodies.NAME.geometry] and "
                         f"so on, not {shown(tables)}.")
    return {name: _body(table, f"{title}: [bodies.{name}]") for name, table in tables.items()}


def check_bodies(study: Bodies, title: str) -> None:
    """Refuse names that are used twice or lead nowhere, and bodies that nothing touches.

    Raises
    ------
    InputError
        Naming the section.
    """
    if not study.bodies:
        for name, one in study.interfaces.items():
            for key, value in to_table(one, defaults=False).items():
                if key not in ("normal", "friction"):
                    raise InputError(
                        f"{title}: [interfaces.{name}]: {key} = {shown(value)} is for several "
                        f"bodies, described in [bodies.NAME]; the interfaces of a single body are "
                        f"the boundaries that [basis] names as contact.")
        if study.links:
            raise InputError(f"{title} has [links], which join several bodies; describe them in "
                             f"[bodies.NAME].")
        return
    _check_names(study, title)
    _check_sector(study, title)
    touched: set[str] = set()
    for name, one in study.interfaces.items():
        where = f"{title}: [interfaces.{name}]"
        if one.face is None:
            raise InputError(f"{where} lacks the key 'face', the boundary \"BODY.BOUNDARY\" of a "
                             f"body.")
        for key, face in (("face", one.face), ("other", one.other)):
            if key == "other" and face == "ground":
                continue
            body, dot, boundary = face.partition(".")
            if not (dot and boundary):
                ground = " or 'ground'" if key == "other" else ""
                raise InputError(f"{where}: {key} = {shown(face)} must be \"BODY.BOUNDARY\""
                                 f"{ground}; the bodies are: {choices(study.bodies)}.")
            if key == "other" and study.symmetry is not None:
                body = body.removeprefix(NEXT)
            touched.add(_known_body(body, study.bodies, f"{where}: {key} = {shown(face)}"))
    if study.symmetry is not None:
        return
    for name, link in study.links.items():
        for key, point in (("first", link.first), ("second", link.second)):
            if point is None:
                continue
            where = f"{title}: [links.{name}]: {key} = {shown(point)}"
            body, dot, _ = point.partition(".")
            if not dot:
                raise InputError(f"{where} must be \"BODY.POINT\"; the bodies are: "
                                 f"{choices(study.bodies)}.")
            touched.add(_known_body(body, study.bodies, where))
    loose = [name for name in study.bodies if name not in touched]
    if loose:
        raise InputError(f"{title}: no interface and no link touches the "
                         f"{'body' if len(loose) == 1 else 'bodies'} {choices(loose)}; name a face "
                         f"of each in [interfaces.NAME], or leave it out.")


def _check_sector(study: Bodies, title: str) -> None:
    """Refuse links in a sector of a wheel, and what only sectors have in other studies."""
    if study.symmetry is not None and study.links:
        raise InputError(f"{title} has [links], which one sector of a wheel does not take; let "
                         f"bodies touch in [interfaces.NAME], or model them as one.")
    for name, one in study.bodies.items():
        if one.basis.rigid and study.symmetry is None:
            raise InputError(f"{title}: [bodies.{name}.basis]: rigid = true is for one sector of a "
                             f"wheel, [symmetry]; take reduction = \"vibration\" with the rigid "
                             f"modes alone.")
        if one.basis.half_space and study.symmetry is not None:
            raise InputError(f"{title}: [bodies.{name}.basis]: half_space = true is not for one "
                             f"sector of a wheel; refine the mesh at the contact instead.")


def _check_names(study: Bodies, title: str) -> None:
    used: dict[str, str] = {}
    for section in ("bodies", "interfaces", "links"):
        for name in getattr(study, section):
            where = f"{title}: [{section}.{name}]"
            if not name or "." in name:
                raise InputError(f"{where}: the name '{name}' must be a text without dots, which "
                                 f"part the names of keys.")
            if section == "bodies" and name == "ground":
                raise InputError(f"{where}: 'ground' is the name of the ground; choose another.")
            if name in used:
                raise InputError(f"{where}: the name '{name}' is that of [{used[name]}.{name}] "
                                 f"too; give each its own.")
            used[name] = section


def _known_body(body: str, bodies: Mapping[str, Any], where: str) -> str:
    if body not in bodies:
        raise InputError(f"{where}: there is no body '{body}'{nearest(body, bodies)}; the bodies "
                         f"are: {choices(bodies)}.")
    return body


def body_meshes(study: Bodies, title: str) -> dict[str, Mesh]:
    """Meshes of all bodies in their places.

    Raises
    ------
    InputError, MeshError
        For geometries that make no mesh, and for plane bodies beside solids.
    """
    found = {}
    for name, one in study.bodies.items():
        mesh = geometry_mesh(one.geometry, study.folder, f"{title}: [bodies.{name}.geometry]:")
        with located(f"{title}: [bodies.{name}.placement]:", "Mesh"):
            found[name] = one.placement.placed(mesh)
    kinds = {2: "a plane body", 3: "a solid"}
    (first, mesh), *others = found.items()
    for name, other in others:
        if other.dimension != mesh.dimension:
            raise InputError(f"{title}: [bodies.{name}.geometry] is {kinds[other.dimension]} and "
                             f"[bodies.{first}.geometry] {kinds[mesh.dimension]}; bodies of one "
                             f"study must be all plane or all solids, model them alike.")
    return found


def elastic_bodies(study: Bodies, meshes: Mapping[str, Mesh], title: str) -> dict[str, ElasticBody]:
    """All elastic bodies."""
    found = {}
    for name, one in study.bodies.items():
        with located(f"{title}: [bodies.{name}.body]:", "ElasticBody"):
            found[name] = one.body.elastic_body(meshes[name])
    return found


def pairings(
    study: Bodies, bodies: Mapping[str, ElasticBody], title: str
) -> dict[str, Pairing | TwoPassPairing]:
    """Pairings of the faces of all interfaces."""
    found: dict[str, Pairing | TwoPassPairing] = {}
    for name, one in study.interfaces.items():
        with located(f"{title}: [interfaces.{name}]:", "pair_faces"):
            assert one.face is not None
            for face in (one.face, one.other):
                body, _, boundary = face.partition(".")
                if boundary and boundary not in (known := bodies[body].mesh.boundaries):
                    raise InputError(f"the mesh of body '{body}' has no boundary '{boundary}'"
                                     f"{nearest(boundary, known)}; its boundaries are: "
                                     f"{choices(known)}.")
            if one.passes == 2:
                found[name] = _both_faces(bodies, one)
                continue
            found[name] = made = pair_faces(
                bodies, one.face, one.other, nodes=one.nodes, nodes_on=one.side_of_nodes,
                reach=one.reach, overlap=one.overlap)
            if one.sliding is not None and made.swapped:
                raise InputError(f"sliding is that of {one.other}, but with nodes_on = 'finer' "
                                 f"the contact nodes lie on it; leave nodes_on out.")
    return found


def _both_faces(bodies: Mapping[str, ElasticBody], one: InterfaceSettings) -> TwoPassPairing:
    """Two passes of an interface."""
    assert one.face is not None
    wrong = {"other": one.other == "ground", "nodes_on": one.nodes_on is not None,
             "sliding": one.sliding is not None}
    for key, is_wrong in wrong.items():
        if is_wrong:
            raise InputError(f"passes = 2 puts contact nodes on both faces, which {key} = "
                             f"{shown(plain(getattr(one, key)))} does not allow; set passes = 1.")
    return pair_both_faces(bodies, one.face, one.other, nodes=one.nodes, reach=one.reach,
                           overlap=one.overlap)


def body_bases(
    study: Bodies, bodies: Mapping[str, ElasticBody],
    faces: Mapping[str, Pairing | TwoPassPairing], title: str
) -> dict[str, ModalBasis]:
    """Modal bases of all bodies, with the forces at their interfaces; see ``reduce_bodies``."""
    found = {}
    with located(f"{title}: [bodies]:"):
        bases = reduce_bodies(
            bodies, list(faces.values()), made_links(study.links, bodies, title),
            modes={name: one.basis.modes for name, one in study.bodies.items()},
            each={name: {**one.basis.options, "rotation": one.body.rotation}
                  for name, one in study.bodies.items()})
    for name, one in study.bodies.items():
        with located(f"{title}: [bodies.{name}.basis]:"):
            basis = bases[name]
            if one.basis.half_space:
                touching = [face for face in faces.values() if name in (face.body, face.other)]
                basis = with_half_space(basis, bodies[name], pairings=touching, name=name)
            found[name] = one.basis.finished(basis)
    return found


def reduced_bodies(
    bases: Mapping[str, ModalBasis], faces: Mapping[str, Pairing | TwoPassPairing],
    links: Mapping[str, LinkSettings], bodies: Mapping[str, ElasticBody], title: str,
) -> Reduced:
    """The assembled basis, and the gaps of the geometry, zero for nonlinear springs."""
    with located(f"{title}:"):
        made = made_links(links, bodies, title)
        springs = np.zeros(len(nonlinear_springs(made)))
        shakers = shaker_bases(links, next(iter(bodies.values())).dimension, title)
        return Reduced(assembled_basis({**bases, **shakers}, faces, made), np.concatenate(
            [*(one.gaps for one in faces.values()), springs]))
