"""Progress bars on terminals and in notebooks, and lines elsewhere."""

import io
import re
import sys
import time
from contextlib import redirect_stderr
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from systems import friction_oscillator, lorenz_field

from fecontact import InputError, ensemble, simulate
from fecontact.bifurcation import (
    ContinuationOptions,
    equilibrium_branch,
    lyapunov_exponents,
    stability_map,
)
from fecontact.cli.console import waiting
from fecontact.core import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


class Notebook(ModuleType):
    """Stand-in for IPython in a kernel: displays with a handle, kept as they are set."""

    def __init__(self):
        super().__init__("IPython")
        self.outputs = []
        self.get_ipython = lambda: SimpleNamespace(kernel=object())
        self.display = self._display

    def _display(self, shapes, *, raw, display_id):
        assert raw
        assert display_id is True
        self.outputs.append([shapes])
        return SimpleNamespace(
            update=lambda shapes, *, raw, own=self.outputs[-1]: own.append(shapes))


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE", -1.0)
    monkeypatch.setattr(progress, "_PAUSE", -1.0)


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    return Terminal()


@pytest.fixture
def notebook(monkeypatch):
    module = Notebook()
    display = ModuleType("IPython.display")
    display.display = module.display
    monkeypatch.setitem(sys.modules, "IPython", module)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    return module


def driven():
    return friction_oscillator()


COMPUTED = {
    "Running": lambda told: simulate(driven(), 0.1, t_start=0.05, outputs=3, progress=told),
    "Running ": lambda told: ensemble(driven(), [[0.0, 0.1]] * 3, workers=1, progress=told),
    "Lyapunov exponents": lambda told: lyapunov_exponents(
        driven(), 0.2, transient=0.1, interval=0.1, progress=told),
    "Mapping stability": lambda told: stability_map(
        lorenz_field(), {"rho": [0.3, 0.5], "sigma": [9.0, 10.0, 11.0]}, start=np.zeros(3),
        progress=told),
    "Following rho": lambda told: equilibrium_branch(
        lorenz_field(), np.zeros(3), "rho", bounds=(1.5, 30.0),
        options=ContinuationOptions(points=4, locate=False, progress=told)),
}


@pytest.mark.parametrize("title", COMPUTED)
def test_computations_draw_a_bar_in_a_notebook(title, notebook, capsys):
    COMPUTED[title](True)
    assert notebook.outputs
    for drawn in notebook.outputs:
        last, cleared = drawn[-2:]
        assert last["text/plain"].startswith(f"{title.strip()} 100 %")
        assert '<progress value="100" max="100">' in last["text/html"]
        assert set(cleared.values()) == {""}
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("title", COMPUTED)
def test_nothing_is_drawn_elsewhere_or_unasked(title, notebook, monkeypatch, capsys):
    COMPUTED[title](None)
    COMPUTED[title](False)
    assert not notebook.outputs
    monkeypatch.delitem(sys.modules, "IPython")
    COMPUTED[title](True)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("title", COMPUTED)
def test_functions_are_told_the_end_and_draw_nothing(title, notebook):
    told = []
    COMPUTED[title](told.append)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(
        {"Running": 0.1, "Running ": 3, "Lyapunov exponents": 0.3, "Mapping stability": 1.0,
         "Following rho": 4}[title])
    assert not notebook.outputs


@pytest.mark.parametrize("title", COMPUTED)
def test_what_is_no_progress_is_refused(title):
    with pytest.raises(InputError, match=r"progress = 3 must be True, for a bar, or a function"):
        COMPUTED[title](3)


def test_a_bar_on_a_terminal(terminal):
    with redirect_stderr(terminal), progress.progress_bar("From [b]", 30.0, 10.0) as tell:
        tell(15.0)
        assert "From [b]" in terminal.getvalue()
        assert " 25 %" in terminal.getvalue()
        tell(30.0)
    shown = terminal.getvalue()
    assert shown.index(" 25 %") < shown.index("100 %")
    assert shown.rstrip().endswith("\x1b[2K")  # the line is erased at the end


def test_terminals_of_ipython_are_terminals(terminal, notebook):
    notebook.get_ipython = SimpleNamespace
    with redirect_stderr(terminal):
        simulate(driven(), 0.05, outputs=3, progress=True)
    assert "Running" in terminal.getvalue()
    assert not notebook.outputs


def test_short_work_shows_nothing(notebook, monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE", 60.0)
    simulate(driven(), 0.05, outputs=3, progress=True)
    assert not notebook.outputs


def test_the_time_left_is_that_of_the_same_rate(notebook, monkeypatch):
    clock = iter([100.0, 100.0, 110.0, 115.0, 120.0]).__next__
    monkeypatch.setattr(progress.time, "perf_counter", clock)
    with progress.titled_bar() as show:
        show("one", 0.2)
        show("one", 0.4)
        show("two & more", 0.1)
        show("two & more", 0.2, "by hand")
    texts = [shapes["text/plain"] for shapes in notebook.outputs[0]]
    assert texts == ["one 20 %", "one 40 % 0:30 left", "two & more 10 %",
                     "two & more 20 % by hand", ""]
    assert re.fullmatch(r"two &amp; more <progress .*></progress> 20 % by hand",
                        notebook.outputs[0][3]["text/html"])


def test_the_bar_goes_when_the_work_fails(notebook):
    def fail(done, total):
        with progress.counting_bar("Drawing") as tell:
            tell(done, total)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail(1, 4)
    assert [shapes["text/plain"] for shapes in notebook.outputs[0]] == ["Drawing 25 %", ""]


def test_without_a_terminal_a_line_is_printed_now_and_then(monkeypatch, capsys):
    clock = iter([100.0, 110.0, 129.0, 131.0, 140.0, 170.0]).__next__
    monkeypatch.setattr(progress.time, "perf_counter", clock)
    monkeypatch.setattr(progress, "PATIENCE", 2.0)
    with progress.titled_bar() as show:
        show("Running", 0.1)
        show("Running", 0.2)
        show("Running", 0.25)
        show("Running", 0.4)
        show("Sweeping 4/8", 0.5, "2 failed")
    assert capsys.readouterr().err.splitlines() == [
        "Running: 25 %, 1:45 left", "Sweeping 4/8: 50 %, 2 failed"]


def test_work_of_unknown_length_prints_lines_without_a_terminal(monkeypatch, capsys):
    monkeypatch.setattr(progress, "LINES", 0.01)
    with waiting("Computing modes"):
        time.sleep(0.2)
    lines = capsys.readouterr().err.splitlines()
    assert lines
    assert all(re.fullmatch(r"Computing modes \.\.\. 0:00", line) for line in lines)


def test_closed_standard_error_stops_no_work(monkeypatch):
    closed = io.StringIO()
    closed.close()
    monkeypatch.setattr(progress, "LINES", -1.0)
    monkeypatch.setattr(progress, "PATIENCE", -1.0)
    for stream in (None, closed):
        monkeypatch.setattr(sys, "stderr", stream)
        with progress.titled_bar() as show:
            show("Running", 0.5)


def test_what_is_slow_is_said_once(notebook, capsys, monkeypatch):
    def wait(seconds, text, applies=True):
        with progress.said_if_slow(text, lambda: applies):
            time.sleep(seconds)
        return capsys.readouterr().err

    monkeypatch.setattr(progress, "PATIENCE", 0.2)
    assert wait(0.0, "Compiling.") == ""
    assert wait(0.6, "Reading.", applies=False) == ""
    assert wait(0.6, "Compiling.") == "Compiling.\n"
    assert wait(0.6, "Compiling.") == ""
