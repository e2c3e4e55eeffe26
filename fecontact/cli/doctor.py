"""Check of the installation: Python packages, system libraries, rendering; remedies.

Optional libraries are tried in separate processes: VTK ends its process instead of raising an
exception if graphics libraries are missing.
"""

import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata

from fecontact.core import system_libraries
from fecontact.core.extras import how_to_install, installed
from fecontact.core.stored_code import prebuilt

_GMSH = """
import gmsh
gmsh.initialize(readConfigFiles=False, interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.mesh.generate(2)
assert len(gmsh.model.mesh.getNodes()[0]) > 3
"""
_FFMPEG = """
import subprocess
from fecontact.output.render.encoder import ffmpeg
subprocess.run([ffmpeg(), "-version"], check=True, capture_output=True)
"""
_COMPILED = "import fecontact.system.contact_system"
_RENDERING = """
import sys
from fecontact.output.render.offscreen import rendering_problem
reason = rendering_problem()
sys.exit(reason)
"""


@dataclass(frozen=True)
class Finding:
    """Result of one check.

    Attributes
    ----------
    what : str
        Name of the component.
    works : bool
        True if it is installed and works.
    detail : str
        Version, or the reason why it does not work.
    remedy : str
        Remedy; empty if it works.
    """

    what: str
    works: bool
    detail: str
    remedy: str = ""


def examine(report: Callable[[str], None] = lambda what: None) -> list[Finding]:
    """Check Python, the packages, the system libraries and the features that need them.

    Parameters
    ----------
    report : callable
        Called with the name of each component before its check.
    """
    found = [Finding("Python", True, sys.version.split()[0])]
    found += _packages()
    kernels = prebuilt()
    found.append(Finding("kernels", True, "compiled on this machine" if kernels is None else
                         f"of the package fecontact-kernels, for {kernels.folder.name}"))
    absent = system_libraries.missing()
    for what, code, module in (
            ("meshing around holes (Gmsh)", _GMSH, "gmsh"),
            ("compiled laws (numba)", _COMPILED, "numba"),
            ("pictures (VTK)", _RENDERING, "pyvista"),
            ("movies (ffmpeg)", _FFMPEG, "imageio_ffmpeg")):
        report(what)
        if not installed(module) and not (code == _FFMPEG and shutil.which("ffmpeg")):
            found.append(Finding(what, True, f"not installed: {how_to_install(module)}"))
            continue
        reason = _attempt(code)
        remedy = ""
        if reason is not None:
            remedy = system_libraries.remedy(absent) if absent else _reinstall(found)
        found.append(Finding(what, reason is None, reason or "works", remedy))
    # System libraries matter only if a package that needs them fails.
    needed = not all(finding.works for finding in found)
    for library, package in system_libraries.PACKAGES.items():
        there = library not in absent
        detail = "found" if there else f"not found, package {package}"
        found.append(Finding(library, there or not needed, detail,
                             "" if there else system_libraries.remedy(absent)))
    return found


def _packages() -> list[Finding]:
    """The packages that fecontact requires, with their versions."""
    findings = []
    for requirement in metadata.requires("fecontact") or []:
        if "extra ==" in requirement:
            continue
        name = re.split(r"[\s<>=!~;\[(]", requirement, maxsplit=1)[0]
        try:
            findings.append(Finding(name, True, metadata.version(name)))
        except metadata.PackageNotFoundError:
            findings.append(Finding(name, False, "not installed",
                                    f"{sys.executable} -m pip install '{requirement}'"))
    return findings


def _reinstall(found: list[Finding]) -> str:
    lines = [finding.remedy for finding in found if finding.remedy]
    return lines[0] if lines else (f"{sys.executable} -m pip install --force-reinstall --no-deps "
                                   f"gmsh vtk pyvista imageio-ffmpeg numba llvmlite")


def _attempt(code: str) -> str | None:
    """Run Python code in a separate process; returns the reason of a failure, or None."""
    try:
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                              timeout=180, check=False, stdin=subprocess.DEVNULL)
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    if done.returncode == 0:
        return None
    if done.returncode < 0:
        return f"the trial process ended by signal {-done.returncode}"
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    return lines[-1] if lines else f"exit code {done.returncode}"
