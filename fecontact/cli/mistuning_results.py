"""Results of the command ``mistuning``: tables, files and pictures of wheels that differ."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.analysis.mistuning import amplification, mistuned_response, whitehead_bound
from fecontact.cli.console import echo, note, show, waiting
from fecontact.cli.tables import table
from fecontact.core.errors import InputError, choices
from fecontact.core.files.atomic_write import write_text
from fecontact.core.files.csv_text import csv_text
from fecontact.core.tables import located
from fecontact.output.diagrams.colours import COLOURS
from fecontact.output.plots.figure import new_figure
from fecontact.reduction.cyclic.cyclic_basis import CyclicBasis
from fecontact.reduction.cyclic.whole_wheel import WholeWheel
from fecontact.sweeps.mistuning import MistuningSweep, mistuning_sweep

if TYPE_CHECKING:
    from fecontact.study.study import Study

_FREQUENCIES = 801  # of a measured wheel
_FAR = 2.0  # distance of the bound from the largest amplification, as a multiple of their range


@dataclass(frozen=True)
class _Excited:
    """Wheel, engine order, range, force and observed displacement of a study."""

    wheel: CyclicBasis
    order: int
    band_hz: tuple[float, float]
    force: tuple[str, str]
    observe: tuple[str, str]

    @classmethod
    def of(cls, study: "Study") -> "_Excited":
        """Settings of ``[response]`` and the first force; InputError if one is missing."""
        wave = study.wave()
        if wave is None:
            raise InputError(f"{study.title}: [mistuning] is for one sector of a wheel; describe "
                             f"it in [symmetry], and give an engine_order in [response].")
        wanted, names = study.response, wave.wheel.basis.extra
        for force in study.load.forces:
            if isinstance(force.point, str) and isinstance(force.component, str):
                break
        else:
            raise InputError(f"{study.title}: [mistuning] needs a force at a named point along an "
                             f"axis; give one in [[load.forces]], the points are "
                             f"{choices(names)}.")
        point = force.point if wanted.point is None else wanted.point
        if not isinstance(point, str):
            raise InputError(f"{study.title}: [response]: point = {point} must be one of the named "
                             f"points, {choices(names)}.")
        with located(f"{study.title}:"):
            return cls(wave.wheel, wave.order, wanted.checked_bounds,
                       (force.point, force.component),
                       (point, wanted.component or force.component))


def random_wheels(
    study: "Study", folder: Path, resume: bool, overwrite: bool, workers: int | None
) -> list[Path]:
    """Compute random wheels, print their statistics, and write table and picture."""
    settings = study.mistuning
    assert settings is not None
    assert settings.spread is not None
    with waiting("Computing modes"):
        given = _Excited.of(study)
    kept = folder / f"{study.name}-mistuning"
    try:
        with waiting(f"Computing {settings.samples} wheels"), located(
                f"{study.title}: [mistuning]:", "mistuning_sweep", "WholeWheel"):
            found = mistuning_sweep(
                given.wheel, settings.group, settings.spread, given.order, given.band_hz,
                given.force, observe=given.observe, samples=settings.samples, seed=settings.seed,
                workers=workers, folder=kept, resume=resume, overwrite=overwrite)
    except KeyboardInterrupt:
        note(f"Finished wheels are kept in {kept}; go on with --resume.")
        raise
    echo(str(found))
    show(table("amplification", "value", "95 %", rows=[
        (name, f"{one.value:.4g}", f"{one.low:.4g} ... {one.high:.4g}")
        for name, one in found.statistics().items()]))
    files = [folder / f"{study.name}-mistuning.{ending}" for ending in ("csv", "png")]
    sectors = found.deviations.shape[1]
    write_text(files[0], csv_text([
        ("amplification", *(f"deviation_{s}" for s in range(sectors))),
        *([repr(float(value)), *map(repr, each)] for value, each in zip(
            found.amplifications, found.deviations.tolist(), strict=True))]))
    _draw_random(found, files[1])
    return files


def measured_wheel(study: "Study", folder: Path) -> list[Path]:
    """Print the amplification of a measured wheel; write its response."""
    settings = study.mistuning
    assert settings is not None
    with waiting("Computing modes"):
        given = _Excited.of(study)
    with located(f"{study.title}: [mistuning]:", "WholeWheel", "mistuned_response"):
        whole = WholeWheel(given.wheel, settings.deviations, settings.group)
        hertz = np.linspace(*given.band_hz, _FREQUENCIES)
        sizes = np.abs(mistuned_response(whole, given.order, hertz, given.force, given.observe))
        larger = amplification(whole, given.order, given.band_hz, given.force, given.observe)
    echo(f"amplification {larger:.4g}, Whitehead's bound {whitehead_bound(whole.sectors):.4g}; "
         f"largest in sector {int(sizes.max(axis=0).argmax())}")
    files = [folder / f"{study.name}-mistuning.{ending}" for ending in ("csv", "png")]
    write_text(files[0], csv_text([
        ("frequency_hz", *(f"displacement_per_newton_{s}" for s in range(whole.sectors))),
        *([repr(float(f)), *map(repr, each)] for f, each in zip(
            hertz, sizes.tolist(), strict=True))]))
    with new_figure(6.4, 4.0, files[1]) as figure:
        axes = figure.subplots()
        axes.semilogy(hertz, sizes, color=COLOURS[0], linewidth=0.7)
        axes.semilogy(hertz, sizes.max(axis=1), color=COLOURS[1], label="largest")
        axes.set(xlabel="frequency [Hz]", ylabel=f"{' '.join(given.observe)} of each sector [m/N]")
        axes.legend()
    return files


def _draw_random(found: MistuningSweep, path: Path) -> None:
    """Histogram of the amplifications with Whitehead's bound, as a line if it is not far off."""
    known, bound = found.amplifications, f"Whitehead's bound {found.bound:.4g}"
    range_of_wheels = float(np.ptp(known))
    with new_figure(6.4, 4.0, path) as figure:
        axes = figure.subplots()
        axes.hist(known, bins="auto", color=COLOURS[0])
        axes.set(xlabel="amplification", ylabel="wheels")
        if 0.0 < _FAR * range_of_wheels < found.bound - known.max():
            axes.set_title(bound, loc="right", fontsize=9)
        else:
            axes.axvline(found.bound, color=COLOURS[1], linestyle="--", label=bound)
            axes.legend()
