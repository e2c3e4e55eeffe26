"""Meshes, elastic bodies and modal bases of a study, made once and kept."""

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from fecontact.bifurcation.harmonic.engine_order import EngineOrder
from fecontact.bifurcation.response_options import ResponseSettings
from fecontact.core.errors import InputError, choices
from fecontact.core.tables import located
from fecontact.fem.cyclic_symmetry import CyclicSymmetry, sector_nodes
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.mesh import Mesh
from fecontact.fem.pairing import Pairing, TwoPassPairing
from fecontact.fem.rotation import Rotation
from fecontact.laws.excitation import Drive, Load
from fecontact.reduction.cyclic.cyclic_basis import CyclicBasis
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.report import usable_hz
from fecontact.study.bodies_section import (
    BodySections,
    InterfaceSettings,
    Reduced,
    body_bases,
    body_meshes,
    elastic_bodies,
    pairings,
    reduced_bodies,
)
from fecontact.study.geometry_section import Geometry, geometry_mesh
from fecontact.study.links_section import LinkSettings, with_stingers
from fecontact.study.measurement_section import MeasurementSettings, masses_of_sensors
from fecontact.study.sections import BasisSettings, BodySettings
from fecontact.study.sector_section import (
    MistuningSettings,
    diameters_of,
    sector_basis,
    usable_of_sector,
    wave_of,
)

# Cached objects of a study, and that on which each depends.
_MADE_FROM: Mapping[str, Callable[["StudyModels"], Any]] = {
    "_mesh": lambda study: study.geometry,
    "_body": lambda study: (study.geometry, study.body),
    "_meshes": lambda study: {
        name: (one.geometry, one.placement) for name, one in study.bodies.items()},
    "_bodies": lambda study: {
        name: (one.geometry, one.placement, one.body) for name, one in study.bodies.items()},
    "_pairings": lambda study: (_MADE_FROM["_bodies"](study), {
        name: one.pairing_keys for name, one in study.interfaces.items()}, study.symmetry),
    "_wheel": lambda study: (study.bodies, study.symmetry, diameters_of(study), study.drive,
                             _MADE_FROM["_pairings"](study)),
    "_bases": lambda study: (study.bodies, study.links, _MADE_FROM["_pairings"](study)),
    "_reduced": lambda study: (study.geometry, study.body, study.basis,
                               study.load if study.basis.prestress else None,
                               _MADE_FROM["_bases"](study),
                               None if study.symmetry is None else _MADE_FROM["_wheel"](study),
                               masses_of_sensors(study.measurement)),
}


class StudyModels:
    """Models that a study makes from geometry, bodies and bases: all but laws and run."""

    geometry: Geometry | None
    body: BodySettings
    basis: BasisSettings
    bodies: Mapping[str, BodySections]
    interfaces: Mapping[str, InterfaceSettings]
    links: Mapping[str, LinkSettings]
    load: Load
    drive: Drive
    response: ResponseSettings
    symmetry: CyclicSymmetry | None
    mistuning: MistuningSettings | None
    measurement: MeasurementSettings | None
    path: Path | None

    @property
    def title(self) -> str:
        """Name of the study in messages."""
        return "The study" if self.path is None else str(self.path)

    @property
    def folder(self) -> Path:
        """Folder of the study file, to which other paths are relative."""
        return Path() if self.path is None else self.path.parent

    def mesh(self) -> Mesh:
        """The mesh, generated or read; cached, as are body and modal basis."""
        self._require_one("mesh", "meshes")
        return self._mesh

    def elastic_body(self) -> ElasticBody:
        """The elastic body."""
        self._require_one("elastic_body", "elastic_bodies")
        return self._body

    def modal_basis(self) -> ModalBasis:
        """The modal basis."""
        self._require_one("modal_basis", "modal_bases")
        return self._reduced.basis

    def meshes(self) -> dict[str, Mesh]:
        """Meshes of several bodies by name, in their places."""
        self._require_several("meshes", "mesh")
        return dict(self._meshes)

    def elastic_bodies(self) -> dict[str, ElasticBody]:
        """Several elastic bodies by name."""
        self._require_several("elastic_bodies", "elastic_body")
        return dict(self._bodies)

    def made_bodies(self) -> dict[str, ElasticBody]:
        """Elastic bodies made so far, by name ("" for the only one); none with a stored basis."""
        if self.bodies:
            return dict(vars(self).get("_bodies", {}))
        body = vars(self).get("_body")
        return {} if body is None else {"": body}

    @property
    def contact_faces(self) -> dict[str, tuple[str, ...]]:
        """Boundaries in contact by the name of their body, "" for the only one."""
        if not self.bodies:
            given = self.basis.contact
            return {"": (given,) if isinstance(given, str) else tuple(given)}
        found: dict[str, tuple[str, ...]] = {}
        for one in self.interfaces.values():
            for face in (one.face, one.other):
                body, dot, boundary = str(face).partition(".")
                if dot:
                    found[body] = (*found.get(body, ()), boundary)
        return found

    def pairings(self) -> dict[str, Pairing | TwoPassPairing]:
        """Pairings of the faces of several bodies, by the names of the interfaces."""
        self._require_several("pairings", "mesh")
        return dict(self._pairings)

    def modal_bases(self) -> dict[str, ModalBasis]:
        """Modal bases of several bodies by name."""
        self._require_several("modal_bases", "modal_basis")
        self.require_no_sector("the modal bases of its bodies are by nodal diameters; use "
                               "Study.cyclic_basis")
        return dict(self._bases)

    def cyclic_basis(self) -> CyclicBasis:
        """Modes of one sector of a wheel by nodal diameters, those that ``[response]`` needs."""
        if self.symmetry is None:
            raise InputError(f"{self.title} lacks the section [symmetry], which makes its bodies "
                             f"one sector of a wheel.")
        self._require_bodies_of_sector()
        return self._wheel

    def wave(self) -> EngineOrder | None:
        """The wave of the engine order of ``[response]``; None without ``[symmetry]``.

        Raises
        ------
        InputError
            For an engine order without a sector, or a sector without one.
        """
        if self.symmetry is None and self.response.engine_order is None:
            return None
        if self.symmetry is None:
            raise InputError(f"{self.title}: [response]: engine_order = "
                             f"{self.response.engine_order} is for one sector of a wheel; describe "
                             f"it in [symmetry], or leave engine_order out.")
        return wave_of(self, self.cyclic_basis(), self.title)

    def body_between_sectors(self) -> tuple[ElasticBody, Rotation | None]:
        """The body that goes on into its neighbours, and how it rotates.

        Raises
        ------
        InputError
            If none or several of the bodies have both boundaries of ``[symmetry]``.
        """
        assert self.symmetry is not None
        if not self.bodies:
            return self._body, self.body.rotation
        faces = {self.symmetry.low, self.symmetry.high}
        found = [name for name, one in self._bodies.items() if faces <= set(one.mesh.boundaries)]
        if len(found) != 1:
            known = sorted({face for one in self._bodies.values() for face in one.mesh.boundaries})
            raise InputError(f"{self.title}: [symmetry]: {len(found) or 'none'} of the bodies has "
                             f"both boundaries {choices(sorted(faces))}, at which sectors meet; "
                             f"one must, the boundaries are {choices(known)}.")
        return self._bodies[found[0]], self.bodies[found[0]].body.rotation

    def _require_bodies_of_sector(self) -> None:
        if not self.bodies:
            raise InputError(f"{self.title}: [symmetry] of a single body is for `fecontact "
                             f"diameters`; describe the sector in [bodies.NAME], also if it is one "
                             f"body, or leave [symmetry] out to take the sector alone.")

    def require_no_sector(self, reason: str) -> None:
        """Raise InputError for one sector of a wheel."""
        if self.symmetry is not None:
            raise InputError(f"{self.title}: [symmetry] makes the bodies one sector of a wheel: "
                             f"{reason}, or leave the section out to take the sector alone.")

    @property
    def usable_hz(self) -> float:
        """Lowest frequency up to which the modal bases of the bodies are usable [Hz]."""
        if self.symmetry is not None:
            return usable_of_sector(self, self._wheel)
        bases = self._bases.values() if self.bodies else [self._reduced.basis]
        return min(usable_hz(basis) for basis in bases)

    @property
    def thickness(self) -> float | None:
        """Thickness of the body, or of all bodies [m]; None if they differ. One for solids."""
        found = {one.body.depth for one in self.bodies.values()} or {self.body.depth}
        return found.pop() if len(found) == 1 else None

    def _require_one(self, name: str, instead: str) -> None:
        if self.bodies:
            raise InputError(f"{self.title} describes the bodies {choices(self.bodies)}; "
                             f"Study.{name} is for a single one, use Study.{instead}.")

    def _require_several(self, name: str, instead: str) -> None:
        if not self.bodies:
            raise InputError(f"{self.title} describes a single body; Study.{name} is for "
                             f"several, use Study.{instead}.")

    def reuse(self, other: Self) -> None:
        """Take over what another study has made, as far as it depends on equal sections."""
        for made, needed in _MADE_FROM.items():
            if made in vars(other) and needed(self) == needed(other):
                vars(self)[made] = vars(other)[made]

    def refined(self) -> Self:
        """Copy of the study on meshes whose cells are cut into four."""
        finer = copy(self)
        for made in _MADE_FROM:
            vars(finer).pop(made, None)
        if self.bodies:
            vars(finer)["_meshes"] = {name: mesh.refined() for name, mesh in self._meshes.items()}
        else:
            vars(finer)["_mesh"] = self._mesh.refined()
        return finer

    @property
    def reduced(self) -> Reduced:
        """The modal basis, that of all bodies together if there are several."""
        return self._reduced

    @cached_property
    def _mesh(self) -> Mesh:
        assert self.geometry is not None
        return geometry_mesh(self.geometry, self.folder, f"{self.title}: [geometry]:")

    @cached_property
    def _body(self) -> ElasticBody:
        mesh = self._mesh
        with located(f"{self.title}: [body]:", "ElasticBody"):
            return self.body.elastic_body(mesh)

    @cached_property
    def _meshes(self) -> dict[str, Mesh]:
        return body_meshes(self, self.title)

    @cached_property
    def _bodies(self) -> dict[str, ElasticBody]:
        return elastic_bodies(self, self._meshes, self.title)

    @cached_property
    def _pairings(self) -> dict[str, Pairing | TwoPassPairing]:
        if self.symmetry is None:
            return pairings(self, self._bodies, self.title)
        body, _ = self.body_between_sectors()
        with located(f"{self.title}: [symmetry]:", "CyclicSymmetry"):
            # A wrong number of sectors is said before faces that do not meet for it.
            sector_nodes(body, self.symmetry)
        return pairings(self, {**self._bodies, **self.symmetry.next_sector(self._bodies)},
                        self.title)

    @cached_property
    def _wheel(self) -> CyclicBasis:
        return sector_basis(self, self._bodies, self._pairings, self.title)

    @cached_property
    def _bases(self) -> dict[str, ModalBasis]:
        return body_bases(self, self._bodies, self._pairings, self.title)

    @cached_property
    def _reduced(self) -> Reduced:
        bare = self._bare
        if self.measurement is None:
            return bare
        with located(f"{self.title}: [measurement]:", "with_sensors", "with_masses"):
            return replace(bare, basis=self.measurement.loaded(
                bare.basis, with_stingers(self.links)))

    @property
    def _bare(self) -> Reduced:
        """The modal basis without sensors."""
        if self.symmetry is not None:
            self._require_bodies_of_sector()
            return Reduced(self._wheel.basis, np.asarray(self._wheel.gaps))
        if self.bodies:
            return reduced_bodies(self._bases, self._pairings, self.links, self._bodies,
                                  self.title)
        body = self._body
        with located(f"{self.title}: [basis]:"):
            return Reduced(self.basis.modal_basis(body, self.body.rotation, self.load))
