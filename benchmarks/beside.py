"""Benchmarks of two checkouts in turn: every time that they print, and the ratio of the two.

Each benchmark runs in the other checkout and in this one, one after the other, several rounds. Of
the times of a row the least one counts. A row is a line of the output without its numbers.

Usage: python benchmarks/beside.py OTHER [BENCHMARK+ARGUMENT... ...] [--rounds 3] [--within 1.1]
OTHER may be a family of processors, `x86-64-v3`: this checkout by code for all of them, as in the
package of compiled code, beside the same by code for this very processor.
BENCHMARK+ARGUMENT is as in the Makefile, `integrator+b+c+--quick` for `integrator.py b c --quick`.
The exit code is 1 if a time of this checkout is more than `--within` times that of the other.
"""

import argparse
import os
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from fecontact.core.stored_code import FAMILIES, compiled_for

HERE = Path(__file__).resolve().parent.parent
DEFAULT = ("integrator+a+b+b2+c+--quick", "ensemble+--quick", "many_contacts+--quick",
           "bodies+--quick", "solids+--quick", "nonsmooth+--quick", "shooting+--quick")
UNITS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
NUMBER = r"\d+(?:\.\d+)?(?:e[-+]?\d+)?"
TIME = re.compile(rf"(?<![\w.])({NUMBER}) *(ns|us|ms|s)\b")
Rows = dict[str, list[float]]


def rows(lines: Iterable[str]) -> Rows:
    """Times [s] of each line of an output, by what the line says beside numbers."""
    found: Rows = {}
    for line in lines:
        times = [float(value) * UNITS[unit] for value, unit in TIME.findall(line)]
        if times:
            words = re.sub(r"[^\w.-]+", " ", TIME.sub("", line)).split()
            # Without ratios and errors, which differ from run to run.
            label = " ".join(word for word in words if not re.fullmatch(r"-|.*\d\.\d.*", word))
            while label in found:
                label += "'"
            found[label] = times
    return found


def run(tree: Path, benchmark: str, target: dict[str, str] | None = None) -> Rows:
    """Times that a benchmark of a checkout prints; compiled for this processor by default."""
    name, *arguments = benchmark.split("+")
    done = subprocess.run(
        [sys.executable, str(tree / "benchmarks" / f"{name}.py"), *arguments], check=True,
        capture_output=True, text=True, cwd=tree / "benchmarks",
        env={**os.environ, "PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1",
             **(target or {"FECONTACT_NATIVE": "1"})})
    return rows(done.stdout.splitlines())


def least(all_rows: Iterable[Rows]) -> Rows:
    """The least of each time over several runs; of rows that all of them have."""
    first, *others = all_rows
    return {label: [min(of_one) for of_one in
                    zip(times, *(other[label] for other in others), strict=False)]
            for label, times in first.items() if all(label in other for other in others)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", help="folder of the other checkout, or a family of processors")
    parser.add_argument("benchmarks", nargs="*", default=DEFAULT)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--within", type=float, default=1.1)
    given = parser.parse_args()
    slower, target = False, compiled_for(given.other) if given.other in FAMILIES else None
    other = Path(given.other).resolve() if target is None else HERE
    for benchmark in given.benchmarks:
        # The first run of each tree compiles and stores the kernels.
        run(other, benchmark, target)
        run(HERE, benchmark)
        turns = [(run(other, benchmark, target), run(HERE, benchmark))
                 for _ in range(given.rounds)]
        before, after = (least(turn[side] for turn in turns) for side in (0, 1))
        print(f"{benchmark.replace('+', ' ')}")
        for label in sorted(before.keys() & after.keys()):
            for old, new in zip(before[label], after[label], strict=False):
                mark = " slower" if new > given.within * old else ""
                slower |= bool(mark)
                ratio = new / max(old, 1e-12)
                print(f"  {old:10.4g} s  {new:10.4g} s  {ratio:5.2f}{mark}  {label}", flush=True)
    return int(slower)


if __name__ == "__main__":
    sys.exit(main())
