"""Shared libraries of the operating system that the wheels of Gmsh and VTK load.

Only the standard library is used here, so that this file also runs before anything is installed.
"""

import ctypes
import os
import shutil
import sys

PACKAGES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libGLU.so.1": "libglu1-mesa",
    "libXcursor.so.1": "libxcursor1",
    "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1",
    "libgomp.so.1": "libgomp1",
}


def missing() -> dict[str, str]:
    """Libraries that cannot be loaded, with their Debian packages; none but on Linux."""
    if not sys.platform.startswith("linux"):
        return {}
    absent = {}
    for library, package in PACKAGES.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            absent[library] = package
    return absent


def remedy(absent: dict[str, str]) -> str:
    """The line that installs these libraries, or what to look for without apt-get."""
    if shutil.which("apt-get") is None:
        return f"install the packages of your distribution that hold {', '.join(absent)}"
    sudo = "" if os.geteuid() == 0 else "sudo "
    return f"{sudo}apt-get install -y --no-install-recommends {' '.join(absent.values())}"
