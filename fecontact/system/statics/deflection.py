"""Statics of elastic bodies with large deflections, by their finite elements."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, ModelWarning, require_finite
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, quantity
from fecontact.fem.constraints import Coupling
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.contact_patches import Count
from fecontact.fem.fields import BodyFields, body_elements
from fecontact.fem.finite_rotations import turning_nodes
from fecontact.fem.finite_strain import LARGE_STRAIN, FiniteStrainModel
from fecontact.fem.follower_pressure import follower_pressure
from fecontact.fem.load_steps import DeflectionSteps, follow
from fecontact.fem.points import Place, place_rows
from fecontact.laws.excitation import Load
from fecontact.laws.signals.base import Signal
from fecontact.reduction.eigenmodes import rigid_modes
from fecontact.system.gap import Gap
from fecontact.system.statics.ground_contact import GroundContact, GroundedModel, NormalLaws
from fecontact.system.statics.static_solution import nodal_forces

# Rotation up to which distributing couplings are linear [rad].
SMALL_ANGLE = 0.1
# Strain by the linear equations of a rotation, relative to that of the body, that is small.
_FALSE = 0.01


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class DeflectionPath(Summarised):
    """States of equilibrium of a body under growing loads, the first without load.

    Attributes
    ----------
    body : ElasticBody
        The body.
    load_factors : (s,) array
        Parts of the load; 1 is the whole load.
    displacements : (s, N, d) array
        Displacements of the nodes [m].
    unknowns : (s, f) array
        Displacements of the free unknowns, of bricks with their incompatible modes.
    energies : (s,) array
        Strain energy, with that of springs at points and of contacts [J].
    strains : (s,) array
        Largest component of Green and Lagrange's strain, without sign.
    unstable : (s,) integer array
        Number of negative eigenvalues of the tangent stiffness; zero in a stable state.
    penetration, normal_force : (s, n) arrays
        Of the contact nodes: penetration of the ground, below zero the gap [m], and force [N].
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
        return BodyFields(self.body.nodes, body_elements(self.body), self.displacements[state],
                          stress[..., 0])


def deflection_path(
    body: ElasticBody,
    load: Load,
    *,
    points: Mapping[str, Place] | None = None,
    time: float = 0.0,
    follower: bool = False,
    steps: DeflectionSteps | None = None,
    contact: str | Sequence[str] = (),
    contact_nodes: Count | Sequence[Count] = "all",
    normal: NormalLaws | None = None,
    gap: Gap = 0.0,
) -> DeflectionPath:
    r"""Equilibria of a body with large deflections, from no load to the whole load.

    .. math:: f(u) = \lambda\,p, \qquad f = \partial U / \partial u, \qquad
        U = \tfrac12 \int E : C : E\,dV

    with Green and Lagrange's strain E, linear elastic (St. Venant and Kirchhoff's material).
    Displacements and rotations may be large, strains must be small. Supports, ties and constraints
    are those of the body; distributing couplings rotate by small angles. Forces on nodes of hinges
    and kinematic couplings keep their moment about the reference point. Contact is that with flat,
    level ground, without friction, see :mod:`fecontact.system.statics.ground_contact`; for friction
    and contact between bodies give a reduced model ``large_deflections``, see
    :func:`~fecontact.modal_basis`.

    Parameters
    ----------
    body : ElasticBody
        With supports against all rigid motions.
    load, points, time : Load, mapping, float
        As of :func:`~fecontact.static_solution`. Forces keep their directions.
    follower : bool
        True if pressures on boundaries act normal to the deformed outline, on its deformed size.
    steps : DeflectionSteps, optional
        Load steps by default; steps of the arc length pass limit points.
    contact, contact_nodes : as of :func:`~fecontact.modal_basis`
        Boundaries that may touch the ground, none by default, and their contact nodes.
    normal : normal law, or mapping of boundary to normal law, optional
        Force from penetration; required with contact.
    gap : float, (n,) sequence, Crown or function of x
        Initial distance of the contact nodes from the ground [m].

    Raises
    ------
    InputError, MeshError
        As :func:`~fecontact.static_solution`; for a body that can move without strain.

    Warns
    -----
    ModelWarning
        If the whole load was not reached, for strains above 1 %, distributing couplings that turn
        by more than 0.1 rad, and nodes of turning couplings that are held by something else too.
    """
    require_kind("deflection_path", ElasticBody, body=body)
    require_kind("deflection_path", Load, load=load)
    require_kind("deflection_path", Mapping, points={} if points is None else points)
    require_kind("deflection_path", bool, follower=follower)
    require_kind("deflection_path", (DeflectionSteps, type(None)), steps=steps)
    require_finite("deflection_path", time=time)
    require_supported(body, "deflection_path")
    model = FiniteStrainModel(body)
    pressures: dict[str, float] = {}
    if follower:
        load, pressures = _without_pressures(load, time)
    dead = model.free(nodal_forces(body, load, points or {}, time))

    def loads(q: Array) -> tuple[Array, object]:
        if not pressures:
            return dead, None
        force, slope = follower_pressure(body, pressures, model.displacement(q))
        pushed, stiffness = model.acting(q, force, slope)
        return dead + pushed, stiffness

    ground = GroundContact.of(body, contact, contact_nodes, normal, gap)
    path = follow(GroundedModel(model, ground) if ground.laws else model, loads,
                  steps or DeflectionSteps())
    found = path.points
    depth = ground.penetration(np.array([model.displacement(one.q).ravel() for one in found]))
    result = DeflectionPath(
        body, np.array([one.factor for one in found]),
        np.array([model.displacement(one.q) for one in found]),
        np.array([one.q for one in found]),
        np.array([one.state.energy for one in found]),
        np.array([one.state.strain for one in found]),
        np.array([one.unstable for one in found]), depth,
        np.array([ground.forces(one)[0] for one in depth]), path.reached, path.message)
    for sentence in _limits(result):
        warnings.warn(f"deflection_path: {sentence}", ModelWarning, stacklevel=2)
    return result


def require_supported(body: ElasticBody, what: str) -> None:
    """Raise InputError for a body that can move without strain."""
    if rigid_modes(body).shape[1]:
        raise InputError(f"{what} is for bodies that supports hold against all rigid motions; "
                         f"support the body with fixed.")


def _without_pressures(load: Load, time: float) -> tuple[Load, dict[str, float]]:
    """The load without pressures on boundaries, and these [Pa]."""
    pressures: dict[str, float] = {}
    others = []
    for one in load.boundaries:
        given = one.pressure
        value = float(given.history(time)[0, 0]) if isinstance(given, Signal) else float(given)
        pressures[one.boundary] = pressures.get(one.boundary, 0.0) + value
        if one.shear or one.shear_across:
            others.append(replace(one, pressure=0.0))
    return replace(load, boundaries=tuple(others)), pressures


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
