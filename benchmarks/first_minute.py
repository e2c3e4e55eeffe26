"""Sizes and times of a new user's first commands, from wheels in a new environment.

Builds both wheels, `fecontact` and `fecontact-kernels`, installs them away from the sources, and
times first commands with and without the compiled kernels; with these nothing may be compiled.
Takes some 20 minutes, most of them for compiling: ``python benchmarks/first_minute.py``, or
``--kernels WHEEL`` with a wheel of `fecontact compile --wheel` that is there already.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ONE_MASS = """
import fecontact as fc
basis = fc.basis_from_matrices([[1.0]], [[400.0]], {"contact": [[[1.0], [0.0], [0.0]]]})
system = fc.ContactSystem(basis, normal=fc.laws.PrescribedForce(10.0),
                          friction=fc.laws.ConstantFriction(0.3), ground=fc.Ground(speed=0.1))
print(fc.simulate(system, 1.0).status.value)
"""


def call(*command, cwd, cache):
    """Seconds and peak memory [MB] of a command, away from the sources, with a cache of its own."""
    free = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    begin = time.perf_counter()
    process = subprocess.Popen(command, cwd=cwd, env=free | {"NUMBA_CACHE_DIR": str(cache)},
                               stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{command} ended with exit code {process.returncode}")
    return time.perf_counter() - begin, used.ru_maxrss / 1e3


def size(folder):
    """Megabytes of the files in a folder."""
    return sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file()) / 1e6


def environment(folder, *packages):
    """A new virtual environment with packages; its programs."""
    venv.create(folder, with_pip=True)
    programs = Path(folder, "bin")
    subprocess.run([programs / "python", "-m", "pip", "install", "--quiet",
                    "--disable-pip-version-check", *packages], check=True, cwd=folder)
    return programs


def first_commands(programs, folder, what):
    """Print times of first commands, each with an empty cache, and how much they compiled."""
    commands = {
        "simulate one mass in Python": [programs / "python", "-c", ONE_MASS],
        "fecontact init and run of a template": [
            "sh", "-c", f"{programs}/fecontact init beam.toml && {programs}/fecontact run beam.toml"
            " --overwrite"],
        "fecontact demo": [programs / "fecontact", "demo", "demo-output"],
    }
    for name, command in commands.items():
        with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryDirectory() as place:
            seconds, peak = call(*command, cwd=place, cache=cache)
            compiled = len([*Path(cache).rglob("*.nbc")])
        print(f"{what:24s} {name:38s} {seconds:6.1f} s {peak:6.0f} MB {compiled:4d} compiled",
              flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kernels", type=Path, help="a wheel of kernels")
    parser.add_argument("--cpu", default="x86-64-v3", help="processors to build kernels for")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps",
                        "--disable-pip-version-check", "--wheel-dir", folder, ROOT], check=True)
        wheel = next(folder.glob("fecontact-*.whl"))
        kernels = given.kernels
        if kernels is None:
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-m", "fecontact", "compile", "--wheel", folder,
                            "--cpu", given.cpu], check=True)
            print(f"kernels built in {time.perf_counter() - begin:.0f} s")
            kernels = next(folder.glob("fecontact_kernels-*.whl"))
        print(f"wheels: {wheel.stat().st_size / 1e6:.1f} MB, kernels "
              f"{kernels.stat().st_size / 1e6:.1f} MB")
        for extra in ("", "[all]"):
            environment(folder / f"sizes{extra}", f"{wheel}{extra}")
            print(f"fecontact{extra:6s} {size(folder / f'sizes{extra}'):6.0f} MB installed")
        programs = environment(folder / "with", f"{wheel}[all]", str(kernels))
        first_commands(programs, folder, "with kernels")
        first_commands(folder / "sizes[all]/bin", folder, "compiled where run")


if __name__ == "__main__":
    main()
