"""Branch and curves of `continuation.py` followed by AUTO-07p, where ``auto-07p`` is installed.

On Debian: ``apt-get install auto-07p gfortran``. Derivatives are analytic, tolerances AUTO's usual
ones.
"""

import os
import resource
import shutil
import statistics
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

EQUATIONS = """
SUBROUTINE FUNC(NDIM, U, ICP, PAR, IJAC, F, DFDU, DFDP)
  IMPLICIT NONE
  INTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC
  DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
  DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
  DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM, NDIM), DFDP(NDIM, *)
  DOUBLE PRECISION B, V, R1, S1, R2, S2
  B = PAR(1)
  V = PAR(2)
  CALL FRICTION(U(2) - V, R1, S1)
  CALL FRICTION(U(4) - V, R2, S2)
  F(1) = U(2)
  F(2) = (-3D0 * U(1) + U(3) - 0.4D0 * U(2) + 0.2D0 * U(4) - B * R1) / 2.5D0
  F(3) = U(4)
  F(4) = U(1) - U(3) + 0.2D0 * U(2) - 0.2D0 * U(4) - B * R2
  IF (IJAC == 0) RETURN
  DFDU(1:4, 1:4) = 0D0
  DFDU(1, 2) = 1D0
  DFDU(2, 1:4) = (/ -3D0, -0.4D0 - B * S1, 1D0, 0.2D0 /) / 2.5D0
  DFDU(3, 4) = 1D0
  DFDU(4, 1:4) = (/ 1D0, 0.2D0, -1D0, -0.2D0 - B * S2 /)
  IF (IJAC == 1) RETURN
  DFDP(1:4, 1) = (/ 0D0, -R1 / 2.5D0, 0D0, -R2 /)
  DFDP(1:4, 2) = (/ 0D0, B * S1 / 2.5D0, 0D0, B * S2 /)
CONTAINS
  SUBROUTINE FRICTION(V, R, S)
    DOUBLE PRECISION, INTENT(IN) :: V
    DOUBLE PRECISION, INTENT(OUT) :: R, S
    DOUBLE PRECISION E, A
    E = 1.14D0 * EXP(-2D0 * ABS(V))
    A = ATAN(100D0 * V)
    R = 0.14D0 * (1D0 + E) * A
    S = 0.14D0 * ((1D0 + E) * 100D0 / (1D0 + 1D4 * V * V) - SIGN(2D0, V) * E * A)
  END SUBROUTINE
END SUBROUTINE

SUBROUTINE STPNT(NDIM, U, PAR, T)
  IMPLICIT NONE
  INTEGER, INTENT(IN) :: NDIM
  DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
  DOUBLE PRECISION, INTENT(IN) :: T
  DOUBLE PRECISION R
  PAR(1) = 0.3D0
  PAR(2) = 1D0
  R = 0.14D0 * (1D0 + 1.14D0 * EXP(-2D0)) * ATAN(100D0)
  U = (/ PAR(1) * R, 0D0, 2D0 * PAR(1) * R, 0D0 /)
END SUBROUTINE

SUBROUTINE BCND
END SUBROUTINE
SUBROUTINE ICND
END SUBROUTINE
SUBROUTINE FOPT
END SUBROUTINE
SUBROUTINE PVLS
END SUBROUTINE
"""
CONSTANTS = """
NDIM=4, IPS={kind}, IRS={start}, ILP={folds}, ICP={free}
NTST={intervals}, NCOL=4, IAD=3, ISP={special}, ISW={switch}, IPLT=0, NBC=0, NINT=0
NMX={most}, NPR=0, MXBF=0, IID=0, ITMX=9, ITNW=7, NWTN=3, JAC=1
EPSL=1e-7, EPSU=1e-7, EPSS=1e-5
DS=0.002, DSMIN=1e-6, DSMAX={largest}, IADS=1
NPAR=11, THL={{11: 0.0}}, UZSTOP={stop}
"""
BRANCH = {"folds": 1, "special": 2, "switch": 1, "most": 1000, "stop": {1: [0.25, 12.0]}}
# A curve needs two runs: the first one makes its start.
CURVE = {"folds": 0, "special": 0, "switch": 2, "kind": 2, "free": [1, 2, 11]}
# Numbers by which its files name special points.
_HOPF, _FOLD, _DOUBLING = 3, 5, 7


class PeerBranch(NamedTuple):
    """CPU time of a branch [s], its points, fold and period doubling."""

    seconds: float
    points: int
    fold: float
    doubling: float


class PeerCurve(NamedTuple):
    """CPU time of a curve [s], its points, force and speed at its end."""

    seconds: float
    points: int
    force: float
    speed: float


class Auto:
    """AUTO-07p with the two masses compiled, in a folder."""

    def __init__(self, path: Path) -> None:
        self.path = path
        # Threads that wait for each other would count as CPU time.
        self.environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        (self.path / "masses.f90").write_text(EQUATIONS)
        (self.path / "c.masses").write_text(CONSTANTS.format(
            kind=1, start=0, free=[1], intervals=50, largest=0.1, **BRANCH))
        (self.path / "steady.auto").write_text('save(run("masses"), "steady")\n')
        self._call("auto-07p", "steady.auto")
        self.hopf = next(label for *_, kind, label, _ in self._points("b.steady")
                         if kind == _HOPF)

    def branch(self, intervals: int, repetitions: int) -> PeerBranch:
        """Orbits from the first Hopf point; the median CPU time of the repetitions."""
        (self.path / "fort.2").write_text(CONSTANTS.format(
            kind=2, start=self.hopf, free=[1, 11], intervals=intervals, largest=0.13, **BRANCH))
        shutil.copy(self.path / "s.steady", self.path / "fort.3")
        seconds = self._timed(repetitions)
        shutil.copy(self.path / "fort.8", self.path / "s.orbits")
        points = self._points("fort.7")
        found = {kind: value for _, kind, _, value in points}
        self._labels = {kind: label for _, kind, label, _ in points}
        return PeerBranch(seconds, max(count for count, *_ in points), found[_FOLD],
                          found[_DOUBLING])

    def curve(self, kind: str, intervals: int, speed: float, repetitions: int) -> PeerCurve:
        """Folds or period doublings of the last branch, up to a speed of the belt."""
        settings = {**CURVE, "intervals": intervals, "largest": 0.13, "stop": {2: [0.5, speed]}}
        label = self._labels[_FOLD if kind == "fold" else _DOUBLING]
        (self.path / "fort.2").write_text(CONSTANTS.format(start=label, most=5, **settings))
        shutil.copy(self.path / "s.orbits", self.path / "fort.3")
        self._call("./masses.exe")
        label = self._points("fort.7")[-1][2]
        (self.path / "fort.2").write_text(CONSTANTS.format(start=label, most=500, **settings))
        shutil.copy(self.path / "fort.8", self.path / "fort.3")
        seconds = self._timed(repetitions)
        count, _, _, force = self._points("fort.7")[-1]
        last = (self.path / "fort.7").read_text().split()
        return PeerCurve(seconds, count, force, float(last[-2]))

    def _timed(self, repetitions: int) -> float:
        """Median CPU time of a run [s]."""
        times = []
        for _ in range(repetitions):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            self._call("./masses.exe")
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        return statistics.median(times)

    def _call(self, *command: str) -> None:
        subprocess.run(command, cwd=self.path, env=self.environment, check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def _points(self, name: str) -> list[tuple[int, int, int, float]]:
        """Number, kind, label and parameter of the points in a file."""
        rows = [line.split() for line in (self.path / name).read_text().splitlines()]
        return [(abs(int(row[1])), abs(int(row[2])) % 10, int(row[3]), float(row[4]))
                for row in rows if len(row) > 4 and row[0] != "0"]


@contextmanager
def auto() -> Iterator[Auto | None]:
    """AUTO-07p, if it is installed with its compiler."""
    if not (shutil.which("auto-07p") and shutil.which("gfortran")):
        yield None
        return
    with tempfile.TemporaryDirectory() as folder:
        yield Auto(Path(folder))
