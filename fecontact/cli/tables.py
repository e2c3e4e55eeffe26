"""Tables of meshes and runs printed by commands."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fecontact.fem.mesh import Mesh
    from fecontact.integrate.trajectory import Trajectory
    from fecontact.system.complex_modes import ComplexModes


def table(*headings: str, rows: Iterable[Iterable[str]], left: int = 1) -> Any:
    """Table for the terminal; the first ``left`` columns are left-aligned, the others right."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    result = Table(*headings, box=SIMPLE_HEAD, show_header=any(headings), pad_edge=False)
    for column in result.columns[left:]:
        column.justify = "right"
    for row in rows:
        result.add_row(*row)
    return result


def mesh_table(mesh: "Mesh") -> Any:
    """Counts, size and groups of a mesh."""
    return table("", "", rows=mesh.summary())


def run_table(trajectory: "Trajectory") -> Any:
    """Summary of a run."""
    from fecontact.analysis.run_facts import run_facts

    return table("", "", rows=run_facts(trajectory))


def complex_table(modes: "ComplexModes") -> Any:
    """Frequencies and damping ratios of complex modes, and which of them grow."""
    rows = [(str(number), f"{hertz:.6g}", f"{ratio:.3%}", "grows" if grows else "")
            for number, (hertz, ratio, grows) in enumerate(zip(
                modes.frequencies_hz.tolist(), modes.damping_ratios.tolist(),
                modes.grows.tolist(), strict=True))]
    return table("mode", "frequency [Hz]", "damping", "", rows=rows)


def file_size(path: Path) -> str:
    """Readable size of a file."""
    size = float(path.stat().st_size)
    for unit in ("B", "kB", "MB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.3g} GB"
