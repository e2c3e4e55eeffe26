"""How much of the static compliance of its interfaces a modal basis resolves.

With the rows W_k that take the nodal displacements of body k to the relative displacements of the
contact nodes along tangents and normals, forces p on these rows move them by ``C p``,

    C = sum_k W_k G_k W_k^T

with the elastic flexibility G_k of the finite-element body, whose rigid motions balance the forces
by their inertia. The elastic modes, of rows T and frequencies w, have the part ``T w^-2 T^T`` of it
and never more, as they are a Ritz space.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised
from fecontact.fem.elastic_body import ElasticBody
from fecontact.reduction.assembly.contact_faces import contact_faces
from fecontact.reduction.eigenmodes import FreeSystem
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.static_modes.residual_vectors import flexibility_of

# Part of the compliance that should be resolved; laws of contact are not known better.
_ENOUGH = 0.9
_ROUND_OFF = 1e-10  # of the largest compliance, below which there is none


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class InterfaceCompliance(Summarised):
    r"""Static compliance of an interface, and how much of it a modal basis resolves.

    For forces p along tangents or normals of the contact nodes, and against them at their feet, the
    work ``p^T C p`` in their own elastic displacement is compared with that of the finite-element
    bodies, C_FE:

    .. math:: \frac{p^T C\, p}{p^T C_\mathrm{FE}\, p} \le 1

    Columns are those of tangential and of normal forces: c = 2, in space 3, both tangents first.
    What the supports do not hold is balanced by inertia.

    Attributes
    ----------
    name : str
        The interface.
    bodies : tuple of str
        The bodies that meet there, and 'ground'; empty for a single body.
    uniform : (c,) array
        Resolved part for uniform traction and for uniform pressure.
    nodes : (n, c) array
        Resolved part for a force at each single node.
    uniform_compliance : (c,) array
        Mean displacement under a uniform load of 1 N in all, of the finite-element bodies [m/N].
    node_compliance : (n, c) array
        Displacement of each node per unit force there, of the finite-element bodies [m/N].
    stiffest : str
        The body that lacks most where the resolved part is least; empty for a single body, and
        where nothing is missing.
    """

    name: str
    bodies: tuple[str, ...]
    uniform: Array
    nodes: Array
    uniform_compliance: Array
    node_compliance: Array
    stiffest: str = ""

    @property
    def worst(self) -> float:
        """Least resolved part of all these loads."""
        return float(min(self.uniform.min(), self.nodes.min()))

    @property
    def enough(self) -> bool:
        """True if 90 % of the compliance are resolved under each of these loads."""
        return self.worst >= _ENOUGH - 1e-9

    @property
    def recommendation(self) -> str:
        """Advice in one sentence; empty if enough of the compliance is resolved."""
        if self.enough:
            return ""
        axis = int(np.argmin(np.minimum(self.uniform, self.nodes.min(axis=0))))
        last = len(self.uniform) - 1
        way = "normal" if axis == last else "tangential"
        if self.uniform[axis] <= self.nodes[:, axis].min():
            load = "uniform pressure" if axis == last else "uniform traction"
        else:
            load = f"a {way} force at node {int(np.argmin(self.nodes[:, axis]))}"
        of = f" of body '{self.stiffest}'" if self.stiffest else ""
        return (f"Interface '{self.name}' is too stiff: only {100.0 * self.worst:.3g} % of its "
                f"static compliance under {load} is resolved. Complete the modes{of} with "
                f"reduction = \"residual\" and a small tolerance, such as 0.01, or keep more "
                f"modes.")

    def summary(self) -> list[tuple[str, str]]:
        """Resolved parts, mean and worst over the nodes."""
        rows = [] if not self.bodies else [("bodies", " and ".join(self.bodies))]
        rows.append(("nodes", f"{len(self.nodes)}"))
        ways = [(len(self.uniform) - 1, "pressure", "normal")]
        if len(self.uniform) == 2:
            ways.append((0, "traction", "tangential"))
        else:
            ways += [(axis, f"traction along {name}", f"tangential ({name})")
                     for axis, name in enumerate(("t", "t2"))]
        for axis, load, way in ways:
            nodes = self.nodes[:, axis]
            rows += [(f"uniform {load}", f"{percent(self.uniform[axis])} of "
                                         f"{self.uniform_compliance[axis]:.4g} m/N resolved"),
                     (f"{way} force at a node", f"{percent(nodes.mean())} resolved on average, "
                                                f"{percent(nodes.min())} at worst")]
        return rows


def percent(part: float) -> str:
    """``99.3 %``."""
    return f"{100.0 * float(part):.4g} %"


def interface_compliance(
    basis: ModalBasis, bodies: ElasticBody | Mapping[str, ElasticBody]
) -> dict[str, InterfaceCompliance]:
    """Compare the static compliance of each interface with that of the finite-element bodies.

    Parameters
    ----------
    basis : ModalBasis
        Basis of one body with contact nodes, or of several, ``assembled_basis(bases, pairings)``.
    bodies : ElasticBody or mapping of name to ElasticBody
        The bodies from which it was made; those without a mesh, as point masses, are exact.

    Returns
    -------
    dict of str to InterfaceCompliance
        Compliances by the names of the interfaces, of a single body the boundaries in contact.

    Raises
    ------
    InputError
        For bodies that are not those of the basis, a basis without shapes, and one of linked
        bodies, whose modes are not those of each: give the basis without links.
    """
    require_kind("interface_compliance", ModalBasis, basis=basis)
    require_kind("interface_compliance", (ElasticBody, Mapping), bodies=bodies)
    rows = _elastic_rows(basis, bodies)
    n, d, w = basis.contact_nodes, basis.dimension, basis.angular_frequencies
    T = basis.contact_T[:, :d].reshape(d * n, -1)
    elastic = np.where(w > 0.0, 1.0, 0.0) / np.where(w > 0.0, w, 1.0)
    whole, missing = np.zeros((d * n, d * n)), {}
    for name, (body, nodal, modes) in rows.items():
        used = np.flatnonzero(np.diff(nodal.indptr))
        own = T[:, modes] * elastic[modes]
        kept = full = own @ own.T
        if body is not None and len(used):
            full = np.zeros_like(kept)
            full[np.ix_(used, used)] = flexibility_of(
                FreeSystem.of(body), nodal[used] @ body.expansion).compliance
        whole += full
        missing[name] = full - kept
    faces, first = contact_faces(basis), 0
    found: dict[str, InterfaceCompliance] = {}
    for name, count in basis.groups:
        if name in basis.springs:
            first += count
            continue
        face = next((face for face in faces if face.name == name), None)
        found[name] = _compared(name, face.bodies if face else (), whole, missing,
                                basis.tributary, slice(first, first + count))
        first += count
    return found


def _compared(
    name: str, bodies: tuple[str, ...], whole: Array, missing: Mapping[str, Array],
    tributary: Array, nodes: slice,
) -> InterfaceCompliance:
    """Uniform loads and single nodes of one interface; compliances of all rows (c n, c n)."""
    n = len(tributary)
    c = len(whole) // n
    share = np.zeros(n)
    share[nodes] = tributary[nodes] / tributary[nodes].sum()

    def works(compliance: Array) -> Array:
        """``p^T C p`` (1 + k, c) of uniform loads, then of each node."""
        blocks = compliance.reshape(n, c, n, c)
        uniform = np.einsum("i,iaja,j->a", share, blocks, share)
        return np.vstack([uniform, np.einsum("iaia->ia", blocks)[nodes]])

    full = works(whole)
    lacks = {body: works(one) for body, one in missing.items()}
    real = full > _ROUND_OFF * full.max(initial=0.0)
    size = np.where(real, full, 1.0)
    resolved = np.clip(np.where(real, 1.0 - sum(lacks.values()) / size, 1.0), 0.0, 1.0)
    worst = np.unravel_index(int(np.argmin(resolved)), resolved.shape)
    stiffest = max(lacks, key=lambda body: float(lacks[body][worst]))
    return InterfaceCompliance(
        name, bodies, resolved[0], resolved[1:], full[0], full[1:],
        stiffest if resolved[worst] < 1.0 - _ROUND_OFF else "")


def _elastic_rows(
    basis: ModalBasis, bodies: ElasticBody | Mapping[str, ElasticBody]
) -> dict[str, tuple[ElasticBody | None, Any, slice]]:
    """Finite-element model, contact rows (d n, d N_k) and modes of each body, by its name."""
    import scipy.sparse as sp

    field, n = basis.mode_shapes, basis.contact_nodes
    if not n:
        raise InputError("interface_compliance: the basis has no contact nodes; name the faces "
                         "that touch.")
    several = bool(basis.parts)
    if several != isinstance(bodies, Mapping):
        raise InputError("interface_compliance: the basis is that of "
                         + (f"the bodies {choices([part.name for part in basis.parts])}; give "
                            "their elastic bodies by name." if several else
                            "a single body; give one ElasticBody."))
    if several and sum(part.modes[1] for part in basis.parts) < basis.modes:
        raise InputError("interface_compliance: the modes of linked bodies are not those of each; "
                         "give the basis without links, assembled_basis(bases, pairings).")
    if field is None:
        raise InputError("interface_compliance: the basis holds no shapes over the body, which "
                         "alone can be compared with its mesh; make it with modal_basis.")
    d, each = basis.dimension, basis.T.shape[1]
    local = np.flatnonzero(np.arange(each * n) % each < d)
    rows = sp.csr_array(field.restriction)[2 * each : (2 + n) * each][local]
    if isinstance(bodies, ElasticBody):
        _require_mesh(bodies, len(field.nodes), "the body")
        return {"": (bodies, rows, slice(0, basis.modes))}
    found: dict[str, tuple[ElasticBody | None, Any, slice]] = {}
    for part in basis.parts:
        body = None
        if part.nodes[1]:
            if part.name not in bodies:
                raise InputError(f"interface_compliance: bodies lacks '{part.name}'"
                                 f"{nearest(part.name, bodies)}; give the elastic body of each.")
            body = bodies[part.name]
            require_kind("interface_compliance", ElasticBody, **{f"bodies['{part.name}']": body})
            _require_mesh(body, part.nodes[1], f"body '{part.name}'")
        found[part.name] = (
            body, sp.csr_array(rows[:, d * part.nodes[0] : d * sum(part.nodes)]),
            slice(part.modes[0], sum(part.modes)))
    return found


def _require_mesh(body: ElasticBody, nodes: int, name: str) -> None:
    if len(body.nodes) != nodes:
        raise InputError(f"interface_compliance: the mesh of {name} has {len(body.nodes)} nodes, "
                         f"but the basis was made for {nodes}; give the same body.")
