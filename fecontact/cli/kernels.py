"""Compiling kernels ahead: into the cache of this machine, or for a package of them."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module, metadata
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

from fecontact.core.errors import FecontactError, InputError, choices
from fecontact.core.progress import counting_bar
from fecontact.core.stored_code import (
    FOLDER,
    MADE_WITH,
    PACKAGE,
    compiled_for,
    made_with,
    own_families,
    size_on_disk,
)

# Modules whose kernels are compiled, then members that are compiled for their address, or size by
# size. Kernels that share much of their code are neighbours.
_BODIES = ("fecontact.laws.sampling", "fecontact.fem.assembly", "fecontact.reduction.modal_basis",
           "fecontact.fem.mesh_files", "fecontact.system.friction_memory",
           "fecontact.system.jacobian")
_STEPS = ("fecontact.integrate.rodas5p.driver",
          "fecontact.integrate.rodas5p.missed_contacts:first_missed",
          "fecontact.integrate.series.method",
          "fecontact.integrate.rodas5p.method:SMALL", "fecontact.study.study")
_PARTS = {
    "runs": (*_BODIES, *_STEPS),
    "all": (
        *_BODIES, "fecontact.bifurcation.attractors.labels",
        "fecontact.bifurcation.linalg.bordered", "fecontact.bifurcation.linalg.periodic_schur",
        "fecontact.bifurcation.linalg.motion_transitions",
        "fecontact.bifurcation.orbits.collocation_kernels", "fecontact.system.quasistatic.march",
        "fecontact.system.fields.function_field", "fecontact.bifurcation.harmonic.memory",
        "fecontact.bifurcation.harmonic.compiled.steps", "fecontact.bifurcation.orbits.branches",
        "fecontact.bifurcation.events.flow", "fecontact.integrate.field_runs.stepper",
        "fecontact.integrate.nonsmooth.driver",
        "fecontact.integrate.nonsmooth.equations:compiled_derivative",
        "fecontact.integrate.nonsmooth.time_stepping", "fecontact.integrate.nonsmooth.impact_steps",
        "fecontact.integrate.nonsmooth.event_driven",
        "fecontact.integrate.nonsmooth.event_log:note_events",
        "fecontact.integrate.nonsmooth.rigid_stops:compiled_change",
        "fecontact.integrate.nonsmooth.event_driven:SMALL",
        "fecontact.integrate.series.method:SMALL",
        "fecontact.integrate.rodas5p.event_kernels:note_events",
        "fecontact.integrate.rodas5p.sliders:attend",
        "fecontact.integrate.simd.step_loop:SMALL",
        "fecontact.integrate.collocation.method:SMALL",
        "fecontact.integrate.collocation.columns:SMALL",
        "fecontact.integrate.rodas5p.variational:SMALL", "fecontact.integrate.reference.watched",
        *_STEPS),
}
# Packages whose modules hold the functions of laws.
_LAWS = ("fecontact.laws", "fecontact.system")


def compile_kernels(part: str) -> tuple[int, int]:
    """Compile 'runs', what runs need, or 'all' kernels, by two processes.

    Returns their number, and the bytes of all code that is stored with theirs.
    """
    # Linear algebra needs no threads here.
    quiet = os.environ | dict.fromkeys(
        ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    with (tempfile.TemporaryDirectory() as folder,
          counting_bar("Compiling kernels, once on this machine") as tell):
        other = subprocess.Popen([sys.executable, "-m", "fecontact.cli.kernels", part, folder],
                                 env=quiet)
        try:
            found = _jobs(part)
            _work(found, Path(folder), lambda done: tell(done, len(found)))
            while other.poll() is None:
                time.sleep(0.1)
        except BaseException:
            other.kill()
            raise
        if other.returncode != 0:
            # Compiled here: kernels that it left out; all others are only read.
            for compile_one in found:
                compile_one()
    return len(found), size_on_disk(import_module("fecontact.core.compiled").KERNELS)


def _jobs(part: str) -> list[Callable[[], Any]]:
    """Functions that compile one kernel each, in the same order in each process."""
    compiled = import_module("fecontact.core.compiled")
    kernels = compiled.KERNELS
    found: list[Callable[[], Any]] = []
    known = 0
    for name in _PARTS[part]:
        place, _, member = name.partition(":")
        module = import_module(place)
        found += [kernel.ready for kernel in kernels[known:]]
        known = len(kernels)
        made: Any = getattr(module, member) if member else None
        if hasattr(made, "compilers"):
            found += made.compilers
        elif made is not None:
            found.append(partial(getattr, made, "address"))
    laws = {}
    for package in _LAWS:
        for entry in walk_packages(import_module(package).__path__, f"{package}."):
            laws.update({id(value): value for value in vars(import_module(entry.name)).values()
                         if isinstance(value, compiled.CompiledLaw)})
    found += [partial(getattr, law, "address") for law in laws.values()]
    return found + [kernel.ready for kernel in kernels[known:]]


def _work(
    found: Sequence[Callable[[], Any]], claims: Path,
    tell: Callable[[int], None] = lambda done: None, backwards: bool = False,
) -> None:
    """Compile what the other process, which begins at the other end, has not begun with."""
    numbers = range(len(found))
    for number in reversed(numbers) if backwards else numbers:
        try:
            os.close(os.open(claims / str(number), os.O_CREAT | os.O_EXCL))
        except FileExistsError:
            return
        found[number]()
        tell(len(os.listdir(claims)))


def build_package(folder: Path, families: Sequence[str]) -> Path:
    """Build the wheel of ``fecontact-kernels`` for families of processors; its path.

    Raises
    ------
    InputError
        For a family that is not known, or of another kind of processor.
    FecontactError
        If the kernels cannot be compiled or the wheel cannot be built.
    """
    for family in families:
        if family not in own_families():
            raise InputError(f"{family!r} must be one of {choices(own_families())}.")
    with tempfile.TemporaryDirectory() as place:
        package = Path(place, PACKAGE)
        for family in families:
            _compile_family(package / family, family)
        (package / "__init__.py").write_text('"""Compiled kernels of fecontact."""\n',
                                             encoding="utf-8")
        for file in metadata.files("fecontact") or []:
            if file.name == "LICENSE":
                shutil.copy(file.locate(), place)
        Path(place, "pyproject.toml").write_text(_project(), encoding="utf-8")
        Path(place, "hatch_build.py").write_text(_HOOK, encoding="utf-8")
        folder.mkdir(parents=True, exist_ok=True)
        made = Path(place, "dist")
        _run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps",
              "--disable-pip-version-check", "--wheel-dir", str(made), place])
        wheel = next(made.glob("*.whl"))
        return Path(shutil.move(wheel, folder / wheel.name))


def _compile_family(folder: Path, family: str) -> None:
    """Compile all kernels for a family of processors into a folder."""
    _run([sys.executable, "-m", "fecontact", "compile", "--all"],
         compiled_for(family) | {FOLDER: str(folder)})
    say_made_with(folder, family)


def say_made_with(folder: Path, family: str) -> None:
    """Write what the kernels of a family in a folder are made with."""
    code = ("from numba.core.registry import cpu_target; "
            "print(*cpu_target.target_context.codegen().magic_tuple(), sep='|')")
    target = _run([sys.executable, "-c", code], compiled_for(family)).strip().split("|")
    (folder / MADE_WITH).write_text(json.dumps(made_with() | {"target": target}, indent=1) + "\n",
                                    encoding="utf-8")


def _run(command: Sequence[str], variables: dict[str, str] | None = None) -> str:
    """Output of a command; FecontactError if it fails."""
    # Progress and errors of the command go to stderr, and are shown.
    found = subprocess.run(command, env=os.environ | (variables or {}), stdout=subprocess.PIPE,
                           text=True, check=False)
    if found.returncode != 0:
        raise FecontactError(f"{' '.join(command[1:4])} failed, with exit code "
                             f"{found.returncode}.")
    return found.stdout


def _project() -> str:
    """``pyproject.toml`` of the package, which fits these versions alone."""
    versions = made_with()
    return f'''[build-system]
requires = ["hatchling>=1.25"]
build-backend = "hatchling.build"

[project]
name = "fecontact-kernels"
version = "{versions["fecontact"]}"
description = "Compiled kernels of fecontact, with which nothing is compiled at its first run"
license = "BSD-3-Clause"
requires-python = "=={sys.version_info.major}.{sys.version_info.minor}.*"
dependencies = ["numba=={versions["numba"]}", "llvmlite=={versions["llvmlite"]}"]

[tool.hatch.build.targets.wheel]
include = ["{PACKAGE}"]

[tool.hatch.build.targets.wheel.hooks.custom]
'''


# Object code needs neither the interpreter's interface nor a C library of a certain age: symbols
# are looked up by name in the process that loads it.
_HOOK = f'''import sys
import sysconfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

class Tag(BuildHookInterface):
    def initialize(self, version, build_data):
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        if platform == "linux_x86_64":
            platform = "manylinux2014_x86_64"
        python = f"cp{{sys.version_info.major}}{{sys.version_info.minor}}"
        build_data["tag"] = f"{{python}}-{{python}}-{{platform}}"
        build_data["force_include"]["{PACKAGE}"] = "{PACKAGE}"
'''

if __name__ == "__main__":
    _work(_jobs(sys.argv[1]), Path(sys.argv[2]), backwards=True)
