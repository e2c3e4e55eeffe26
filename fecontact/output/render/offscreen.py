"""Off-screen rendering: a check that it works, and the kind of window to use."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from fecontact.core import system_libraries
from fecontact.core.errors import InputError, MissingLibraryError
from fecontact.core.extras import how_to_install, installed
from fecontact.core.resources.memory import available_memory, shown_memory

_WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
_BYTES = 60  # per rendered pixel: window, depth, copies, their mean

# VTK crashes with a segmentation fault where graphics libraries are missing, so the attempt runs in
# a process of its own. It uses the VTK modules of pyvista, without pyvista.
_ATTEMPT = """
import vtkmodules.vtkRenderingOpenGL2
import vtkmodules.vtkRenderingFreeType
import vtkmodules.vtkInteractionStyle
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
from vtkmodules.vtkRenderingOpenGL2 import vtkTextureObject
window, renderer = vtkRenderWindow(), vtkRenderer()
renderer.SetBackground(1.0, 0.0, 0.0)
window.SetOffScreenRendering(True)
window.SetSize(16, 16)
window.AddRenderer(renderer)
window.Render()
pixels = vtkUnsignedCharArray()
window.GetPixelData(0, 0, 15, 15, 1, pixels, 0)
assert pixels.GetValue(0) == 255 and pixels.GetValue(1) == 0, "the picture came out blank"
print("window", window.GetClassName(), vtkTextureObject.GetMaximumTextureSize(window))
"""


def rendering_problem() -> str | None:
    """Try to render a small picture off screen, once per process.

    Returns
    -------
    str or None
        Reason why it is not possible, in one sentence, or None if it is.
    """
    return _attempt()[0]


def require_rendering(size: tuple[int, int], fineness: int) -> None:
    """Check that pictures of a size [pixels] can be rendered here.

    ``fineness`` pixels are rendered for each of the picture, in both directions. What is too large
    for the graphics library comes out blank, what is too large for memory ends the process.

    Raises
    ------
    MissingLibraryError
        If no picture can be rendered, with what to install.
    InputError
        If this one is too large, with the size that fits.
    """
    reason, _, largest = _attempt()
    if reason is not None:
        raise MissingLibraryError(reason)
    width, height = size
    side = 2 * (largest // (2 * fineness))
    free = available_memory()
    fits = free / (_BYTES * fineness**2)
    if max(size) > side or width * height > fits:
        # Keep the shape, with even numbers of pixels.
        shrink = min(side / max(size), (fits / (width * height)) ** 0.5)
        least = [2 * int(0.5 * shrink * length) for length in size]
        raise InputError(f"size = [{width}, {height}] is more than can be drawn on this computer, "
                         f"with {shown_memory(free)} of free memory and {side} pixels in either "
                         f"direction; take at most [{least[0]}, {least[1]}].")


@contextmanager
def known_window() -> Iterator[None]:
    """Make VTK use the kind of window that works, without trying others first."""
    window = _attempt()[1]
    if window is None or _WINDOW in os.environ:
        yield
        return
    os.environ[_WINDOW] = window
    try:
        yield
    finally:
        os.environ.pop(_WINDOW, None)


@cache
def _attempt() -> tuple[str | None, str | None, int]:
    """The reason why rendering fails, the kind of window that works, its largest side in pixels.

    One of the first two is None.
    """
    if not installed("pyvista"):
        return (f"Pictures of bodies need pyvista, which is not installed; install it with: "
                f"{how_to_install('pyvista')}"), None, 0
    try:
        done = subprocess.run([sys.executable, "-c", _ATTEMPT], capture_output=True, text=True,
                              timeout=120, check=False, stdin=subprocess.DEVNULL)
    except (OSError, subprocess.TimeoutExpired) as error:
        return _reason(str(error)), None, 0
    windows = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("window ")]
    if done.returncode == 0 and windows:
        name, largest = windows[0]
        return None, name, int(largest)
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    if done.returncode < 0:
        return _reason(f"the trial process ended by signal {-done.returncode}"), None, 0
    return _reason(lines[-1].strip() if lines else f"exit code {done.returncode}"), None, 0


def _reason(what: str) -> str:
    return (f"Pictures cannot be rendered here ({what.rstrip('.')}); on Debian or Ubuntu install "
            f"the graphics libraries with: "
            f"apt-get install -y {' '.join(system_libraries.PACKAGES.values())}")
