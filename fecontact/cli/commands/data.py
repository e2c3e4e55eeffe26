"""The commands ``data`` and ``measure``: measurements in files, and those of virtual sensors."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from fecontact.cli.console import echo_written, show
from fecontact.cli.options import Changes, StudyFile, Trust
from fecontact.core.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fecontact.measured.measurement import Channel, Measurement


def data(
    file: Annotated[Path, Parameter(
        help="A .csv, .txt, .mat, .h5, .uff or .unv file.")],
    /,
    *,
    unit: Annotated[list[str] | None, Parameter(
        negative=(), show_default=False,
        help="Unit in which the file gives a channel, CHANNEL=mm. May be repeated.")] = None,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"],
        help="A .uff file to which the measurements are written.")] = None,
) -> None:
    """Print what a file of measurements holds: channels, units, places, and what looks wrong."""
    from fecontact.measured.read_measurements import read_measurements
    from fecontact.measured.uff_functions import write_uff

    units = {}
    for text in unit or ():
        name, equals, symbol = text.rpartition("=")
        if not equals or not name:
            raise InputError(f"--unit {text} must be CHANNEL=UNIT, such as x=mm.")
        units[name] = symbol
    found = read_measurements(file, units=units or None)
    if output is not None and len(found) > 1:
        raise InputError(f"{file} holds {len(found)} measurements; a file of one is written by "
                         f"write_uff in Python.")
    for one in found:
        show_measurement(one)
    if output is not None:
        echo_written(write_uff(found[0], output))


def measure(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="A .uff file, by default NAME-measured.uff among the results "
                                      "of the study.")] = None,
    trust: Trust = False,
) -> None:
    """Measure the run of a study by the virtual sensors of [measurement]; write a universal file.

    The stored run is taken if it has the values of the study, else the study is run.
    """
    from fecontact.cli.run_files import read_study, stored_or_computed_run
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.measured.uff_functions import write_uff

    described = read_study(study, set_)
    described.require_sensors()
    run = stored_or_computed_run(study, set_, trust).trajectory
    found = described.measure(run)
    show_measurement(found)
    target = output or described.results / f"{described.name}-measured.uff"
    with output_folder(target.parent):
        echo_written(write_uff(found, target))


def show_measurement(one: "Measurement") -> None:
    """Print summary and channels of a measurement."""
    from fecontact.cli.tables import table

    show(table("", "", rows=[row for row in one.summary() if row[0] != "channels"], left=2))
    show(table("channel", "unit", "place", "smallest", "largest", rows=[
        (channel.name, channel.unit or "unknown", _place(channel), *_range(one.values[:, k]))
        for k, channel in enumerate(one.channels)], left=3))


def _place(channel: "Channel") -> str:
    place = "" if channel.node is None else f"node {channel.node} {channel.direction}".strip()
    if channel.reference_node is None:
        return place
    return f"{place} by {channel.reference_node} {channel.reference_direction}".strip()


def _range(values: "NDArray[Any]") -> tuple[str, str]:
    """Smallest and largest value; of complex ones, magnitude."""
    import numpy as np

    data = np.abs(values) if np.iscomplexobj(values) else values
    known = data[np.isfinite(data)]
    return ("none", "none") if not len(known) else (f"{known.min():.4g}", f"{known.max():.4g}")
