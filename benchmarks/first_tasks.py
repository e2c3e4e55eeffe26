"""Lines and seconds from a mesh to a result, and of each plot of a stored run.

``python benchmarks/first_tasks.py [--quick]``: four scripts as a reader of the pages writes them,
each in a process of its own; then `fecontact plot` for each kind of plot, and the same in a process
that has the run. Times are those of the processor, with all kernels compiled.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from usage import explain

ROOT = Path(__file__).resolve().parents[1]
PYTHON = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, (
    str(ROOT), os.environ.get("PYTHONPATH", ""))))}

TASKS = {
    "own plane part": """
import gmsh
import fecontact as fc

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
corners = [(5, 0), (60, 0), (60, 15), (0, 15), (0, 3)]
points = [gmsh.model.geo.addPoint(x, y, 0) for x, y in corners]
lines = [gmsh.model.geo.addLine(points[i], points[(i + 1) % 5]) for i in range(5)]
face = gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(lines)])
gmsh.model.geo.synchronize()
gmsh.model.addPhysicalGroup(2, [face], name="pad")
gmsh.model.addPhysicalGroup(1, [lines[0]], name="LINING")
gmsh.option.setNumber("Mesh.MeshSizeMax", 2.5)
gmsh.model.mesh.generate(2)
gmsh.write("pad.msh")
gmsh.finalize()

mesh = fc.read_mesh("pad.msh", scale=1e-3, boundaries={"contact": "LINING"},
                    points={"B": (0.060, 0.0075), "C": (0.030, 0.015)})
pad = fc.ElasticBody(mesh, fc.Material(10e9, 0.25, 2500.0), thickness=0.040)
basis = fc.modal_basis(pad, 10, contact_nodes=12, damping=0.01, reduction="residual")
system = fc.ContactSystem(
    basis, normal=fc.laws.LinearContact(2e8), friction=fc.laws.ConstantFriction(0.4),
    ground=fc.Ground(speed=0.5), drive=fc.Drive(stiffness_x=1e6, damping_x=20.0),
    load=fc.Load(normal=500.0))
run = fc.simulate(system, 0.02, initial="sliding")
print(run.normal_force[-1].sum())
fc.plot.plot_history(run, path="history.png")
""",
    "two bodies": """
import numpy as np
import fecontact as fc

block = fc.Mesh.grid(np.linspace(0.05, 0.15, 9), np.linspace(0.0, 0.03, 3))
table = fc.Mesh.grid(np.linspace(0.0, 0.2, 13), np.linspace(-0.05, 0.0, 4))
model = fc.Assembly()
model.add("block", fc.ElasticBody(block, thickness=0.02), modes=8, C="top")
model.add("table", fc.ElasticBody(table, thickness=0.02, fixed={"bottom": "xy"}), modes=6)
model.contact("joint", "block.bottom", "table.top", normal=fc.laws.LinearContact(5e9),
              friction=fc.laws.ConstantFriction(0.3))
system = model.system(damping=0.01, load=fc.Load(normal=2000.0))
run = fc.simulate(system, 1e-3, initial="rest")
print(run.normal_force[-1].sum())
fc.plot.plot_contact_map(run, path="map.png")
""",
    "solid on a belt": """
import fecontact as fc

shape = fc.fem.SolidBlock(0.1, 0.06, 0.04)
body = fc.ElasticBody(fc.generate(shape), fc.Material.named("steel"))
basis = fc.modal_basis(body, 12, contact_nodes=(5, 3), damping=0.02)
system = fc.ContactSystem(
    basis, normal=fc.laws.LinearContact(1e9), friction=fc.laws.ConstantFriction(0.3),
    ground=fc.Ground(speed=0.5),
    drive=fc.Drive(stiffness_x=1e7, stiffness_y=1e7, damping_x=500.0, damping_y=500.0),
    load=fc.Load(normal=1000.0))
run = fc.simulate(system, 0.01, initial="sliding")
print(run.normal_force[-1].sum())
fc.plot.plot_contact_map(run, path="map.png")
""",
    "frequency response": """
import fecontact as fc
from fecontact.bifurcation import frequency_response

beam = fc.ElasticBody(fc.generate(fc.Beam(length=0.2, height=0.01)), fc.Material.named("steel"),
                      thickness=0.02)
basis = fc.modal_basis(beam, 4, contact_nodes=3, damping=0.01)
system = fc.ContactSystem(
    basis, normal=fc.laws.LinearContact(1e8),
    friction=fc.laws.JenkinsFriction(stiffness=2e5, friction_coefficient=0.3),
    drive=fc.Drive(stiffness_x=1e5, damping_x=10.0, amplitude_x=1e-3, frequency_hz=60.0),
    load=fc.Load(normal=100.0))
response = frequency_response(system, (40.0, 160.0), levels={"drive.amplitude_x": [1e-4, 1e-3]})
print(response.peak(0).parameter)
fc.plot.plot_response(response, path="response.png")
""",
}


def seconds_of(command: list[str], folder: Path) -> tuple[float, str]:
    """Processor time of a command and what it printed."""
    before = os.times()
    done = subprocess.run(command, cwd=folder, env=PYTHON, capture_output=True, text=True,
                          check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    after = os.times()
    return (after.children_user + after.children_system - before.children_user
            - before.children_system), done.stdout.strip()


def tasks(folder: Path, quick: bool) -> None:
    """Print lines, processor time with all kernels compiled, and the answer of each task."""
    print(f"{'task':22s} lines  time [s]  answer")
    for name in ("two bodies",) if quick else TASKS:
        script = folder / "task.py"
        script.write_text(TASKS[name])
        lines = sum(bool(line.strip()) for line in TASKS[name].splitlines())
        command = [sys.executable, str(script)]
        seconds_of(command, folder)  # compiles
        seconds, printed = seconds_of(command, folder)
        print(f"{name:22s} {lines:5d} {seconds:9.2f}  {float(printed):.7g}")


def plots(folder: Path, quick: bool) -> None:
    """Print the processor time of each plot of a stored run, as a command and in this process."""
    from fecontact import read_case
    from fecontact.cli.plot_kinds import KINDS, redraw

    command = [sys.executable, "-m", "fecontact"]
    seconds_of([*command, "init", "study.toml"], folder)
    seconds_of([*command, "run", "study.toml"], folder)
    file = next(folder.rglob("*.vtkhdf"))
    run = read_case(file).trajectory
    print(f"\n{len(run.time)} outputs, {file.stat().st_size / 1e6:.2f} MB")
    print(f"{'plot':16s} command [s]  in Python [s]")
    for kind in ("history", "energies") if quick else KINDS:
        seconds, _ = seconds_of([*command, "plot", str(file), kind], folder)
        begin = time.process_time()
        redraw(run, kind, path=folder / f"{kind}.png")
        print(f"{kind:16s} {seconds:11.2f} {time.process_time() - begin:14.2f}")


def main() -> None:
    quick = "--quick" in sys.argv
    with tempfile.TemporaryDirectory() as made:
        tasks(Path(made), quick)
        plots(Path(made), quick)


if __name__ == "__main__":
    explain(__doc__)
    main()
