"""Statics of elastic bodies with large deflections, by their finite elements."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, overload

import numpy as np
from typing_extensions import TypeAliasType

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, ModelWarning, require_finite
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, quantity
from fecontact.fem.constraints import Coupling
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.contact_patches import Count
from fecontact.fem.fields import BodyFields
from fecontact.fem.finite_rotations import turning_nodes
from fecontact.fem.finite_strain import LARGE_STRAIN, FiniteStrainModel
from fecontact.fem.load_steps import DeflectionSteps, Loads, PathPoint, follow
from fecontact.fem.points import Place, place_rows
from fecontact.laws.excitation import Load
from fecontact.reduction.eigenmodes import rigid_modes
from fecontact.system.gap import Gap
from fecontact.system.interfaces import Interface
from fecontact.system.statics.contact_forces import MovingContact, PointForces
from fecontact.system.statics.contact_points import (
    FrictionLaws,
    NormalLaws,
    ground_points,
    interface_points,
)
from fecontact.system.statics.deflecting_bodies import DeflectingBodies, models_of

Bodies = TypeAliasType("Bodies", ElasticBody | Mapping[str, ElasticBody])
Loading = TypeAliasType("Loading", Load | Sequence[Load])
# Rotation up to which distributing couplings are linear [rad].
SMALL_ANGLE = 0.1
# Strain by the linear equations of a rotation, relative to that of the body, that is small.
_FALSE = 0.01


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class DeflectionPath(Summarised):
    """States of equilibrium of a body under growing loads, the first without load.

    Of several bodies energies, strains and contacts are those of all.

    Attributes
    ----------
    body : ElasticBody
        The body.
    load_factors : (s,) array
        Parts of the load; 1 is the whole load. Of several loads k + r is the part 1 - r of load k
        with the part r of the next one.
    displacements : (s, N, d) array
        Displacements of the nodes [m].
    unknowns : (s, f) array
        Displacements of the free unknowns, of bricks with their incompatible modes.
    energies : (s,) array
        Strain energy, with that of springs at points and of contacts, springs of friction too [J].
    strains : (s,) array
        Largest component of Green and Lagrange's strain, without sign.
    unstable : (s,) integer array
        Number of negative eigenvalues of the tangent stiffness; zero in a stable state. Where
        contacts slide the tangent is not symmetric: number of negative pivots.
    penetration, normal_force : (s, n) arrays
        Of the contact nodes, first those of ``contact``, then of each interface: penetration, below
        zero the gap [m], and force [N].
    friction_force : (s, n, d) array
        Friction force on the nodes along x, y (, z) [N].
    slip : (s, n) array
        Path that the nodes have slid [m].
    friction_loss : (s,) array
        Energy that friction has lost [J]; of mean forces of each step.
    reached : bool
        Whether the path ends with the whole load.
    message : str
        Why the path ends.
    """

    body: ElasticBody
    load_factors: Array
    displacements: Array
    unknowns: Array
    energies: Array
    strains: Array
    unstable: Integers
    penetration: Array
    normal_force: Array
    friction_force: Array
    slip: Array
    friction_loss: Array
    reached: bool
    message: str

    def summary(self) -> list[tuple[str, str]]:
        """Steps, load factors, displacement, strain and the end of the path."""
        size = np.linalg.norm(self.displacements, axis=2).max()
        return [
            ("states", f"{len(self.load_factors)}"),
            ("load factors", f"{self.load_factors.min():.5g} to {self.load_factors.max():.5g}"),
            ("largest displacement", quantity(float(size), "m")),
            ("largest strain", f"{self.strains.max():.3g}"),
            ("unstable states", f"{np.count_nonzero(self.unstable)}"),
            *([("nodes in contact", f"{np.count_nonzero(self.normal_force[-1])} of "
                f"{self.normal_force.shape[1]}")] if self.normal_force.size else []),
            *([("lost to friction", quantity(float(self.friction_loss[-1]), "J"))]
              if self.friction_force.any() else []),
            ("end", self.message),
        ]

    def displacement(self, place: Place) -> Array:
        """Displacements (s, d) of a point of the mesh, a boundary's mean, or a place [m]."""
        body = self.body
        rows = place_rows(body, place, "displacement").matrix[: body.dimension]
        if isinstance(place, str) and place in body.references:
            return np.asarray((rows @ _linear_displacements(self)).T)
        return np.asarray((rows @ self.displacements.reshape(len(self.load_factors), -1).T).T)

    def fields(self, state: int = -1) -> BodyFields:
        """Displacement and stress over the body in one state, the last by default.

        The stress is the second one of Piola and Kirchhoff; ``cauchy_stress`` of the fields is the
        true one. InputError for a state that does not exist.
        """
        count = len(self.load_factors)
        if type(state) is not int or not -count <= state < count:
            raise InputError(f"fields: state = {state!r} must be a whole number from {-count} to "
                             f"{count - 1}.")
        stress = FiniteStrainModel(self.body).stress(self.unknowns[state][:, None])
        return BodyFields(self.body.nodes, self.body.elements, self.displacements[state],
                          stress[..., 0])


@overload
def deflection_path(
    body: ElasticBody, load: Load | Sequence[Load], *, points: Mapping[str, Place] | None = None,
    time: float = 0.0, follower: bool = False, steps: DeflectionSteps | None = None,
    contact: str | Sequence[str] = (), contact_nodes: Count | Sequence[Count] = "all",
    normal: NormalLaws | None = None, friction: FrictionLaws | None = None,
    gap: Gap | None = None,
    interfaces: Sequence[Interface] = (),
) -> DeflectionPath: ...


@overload
def deflection_path(
    body: Mapping[str, ElasticBody], load: Load | Sequence[Load], *,
    points: Mapping[str, Place] | None = None, time: float = 0.0, follower: bool = False,
    steps: DeflectionSteps | None = None, interfaces: Sequence[Interface] = (),
) -> dict[str, DeflectionPath]: ...


def deflection_path(
    body: Bodies,
    load: Loading,
    *,
    points: Mapping[str, Place] | None = None,
    time: float = 0.0,
    follower: bool = False,
    steps: DeflectionSteps | None = None,
    contact: str | Sequence[str] = (),
    contact_nodes: Count | Sequence[Count] = "all",
    normal: NormalLaws | None = None,
    friction: FrictionLaws | None = None,
    gap: Gap | None = None,
    interfaces: Sequence[Interface] = (),
) -> DeflectionPath | dict[str, DeflectionPath]:
    r"""Equilibria of bodies with large deflections, from no load to the whole load.

    ``f(u) = factor p`` with the derivative f of the energy of Green and Lagrange's strain, linear
    elastic. Displacements and rotations may be large, strains must be small. Distributing couplings
    rotate by small angles. Contact nodes slide any distance on flat ground or deformed faces; see
    :mod:`fecontact.system.statics.contact_forces`. Friction is that of quasi-static loading: of
    Jenkins' and Iwan's springs; laws without memory act with mu(0+) behind a spring of 0.82 of the
    normal law's stiffness at its scale of penetration.

    Parameters
    ----------
    body : ElasticBody, or mapping of name to ElasticBody
        Supported against all rigid motions. Places of several bodies are 'BODY.PLACE'.
    load, points, time : Load or sequence of Load, mapping, float
        See :func:`~fecontact.static_solution`; several loads act one after the other.
    follower : bool
        True if pressures on boundaries act normal to the deformed outline, on its deformed size.
    steps : DeflectionSteps, optional
        Load steps by default; steps of the arc length pass limit points.
    contact, contact_nodes : as of :func:`~fecontact.modal_basis`
        Boundaries of one body that may touch the ground, none by default.
    normal, friction : laws, or mappings of boundary to law, optional
        Of the ground; the normal law is required with contact.
    gap : float, (n,) sequence, Crown, HeightMap or function of x
        Initial distance from the ground [m]; by default that of the mesh, as of
        :class:`~fecontact.ContactSystem`.
    interfaces : sequence of Interface
        Faces paired by :func:`~fecontact.fem.pair_faces`, and their laws.

    Raises
    ------
    InputError, MeshError
        As :func:`~fecontact.static_solution`; for bodies, laws and interfaces that do not fit.

    Warns
    -----
    ModelWarning
        If the whole load was not reached, and for strains or rotations beyond the range.
    """
    require_kind("deflection_path", (ElasticBody, Mapping), body=body)
    bodies = {"": body} if isinstance(body, ElasticBody) else body
    for name, one in bodies.items():
        require_kind("deflection_path: body", ElasticBody, **{name or "body": one})
        require_supported(one, f"deflection_path{f' of {name}' if name else ''}")
    require_kind("deflection_path", (Load, Sequence), load=load)
    loads = [load] if isinstance(load, Load) else [*load]
    if not bodies or not loads:
        raise InputError(f"deflection_path: there is no {'load' if bodies else 'body'}; give one"
                         f"{', if nothing acts Load().' if bodies else '.'}")
    for load in loads:
        require_kind("deflection_path", Load, load=load)
    require_kind("deflection_path", Mapping, points={} if points is None else points)
    require_kind("deflection_path", bool, follower=follower)
    require_kind("deflection_path", (DeflectionSteps, type(None)), steps=steps)
    require_finite("deflection_path", time=time)
    plain = DeflectingBodies(models_of(bodies))
    if isinstance(body, ElasticBody):
        touching = ground_points(body, contact, contact_nodes, normal, friction, gap)
    elif contact or normal or friction:
        raise InputError("deflection_path: contact and its laws are those of one body; give "
                         "several bodies interfaces, with the ground too.")
    else:
        touching = []
    touching += interface_points(bodies, interfaces)
    whole = replace(plain, contacts=[MovingContact(plain.places, one) for one in touching])
    forces = [whole.loads(one, points or {}, time, follower) for one in loads]
    contacts: list[list[PointForces]] = []
    found: list[PathPoint] = []
    for number, acting in enumerate(forces):
        stage = replace(whole, held=(forces[number - 1],)) if number else whole
        path = follow(stage, _difference(forces[number - 1], acting) if number else acting,
                      steps or DeflectionSteps(), begin=found[-1].q if found else None,
                      accepted=lambda q: contacts.append(whole.accept(q)))
        found += [replace(one, factor=number + one.factor)
                  for one in path.points[min(number, 1):]]
        if not path.reached:
            break
    paths = {name: DeflectionPath(
        one, np.array([point.factor for point in found]),
        np.array([whole.models[name].displacement(whole.parts(point.q)[k]) for point in found]),
        np.array([whole.parts(point.q)[k] for point in found]),
        np.array([point.state.energy for point in found]),
        np.array([point.state.strain for point in found]),
        np.array([point.unstable for point in found]), reached=path.reached,
        message=path.message, **_contact_arrays(contacts, one.dimension))
        for k, (name, one) in enumerate(bodies.items())}
    said = {sentence for one in paths.values() for sentence in _limits(one)}
    for sentence in sorted(said):
        warnings.warn(f"deflection_path: {sentence}", ModelWarning, stacklevel=2)
    return paths[""] if isinstance(body, ElasticBody) else paths


def require_supported(body: ElasticBody, what: str) -> None:
    """Raise InputError for a body that can move without strain."""
    if rigid_modes(body).shape[1]:
        raise InputError(f"{what} is for bodies that supports hold against all rigid motions; "
                         f"support the body with fixed.")


def _difference(first: Loads, last: Loads) -> Loads:
    """Forces that a load adds to those of the load before."""
    def at(q: Array) -> tuple[Array, Any]:
        (before, slope), (after, other) = first(q), last(q)
        if slope is None or other is None:
            change = other if slope is None else -slope
        else:
            change = other - slope
        return after - before, change

    return at


def _contact_arrays(states: list[list[PointForces]], dimension: int) -> dict[str, Array]:
    """Penetration, normal force, friction, slip (s, n, ...) and loss (s,) of all contacts."""
    def together(name: str, *shape: int) -> Array:
        none = np.zeros((0, *shape))
        return np.array([np.concatenate([none, *(getattr(one, name) for one in state)])
                         for state in states])

    return {"penetration": together("penetration"), "normal_force": together("normal_force"),
            "friction_force": together("friction", dimension), "slip": together("slip"),
            "friction_loss": together("loss").sum(axis=1)}


def _limits(path: DeflectionPath) -> list[str]:
    """Sentences about states beyond the range of the model."""
    found = [] if path.reached else [path.message]
    if path.strains.max() > LARGE_STRAIN:
        found.append(f"the strain reaches {path.strains.max():.2g}; above {LARGE_STRAIN:g} metals "
                     f"yield and rubber has another law, so lower the load.")
    body, linear = path.body, _linear_displacements(path)
    turned = max((float(np.abs(body.motion_rows(one.reference)[body.dimension :] @ linear).max())
                  for one in body.equations
                  if isinstance(one, Coupling) and one.kind == "distributing"), default=0.0)
    if turned > SMALL_ANGLE:
        found.append(f"the reference point of a distributing coupling turns by {turned:.2g} rad; "
                     f"its equations are those of small angles up to {SMALL_ANGLE:g} rad.")
    found += [f"nodes of {one.name} turn as a rigid body, but other constraints or supports hold "
              f"some of them too, so that their equations are those of small angles and strain the "
              f"body; let no other one name these nodes."
              for one in turning_nodes(body) if one.shared and (
                  np.linalg.norm(one.rows @ linear, axis=0)**2 > 2.0 * _FALSE * path.strains).any()]
    return found


def _linear_displacements(path: DeflectionPath) -> Array:
    """Displacements (d N, s) by the linear equations of couplings and hinges."""
    E = path.body.expansion
    return np.asarray(E @ path.unknowns[:, : E.shape[1]].T)
