"""Convergence of the models of a study with mesh refinement and number of modes."""

from collections.abc import Callable
from dataclasses import replace

from fecontact.core.checks import as_count, require_kind
from fecontact.core.progress import counting_bar, shown
from fecontact.core.types import Array
from fecontact.reduction.assembly.assembled_basis import assembled_basis
from fecontact.reduction.assembly.bodies_convergence import BodiesConvergence, bodies_convergence
from fecontact.reduction.convergence import ModeConvergence, mode_convergence
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.study.study import Study
from fecontact.system.quasistatic.prestressed_modes import prestressed_modes

_FACTORS = (0.5, 1.0, 2.0, 4.0)  # of the numbers of modes


def study_convergence(
    study: Study, *, levels: int | None = None,
    progress: bool | Callable[[int, int], None] | None = None,
) -> ModeConvergence | BodiesConvergence:
    """Convergence of frequencies and contact compliance with mesh and number of modes.

    Each refinement cuts every cell of every body into four; faces are paired again. Half, one, two
    and four times the modes are compared on the given mesh. Several bodies have frequencies each
    by itself and, with links, those of the linked bodies; with ``[preload]``, those about its end,
    where contacts stick or slip.

    Parameters
    ----------
    study : Study
        Study of one or several bodies.
    levels : int, optional
        Number of meshes, at least two; by default three, four for a single body of few unknowns.
    progress : bool or callable, optional
        True for a progress bar; a function is called with the numbers of completed and of all
        models.

    Raises
    ------
    InputError, AnalysisError
        As in the models of the study.
    """
    require_kind("study_convergence", Study, study=study)
    if levels is not None:
        levels = as_count(levels, "study_convergence: levels", 2)
    if not study.bodies:
        settings, body = replace(study.basis, select=None), study.elastic_body()
        return mode_convergence(
            body, lambda part, count: replace(settings, modes=count).modal_basis(part),
            settings.modes, levels=levels or (4 if body.mass.shape[0] < 4000 else 3),
            progress=progress)
    levels = levels or 3
    refined = [_with_modes(study, 1.0)]
    bases: list[ModalBasis] = []
    meshes, joined = [], []
    with shown(progress, lambda: counting_bar("Refining")) as tell:
        for done in range(1, levels + len(_FACTORS)):
            if done <= levels:
                refined += [refined[-1].refined()] if done > 1 else []
                meshes.append((refined[-1].elastic_bodies(), _assembled(refined[-1])))
                joined.append(_joined(refined[-1]))
            else:
                factor = [one for one in _FACTORS if one != 1.0][done - levels - 1]
                bases.append(_assembled(_with_modes(study, factor)))
            if tell is not None:
                tell(done, levels + len(_FACTORS) - 1)
    # Small meshes have no more modes to give.
    bases = list({basis.modes: basis for basis in sorted(
        [*bases, meshes[0][1]], key=lambda basis: basis.modes)}.values())
    together = [found for found in joined if found is not None]
    return bodies_convergence(
        meshes, bases, joined_hz=together or None,
        joined="about the end of the preload" if study.preload is not None else "linked bodies")


def _with_modes(study: Study, factor: float) -> Study:
    """The study with other numbers of modes, of which none are left out."""
    bodies = study.elastic_bodies()
    settings = {}
    for name, one in study.bodies.items():
        count = one.basis.modes
        if factor != 1.0:
            # Residual vectors need all rigid modes, and half of the unknowns have no meaning.
            most = (len(bodies[name].expansion.indptr) - 1) // 2
            count = min(max(3, round(factor * count)), max(most, count))
        settings[name] = replace(one, basis=replace(one.basis, modes=count, select=None))
    found = replace(study, bodies=settings)
    found.reuse(study)
    return found


def _assembled(study: Study) -> ModalBasis:
    """The bodies without links between them, whose modes are those of each."""
    return assembled_basis(study.modal_bases(), study.pairings())


def _joined(study: Study) -> Array | None:
    """Elastic frequencies of all bodies together [Hz], if the study says what joins them."""
    if study.preload is not None:
        return prestressed_modes(study.system(), study.load_history()).frequencies_hz
    if not study.links:
        return None
    found = study.reduced.basis.frequencies_hz
    return found[found > 0.0]
