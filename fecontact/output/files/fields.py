"""Displacement and stress of one state as a VTU file."""

from pathlib import Path

from fecontact.core.checks import as_path, require_kind
from fecontact.fem.fields import BodyFields


def export_fields(fields: BodyFields, path: str | Path) -> Path:
    """Write displacement and stress over a body as a VTU file, for ParaView and other programs.

    At the nodes of the undeformed body: ``displacement`` [m], ``stress_xx``, ``stress_yy``,
    ``stress_zz``, ``stress_xy`` and ``von_mises`` [Pa].

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        If the name does not end in .vtu, or the file cannot be written.
    """
    require_kind("export_fields", BodyFields, fields=fields)
    path = as_path(path, "fields")
    from fecontact.fem.mesh_files import write_fields

    stresses = zip(("xx", "yy", "zz", "xy"), fields.stress.T, strict=True)
    write_fields(path, fields.nodes, fields.cells, {
        "displacement": fields.displacement,
        **{f"stress_{name}": values for name, values in stresses},
        "von_mises": fields.von_mises})
    return path
