"""Commands on bodies under stress, that rotate, or repeat: ``buckling``, ``campbell``..."""

from typing import Annotated

from cyclopts import Parameter

from fecontact.cli.console import echo, echo_written, show
from fecontact.cli.options import Changes, Folder, StudyFile
from fecontact.core.errors import InputError


def buckling(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Folder = None,
    count: Annotated[int, Parameter(help="Number of load factors.")] = 4,
) -> None:
    """Print the load factors at which the body of a study buckles under [load]; plot the shapes.

    Only the supports of [body] hold the body, not contact. Shapes are drawn to NAME-buckling.png.
    """
    from fecontact.analysis.buckling import buckling_loads
    from fecontact.cli.console import waiting
    from fecontact.cli.run_files import read_study
    from fecontact.cli.tables import table
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.core.tables import located
    from fecontact.output.plots.modes import plot_buckling

    described = read_study(study, set_)
    if described.bodies:
        raise InputError(f"{described.title}: buckling is that of a single body; describe it in "
                         f"[geometry] and [body].")
    with described.warning_of_bodies():
        body, places = described.elastic_body(), described.basis.load_points
    with output_folder(output or described.results) as folder:
        with waiting("Computing load factors"), located(f"{described.title}:"):
            found = buckling_loads(body, described.load, count, points=places)
        show(table("", "load factor", rows=(
            (str(number), f"{factor:.6g}") for number, factor in enumerate(found.load_factors))))
        if not len(found.load_factors):
            echo("These loads do not make the body buckle.")
            return
        picture = folder / f"{described.name}-buckling.png"
        plot_buckling(found, path=picture)
        echo_written(picture)


def campbell(
    study: StudyFile,
    /,
    *,
    speeds: Annotated[tuple[float, float], Parameter(help=(
        "Lowest and highest speed of rotation [rad/s]."))],
    points: Annotated[int, Parameter(help="Number of speeds, equally spaced.")] = 101,
    count: Annotated[int, Parameter(help="Number of modes, the lowest at the first speed.")] = 12,
    orders: Annotated[tuple[float, ...], Parameter(consume_multiple=True, help=(
        "Engine orders: their lines are drawn, and the speeds printed at which they meet a "
        "frequency."))] = (),
    set_: Changes = None,
    output: Folder = None,
) -> None:
    """Frequencies and damping of a rotating body over its speed: NAME-campbell.png and .csv.

    The study has a section [body.rotation]; contact is left out. Frequencies are those in the
    frame of [body.rotation].
    """
    import numpy as np

    from fecontact.analysis.campbell import campbell as diagram_of
    from fecontact.cli.console import waiting
    from fecontact.cli.run_files import read_study
    from fecontact.cli.tables import table
    from fecontact.core.files.atomic_write import output_folder, write_text
    from fecontact.core.files.csv_text import csv_text
    from fecontact.output.plots.campbell import plot_campbell

    described = read_study(study, set_)
    if described.bodies or described.body.rotation is None:
        raise InputError(f"{described.title}: campbell is for a single body that rotates; describe "
                         f"it in [geometry], [body] and [body.rotation].")
    if points < 2 or not speeds[0] < speeds[1]:
        raise InputError(f"--points {points} and --speeds {speeds[0]:g} {speeds[1]:g} must be at "
                         f"least two speeds, the lower one first.")
    with output_folder(output or described.results) as folder:
        with described.warning_of_bodies(), waiting("Computing modes"):
            diagram = diagram_of(described.modal_basis(), np.linspace(*speeds, points), count=count)
        echo(str(diagram))
        if orders:
            show(table("order", "critical speeds [rad/s]", left=2, rows=(
                (f"{order:g}", ", ".join(f"{speed:.5g}" for speed in diagram.critical_speeds(order))
                 or "none") for order in orders)))
        modes = range(1, diagram.eigenvalues.shape[1] + 1)
        file = folder / f"{described.name}-campbell.csv"
        write_text(file, csv_text([
            ("speed", *(f"{name}_{k}" for name in ("frequency_hz", "damping_ratio")
                        for k in modes)),
            *([repr(float(value)) for value in row] for row in np.column_stack(
                [diagram.speeds, diagram.frequencies_hz, diagram.damping_ratios]))]))
        picture = folder / f"{described.name}-campbell.png"
        plot_campbell(diagram, orders=orders, path=picture)
        echo_written(file, picture)


def diameters(
    study: StudyFile,
    /,
    *,
    modes: Annotated[int, Parameter(help="Number of modes of each nodal diameter.")] = 6,
    speed: Annotated[float | None, Parameter(help=(
        "Speed of rotation [rad/s], for the line of excitation by engine orders; by default that "
        "of [body.rotation]."))] = None,
    set_: Changes = None,
    output: Folder = None,
) -> None:
    """Frequencies of a wheel over its nodal diameters, from the sector of [symmetry].

    Prints the frequencies at rest and with [body.rotation] those at its speed, of waves that travel
    forwards and backwards; writes them to NAME-diameters.csv, and draws them at the speed, or at
    rest without one, to NAME-diameters.png. NAME-wheel.png shows the lowest elastic mode of each
    diameter over the whole wheel.
    """
    import numpy as np

    from fecontact.cli.console import waiting
    from fecontact.cli.run_files import read_study
    from fecontact.cli.tables import table
    from fecontact.core.files.atomic_write import output_folder, write_text
    from fecontact.core.files.csv_text import csv_text
    from fecontact.core.tables import located
    from fecontact.output.plots.diameters import plot_diameters
    from fecontact.output.plots.modes import plot_wheel
    from fecontact.reduction.sector_modes import sector_modes

    described = read_study(study, set_)
    if described.symmetry is None:
        raise InputError(f"{described.title}: diameters is for one sector of a wheel; describe it "
                         f"in [symmetry].")
    body, rotation = described.body_between_sectors()
    with output_folder(output or described.results) as folder:
        with waiting("Computing modes"), located(f"{described.title}: [symmetry]:",
                                                 "CyclicSymmetry"):
            turning = rotation
            found = sector_modes(body, described.symmetry, modes, rotation=turning)
        columns = {"frequency": found.frequencies_hz}
        seen = {"frequencies [Hz]": found.frequencies_hz}
        if turning is not None and found.rotation is not None:
            at_speed = found.rotation.frequencies_hz(turning.speed)
            columns |= zip(("forwards", "backwards"), at_speed, strict=True)
            seen = {"at rest [Hz]": found.frequencies_hz, **dict(zip((
                f"{way} at {turning.speed:g} rad/s [Hz]" for way in ("forwards", "backwards")),
                at_speed, strict=True))}
            speed = (turning.speed or None) if speed is None else speed
        show(table("diameter", *seen, left=1 + len(seen), rows=(
            (str(k), *(", ".join(f"{value:.5g}" for value in values[row][np.isfinite(values[row])])
                       for values in seen.values()))
            for row, k in enumerate(found.diameters))))
        name = folder / described.name
        files = [name.with_name(f"{described.name}-{kind}") for kind in (
            "diameters.csv", "diameters.png", "wheel.png")]
        write_text(files[0], csv_text([
            ("diameter", *(f"{way}_hz_{k}" for way, values in columns.items()
                           for k in range(1, values.shape[1] + 1))),
            *((k, *(repr(float(value)) for value in row)) for k, row in zip(
                found.diameters, np.hstack([*columns.values()]), strict=True))]))
        plot_diameters(found, speed=speed, path=files[1])
        elastic = [(k, int(np.argmax(row > 0.0))) for k, row in zip(
            found.diameters, found.frequencies_hz, strict=True) if row.any()]
        plot_wheel(found, elastic[:12], path=files[2])
        echo_written(*files)


def mistuning(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Folder = None,
    resume: Annotated[bool, Parameter(
        negative=(), help="Continue with random wheels; finished ones are not repeated.")] = False,
    overwrite: Annotated[bool, Parameter(
        negative=(), help="Remove finished wheels and start again.")] = False,
    workers: Annotated[int | None, Parameter(
        help="Processes on this machine; one per core by default.")] = None,
) -> None:
    """Amplification of the linear response of wheels whose blades differ, from [mistuning].

    Engine order and range are those of [response], the force is the first of [[load.forces]].
    Contact is left out. Random wheels give statistics, NAME-mistuning.csv with each wheel and a
    picture; finished wheels are kept in NAME-mistuning. Measured deviations give the displacement
    of each sector over the frequency.
    """
    from fecontact.cli.mistuning_results import measured_wheel, random_wheels
    from fecontact.cli.run_files import read_study
    from fecontact.core.files.atomic_write import output_folder

    described = read_study(study, set_)
    if described.mistuning is None:
        raise InputError(f"{described.title} lacks the section [mistuning]; give the group of "
                         f"cells that deviates and its spread, or measured deviations.")
    with output_folder(output or described.results) as folder:
        if described.mistuning.deviations:
            files = measured_wheel(described, folder)
        else:
            files = random_wheels(described, folder, resume, overwrite, workers)
        echo_written(*files)
