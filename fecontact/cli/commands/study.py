"""Commands that work on a study: ``init``, ``import``, ``mesh``, ``modes``, ``run``, ``wear``."""

import os
import shlex
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from fecontact.cli.console import INTERRUPTED, echo, echo_written, fail, note, show
from fecontact.cli.options import All, Changes, Folder, StudyFile
from fecontact.core.errors import InputError


def init(
    file: Annotated[Path, Parameter(help="Study file to write.")] = Path("study.toml"),
    /,
    *,
    shape: Annotated[Literal["beam", "pendulum", "block", "pad", "solid", "mesh", "sweep",
                              "response"],
                     Parameter(
        help="beam: on wavy ground. pendulum: strikes a stop. block: on a moving belt. pad: two "
        "bodies, a pad on a block. solid: three-dimensional pad on a belt. mesh: your own mesh "
        "file. sweep: block on a belt over two parameters. response: frequency responses of a "
        "block held by friction.")] = "beam",
    force: Annotated[bool, Parameter(negative=(), help="Overwrite an existing file.")]
    = False,
) -> None:
    """Write a commented study file to start from."""
    from fecontact.cli.templates import template
    from fecontact.core.files.atomic_write import write_text

    _require_new(file, force)
    write_text(file, template(shape))
    following = {"mesh": "put your mesh beside it as part.msh, or change its name there; then: "
                         "fecontact mesh", "sweep": "next: fecontact sweep",
                 "response": "next: fecontact response"}
    command = following.get(shape, "next: fecontact run")
    echo(f"{file} is written; {command} {shlex.quote(str(file))}")


def _require_new(file: Path, force: bool) -> None:
    """Refuse a name that no study can have, and an existing file unless ``force``."""
    from fecontact.cli.run_files import require_short
    from fecontact.core.files.atomic_write import require_possible

    require_possible(file)
    if file.suffix.lower() != ".toml":
        raise InputError(f"{file} must end in .toml.")
    require_short(file.stem)
    # Resolve the path: none/../study.toml exists as soon as the folder of the new file is made.
    if (os.path.lexists(file) or file.resolve().exists()) and not force:
        raise InputError(f"{file} exists; choose another name, or replace it with --force.")


def import_(
    file: Annotated[Path, Parameter(help="Mesh file: an Abaqus or CalculiX deck (.inp), Ansys "
                                         "archive (.cdb), Gmsh, Nastran, MED, VTK.")],
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"], help=(
        "Study file to write; by default no study is written."))] = None,
    scale: Annotated[float, Parameter(help="Metres per unit of the file: 0.001 for mm.")] = 1.0,
    force: Annotated[bool, Parameter(negative=(), help="Overwrite an existing study file.")]
    = False,
) -> None:
    """List the contents of a mesh file; write a study with bodies, interfaces, loads and supports.

    Reads bodies, materials, surfaces, ties, couplings, equations, and simple loads and supports.
    Lists what it leaves out. Contact pairs of the deck, and surfaces of different bodies that are
    close to each other, become interfaces. Replace their laws, which are placeholders.
    """
    from fecontact.cli.console import waiting
    from fecontact.cli.tables import table
    from fecontact.core.files.atomic_write import write_text
    from fecontact.study.imported import imported

    if output is not None:
        _require_new(output, force)
    with waiting("Reading the mesh"):
        found = imported(file, scale)
    show(table("", "", rows=found.summary()))
    for sentence in found.notes:
        note(f"note: {sentence}")
    if output is None:
        option = "" if scale == 1.0 else f" --scale {scale:g}"
        echo(f"next: fecontact import {shlex.quote(str(file))}{option} -o study.toml")
        return
    write_text(output, found.toml(output.parent))
    echo(f"{output} is written; next: fecontact mesh {shlex.quote(str(output))}")


def mesh(study: StudyFile, /, *, set_: Changes = None, output: Folder = None) -> None:
    """Generate or read the mesh of each body of a study; print size and groups."""
    from fecontact.cli.run_files import read_study
    from fecontact.cli.tables import mesh_table, table
    from fecontact.core.files.atomic_write import name_parts, output_folder
    from fecontact.fem.mesh_files import write_mesh
    from fecontact.system.model_limits import implausible_size, warn_of_limits

    described = read_study(study, set_)
    with output_folder(output or described.results) as folder:
        several = described.meshes() if described.bodies else {}
        meshes = several or {"": described.mesh()}
        for (name, made), part in zip(meshes.items(), name_parts(meshes), strict=True):
            geometry = described.bodies[name].geometry if name else described.geometry
            if name:
                echo(f"\n{name}:")
            body = described.bodies[name].body if name else described.body
            show(mesh_table(made, body.degree))
            warn_of_limits(implausible_size(f"body '{name}'" if name else "the body", made),
                           "In this study")
            target = folder / f"{described.name}{'-' * bool(name)}{part}.msh"
            source = getattr(geometry, "file", None)
            if source is not None and target.exists() and (
                    target.samefile(described.folder / source)):
                raise InputError(f"{target} is the mesh that the study names; choose another "
                                 f"folder for what is read of it.")
            write_mesh(made, target)
            echo_written(target)
        if several:
            for name, pairing in described.pairings().items():
                echo(f"\n{name}:")
                show(table("", "", rows=pairing.summary()))


def modes(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Folder = None,
    converge: Annotated[bool, Parameter(negative=(), help=(
        "Show convergence with mesh refinement and number of modes, as a table and a plot."))]
    = False,
    complex_: Annotated[bool, Parameter(name="--complex", negative=(), help=(
        "Show also the complex modes of steady sliding; modes with negative damping are unstable "
        "(squeal)."))]
    = False,
    movie: Annotated[int | None, Parameter(help=(
        "Number of a mode to draw as a movie; with --complex, of a complex mode."))] = None,
    nonlinear: Annotated[int | None, Parameter(help=(
        "Number of a nonlinear mode to follow over its amplitude; 1 is the lowest that "
        "oscillates about rest, where contacts may be closed as in no mode of the table."))] = None,
    amplitudes: Annotated[tuple[float, float] | None, Parameter(help=(
        "Smallest and largest amplitude of a nonlinear mode [m]."))] = None,
    resume: Annotated[bool, Parameter(negative=(), help=(
        "Continue an interrupted nonlinear mode."))] = False,
    all_: All = False,
) -> int:
    """Print frequency, damping, kind and effective mass of the modes; plot their shapes.

    With several bodies, the modes of each body are printed, and how much of the compliance of each
    interface they resolve. --complex (complex eigenvalue analysis), --movie and --nonlinear take
    all bodies together and number their modes through.

    --nonlinear follows the backbone: frequency and damping of a nonlinear mode over its amplitude.
    It writes a table (NAME-mode-N.h5, .csv), a picture (.png) and a page whose points play the
    motion (.html). Harmonics, observed displacement and preload are those of [response]. Ctrl-C
    stops the mode, --resume continues it; with a tolerance in [response] it starts again. With
    [symmetry] and an engine_order the mode is a travelling wave, and no page is written.
    """
    import numpy as np

    from fecontact.cli.console import waiting
    from fecontact.cli.mode_results import follow_mode
    from fecontact.cli.run_files import interfaces_of, read_study
    from fecontact.cli.tables import complex_table, compliance_table
    from fecontact.core.files.atomic_write import name_parts, output_folder
    from fecontact.core.units import quantity
    from fecontact.reduction.report import BasisReport

    described = read_study(study, set_)
    from fecontact.output.plots.modes import plot_convergence, plot_modes

    if nonlinear is None or movie is not None or complex_ or converge:
        described.require_no_sector("`fecontact diameters` prints the modes of the wheel, "
                                    "--nonlinear alone follows that of a travelling wave")
    with output_folder(output or described.results) as folder:
        if described.symmetry is not None and nonlinear is not None:
            return follow_mode(described, nonlinear, amplitudes, folder, resume)
        with described.warning_of_bodies(), waiting("Computing modes"):
            basis = described.reduced.basis
            bases = described.modal_bases() if described.bodies else {"": basis}
            interfaces = interfaces_of(described)
        for (name, one), part in zip(bases.items(), name_parts(bases), strict=True):
            if name:
                echo(f"\n{name}:")
            touched = tuple(face.name for face in interfaces if name in face.bodies)
            echo(str(BasisReport(one, touched if name else None)))
            picture = folder / f"{described.name}{'-' * bool(name)}{part}-modes.png"
            plot_modes(one, path=picture)
            echo_written(picture)
        if interfaces:
            echo("\nStatic compliance that the modes resolve [%]: under uniform pressure, and "
                 "under normal forces\nat single nodes (mean and worst node); under uniform "
                 "traction, and under tangential forces\nat single nodes (mean and worst node):")
            show(compliance_table(interfaces))
            for face in interfaces:
                if not face.enough:
                    echo(f"note: {face.recommendation}")
        sliding = None
        if complex_:
            from fecontact.analysis.complex_modes import complex_modes

            sliding = complex_modes(described.system(), "sliding")
            usable = np.inf if all_ else described.usable_hz
            beyond = sliding.frequencies_hz > usable
            echo("\nsteady sliding:")
            show(complex_table(sliding, usable))
            if beyond.any():
                growing = np.count_nonzero(sliding.grows & beyond)
                echo(f"note: {np.count_nonzero(beyond)} modes above {quantity(usable, 'Hz')} are "
                     f"left out, because the basis is not accurate there; {growing} of them are "
                     f"unstable. --all shows these modes.")
        if movie is not None:
            from fecontact.output.render.mode_movie import render_mode

            kind = "mode" if sliding is None else "complex-mode"
            echo_written(render_mode(basis, folder / f"{described.name}-{kind}-{movie}.mp4", movie,
                                     modes=sliding, progress=True))
        if converge:
            from fecontact.study.convergence import study_convergence

            result = study_convergence(described, progress=True)
            echo(f"\n{result}")
            picture = folder / f"{described.name}-convergence.png"
            plot_convergence(result, path=picture)
            echo_written(picture)
        if nonlinear is None:
            if amplitudes is not None or resume:
                option = "--amplitudes" if amplitudes is not None else "--resume"
                raise InputError(f"{option} is for a nonlinear mode; add --nonlinear with its "
                                 f"number.")
            return 0
        return follow_mode(described, nonlinear, amplitudes, folder, resume)


def preload(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Folder = None,
    modes: Annotated[bool, Parameter(negative=(), help=(
        "Print frequency and damping of the modes at the end of the path too."))] = False,
) -> int:
    """Load a study along the path of [preload]; write a table and plots of shear and loop."""
    from fecontact.cli.console import waiting
    from fecontact.cli.run_files import read_study, write_preload
    from fecontact.cli.tables import preload_table, table
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.system.quasistatic.prestressed_modes import prestressed_modes

    described = read_study(study, set_)
    with output_folder(output or described.results) as folder:
        with waiting("Loading the system"):
            history = described.load_history()
        files = write_preload(described, history, folder)
        system = described.system()
        show(preload_table(history, system.basis))
        if modes:
            found = prestressed_modes(system, history)
            show(table("mode", "frequency [Hz]", "damping ratio", rows=(
                (str(number), f"{frequency:.6g}", f"{ratio:.3g}")
                for number, (frequency, ratio) in enumerate(
                    zip(found.frequencies_hz, found.damping_ratios, strict=True)))))
        if history.statistics["jumps"]:
            what = "the bodies jump" if described.bodies else "the body jumps"
            echo(f"note: {what} {history.statistics['jumps']} times along the path.")
        echo_written(*files)
    if history.status != "finished":
        return fail("no equilibrium was found beyond the points of the path that are written; "
                    "lower the loads of [preload], or add a support.", 1)
    return 0


def run(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Folder = None,
    resume: Annotated[bool, Parameter(
        negative=(), help="Resume an interrupted run.")] = False,
    overwrite: Annotated[bool, Parameter(
        negative=(), help="Remove an interrupted run and start again.")] = False,
) -> int:
    """Run a study in time; write the run (NAME.vtkhdf, opens in ParaView) and plots.

    Prints the key numbers over the second half of the run, and whether its motion has become
    steady: at rest, or periodic to within 1 % over the last quarter of the run.

    Ctrl-C, SIGTERM and SIGHUP stop the run; the part computed so far is written, and --resume
    continues it. --overwrite starts again.
    """
    from fecontact.cli.console import waiting
    from fecontact.cli.run_files import read_study, tell_replaced, write_results_of_run
    from fecontact.cli.tables import key_table, run_table
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.core.files.locks import locked

    if resume and overwrite:
        raise InputError("--resume goes on with an interrupted run and --overwrite removes it; "
                         "give one of them.")
    described = read_study(study, set_)
    _ = described.t_end
    with waiting("Compiling, once after an installation"):
        pass
    with (output_folder(output or described.results) as folder,
          locked(folder / f".{described.name}.lock",
                 f"Another run is writing {folder / described.name}.vtkhdf; wait for it, or choose "
                 f"another folder with -o.")):
        with waiting("Computing modes"):
            described.system()
        checkpoint = folder / f"{described.name}.checkpoint"
        if overwrite:
            checkpoint.unlink(missing_ok=True)
        elif checkpoint.exists() and not resume:
            raise InputError(f"{checkpoint} holds an interrupted run; go on with --resume, start "
                             f"again with --overwrite, or choose another folder with -o.")
        elif resume and not checkpoint.exists():
            raise InputError(f"There is no interrupted run to go on with: {checkpoint} does not "
                             f"exist; run the study without --resume.")
        if not resume:  # which goes on with equal values only
            tell_replaced(described, folder / f"{described.name}.vtkhdf", set_)
        trajectory = described.run(True, checkpoint)
        from fecontact.analysis.run_facts import notes

        with waiting("Writing"):
            files = write_results_of_run(described, trajectory, folder)
        ended = trajectory.status.name
        if ended != "INTERRUPTED":
            checkpoint.unlink(missing_ok=True)
        show(run_table(trajectory))
        if (numbers := key_table(trajectory, described.output.points)) is not None:
            show(numbers)
        for note in notes(trajectory):
            echo(f"note: {note}")
        echo_written(*files)
    if ended == "INTERRUPTED" and checkpoint.exists():
        changes = [part for change in set_ or () for part in ("--set", change)]
        place = [] if output is None else ["-o", str(output)]
        again = shlex.join(["fecontact", "run", str(study), *changes, *place, "--resume"])
        echo(f"next: {again}")
    if ended not in ("FINISHED", "EVENT", "INTERRUPTED"):
        return fail("the run did not reach its end; what was computed is written.", 1)
    return INTERRUPTED if ended == "INTERRUPTED" else 0


def wear(study: StudyFile, /, *, set_: Changes = None, output: Folder = None) -> int:
    """Wear the contact faces of a study over many cycles; the loads redistribute.

    The section [wear] of the study gives the law, its coefficient, the blocks and the acceleration
    of cycles. Writes the history (NAME-wear.h5) and a plot of the worn profile. Ctrl-C stops it;
    the finished blocks are written.
    """
    from fecontact.cli.console import waiting
    from fecontact.cli.run_files import read_study
    from fecontact.cli.tables import wear_table
    from fecontact.core.files.atomic_write import output_folder

    described = read_study(study, set_)
    with output_folder(output or described.results) as folder:
        with waiting("Computing modes"):
            basis = described.system().basis
        history = described.wear_history(progress=True)
        from fecontact.output.files.wear import write_wear
        from fecontact.output.plots.wear import plot_wear

        with waiting("Writing"):
            stored = write_wear(folder / f"{described.name}-wear.h5", history)
            picture = folder / f"{described.name}-wear.png"
            plot_wear(history, basis=basis, path=picture)
        show(wear_table(history, basis))
        echo_written(stored, picture)
    return INTERRUPTED if history.status.name == "INTERRUPTED" else 0
