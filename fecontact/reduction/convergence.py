"""Convergence of frequencies and contact compliance with mesh and number of modes."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fecontact.core.checks import as_count, require_kind
from fecontact.core.progress import counting_bar, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.report import BasisReport


@read_only_arrays
@dataclass(frozen=True, eq=False)
class ModeConvergence:
    """Effect of mesh refinement and of further modes; ``str(...)`` is a table.

    Attributes
    ----------
    unknowns : (L,) array
        Degrees of freedom of each mesh; each refinement cuts every cell into four, of solids into
        eight.
    frequencies_hz : (L, k) array
        The lowest elastic frequencies on each mesh [Hz].
    compliance : (L, d) array
        Elastic displacement along each axis per unit force at the same node, mean over the contact
        nodes of the full finite-element body, on each mesh [m/N].
    modes : (K,) array
        Numbers of modes, on the given mesh.
    residual_vectors : (K,) array
        Numbers of residual vectors that complete them.
    missing : (K, d) array
        Largest fraction of a contact node's compliance along each axis that is missing with these
        numbers of modes.
    """

    unknowns: Integers
    frequencies_hz: Array
    compliance: Array
    modes: Integers
    residual_vectors: Integers
    missing: Array

    def __str__(self) -> str:
        shown, axes = self.frequencies_hz.shape[1], "xyz"[: self.compliance.shape[1]]
        lines = [" ".join([f"{'unknowns':>9s}", *(f"{f'f{i + 1} [Hz]':>11s}" for i in range(shown)),
                           *(f"{f'{axis} [m/N]':>11s}" for axis in axes)])]
        lines += [" ".join([f"{unknowns:9d}", *(f"{f:11.6g}" for f in frequencies),
                            *(f"{c:11.5g}" for c in compliance)])
                  for unknowns, frequencies, compliance in zip(
                      self.unknowns, self.frequencies_hz, self.compliance, strict=True)]
        change = np.abs(self.frequencies_hz / self.frequencies_hz[-1] - 1.0)
        if shown:
            lines.append(f"On the given mesh these frequencies are off by up to "
                         f"{change[0].max():.1e}, against the finest.")
        completed = bool(self.residual_vectors.any())
        lines += ["", " ".join([f"{'modes':>9s}", *(["residual vectors"] * completed),
                                *(f"{f'missing {axis}':>11s}" for axis in axes)])]
        lines += [" ".join([f"{modes:9d}", *([f"{vectors:16d}"] * completed),
                            *(f"{one:11.2%}" for one in missing)])
                  for modes, vectors, missing in zip(
                      self.modes, self.residual_vectors, self.missing, strict=True)]
        if completed:
            lines.append("Residual vectors complete each basis up to its tolerance; what is "
                         "missing below that does not tell whether modes are enough.")
        return "\n".join(lines)


def mode_convergence(
    body: ElasticBody,
    build: Callable[[ElasticBody, int], ModalBasis],
    modes: int,
    *,
    levels: int = 3,
    progress: bool | Callable[[int, int], None] | None = None,
) -> ModeConvergence:
    """Study the convergence of a modal basis with the mesh and the number of modes.

    Parameters
    ----------
    body : ElasticBody
        The body on its coarsest mesh.
    build : callable
        ``build(body, modes)``, the modal basis to study.
    modes : int
        Number of modes; half, one, two and four times as many are compared.
    levels : int
        Number of meshes, at least two.
    progress : bool or callable, optional
        True for a progress bar on a terminal or in a notebook; a function is called with the
        numbers of completed and of all bases.
    """
    require_kind("mode_convergence", ElasticBody, body=body)
    require_kind("mode_convergence", Callable, build=build)  # type: ignore[arg-type]
    modes = as_count(modes, "mode_convergence: modes")
    levels = as_count(levels, "mode_convergence: levels", 2)
    unknowns = len(body.expansion.indptr) - 1
    counts = [max(1, modes // 2), modes, 2 * modes, 4 * modes]
    counts = sorted({count for count in counts if count <= unknowns // 2} | {modes})
    steps = len(counts) + levels - 1
    bases = []
    with shown(progress, lambda: counting_bar("Refining")) as tell:
        for done, count in enumerate(counts, 1):
            bases.append(build(body, count))
            if tell is not None:
                tell(done, steps)
        own = bases[counts.index(modes)]
        meshes, refined = [own], body
        sizes = [unknowns]
        for level in range(1, levels):
            refined = replace(refined, mesh=refined.mesh.refined())
            meshes.append(build(refined, modes))
            sizes.append(len(refined.expansion.indptr) - 1)
            if tell is not None:
                tell(len(counts) + level, steps)
    some = min(6, own.modes - own.rigid_modes)
    first = own.rigid_modes
    return ModeConvergence(
        unknowns=np.array(sizes),
        frequencies_hz=np.array([basis.frequencies_hz[first : first + some] for basis in meshes]),
        compliance=np.array([_compliance(basis).mean(axis=0) for basis in meshes]),
        modes=np.array(counts),
        residual_vectors=np.array([_residual_vectors(basis) for basis in bases]),
        missing=np.array([BasisReport(basis).contact_error.max(axis=0) for basis in bases]),
    )


def _residual_vectors(basis: ModalBasis) -> int:
    assert basis.quality is not None, "bases of bodies carry their quality"
    return basis.modes - basis.quality.vibration_modes


def _compliance(basis: ModalBasis) -> Array:
    assert basis.quality is not None, "bases of bodies carry their quality"
    return basis.quality.compliance[2 : 2 + basis.contact_nodes]
