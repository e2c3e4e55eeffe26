"""Compilation: of a first run of one mass with nothing stored, and of all kernels.

Processor time of all processes, the number of functions that are stored, and their size. Quickly
the first run alone. Two checkouts are compared by `python benchmarks/beside.py OTHER compilation`.

Usage: python benchmarks/compilation.py [--quick]
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from first_minute import ONE_MASS, size
from usage import explain


def compile_by(name: str, *arguments: str) -> None:
    """Print what a command of this interpreter takes with nothing stored."""
    with tempfile.TemporaryDirectory() as store:
        begin = os.times()
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL,
                       env=os.environ | {"NUMBA_CACHE_DIR": store})
        end = os.times()
        seconds = (end.children_user - begin.children_user
                   + end.children_system - begin.children_system)
        stored = len([*Path(store).rglob("*.nbc")])
        print(f"{name:10s} {seconds:7.1f} s {stored:5} functions {size(store):6.1f} MB", flush=True)


def main() -> None:
    """Measure both, or quickly the first."""
    compile_by("first run", "-c", ONE_MASS)
    if "--quick" not in sys.argv:
        compile_by("all", "-m", "fecontact", "compile", "--all")


if __name__ == "__main__":
    explain(__doc__)
    main()
