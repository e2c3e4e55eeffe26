"""Programs that show result files: ParaView, and the browser of the system.

Both get a file as data. Kinds that may hold scripts (pages, SVG pictures, states and macros of
ParaView) are refused, because files may come from strangers.
"""

import os
import shutil
import subprocess
import sys
import webbrowser
from pathlib import Path

from fecontact.core.checks import require_file
from fecontact.core.errors import InputError, MissingLibraryError, choices
from fecontact.core.files.hdf5_check import open_hdf5
from fecontact.core.files.stored import reading

FRAMES = (".vtkhdf", ".pvd", ".vtu")  # fields over the bodies, for ParaView
MEDIA = (".png", ".mp4", ".pdf")
BRANCHES = (".h5", ".hdf5")  # branches and responses, shown as a page made of their numbers
_started: list[subprocess.Popen[bytes]] = []  # not waited for; Python warns of those let go


def paraview() -> Path | None:
    """The program ParaView: on the path, or where its installers put it; None if not found."""
    found = shutil.which("paraview")
    if found is not None:
        return Path(found)
    places = {"darwin": ("/Applications", "ParaView*.app/Contents/MacOS/paraview"),
              "win32": (os.environ.get("PROGRAMFILES", ""), "ParaView*/bin/paraview.exe")}
    folder, pattern = places.get(sys.platform, ("", ""))
    if not folder or not Path(folder).is_dir():
        return None
    return max(Path(folder).glob(pattern), default=None)


def require_kind_of_result(file: Path) -> None:
    """InputError unless a file is one that can be shown and cannot run code."""
    require_file(file, "a file of results")
    if not file.is_file():
        raise InputError(f"{file} does not exist; give a file that fecontact wrote, or a study "
                         f"that was run.")
    known = (*FRAMES, *MEDIA, *BRANCHES)
    if file.suffix.lower() not in known:
        raise InputError(f"{file} is not a result that can be shown without running code; files "
                         f"that can end in {choices(known)}.")


def has_frames(file: Path) -> bool:
    """Whether ParaView finds fields over bodies in a file."""
    if file.suffix.lower() != ".vtkhdf":
        return True
    with reading(file, "not an HDF5 file, or is damaged"), open_hdf5(file) as content:
        return "VTKHDF" in content


def show_in_paraview(file: Path, program: Path | None) -> None:
    """Open a file in ParaView, which goes on when this command ends.

    Raises
    ------
    InputError
        If the file holds no fields.
    MissingLibraryError
        If there is no ParaView.
    """
    if program is None:
        raise MissingLibraryError("ParaView is not found; install it from paraview.org and put its "
                                  "folder 'bin' on the path, or leave out --with paraview.")
    if not has_frames(file):
        raise InputError(f"{file} holds no fields over the body for ParaView; run the study with "
                         f"'frames' in [output] above zero.")
    # An absolute path cannot be mistaken for an option.
    _started.append(subprocess.Popen(
        [str(program), str(file.resolve())], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, start_new_session=True))


def show_in_browser(file: Path) -> None:
    """Open a file in the browser of the system; MissingLibraryError if there is none."""
    if not webbrowser.open(file.resolve().as_uri()):
        raise MissingLibraryError(f"no browser is found; open {file} by hand.")
