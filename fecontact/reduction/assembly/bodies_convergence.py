"""Convergence of several bodies and their interfaces with mesh and number of modes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.reduction.assembly.interface_compliance import (
    InterfaceCompliance,
    interface_compliance,
)
from fecontact.reduction.eigenmodes import eigenfrequencies_hz
from fecontact.reduction.modal_basis import ModalBasis

_SHOWN, _RIGID = 6, 3  # frequencies, and the most rigid modes of a body


@read_only_arrays
@dataclass(frozen=True, eq=False)
class BodiesConvergence:
    """Effect of mesh refinement and of further modes on several bodies; ``str(...)`` is a table.

    Attributes
    ----------
    unknowns : mapping of body to (L,) array
        Degrees of freedom on each mesh.
    frequencies_hz : mapping of body to (L, k) array
        The lowest elastic frequencies of each body by itself on each mesh [Hz].
    joined_hz : (L, k) array or None
        The lowest elastic frequencies of the bodies together on each mesh [Hz].
    joined : str
        Heading of the joined frequencies in the table.
    compliance : mapping of interface to (L, 2) array, in space (L, 3)
        Mean relative displacement under uniform traction and pressure of 1 N in all, of the
        finite-element bodies on each mesh [m/N].
    modes : mapping of body to (K,) array
        Numbers of modes on the first mesh, those of residual vectors included.
    missing : mapping of interface to (K, 2) array, in space (K, 3)
        Largest fraction of the tangential and normal compliance that is missing with them, for
        uniform loads and forces at single nodes.
    """

    unknowns: Mapping[str, Integers]
    frequencies_hz: Mapping[str, Array]
    joined_hz: Array | None
    joined: str
    compliance: Mapping[str, Array]
    modes: Mapping[str, Integers]
    missing: Mapping[str, Array]

    def __str__(self) -> str:
        lines: list[str] = []
        sizes = np.sum(list(self.unknowns.values()), axis=0)
        tables = [(f"body '{name}':", self.unknowns[name], frequencies)
                  for name, frequencies in self.frequencies_hz.items()]
        if self.joined_hz is not None:
            tables.append((f"{self.joined}:", sizes, self.joined_hz))
        for title, unknowns, frequencies in tables:
            heads = [f"f{i + 1} [Hz]" for i in range(frequencies.shape[1])]
            lines += [title, *_rows("unknowns", unknowns, heads, frequencies, "11.6g")]
            if frequencies.size:
                lines.append(f"On the given mesh they are off by up to "
                             f"{_change(frequencies)[0].max():.1e}, against the finest.")
            lines.append("")
        for name, compliance in self.compliance.items():
            lines += [f"interface '{name}', displacement under uniform loads:", *_rows(
                "unknowns", sizes, [f"{way} [m/N]" for way in _ways(compliance)], compliance,
                "11.5g"), ""]
        counts = np.sum(list(self.modes.values()), axis=0)
        for name, missing in self.missing.items():
            lines += [f"interface '{name}', missing compliance, most of all loads:", *_rows(
                "modes", counts, ["tangential", "normal"] if missing.shape[1] == 2
                else _ways(missing), missing, "11.2%"), ""]
        return "\n".join(lines[:-1])


def _ways(columns: Array) -> list[str]:
    return ["t", "n"] if columns.shape[1] == 2 else ["t", "t2", "n"]


def bodies_convergence(
    meshes: Sequence[tuple[Mapping[str, ElasticBody], ModalBasis]],
    modes: Sequence[ModalBasis],
    *,
    joined_hz: Sequence[ArrayLike] | None = None,
    joined: str = "together",
) -> BodiesConvergence:
    """Compare assembled bases of the same bodies on several meshes, and with more modes.

    Parameters
    ----------
    meshes : sequence of (mapping of name to ElasticBody, ModalBasis)
        The bodies on each mesh, the coarsest first, and their ``assembled_basis(bases, pairings)``
        without links. At least two.
    modes : sequence of ModalBasis
        Assembled bases of the bodies on the first mesh, with more and more modes.
    joined_hz : sequence of (k,) arrays, optional
        Elastic frequencies of the bodies together on each mesh, ascending [Hz].
    joined : str
        Heading of the joined frequencies in the table.

    Raises
    ------
    InputError
        For fewer than two meshes, bases of other bodies, and joined frequencies of another number
        of meshes.
    """
    require_kind("bodies_convergence", Sequence, meshes=meshes, modes=modes)
    require_kind("bodies_convergence", str, joined=joined)
    if len(meshes) < 2:
        raise InputError("bodies_convergence: meshes must hold at least two, the given and a finer "
                         "one.")
    for pair in meshes:
        if not isinstance(pair, tuple) or len(pair) != 2:
            raise InputError("bodies_convergence: meshes must hold pairs (bodies, basis).")
    if not modes:
        raise InputError("bodies_convergence: modes is empty; give at least one basis.")
    if joined_hz is not None and len(joined_hz) != len(meshes):
        raise InputError(f"bodies_convergence: joined_hz must have {len(meshes)} rows, one a mesh, "
                         f"not {len(joined_hz)}.")
    on_meshes = [_described(basis, bodies) for bodies, basis in meshes]
    with_modes = [_described(basis, meshes[0][0]) for basis in modes]
    names = [part.name for part in meshes[0][1].parts]
    for basis in (*(basis for _, basis in meshes), *modes):
        if [part.name for part in basis.parts] != names:
            raise InputError("bodies_convergence: the bases must be those of the same bodies in "
                             "the same order.")
    together = None
    if joined_hz is not None:
        together = _lowest([as_floats(row, "bodies_convergence: joined_hz") for row in joined_hz])
    return BodiesConvergence(
        unknowns={name: np.array([len(bodies[name].expansion.indptr) - 1 if name in bodies else 0
                                  for bodies, _ in meshes]) for name in names},
        frequencies_hz={name: _lowest([_frequencies(bodies.get(name)) for bodies, _ in meshes])
                        for name in names},
        joined_hz=together,
        joined=joined,
        compliance={name: np.array([one[name].uniform_compliance for one in on_meshes])
                    for name in on_meshes[0]},
        modes={name: np.array([basis.parts[k].modes[1] for basis in modes])
               for k, name in enumerate(names)},
        missing={name: np.array([
            1.0 - np.minimum(one[name].uniform, one[name].nodes.min(axis=0))
            for one in with_modes]) for name in with_modes[0]})


def _described(
    basis: ModalBasis, bodies: Mapping[str, ElasticBody]
) -> dict[str, InterfaceCompliance]:
    require_kind("bodies_convergence", ModalBasis, basis=basis)
    return interface_compliance(basis, bodies) if basis.contact_nodes else {}


def _frequencies(body: ElasticBody | None) -> Array:
    """Lowest elastic frequencies of the finite-element body [Hz]; none without a mesh."""
    if body is None:
        return np.zeros(0)
    found = eigenfrequencies_hz(body, min(_RIGID + _SHOWN, len(body.expansion.indptr) - 1))
    return found[found > 0.0]


def _lowest(rows: Sequence[Array]) -> Array:
    return np.array([row[: min(_SHOWN, *(len(one) for one in rows))] for row in rows])


def _change(values: Array) -> Array:
    """Relative distance (L, k) from the last row."""
    return np.asarray(np.abs(values / values[-1] - 1.0))


def _rows(
    first: str, numbers: Integers, heads: Sequence[str], values: Array, form: str
) -> list[str]:
    lines = [" ".join([f"{first:>9s}", *(f"{head:>11s}" for head in heads)])]
    return lines + [" ".join([f"{number:9d}", *(f"{value:{form}}" for value in row)])
                    for number, row in zip(numbers, values, strict=True)]
