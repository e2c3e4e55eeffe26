"""Several branches in one HDF5 file."""

from collections.abc import Mapping
from pathlib import Path

from fecontact.bifurcation.branch import Branch
from fecontact.errors import InputError


def save_branches(path: str | Path, branches: Mapping[str, Branch]) -> Path:
    """Write branches by name into one HDF5 file, whole or not at all.

    They stand in ``branches/0``, ``branches/1``, ... with their names as attributes;
    :meth:`fecontact.bifurcation.branch.Branch.load` reads the first.

    Raises
    ------
    InputError
        If there are none, or the file cannot be written.
    """
    from h5py import SoftLink

    from fecontact.output.hdf5 import new_file

    if not branches:
        raise InputError(f"There are no branches to write into {path}.")
    with new_file(path) as file:
        for number, (name, branch) in enumerate(branches.items()):
            group = file.create_group(f"branches/{number}")
            group.attrs["name"] = name
            branch.write(group)
        file["branch"] = SoftLink("/branches/0")
    return Path(path)


def load_branches(path: str | Path) -> dict[str, Branch]:
    """Read the branches that :func:`save_branches` wrote, in their order.

    Raises
    ------
    InputError
        If there is no such file, it is damaged, or it holds no branches.
    """
    from fecontact.output.hdf5 import open_file
    from fecontact.stored import member, text

    with open_file(path, "branches") as file:
        groups = member(file, "branches")
        return {text(groups[key], "name"): Branch.read(groups[key], path)
                for key in sorted(groups, key=int)}
