"""A small study to sweep, summaries of its user, executors with prescribed behaviour."""

import os
from concurrent.futures import Executor, Future
from pathlib import Path

STUDY = """
geometry = { shape = "block", element_size = 0.03 }
body = { thickness = 0.1 }
basis = { modes = 4, contact_nodes = 3, damping = 0.01 }
normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
ground = { speed = 2e-3 }
load = { normal = 14.0 }
drive = { stiffness_x = 5610.0, damping_x = 0.768, amplitude_x = 0.5e-3, frequency_hz = 2.196 }
simulation = { t_end = 0.1, outputs = 41 }
"""

SUMMARIES = '''
import os
import sys
import time
from pathlib import Path

import fecontact.core.errors


def failing(run):
    if run.system.friction.static_coefficient > 0.75:
        raise ZeroDivisionError("a case that fails")
    return 1.0


def leaving(run):
    if run.system.friction.static_coefficient > 0.75:
        sys.exit(0)
    return 1.0


def deadly(run):
    if run.system.friction.static_coefficient > 0.75:
        os._exit(3)
    return 1.0


def slow(run):
    time.sleep(0.05)
    return 1.0


def heavy(run):
    names = ("gmsh", "vtk", "vtkmodules", "pyvista", "matplotlib", "skfem.visuals", "meshio",
             "distributed", "rich")
    return float(sum(name in sys.modules for name in names))


def threads(run):
    return float(os.environ["OPENBLAS_NUM_THREADS"])


def process(run):
    return float(os.getpid())


def counted(run):
    with Path(os.environ["SWEEP_COUNTS"]).open("a") as file:
        file.write(f"{run.system.ground.speed!r}\\n")
    return 1.0
'''


class Serial(Executor):
    """Computes at once, in this process."""

    def submit(self, function, /, *arguments, **options):
        future = Future()
        try:
            future.set_result(function(*arguments, **options))
        except Exception as error:
            future.set_exception(error)
        return future


def write_study(folder, sweep="", name="small.toml", text=STUDY):
    folder = Path(folder)
    (folder / "own.py").write_text(SUMMARIES)
    path = folder / name
    path.write_text(text + sweep)
    return path


def files_below(folder):
    """Contents of all files of a sweep, by name."""
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(Path(folder).rglob("*"))
            if path.is_file() and path.name != ".lock"}


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")
    return not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] != "Z"
