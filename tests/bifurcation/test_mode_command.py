"""The command `fecontact modes --nonlinear`: files, interruption, kills."""

import os
import random
import re
import signal
import time

import numpy as np
import pytest
from response_study import STUDY, study

from fecontact import Study
from fecontact.bifurcation import BranchStatus
from fecontact.bifurcation.modes_of_study import follow_mode
from fecontact.cli import execute
from fecontact.core.errors import FecontactError
from fecontact.io import read_mode, write_mode

AMPLITUDES = (1e-5, 3e-3)
ARGUMENTS = ("--nonlinear", 1, "--amplitudes", *AMPLITUDES)


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "block.toml"
    path.write_text(STUDY)
    return path


def store(described, mode, folder):
    folder.mkdir(exist_ok=True)
    return write_mode(folder / "block-mode-1.h5", mode, system=described.system(),
                      study=described.to_toml(), root=described.folder)


def frequency_at(mode, amplitude):
    return np.interp(np.log(amplitude), np.log(mode.amplitude), mode.frequency_hz)


def block_frequency(described, amplitude):
    """One harmonic: m w^2 = c + k N(A), with the describing function of the element."""
    mass = 1.0 / described.modal_basis().T[0, 0, 0] ** 2
    part = np.minimum(0.4 * 14.0 / (2e4 * amplitude), 1.0)
    angle = np.arccos(1.0 - 2.0 * part)
    stiffness = 2e4 / np.pi * (angle - 0.5 * np.sin(2.0 * angle))
    return np.sqrt((5610.0 + stiffness) / mass) / (2.0 * np.pi)


def test_mode_of_a_block_is_that_of_its_element(cli, file):
    code, said, _ = cli("modes", file, *ARGUMENTS, "--set", "response.harmonics=1")
    assert code == 0
    assert re.search(r"nonlinear mode 1, which begins at \S+ Hz: The branch reached a bound", said)
    results = file.parent / "results"
    mode = read_mode(results / "block-mode-1.h5")
    assert mode.amplitude[[0, -1]] == pytest.approx(AMPLITUDES, rel=1e-6)
    assert mode.frequency_hz == pytest.approx(
        block_frequency(Study.read(file), mode.amplitude), rel=1e-3)
    assert np.ptp(mode.frequency_hz) > 0.4 * mode.frequency_hz[0]
    for ending in ("csv", "png", "html"):
        assert (results / f"block-mode-1.{ending}").stat().st_size > 1000


def test_a_mode_of_few_points_tells_the_amplitude_that_it_reached(cli, file):
    code, said, _ = cli("modes", file, *ARGUMENTS, "--set", "response.points=6")
    assert code == 0
    reached = float(read_mode(file.parent / "results" / "block-mode-1.h5").amplitude[-1])
    assert f"ends at the amplitude {1e6 * reached:.5g} µm of B x: raise points" in " ".join(
        said.split())


class _Interrupts:
    """A progress that presses Ctrl-C at a point."""

    def __init__(self, points):
        self.points, self.count = points, 0

    def __call__(self, points):
        self.count += 1
        if self.count > self.points:
            raise KeyboardInterrupt


@pytest.mark.parametrize("points", [5, 50, 51, 60])
def test_resumed_mode_has_the_numbers_of_an_uninterrupted_one(points, file, cli):
    """In the first part that is stored, at its end and in the second."""
    described = study()
    system, wanted = described.system(), described.response
    whole, parts = follow_mode(system, wanted, AMPLITUDES, 1), []
    assert len(whole) > 62
    found = follow_mode(system, wanted, AMPLITUDES, 1, _Interrupts(points), keep=parts.append)
    assert found.branch.status is BranchStatus.INTERRUPTED
    assert [len(part) for part in parts] == [50] * (points >= 50)
    assert points - 1 <= len(found) <= points + 1
    described = Study.read(file)
    stored = store(described, found, file.parent / "results")
    code, _, _ = cli("modes", file, *ARGUMENTS, "--resume")
    assert code == 0
    resumed = read_mode(stored)
    assert resumed.branch.status is BranchStatus.BOUND
    assert (np.diff(resumed.amplitude) > 0.0).all()
    assert resumed.amplitude[-1] == pytest.approx(AMPLITUDES[1], rel=1e-6)
    assert len(resumed) == len(whole)
    for a, b in zip(resumed.branch.points, whole.branch.points, strict=True):
        assert (a.u == b.u).all()
        assert (a.tangent == b.tangent).all()
        assert all(np.array_equal(a.values[name], b.values[name]) for name in b.values)
    # A finished mode is left as it is.
    code, _, _ = cli("modes", file, *ARGUMENTS, "--resume")
    assert code == 0
    assert len(read_mode(stored)) == len(resumed)


def test_going_on_needs_the_same_values(cli, file):
    described = study()
    part = follow_mode(described.system(), described.response, AMPLITUDES, 1, _Interrupts(3))
    store(Study.read(file), part, file.parent / "results")
    for changed, told in ((["--set", "load.normal=15.0"], "was computed with other values"),
                          (["--set", "response.harmonics=5"], "was computed with other values"),
                          (["-o", "nowhere"], "no interrupted mode to go on with")):
        code, _, said = cli("modes", file, *ARGUMENTS, *changed, "--resume")
        assert code == 1
        assert told in said
    code, _, said = cli("modes", file, "--nonlinear", 1, "--amplitudes", 2e-5, 3e-3, "--resume")
    assert code == 1
    assert "begins at the amplitude 1e-05, not at 2e-05" in said
    code, _, said = cli("modes", file, "--resume")
    assert code == 1
    assert "--resume is for a nonlinear mode" in said
    # Keys that only responses read may differ.
    assert cli("modes", file, *ARGUMENTS, "--set", "response.bounds=[5.0, 6.0]",
               "--resume")[0] == 0


def test_a_finished_mode_ends_at_its_amplitude(cli, file):
    described = Study.read(file)
    mode = follow_mode(described.system(), described.response, (1e-5, 3e-5), 1)
    stored = store(described, mode, file.parent / "results")
    before = stored.read_bytes()
    code, _, said = cli("modes", file, "--nonlinear", 1, "--amplitudes", 1e-5, 3e-4, "--resume")
    assert code == 1
    assert "ends at the amplitude 3e-05, not at 0.0003; give the same --amplitudes" in said
    assert stored.read_bytes() == before
    assert cli("modes", file, "--nonlinear", 1, "--amplitudes", 1e-5, 3e-5, "--resume")[0] == 0


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")
def test_killed_mode_is_never_corrupt(file):
    """At random moments: the file is whole or absent, and what it holds is gone on with."""
    results = file.parent / "results" / "block-mode-1.h5"
    arguments = ["modes", str(file), *map(str, ARGUMENTS), "--set", "response.samples=1024"]
    lasts, rng, kept, kills = None, random.Random(5), [], 0
    # Until one was killed half-way.
    while kills < 12 or (kills < 60 and not any(count % 50 < 3 for count in kept)):
        begin, child = time.monotonic(), os.fork()
        if child == 0:
            os._exit(execute([*arguments, *(["--resume"] if results.exists() else [])]))
        if lasts is None:
            assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
            lasts, whole = time.monotonic() - begin, read_mode(results)
            results.unlink()
            continue
        time.sleep(rng.uniform(0.0, lasts))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        kills += 1
        if results.exists():
            mode = read_mode(results)
            kept.append(len(mode))
            assert (np.diff(mode.amplitude) > 0.0).all()
            if mode.branch.status is BranchStatus.BOUND:
                results.unlink()
    assert any(count % 50 < 3 for count in kept)
    execute([*arguments, *(["--resume"] if results.exists() else [])])
    assert read_mode(results).frequency_hz[-1] == pytest.approx(whole.frequency_hz[-1], rel=1e-5)
    with pytest.raises(FecontactError):
        read_mode(file)
