"""Runs examples and tutorials for the site, two at a time, and keeps what they gave.

A result is kept under the digest of the script, of the other examples that it imports and of the
package: a second build runs only what has changed.
"""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
IMPORT = re.compile(r"^(?:from|import) (\w+)", re.MULTILINE)


@dataclass(frozen=True)
class Job:
    """A command that writes into the folder in which it runs."""

    name: str
    command: tuple[str, ...]
    sources: tuple[Path, ...]
    kind: str

    @property
    def key(self) -> str:
        """An example and a tutorial may have one name."""
        return f"{self.kind}/{self.name}"


@cache
def package_digest() -> str:
    """Digest of all sources of the package and of the libraries that compute."""
    import numba
    import numpy
    import scipy

    digest = hashlib.sha256()
    for path in sorted((ROOT / "fecontact").rglob("*.py*")):
        if path.suffix in (".py", ".pyi"):
            digest.update(path.read_bytes())
    digest.update(f"{numpy.__version__} {scipy.__version__} {numba.__version__}".encode())
    return digest.hexdigest()


def with_imports(script: Path) -> tuple[Path, ...]:
    """A script and those beside it that it imports, however indirectly."""
    found, new = {script}, [script]
    while new:
        for name in IMPORT.findall(new.pop().read_text(encoding="utf-8")):
            other = script.parent / f"{name}.py"
            if other.exists() and other not in found:
                found.add(other)
                new.append(other)
    return tuple(sorted(found))


def digest(job: Job) -> str:
    """What the results of a job depend on."""
    total = hashlib.sha256(package_digest().encode() + repr(job.command[1:]).encode())
    for path in job.sources:
        total.update(path.read_bytes())
    return total.hexdigest()[:16]


def run(job: Job, cache_folder: Path, tell: Callable[[str], None]) -> Path:
    """The folder with what a job printed and wrote, run only if it is not there yet."""
    kept = cache_folder / job.kind / f"{job.name}-{digest(job)}"
    if kept.exists():
        return kept
    for old in kept.parent.glob(f"{job.name}-*"):
        if re.fullmatch(rf"{re.escape(job.name)}-[0-9a-f]{{16}}(\.new)?", old.name):
            shutil.rmtree(old)
    new = kept.with_name(f"{kept.name}.new")
    (new / "files").mkdir(parents=True)
    paths = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH", ""))))
    environment = {**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1",
                   "MPLBACKEND": "agg"}
    start = time.perf_counter()
    done = subprocess.run(job.command, cwd=new / "files", env=environment, capture_output=True,
                          text=True, encoding="utf-8")
    if done.returncode:
        raise SystemExit(f"{job.kind} {job.name} failed:\n{done.stdout}{done.stderr}")
    (new / "printed.txt").write_text(done.stdout, encoding="utf-8")
    new.rename(kept)
    tell(f"{job.kind} {job.name}: {time.perf_counter() - start:.0f} s")
    return kept


def run_all(jobs: Iterable[Job], cache_folder: Path, tell: Callable[[str], None]
            ) -> dict[str, Path]:
    """Folders of the results of jobs by kind and name; two processes run at a time."""
    jobs = list(jobs)
    with ThreadPoolExecutor(2) as pool:
        folders = pool.map(lambda job: run(job, cache_folder, tell), jobs)
        return {job.key: folder for job, folder in zip(jobs, folders, strict=True)}


def python(*arguments: str) -> tuple[str, ...]:
    """A command with the Python that builds the site."""
    return (sys.executable, *arguments)
