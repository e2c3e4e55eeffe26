"""Libraries that are installed on request, as extras of fecontact."""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from fecontact.core.errors import MissingLibraryError

# Extras by the modules that they bring.
EXTRAS = {"gmsh": "mesh", "pyvista": "render", "imageio_ffmpeg": "render",
          "pyuff": "data", "nptdms": "data", "emcee": "posterior", "sdypy.EMA": "modal",
          "ansys.mapdl.reader": "ansys", "mapdl_archive": "ansys", "pyyeti.nastran.op4": "nastran",
          "pyyeti.nastran.op2": "nastran", "SurfaceTopography": "topography", "x3pio": "topography"}


def installed(module: str) -> bool:
    """Whether a module can be imported."""
    return find_spec(module) is not None


def how_to_install(module: str) -> str:
    """The command that installs a module."""
    return f"pip install 'fecontact[{EXTRAS[module]}]'"


def optional(module: str, what: str) -> Any:
    """A module of an extra, without which ``what``, in words, cannot be done.

    NumPy prints as before, whatever a module sets when it is imported.

    Raises
    ------
    MissingLibraryError
        If it is not installed, with the command that installs it.
    """
    import numpy as np

    try:
        with np.printoptions():
            return import_module(module)
    except ImportError:
        raise MissingLibraryError(f"{what} needs {module}, which is not installed; install it "
                                  f"with: {how_to_install(module)}") from None
