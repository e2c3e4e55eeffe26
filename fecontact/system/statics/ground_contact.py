r"""Contact of a whole body with flat ground, in statics with large deflections.

With the upward displacements :math:`w_j = r_j \cdot u` of the contact nodes, their initial gaps g
and a normal law F, the equilibria of the body are

.. math:: f(u) - \sum_j r_j\,F_j(-g_j - w_j) = \lambda\,p.

Flat ground stays under a node that moves along it, so that this is exact for large motions. Contact
has no friction here.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.types import Array, Integers
from fecontact.fem.contact_face import contact_groups
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.contact_patches import Count
from fecontact.fem.finite_strain import FiniteStrainModel, StrainState
from fecontact.laws.base import NormalLaw
from fecontact.laws.check import require_sound
from fecontact.system import kernels
from fecontact.system.arrays import LawGroup, groups_of_laws, law_table
from fecontact.system.gap import Gap, gap_values

NormalLaws = NormalLaw | Mapping[str, NormalLaw]


@dataclass(frozen=True, eq=False)
class GroundContact:
    """Contact nodes of a body above flat ground.

    Attributes
    ----------
    rows : sparse (n, d N) array
        Upward displacements of the nodes from those of the body.
    gap : (n,) array
        Initial distances from the ground [m].
    laws : sequence of (slice, (k,) array, NormalLaw)
        Nodes, their shares of the face, and their normal law.
    """

    rows: Any
    gap: Array
    laws: Sequence[LawGroup]

    @classmethod
    def of(
        cls, body: ElasticBody, boundaries: str | Sequence[str], counts: Count | Sequence[Count],
        normal: NormalLaws | None, gap: Gap,
    ) -> "GroundContact":
        """Contact nodes and laws of boundaries; InputError or MeshError for what does not fit."""
        face, d = contact_groups(body, boundaries, counts), body.dimension
        if not face.groups:
            if normal is not None:
                raise InputError(f"deflection_path: normal = {normal!r} is a law of contact nodes, "
                                 f"but there are none; name boundaries by contact, or leave it "
                                 f"out.")
            return cls(face.matrix, np.zeros(0), ())
        if normal is None:
            raise InputError("deflection_path lacks normal, the law of the normal force at "
                             "contact; give one, such as LinearContact with its stiffness.")
        laws = list(groups_of_laws(_laws(normal, face.groups), face.tributary))
        for _, share, law in laws:
            law.table(share)
            require_sound(law)
        given = gap_values(gap, face.positions)
        count = len(face.tributary)
        if np.ndim(given) and np.size(given) != count:
            raise InputError(f"deflection_path: gap has {np.size(given)} values for {count} "
                             f"contact nodes; give one number or one per node.")
        each = 3 * (d - 1)
        return cls(face.matrix.tocsr()[np.arange(count) * each + d - 1],
                   np.broadcast_to(given, count).astype(float), laws)

    def penetration(self, displacement: Array) -> Array:
        """Penetrations (..., n) under displacements (..., d N) [m]; below zero they are gaps."""
        return np.asarray(-self.gap - (self.rows @ displacement.T).T)

    def forces(self, penetration: Array) -> tuple[Array, Array]:
        """Normal forces (n,) [N] and their slopes (n,) [N/m]."""
        n = len(penetration)
        force, slope = np.empty(n), np.empty(n)
        if n:
            addresses, parameters = self._table
            kernels.normal_values(addresses, np.ascontiguousarray(penetration), np.zeros(n),
                                  parameters, force, slope)
        return force, slope

    def stored_energy(self, penetration: Array) -> float:
        """Energy stored in the contacts [J]."""
        return float(sum(law.stored_energy(penetration[nodes], share).sum()
                         for nodes, share, law in self.laws))

    @cached_property
    def _table(self) -> tuple[Integers, Array]:
        return law_table(self.laws)


@dataclass(frozen=True, eq=False)
class GroundedModel:
    """A body of finite elements with its contact forces, for :func:`fecontact.fem.load_steps`."""

    model: FiniteStrainModel
    contact: GroundContact

    @property
    def expansion(self) -> Any:
        """All displacements from the free unknowns, sparse (d n, f)."""
        return self.model.expansion

    def state(self, q: Array) -> StrainState:
        """Energy, forces and tangent of body and contacts at free unknowns (f,)."""
        import scipy.sparse as sp

        found = self.model.state(q)
        contact = self.contact
        depth = contact.penetration(self.model.displacement(q).ravel())
        force, slope = contact.forces(depth)
        pull, stiffness = self.model.acting(
            q, -(contact.rows.T @ force),
            sp.csc_array(contact.rows.T @ sp.diags_array(slope) @ contact.rows))
        return replace(found, energy=found.energy + contact.stored_energy(depth),
                       force=found.force + pull, tangent=(found.tangent + stiffness).tocsc())


def _laws(normal: NormalLaws, groups: Sequence[tuple[str, int]]) -> Iterator[tuple[int, NormalLaw]]:
    """Number of nodes and law of each group, or of all with one law."""
    require_kind("deflection_path", (NormalLaw, Mapping), normal=normal)
    if isinstance(normal, NormalLaw):
        yield sum(count for _, count in groups), normal
        return
    names = [name for name, _ in groups]
    for name, law in normal.items():
        if name not in names:
            raise InputError(f"deflection_path: normal has a law for {name!r}"
                             f"{nearest(str(name), names)}, but contact names {choices(names)}.")
        require_kind("deflection_path: normal", NormalLaw, **{name: law})
    for name, count in groups:
        if name not in normal:
            raise InputError(f"deflection_path: normal lacks a law for '{name}'.")
        yield count, normal[name]
