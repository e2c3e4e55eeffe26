"""Environments that programs stumble over: variables, encodings, closed descriptors."""

import os
import subprocess
import sys

import pytest
from tiny_study import TINY

from fecontact import read_case


def fecontact(*tokens, before="", **variables):
    """Run a command line in a process of its own, after commands of a shell."""
    line = [sys.executable, "-m", "fecontact", *map(str, tokens)]
    return subprocess.run(["sh", "-c", f'{before} exec "$@"', "sh", *line], text=True,
                          encoding="utf-8", capture_output=True, check=False,
                          env={**os.environ, **variables})


@pytest.mark.parametrize("width", ["0", "-3", "wide", ""])
def test_widths_that_are_none_are_dropped(width):
    done = fecontact("--help", COLUMNS=width)
    assert done.returncode == 0
    assert "Usage" in done.stdout
    assert done.stderr == ""


@pytest.mark.parametrize("threads", ["0", "-1", "many"])
def test_no_threads(threads):
    done = fecontact("--help", NUMBA_NUM_THREADS=threads)
    assert done.returncode == 1
    assert done.stderr == (
        f'error: the environment variable NUMBA_NUM_THREADS = "{threads}" must be a whole number '
        f"of 1 or more; set it so, or unset it.\n")


@pytest.mark.slow
def test_a_run_in_ascii_with_an_unknown_backend(tmp_path):
    study = tmp_path / "tiny.toml"
    study.write_text(TINY)
    done = fecontact("run", study, LC_ALL="C", PYTHONIOENCODING="ascii", MPLBACKEND="nonsense")
    assert done.returncode == 0
    assert done.stderr == ""
    assert done.stdout.isascii()
    assert "500 us" in done.stdout


@pytest.mark.slow
def test_results_are_whole_if_stdout_and_stderr_are_closed(tmp_path):
    """Warnings of a load beyond the limits of the model go nowhere."""
    study = tmp_path / "tiny.toml"
    study.write_text(TINY)
    done = fecontact("run", study, "--set", "load.normal=1000.0", before="exec <&- >&- 2>&-;")
    assert done.returncode == 0
    assert done.stdout == done.stderr == ""
    case = read_case(tmp_path / "results" / "tiny.vtkhdf")
    assert len(case.trajectory.time) == 11


def test_descriptors_stay_open_for_children():
    """A child finds the null device at descriptors that were closed.

    Libraries that Python loads before may keep a file of their own at the lowest one.
    """
    code = ("from fecontact.cli.environment import prepare; prepare(); import os, subprocess, sys; "
            "null = os.stat(os.devnull); "
            "held = [k for k in (0, 2) if os.path.samestat(os.fstat(k), null)]; "
            "child = f'import os; [os.fstat(k) for k in {held}]'; "
            "print(2 in held, subprocess.run([sys.executable, '-c', child]).returncode, end='')")
    shell = 'exec <&- 2>&-; exec "$@"'
    done = subprocess.run(["sh", "-c", shell, "sh", sys.executable, "-c", code],
                          capture_output=True, text=True, check=False)
    assert done.stdout == "True 0"


def test_ctrl_c_while_modules_are_loaded_is_one_sentence():
    code = """
import sys
from importlib.abc import MetaPathFinder

import fecontact.cli


class Interrupted(MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "fecontact.cli.entry":
            raise KeyboardInterrupt


sys.meta_path.insert(0, Interrupted())
fecontact.cli.main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted.\n")
