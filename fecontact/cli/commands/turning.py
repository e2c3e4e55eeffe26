"""Commands on a body under stress: ``buckling``."""

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

    The body is held by the supports of [body] alone, not by contact. Shapes are drawn to
    NAME-buckling.png.
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
    body, basis = described.elastic_body(), described.basis
    places = {name: place for name, place in (("B", basis.B), ("C", basis.C)) if place}
    with output_folder(output or described.results) as folder:
        with waiting("Computing load factors"), located(f"{described.title}:"):
            found = buckling_loads(body, described.load, count, points={**basis.points, **places})
        show(table("", "load factor", rows=(
            (str(number), f"{factor:.6g}") for number, factor in enumerate(found.load_factors))))
        if not len(found.load_factors):
            echo("These loads do not make the body buckle.")
            return
        picture = folder / f"{described.name}-buckling.png"
        plot_buckling(found, path=picture)
        echo_written(picture)
