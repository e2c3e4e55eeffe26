"""One or several bodies under large deflections, with their contacts and loads, as one model.

Displacements of the nodes of all bodies stand one below the other, body by body, as do their free
unknowns; see :class:`~fecontact.fem.finite_strain.FiniteStrainModel`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.finite_strain import FiniteStrainModel, StrainState
from fecontact.fem.follower_pressure import follower_pressure
from fecontact.fem.load_steps import Loads
from fecontact.fem.points import Place
from fecontact.laws.excitation import Load
from fecontact.laws.signals.base import value_at
from fecontact.system.statics.contact_forces import MovingContact, PointForces
from fecontact.system.statics.static_solution import nodal_forces


@dataclass(frozen=True, eq=False)
class DeflectingBodies:
    """Bodies of finite elements, for :func:`fecontact.fem.load_steps.follow`.

    Attributes
    ----------
    models : mapping of name to FiniteStrainModel
        The bodies.
    contacts : sequence of MovingContact
        Their contacts, over all nodes.
    held : tuple of Loads
        Loads that stay, whose forces count as inner ones.
    """

    models: Mapping[str, FiniteStrainModel]
    contacts: Sequence[MovingContact] = ()
    held: tuple[Loads, ...] = ()

    @cached_property
    def _unknowns(self) -> Integers:
        return np.cumsum([0, *(one.expansion.shape[1] for one in self.models.values())])

    @cached_property
    def nodes(self) -> Integers:
        """Number of the first node of each body, and of all nodes."""
        return np.cumsum([0, *(len(one.body.nodes) for one in self.models.values())])

    @cached_property
    def places(self) -> Array:
        """Places (N, d) of all nodes in the undeformed bodies [m]."""
        return np.concatenate([one.body.nodes for one in self.models.values()])

    @cached_property
    def expansion(self) -> Any:
        """All displacements from the free unknowns, sparse."""
        import scipy.sparse as sp

        return sp.csc_array(sp.block_diag([one.expansion for one in self.models.values()]))

    def parts(self, q: Array) -> list[Array]:
        """Free unknowns (..., f) of each body."""
        return np.split(q, self._unknowns[1:-1], axis=-1)

    def displacement(self, q: Array) -> Array:
        """Displacements (N, d) of all nodes at free unknowns (f,)."""
        return np.concatenate([one.displacement(own) for one, own in zip(
            self.models.values(), self.parts(q), strict=True)])

    def state(self, q: Array) -> StrainState:
        """Energy, forces and tangent of bodies and contacts at free unknowns (f,)."""
        import scipy.sparse as sp

        each = [one.state(own) for one, own in zip(self.models.values(), self.parts(q),
                                                   strict=True)]
        found = each[0] if len(each) == 1 else StrainState(
            sum(one.energy for one in each), np.concatenate([one.force for one in each]),
            sp.csc_array(sp.block_diag([one.tangent for one in each])),
            max(one.strain for one in each))
        displacement = self.displacement(q) if self.contacts else np.zeros(0)
        for contact in self.contacts:
            own = contact.forces(displacement)
            acting, stiffness = self.acting(q, own.force, own.slope)
            found = replace(found, energy=found.energy + own.energy, force=found.force + acting,
                            tangent=(found.tangent + stiffness).tocsc(),
                            contacts=found.contacts + own.status,
                            rounding=found.rounding + own.rounding)
        for loads in self.held:
            force, slope = loads(q)
            found = replace(found, force=found.force - force, tangent=(
                found.tangent if slope is None else (found.tangent - slope).tocsc()))
        return found

    def acting(self, q: Array, force: Array, matrix: Any) -> tuple[Array, Any]:
        """Forces (f,) and their sparse derivative (f, f) at free unknowns (f,).

        Of forces (d N,) on the nodes of all bodies and their derivative, sparse (d N, d N).
        """
        import scipy.sparse as sp

        models = list(self.models.values())
        if len(models) == 1:
            return models[0].acting(q, force, matrix)
        own, d = self.parts(q), self.places.shape[1]
        slopes = [model.slopes(part) for model, part in zip(models, own, strict=True)]
        J = sp.csc_array(sp.block_diag(slopes))
        curvatures = [model.curvature(part, each) for model, part, each in zip(
            models, own, np.split(force, d * self.nodes[1:-1]), strict=True)]
        return J.T @ force, (J.T @ matrix @ J + sp.block_diag(curvatures)).tocsc()

    def accept(self, q: Array) -> list[PointForces]:
        """Keep a state (f,) of equilibrium: the next one is loaded from it."""
        displacement = self.displacement(q)
        return [one.accept(displacement) for one in self.contacts]

    def loads(
        self, load: Load, points: Mapping[str, Place], time: float, follower: bool
    ) -> Loads:
        """Forces of a load at free unknowns, and their derivative or None."""
        import scipy.sparse as sp

        each = []
        for name, model in self.models.items():
            own, pressures = self._own(load, name), dict[str, float]()
            if follower:
                own, pressures = _without_pressures(own, time)
            known = {_local(key, name): place for key, place in points.items()
                     if not name or key.partition(".")[0] == name}
            each.append((model, pressures, model.free(nodal_forces(model.body, own, known, time))))
        dead = np.concatenate([one for *_, one in each])
        pressed = any(pressures for _, pressures, _ in each)

        def at(q: Array) -> tuple[Array, Any]:
            if not pressed:
                return dead, None
            found = [model.acting(own, *follower_pressure(
                model.body, pressures, model.displacement(own))) for (model, pressures, _), own
                in zip(each, self.parts(q), strict=True)]
            return (dead + np.concatenate([force for force, _ in found]),
                    sp.csc_array(sp.block_diag([slope for _, slope in found])))

        return at

    def _own(self, load: Load, body: str) -> Load:
        """The part of a load that acts on a body: places are 'BODY.NAME' where there are several.

        InputError for places of no body, or by coordinates alone.
        """
        if not body:
            return load
        places = [("force", one.point) for one in load.forces]
        for what, place in [*places, *(("boundary load", one.boundary) for one in load.boundaries)]:
            first, dot, _ = place.partition(".") if isinstance(place, str) else ("", "", "")
            if not dot or first not in self.models:
                raise InputError(f"deflection_path: a {what} at {place!r} must name a body and a "
                                 f"place of it, as 'BODY.PLACE'{nearest(first, self.models)}; "
                                 f"bodies are {choices(self.models)}.")
        if load.normal:
            raise InputError(f"deflection_path: load.normal = {load.normal!r} acts at the point C "
                             f"of one body; give forces at named places of the bodies.")
        return replace(
            load,
            forces=tuple(replace(one, point=_local(str(one.point), body)) for one in load.forces
                         if str(one.point).partition(".")[0] == body),
            boundaries=tuple(replace(one, boundary=_local(one.boundary, body))
                             for one in load.boundaries if one.boundary.partition(".")[0] == body))


def _local(name: str, body: str) -> str:
    """Name of a place without that of its body."""
    return name.partition(".")[2] if body else name


def _without_pressures(load: Load, time: float) -> tuple[Load, dict[str, float]]:
    """The load without pressures on boundaries, and these [Pa]."""
    pressures: dict[str, float] = {}
    others = []
    for one in load.boundaries:
        before = pressures.get(one.boundary, 0.0)
        pressures[one.boundary] = before + value_at(one.pressure, time)
        if one.shear or one.shear_across:
            others.append(replace(one, pressure=0.0))
    return replace(load, boundaries=tuple(others)), pressures


def models_of(bodies: Mapping[str, ElasticBody]) -> dict[str, FiniteStrainModel]:
    """Models of named bodies; InputError for plane bodies and solids together."""
    if len({one.dimension for one in bodies.values()}) > 1:
        raise InputError(f"deflection_path: the bodies {choices(bodies)} are plane and solid; "
                         f"give bodies of one kind.")
    return {name: FiniteStrainModel(one) for name, one in bodies.items()}
