"""Signals: what ends a command, and what Gmsh does to them."""

import os
import pty
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from fecontact import Beam, Status, generate, read_case
from fecontact.cli import execute
from fecontact.cli.console import ending_signals, interrupted_code

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")

STUDY = """
geometry = { shape = "beam", length = 0.1, height = 0.01, element_size = 0.01 }
body = { material = "steel", thickness = 0.02 }
basis = { modes = 5, contact_nodes = 4, damping = 0.01 }
ground = { speed = 0.1, amplitude = 1e-5 }
load = { normal = 10.0 }
normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
simulation = { t_end = 1e5, outputs = 100001 }
output = { frames = 0 }
"""
RUN = """
import signal, sys, threading
from fecontact.cli import execute
from fecontact.integrate.rodas5p.driver import Run
from fecontact.system import model_limits

model_limits.PERIODS = 1e15  # the run is meant to last
advance = Run.advance
def told(run, steps):
    if run.outputs:
        print("running", file=sys.stderr, flush=True)
    return advance(run, steps)
Run.advance = told
sys.exit(execute(["run", sys.argv[1]]))
"""


ENDLESS = """
import math
from dataclasses import dataclass
from typing import ClassVar

from fecontact.laws import FrictionLaw, friction_law


@friction_law
def _endless(v, F, p):
    x = 1.0
    while 4.0 < F < 90.0 and x > 0.0:
        x = 1.0 + 0.5 * x
    smooth = math.tanh(1e4 * v)
    return 0.1 * smooth * F * x, 1e3 * (1.0 - smooth**2) * F, 0.1 * smooth


@dataclass(frozen=True)
class Endless(FrictionLaw):
    kernel: ClassVar = _endless

    @property
    def velocity_scale(self):
        return 1e-4
"""


def files(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("deaf", [False, True])
def test_sigterm_writes_the_run_and_its_checkpoint(tmp_path, deaf):
    """SIGTERM acts like Ctrl-C, also where SIGINT is ignored; further signals change nothing."""
    (tmp_path / "s.toml").write_text(STUDY)
    ignored = signal.SIG_IGN if deaf else signal.default_int_handler
    process = subprocess.Popen(
        [sys.executable, "-c", RUN, str(tmp_path / "s.toml")], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, ignored))
    assert process.stderr.readline() == "running\n"
    for _ in range(3):
        process.send_signal(signal.SIGTERM)
        time.sleep(0.05)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM, err
    assert set(err.splitlines()) <= {"running"}
    assert "The run was interrupted" in out
    assert {"s.checkpoint", "s.vtkhdf", "s-history.png"} <= set(files(tmp_path / "results"))
    run = read_case(tmp_path / "results" / "s.vtkhdf").trajectory
    assert run.status is Status.INTERRUPTED
    assert 0.0 < run.time[-1] < 1e5


def test_a_run_that_is_ended_before_its_first_step_leaves_nothing(tmp_path):
    (tmp_path / "s.toml").write_text(STUDY)
    code = RUN.replace("def told(run, steps):", "def told(run, steps):\n"
                       "    signal.raise_signal(signal.SIGTERM)")
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path / "s.toml")], text=True,
                          capture_output=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (143, "error: interrupted.\n")
    assert files(tmp_path) == ["s.toml"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_signal_ends_a_run_whose_law_never_returns(tmp_path, number):
    """A load of 90 N from 10 ms on, on four nodes: above 4 N at one the law loops for ever."""
    (tmp_path / "own.py").write_text(ENDLESS)
    head, _, tail = STUDY.partition("friction = ")
    tail = tail.partition("\n")[2]
    load = 'normal = 10.0, forces = [{ point = "B", component = "y", signal = SIGNAL }]'.replace(
        "SIGNAL", '{ law = "step", time = 0.01, value = -80.0 }')
    (tmp_path / "s.toml").write_text(
        f'{head}friction = {{ law = "own.py:Endless" }}\n{tail}'.replace("normal = 10.0", load)
        .replace("1e5", "1.0").replace("100001", "11"))
    code = RUN.replace("    if run.outputs:\n    ", "").replace(
        "model_limits.PERIODS", "console._PATIENCE = 0.5\nmodel_limits.PERIODS").replace(
        "import execute", "import console, execute")
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path / "s.toml")], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
    assert process.stderr.readline() == "running\n"
    time.sleep(1.0)
    process.send_signal(number)
    line = process.stderr.readline()
    while line == "running\n":
        line = process.stderr.readline()
    assert line.startswith("Compiled code has not returned for 0.5 s"), line
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err, out) == (128 + number, "error: interrupted.\n", "")
    assert "s.vtkhdf" not in files(tmp_path / "results")


def test_a_closed_terminal_writes_the_run(tmp_path):
    """SIGHUP comes, and all that is written to the terminal from then on is an error."""
    (tmp_path / "s.toml").write_text(STUDY)
    # The terminal may be gone before its signal is heard; what the test writes must not fail then.
    code = "import contextlib\n" + RUN.replace(
        "        print(", "        with contextlib.suppress(OSError): print(")
    child, terminal = pty.fork()
    if child == 0:
        os.execv(sys.executable, [sys.executable, "-c", code, str(tmp_path / "s.toml")])
    seen = b""
    while b"running" not in seen:
        seen += os.read(terminal, 1000)
    os.close(terminal)
    _, status = os.waitpid(child, 0)
    assert os.WIFEXITED(status)
    assert os.WEXITSTATUS(status) == 128 + signal.SIGHUP
    assert {"s.checkpoint", "s.vtkhdf", "s-energies.png"} <= set(files(tmp_path / "results"))


def test_handlers_are_as_before_afterwards():
    handlers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in handlers]
    assert execute(["laws"]) == 0
    assert [signal.getsignal(number) for number in handlers] == before
    ignored = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ending_signals():
            signal.raise_signal(signal.SIGHUP)  # as under nohup
            assert interrupted_code() == 130
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGTERM)
            assert interrupted_code() == 143
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, ignored)
    assert interrupted_code() == 130
    found = []
    thread = threading.Thread(target=lambda: found.append(execute(["laws", "nonsense"])))
    thread.start()
    thread.join()
    assert found == [1]


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="looks at signals in /proc")
def test_gmsh_leaves_all_signals_as_they_were():
    """A closed pipe stays an error of Python's, and handlers of the caller's stay in place."""
    def dispositions():
        return re.findall(r"^Sig(?:Ign|Cgt):.*$", Path("/proc/self/status").read_text(),
                          re.MULTILINE)

    import gmsh  # noqa: F401  before: it loads libraries with a signal of their own

    before = signal.signal(signal.SIGTERM, lambda *_: None)
    try:
        kept = dispositions()
        generate(Beam(length=0.1, height=0.01, element_size=0.01))
        assert dispositions() == kept
        thread = threading.Thread(
            target=generate, args=(Beam(length=0.1, height=0.01, element_size=0.01),))
        thread.start()
        thread.join()
        assert dispositions() == kept
        read, write = os.pipe()
        os.close(read)
        with pytest.raises(BrokenPipeError):
            os.write(write, b"x")
        os.close(write)
    finally:
        signal.signal(signal.SIGTERM, before)
