"""Times of writing and drawing a run: ``python benchmarks/output.py [--quick]``."""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from usage import explain

from fecontact import (
    Beam,
    ContactSystem,
    ElasticBody,
    Ground,
    Material,
    Trajectory,
    generate,
    modal_basis,
    read_case,
    render,
    write_case,
)
from fecontact.io import export_pvd
from fecontact.laws import ExponentialFriction, RoughSurface
from fecontact.plot import rendering_problem
from fecontact.system.columns import POWERS

FRAMES = 200


def bouncing_beam(element_size: float = 0.00145) -> Trajectory:
    """A beam of 8000 cells in free oscillation of its modes, over sliding ground."""
    body = ElasticBody(generate(Beam(element_size=element_size)), Material(), thickness=0.01)
    basis = modal_basis(body, 20, contact_nodes=40)
    system = ContactSystem(basis, RoughSurface(0.3e6, 5.2e-6, 6.0),
                           ExponentialFriction(0.8, 0.55, 1e3), Ground(speed=0.5))
    t = np.linspace(0.0, 0.02, 2001)
    w = 2.0 * np.pi * 100.0 * np.arange(1, basis.modes + 1)
    size = 1e-5 / np.arange(1, basis.modes + 1)
    return Trajectory(system, t, size * np.sin(w * t[:, None]),
                      size * w * np.cos(w * t[:, None]), np.zeros((len(t), len(POWERS))))


def best_of(count: int, task) -> float:
    seconds = []
    for _ in range(count):
        start = time.perf_counter()
        task()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def frames_per_second(trajectory: Trajectory, path: Path, size: tuple[int, int],
                      frames: int = FRAMES) -> float:
    """Without the start of VTK and the encoder, from the first frame to the last."""
    ticks: list[float] = []
    render(trajectory, path, frames=frames, size=size,
           progress=lambda done, total: ticks.append(time.perf_counter()))
    return (len(ticks) - 1) / (ticks[-1] - ticks[0])


def main(quick: bool = False) -> None:
    frames, times = (5, 1) if quick else (FRAMES, 3)
    trajectory = bouncing_beam(0.01) if quick else bouncing_beam()
    field = trajectory.system.basis.mode_shapes
    _ = trajectory.normal_force
    print(f"{len(field.nodes)} nodes, {len(field.cells)} cells, {frames} frames")
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder, "case.vtkhdf")
        print(f"{'case with VTKHDF':32}"
              f"{best_of(times, lambda: write_case(case, trajectory, frames=frames)):8.2f} s"
              f"{case.stat().st_size / 1e6:8.0f} MB")
        print(f"{'reading it':32}{best_of(times, lambda: read_case(case)):8.2f} s")
        plain = Path(folder, "plain.vtkhdf")
        print(f"{'case without frames':32}"
              f"{best_of(times, lambda: write_case(plain, trajectory, frames=0)):8.2f} s"
              f"{plain.stat().st_size / 1e6:8.0f} MB")
        seconds = best_of(1, lambda: export_pvd(trajectory, Path(folder, "pvd"), frames=frames))
        print(f"{'PVD and VTU':32}{seconds:8.2f} s")
        if (reason := rendering_problem()) is not None:
            print(reason)
            return
        for size in ((320, 180),) if quick else ((960, 540), (1280, 720)):
            rate = frames_per_second(trajectory, Path(folder, "run.mp4"), size, frames)
            print(f"{f'movie {size[0]} x {size[1]}':32}{rate:8.1f} frames/s")


if __name__ == "__main__":
    explain(__doc__)
    main("--quick" in sys.argv)
