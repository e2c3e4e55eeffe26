"""Runs of `nonsmooth.py` by Siconos' Moreau-Jean scheme, where ``python3-siconos`` is installed.

On Debian: ``apt-get install python3-siconos gcc``. The package is for Debian's own Python, which
runs the program below; forces are compiled in C, as Siconos recommends.

The scheme knows impacts and Coulomb friction with one coefficient on rigid ground. That is what a
mass with a constant load on level ground needs: friction at rest is Siconos' Coulomb law with the
static coefficient, and what the coefficient falls by with slip velocity, a continuous force, goes
to the internal forces, whose derivatives Newton's iteration gets. The belt's speed is taken out of
the coordinates.
"""

import json
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PYTHON = "/usr/bin/python3"

FORCES = """
#include <math.h>

/* Modes along the belt, then the motion away from it. */
enum {{ MODES = {modes} }};
static const double K[MODES][MODES] = {stiffness}, D[MODES][MODES] = {damping};
static const double ROW[MODES] = {row}, PULL[MODES] = {pull}, BELT[MODES] = {belt};
static const double SPEED = {speed}, LOAD = {load}, FALL = {fall}, DECAY = {decay};
static const double SINE = {sine}, COSINE = {cosine}, FREQUENCY = {frequency};

static double slip(const double *v)
{{
  double sum = 0.0;
  for (int i = 0; i < MODES; i++) sum += ROW[i] * v[i];
  return sum;
}}

void given(double t, unsigned int n, double *f, unsigned int nz, double *z)
{{
  double pull = SINE * sin(FREQUENCY * t) + COSINE * cos(FREQUENCY * t);
  for (int i = 0; i < MODES; i++) {{
    f[i] = PULL[i] * pull;
    for (int k = 0; k < MODES; k++) f[i] -= (K[i][k] * t + D[i][k]) * BELT[k] * SPEED;
  }}
  f[MODES] = -LOAD;
}}

void inner(double t, unsigned int n, double *q, double *v, double *f, unsigned int nz, double *z)
{{
  double s = slip(v), less = copysign(-FALL * expm1(-DECAY * fabs(s)), s);
  for (int i = 0; i < MODES; i++) {{
    f[i] = -ROW[i] * less;
    for (int k = 0; k < MODES; k++) f[i] += K[i][k] * q[k] + D[i][k] * v[k];
  }}
  f[MODES] = 0.0;
}}

void inner_q(double t, unsigned int n, double *q, double *v, double *J, unsigned int nz, double *z)
{{
  for (unsigned int i = 0; i < n * n; i++) J[i] = 0.0;
  for (int i = 0; i < MODES; i++)
    for (int k = 0; k < MODES; k++) J[i + k * n] = K[i][k];
}}

void inner_v(double t, unsigned int n, double *q, double *v, double *J, unsigned int nz, double *z)
{{
  double rise = FALL * DECAY * exp(-DECAY * fabs(slip(v)));
  for (unsigned int i = 0; i < n * n; i++) J[i] = 0.0;
  for (int i = 0; i < MODES; i++)
    for (int k = 0; k < MODES; k++) J[i + k * n] = D[i][k] - rise * ROW[i] * ROW[k];
}}
"""

PROGRAM = """
import json, sys, time
import numpy as np
import siconos.kernel as sk
import siconos.numerics as sn

given = json.load(open("given.json"))
modes, row, ends = given["modes"], given["row"], np.array(given["times"])
body = sk.LagrangianDS(np.zeros(modes + 1), np.array(given["velocity"] + [0.0]), np.eye(modes + 1))
body.setComputeFExtFunction("./forces", "given")
body.setComputeFIntFunction("./forces", "inner")
body.setComputeJacobianFIntqFunction("./forces", "inner_q")
body.setComputeJacobianFIntqDotFunction("./forces", "inner_v")
relation = sk.LagrangianLinearTIR(np.array([[0.0] * modes + [1.0], row + [0.0]]))
contact = sk.Interaction(sk.NewtonImpactFrictionNSL(0.0, 0.0, given["static"], 2), relation)
steps = given["steps"]
h = ends[-1] / (steps * (len(ends) - 1))
model = sk.NonSmoothDynamicalSystem(0.0, ends[-1] + h)
model.insertDynamicalSystem(body)
model.link(contact, body)
problem = sk.FrictionContact(2, sn.SICONOS_FRICTION_2D_NSGS)
problem.numericsSolverOptions().dparam[sn.SICONOS_DPARAM_TOL] = 1e-12
simulation = sk.TimeStepping(model, sk.TimeDiscretisation(0.0, h), sk.MoreauJeanOSI(0.5), problem)
simulation.setNewtonTolerance(1e-10)
simulation.setNewtonMaxIteration(20)
simulation.initialize()
states = np.empty((len(ends), 2 * modes))
states[0] = np.concatenate([np.zeros(modes), given["velocity"]])
begin = time.process_time()
for output in range(1, len(ends)):
    for _ in range(steps):
        simulation.computeOneStep()
        simulation.nextStep()
    states[output, :modes] = body.q()[:modes]
    states[output, modes:] = body.velocity()[:modes]
seconds = time.process_time() - begin
np.savez("states.npz", states=states, seconds=seconds)
"""


class Mass(NamedTuple):
    """A mass with modes along a belt: equations of motion, friction and excitation.

    Mass-normalised: ``stiffness`` and ``damping`` (m, m), the contact's ``row`` (m,), that of the
    driven ``point`` (m,); the pull ``sine sin(w t) + cosine cos(w t)`` [N] at this point.
    """

    stiffness: Array
    damping: Array
    row: Array
    point: Array
    sine: float
    cosine: float
    frequency: float
    speed: float
    load: float
    static: float
    kinetic: float
    decay: float


def available() -> bool:
    """Whether Siconos and a compiler are installed."""
    try:
        return all(subprocess.run(command, capture_output=True, check=False).returncode == 0
                   for command in ([PYTHON, "-c", "import siconos.kernel"], ["gcc", "--version"]))
    except FileNotFoundError:
        return False


def run(mass: Mass, times: Array, steps: int) -> tuple[Array, float]:
    """States (N, 2 m) at equidistant times, from rest, and seconds; so many steps between them."""
    modes = len(mass.row)
    belt = mass.row / (mass.row @ mass.row)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        (path / "forces.c").write_text(FORCES.format(
            modes=modes, stiffness=_table(mass.stiffness), damping=_table(mass.damping),
            row=_table(mass.row), pull=_table(mass.point), belt=_table(belt), speed=mass.speed,
            load=mass.load, fall=(mass.static - mass.kinetic) * mass.load, decay=mass.decay,
            sine=mass.sine, cosine=mass.cosine, frequency=mass.frequency))
        subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "forces.c", "-o", "forces.so", "-lm"],
                       cwd=path, check=True)
        (path / "given.json").write_text(json.dumps({
            "modes": modes, "row": mass.row.tolist(), "times": times.tolist(),
            "velocity": (-mass.speed * belt).tolist(), "static": mass.static, "steps": steps}))
        (path / "program.py").write_text(PROGRAM)
        subprocess.run([PYTHON, "program.py"], cwd=path, check=True, stdout=subprocess.DEVNULL,
                       env={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
        with np.load(path / "states.npz") as found:
            states, seconds = found["states"], float(found["seconds"])
    states[:, :modes] += times[:, None] * mass.speed * belt
    states[:, modes:] += mass.speed * belt
    return states, seconds


def _table(values: Array) -> str:
    """An array as C writes it."""
    if values.ndim == 1:
        return "{" + ", ".join(repr(float(value)) for value in values) + "}"
    return "{" + ", ".join(_table(row) for row in values) + "}"
