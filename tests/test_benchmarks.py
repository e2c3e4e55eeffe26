"""Every benchmark runs in its short form, and the answers whose times it takes are right."""

import re
import shutil
import subprocess
import sys

import pytest
from scripts_for_tests import ROOT, check_numbers, run_script

# Arguments, and patterns, numbers and tolerances of what does not depend on the machine.
BENCHMARKS = {
    "bodies": ((), [(r"^ (2) bodies of 20 modes", 2.0, 0.0)]),
    "calculix": ((), []),
    "contact_kernels": ((), [(r"^ +400 +(\d+)", 40.0, 0.0)]),
    "compilation": ((), [(r"^first run .* (\d+) functions", 20.0, 12.0)]),
    "continuation": ((), [(r"^ +50 fecontact .* (\S+) +\S+$", 0.0, 1e-9),
                          (r"^ +50 fecontact .* \S+ +(\S+)$", 0.0, 1e-6),
                          (r"^ +50 curve of folds: .* (\S+)$", 0.0, 1e-9),
                          (r"^ +50 curve of period doublings: .* (\S+)$", 0.0, 1e-5)]),
    "eigen": ((), [(r"^square 13 x 13, P2.* (\S+)$", 0.0, 1e-12),
                   (r"^cube .* iterative .* (\S+)$", 0.0, 1e-8),
                   (r"^plate .* direct .* (\S+)$", 0.0, 1e-8),
                   (r"^tied .* iterative .* (\S+)$", 0.0, 1e-8)]),
    "decks": ((), [(r"^fecontact, .inp +(\d+)", 5324.0, 0.0),
                   (r"^fecontact, .cdb .* (\d+)$", 430.0, 0.0)]),
    "ensemble": (("4", "3"), [(r"1 thread +rtol 1e-05 .* error (\S+)$", 0.0, 1e-3)]),
    "first_tasks": ((), [(r"^two bodies .* (\S+)$", 2000.0, 1e-3),
                         (r"^(2601) outputs", 2601.0, 0.0)]),
    "fit_coverage": ((), [(r"^  alpha (\S+),", 5e4, 1e3), (r"^  gamma (\S+),", 0.8, 0.03),
                          (r"^  delta (\S+),", -1.1, 0.05),
                          (r"^swept .* freedom (\S+),", 1.0, 0.2)]),
    "harmonic": ((), [(r"^Duffing .* peak +(\S+)$", 0.0, 1e-3),
                      (r"^Jenkins .* peak +(\S+)$", 0.0, 3e-3),
                      (r"^harmonic balance .* error (\S+)$", 0.0, 1e-5)]),
    "wheel": ((), [(r"first points (\S+);", 0.0, 1e-8)]),
    # The frequency of the whole body, and the largest difference of both motions.
    "large_deflections": ((), [(r"^ +0.50 +(\S+) ", 22.927, 0.02),
                               (r"^ +0.50 +\S+ +(\S+) ", 22.927, 0.02),
                               (r"^ +0.50 +\S+ +\S+ +(\S+) ", 22.927, 0.02),
                               (r"^ +0.50 +\S+ +\S+ +\S+ +(\S+) ", 0.0, 0.012),
                               (r"^backbone: .* off by (\S+)$", 0.0, 1e-3),
                               (r"^ +20 +1 +(2) ", 2.0, 0.0)]),
    "laws": ((), [(r"lugre .* us, (\d) internal", 1.0, 0.0),
                   (r"iwan .* us, (\d) internal", 8.0, 0)]),
    "many_contacts": ((), [(r"^ +400 .* (\S+) +\S+$", 0.1, 0.03)]),
    "nonsmooth": ((), [(r"^b event-driven +rtol 1.0e-07 .* error (\S+)$", 0.0, 1e-5),
                       (r"^b smoothed +rtol 1.0e-07 .* error (\S+)$", 0.0, 1e-4),
                       (r"^c event-driven +rtol 1.0e-07 .* error (\S+)$", 0.0, 1e-4)]),
    # The root of a^2 (1 + .075 a^2) = (.18 / .05)^2, and what higher harmonics add.
    "nlvib": ((), [(r"^1 duffing .* (\S+)  bound$", 2.841, 0.05)]),
    "output": ((), [(r"^(\d+) nodes", 205.0, 50.0)]),
    "random_systems": ((), [(r"^all +10 +(\S+)", 1e-5, 1e-5),
                            (r"^finished (\d+) of 10", 10.0, 0.0)]),
    # With all residual vectors nothing is missing of the compliance.
    "reduction": ((), [(r"^slender beam, P2 +0 .* (\S+)$", 0.0, 1e-9)]),
    "shooting": ((), [(r"^ +(3) ", 3.0, 0.0)]),
    "solids": ((), [(r"^ +6 +(8) ", 8.0, 0.0)]),
    "sweep": ((), [(r"^(\d+) cases on", 20.0, 0.0)]),
}
# first_minute builds wheels and installs them, which takes half an hour.
HELPERS = {"beside", "continuation_peer", "first_minute", "integrator", "integrator_peers",
           "integrator_problems", "kept_runs", "nonsmooth_peer", "usage"}


# Two checkouts in turn: here one and the same, in which no row has another name.
def test_two_checkouts_in_turn():
    done = subprocess.run(
        [sys.executable, "benchmarks/beside.py", ".", "solids+--quick", "--rounds", "1",
         "--within", "1e9"], cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    title, *rows = done.stdout.splitlines()
    assert title == "solids --quick"
    ratios = [float(row.split()[4]) for row in rows]
    assert ratios
    assert all(0.01 < ratio < 100.0 for ratio in ratios)


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_decks_are_solved_as_by_calculix(tmp_path, monkeypatch, capsys):
    printed, _ = run_script("benchmarks/calculix.py", (), tmp_path, monkeypatch, capsys)
    rows = re.findall(r"^(.{24}) +(\S+) +(\S+)$", printed, re.MULTILINE)[1:]
    assert len(rows) == 7
    for name, displacement, frequencies in rows:
        assert float(displacement) < 1e-6, name
        assert float(frequencies) < (1e-2 if "C3D8I" in name else 5e-4), name
    others = re.findall(r"^block of (\S+) +(\S+)$", printed, re.MULTILINE)
    assert [name for name, _ in others] == ["C3D8R", "C3D20", "C3D20R", "C3D6", "C3D15"]
    for name, frequencies in others:
        assert float(frequencies) < {"C3D8R": 0.2, "C3D6": 0.4, "C3D15": 0.02}.get(name, 5e-3)


def test_every_benchmark_is_here():
    assert {path.stem for path in (ROOT / "benchmarks").glob("*.py")} == set(BENCHMARKS) | HELPERS


def test_make_bench_runs_every_benchmark():
    written = (ROOT / "Makefile").read_text().replace("\\\n", " ")
    runs = re.search(r"^BENCHMARKS := (.*)$", written, re.MULTILINE)
    assert runs is not None
    assert {run.partition("+")[0] for run in runs[1].split()} == set(BENCHMARKS) | {"integrator"}


@pytest.mark.parametrize("name", ["integrator", *BENCHMARKS])
def test_help_and_options_that_there_are_not(name):
    """Neither measures anything."""
    script = [sys.executable, f"benchmarks/{name}.py"]
    told = subprocess.run([*script, "--help"], cwd=ROOT, capture_output=True, text=True)
    assert (told.returncode, told.stderr) == (0, "")
    assert f"{name}.py" in told.stdout
    refused = subprocess.run([*script, "--qick"], cwd=ROOT, capture_output=True, text=True)
    assert refused.returncode != 0
    assert "--qick" in refused.stderr
    assert "Traceback" not in refused.stderr


@pytest.mark.parametrize("name", BENCHMARKS)
def test_benchmark(name, tmp_path, monkeypatch, capsys):
    arguments, numbers = BENCHMARKS[name]
    printed, left = run_script(f"benchmarks/{name}.py", arguments, tmp_path, monkeypatch, capsys)
    check_numbers(printed, numbers)
    assert left == set()


def test_ensemble_of_friction_oscillators(tmp_path, monkeypatch, capsys):
    printed, left = run_script("benchmarks/ensemble.py", ("4", "3", "--problem", "b"), tmp_path,
                               monkeypatch, capsys)
    check_numbers(printed, [(r"1 thread +rtol 1e-05 .* error (\S+)$", 0.0, 1e-5)])
    assert left == set()


@pytest.mark.parametrize("problem", ["a", "b"])
def test_integrator(problem, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    printed, left = run_script("benchmarks/integrator.py", (problem,), tmp_path, monkeypatch,
                               capsys)
    check_numbers(printed, [(r"1e-12 differs by (\S+)$", 0.0, 1e-6),
                            (r"fecontact +rtol 1.0e-07 .* error (\S+)$", 0.0, 1e-4),
                            (r"odeint +rtol 1.0e-07 .* error (\S+)$", 0.0, 1e-4)])
    assert left == set()
