"""Files are whole or not there: links, leftovers, other people's files, disks that are full."""

import os
import signal
import stat
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import h5py
import numpy as np
import pytest
from synthetic import basis, run

from fecontact import Beam, InputError, generate, read_case, render, write_case, write_mesh
from fecontact.cli import execute
from fecontact.core.files import atomic_write
from fecontact.core.files.atomic_write import (
    clear_leftovers,
    name_part,
    name_parts,
    replaced,
    replaced_folder,
)
from fecontact.io import export_csv, export_pvd
from fecontact.output.files.hdf5 import new_file
from fecontact.plot import rendering_problem

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="locks and limits of Linux")


def in_process(code, *arguments, check=True):
    """Run a script in a process of its own, in which the synthetic runs are at hand."""
    tests = Path(__file__).parents[1]
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code), *map(str, arguments)], check=check,
        capture_output=True, text=True, timeout=120,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tests.parent), str(tests)])})


def listed(folder):
    return sorted(path.name for path in folder.iterdir())


def test_content_takes_the_place_when_it_is_whole(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("earlier")

    def fail(error):
        with replaced(path) as part:
            part.write_text("half")
            raise error

    for error in (KeyboardInterrupt, ZeroDivisionError):
        with pytest.raises(error):
            fail(error)
    assert path.read_text() == "earlier"
    with replaced(path) as part:
        part.write_text("whole")
        assert path.read_text() == "earlier"
    assert path.read_text() == "whole"
    assert listed(tmp_path) == ["a.txt"]
    long = tmp_path / ("n" * 250 + ".txt")
    with replaced(long) as part:
        part.write_text("of a long name")
    assert long.read_text() == "of a long name"


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_files_get_the_mode_that_open_gives(tmp_path, mask):
    before = os.umask(mask)
    try:
        (tmp_path / "opened").write_text("")
        for name in ("a.txt", "b.csv"):
            with replaced(tmp_path / name) as part:
                part.write_text("")
        write_case(tmp_path / "case.vtkhdf", run(times=3), frames=0)
        with replaced_folder(tmp_path / "folder") as part:
            (part / "inside").write_text("")
    finally:
        os.umask(before)
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()}
    assert modes.pop("folder") == 0o777 & ~mask
    assert set(modes.values()) == {0o666 & ~mask}


def test_links_lead_nowhere(tmp_path):
    """Neither those of temporary names, which anybody may guess, nor one of the name itself."""
    victim = tmp_path / "victim"
    victim.write_bytes(b"precious")
    work = tmp_path / "work"
    work.mkdir()
    for name in ("case.vtkhdf.part", "run.part.mp4", ".case.vtkhdf.1.part", ".run.csv.1.part",
                 "case.vtkhdf", "run.csv"):
        (work / name).symlink_to(victim)
    trajectory = run(times=3)
    write_case(work / "case.vtkhdf", trajectory, frames=0)
    export_csv(trajectory, work / "run.csv")
    assert victim.read_bytes() == b"precious"
    assert not (work / "case.vtkhdf").is_symlink()
    assert not (work / "run.csv").is_symlink()
    assert read_case(work / "case.vtkhdf").trajectory.time[-1] == trajectory.time[-1]
    assert (work / ".case.vtkhdf.1.part").is_symlink()


@linux
def test_only_files_are_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "folder.csv").mkdir()
    for name, what in (("pipe.csv", "is not a file"), ("folder.csv", "is a folder")):
        with pytest.raises(InputError, match=what):
            export_csv(run(times=3), tmp_path / name)
    assert stat.S_ISFIFO((tmp_path / "pipe.csv").stat().st_mode)
    with pytest.raises(InputError, match=r"folder .*nowhere does not exist"), \
            replaced(tmp_path / "nowhere" / "a.txt"):
        pass


KILLED = """
import os, signal, sys
from pathlib import Path
from fecontact.core.files.atomic_write import replaced, replaced_folder
with (replaced_folder if sys.argv[2] == "folder" else replaced)(Path(sys.argv[1])) as part:
    (part / "x" if part.is_dir() else part).write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@linux
def test_leftovers_of_killed_processes_are_cleared_and_no_others(tmp_path):
    for _ in range(2):
        assert in_process(KILLED, tmp_path / "a.txt", "file", check=False).returncode == -9
    assert in_process(KILLED, tmp_path / "b", "folder", check=False).returncode == -9
    assert listed(tmp_path) == [".a.txt.1.part", ".b.1.part"]
    others = (".a.txt.2.part", "a.txt.part", "a.txt.abc.part", ".c.1.part")
    (tmp_path / others[0]).mkdir()
    (tmp_path / others[0] / "mine").write_text("of the user")
    (tmp_path / others[1]).write_text("of the user")
    (tmp_path / others[2]).write_text("of the user")
    (tmp_path / others[3]).mkdir()
    (tmp_path / others[3] / "lock").write_text("not of fecontact")
    with replaced(tmp_path / "a.txt") as part:
        # While it is written, another process neither clears it nor is kept from writing.
        clear_leftovers(tmp_path)
        in_process("import sys; from pathlib import Path\n"
                   "from fecontact.core.files import atomic_write\n"
                   "atomic_write.clear_leftovers(Path(sys.argv[1]))\n"
                   "with atomic_write.replaced(sys.argv[1] + '/a.txt') as part:\n"
                   "    part.write_text('of another process')", tmp_path)
        assert (tmp_path / "a.txt").read_text() == "of another process"
        part.write_text("whole")
    assert (tmp_path / "a.txt").read_text() == "whole"
    assert listed(tmp_path) == sorted([*others, "a.txt"])


@linux
def test_a_folder_whose_replacing_was_cut_short_comes_back(tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    (folder / "kept").write_text("earlier")
    code = """
        import os, signal, sys
        from pathlib import Path
        from fecontact.core.files import atomic_write
        real = os.replace
        def stop(source, target):
            real(source, target)
            os.kill(os.getpid(), signal.SIGKILL)
        os.replace = stop
        with atomic_write.replaced_folder(Path(sys.argv[1])) as part:
            (part / "new").write_text("new")
    """
    assert in_process(code, folder, check=False).returncode == -9
    assert not folder.exists()
    clear_leftovers(tmp_path)  # which does not know where it belongs

    def fail():
        with replaced_folder(folder):
            assert (folder / "kept").read_text() == "earlier"
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert listed(tmp_path) == ["frames"]
    with replaced_folder(folder) as part:
        (part / "new").write_text("new")
    assert listed(folder) == ["new"]


def test_many_writers_of_one_name(tmp_path):
    path = tmp_path / "a.txt"

    def write(k):
        for _ in range(20):
            with replaced(path) as part:
                part.write_text(f"{k}" * 5000)

    threads = [threading.Thread(target=write, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    content = path.read_text()
    assert len(content) == 5000
    assert len(set(content)) == 1
    assert listed(tmp_path) == ["a.txt"]


@pytest.mark.skipif(rendering_problem() is not None, reason=str(rendering_problem()))
def test_pictures_and_frames_leave_what_is_not_theirs(tmp_path):
    trajectory = run(basis(columns=4, rows=2), times=5)
    for name in ("pics.part", "frames.old", "frames.part", "run.part"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.txt").write_text("of the user")
    (tmp_path / "pics").mkdir()
    (tmp_path / "pics" / "frame_2024.png").write_bytes(b"a photograph")
    for _ in range(2):
        render(trajectory, tmp_path / "pics", frames=2, size=(320, 180))
        export_pvd(trajectory, tmp_path / "frames", frames=2)
    assert listed(tmp_path / "pics") == ["frame_0000.png", "frame_0001.png", "frame_2024.png"]
    assert listed(tmp_path) == ["frames", "frames.old", "frames.part", "pics", "pics.part",
                                "run.part"]
    assert all((tmp_path / name / "mine.txt").exists()
               for name in ("pics.part", "frames.old", "frames.part", "run.part"))
    # A folder of somebody else's VTU files is not replaced.
    (tmp_path / "frames" / "other.vtu").write_text("of the user")
    with pytest.raises(InputError, match=r"other files \(other\.vtu\)"):
        export_pvd(trajectory, tmp_path / "frames", frames=2)


FULL = """
import resource, sys
from pathlib import Path
from synthetic import run
from fecontact import InputError
from fecontact.io import export_csv, export_mat
from fecontact.plot import plot_history
from fecontact import write_case
trajectory = run(times=50)
folder, said = Path(sys.argv[1]), []
for name, write in (("a.vtkhdf", write_case), ("a.csv", export_csv), ("a.mat", export_mat),
                    ("a.png", lambda run, path: plot_history(run, path=path)),
                    ("a.pdf", lambda run, path: plot_history(run, path=path))):
    path = folder / name
    write(trajectory, path) if write is not write_case else write_case(path, trajectory)
    whole = path.read_bytes()
    for limit in (0, min(9000, len(whole) // 2), len(whole) - 1 - 500 * (name == "a.pdf")):
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
        try:
            write_case(path, trajectory) if write is write_case else write(trajectory, path)
        except InputError as error:
            said.append(str(error))
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
        assert path.read_bytes() == whole, (name, limit)
print("\\n".join(said))
"""


@pytest.mark.slow
@linux
def test_what_cannot_be_written_is_one_sentence_and_the_earlier_file_stays(tmp_path):
    """Files are limited to some bytes: writing fails at any place, as on a full disk."""
    done = in_process(FULL, tmp_path)
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert len(lines) == 5 * 3
    assert all(line.startswith(str(tmp_path)) and line.endswith(
        " cannot be written (file too large); make room on the disk, or choose another folder.")
               for line in lines), lines
    assert listed(tmp_path) == ["a.csv", "a.mat", "a.pdf", "a.png", "a.vtkhdf"]


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 200 kB."""
    place = tmp_path / "disk"
    place.mkdir()
    if os.geteuid() != 0 or subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(place)],
            capture_output=True, check=False).returncode != 0:
        pytest.skip("only root can make a small disk")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.slow
@linux
def test_a_full_disk_keeps_the_earlier_run_and_its_checkpoint(small_disk, tmp_path):
    """The checkpoint is removed when the file of the run is whole, not before."""
    study = tmp_path / "s.toml"
    study.write_text("""
        geometry = { shape = "beam", length = 0.1, height = 0.01, element_size = 0.01 }
        body = { material = "steel", thickness = 0.02 }
        basis = { modes = 5, contact_nodes = 4 }
        load = { normal = 10.0 }
        normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
        friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
        ground = { speed = 0.1, amplitude = 1e-5 }
        simulation = { t_end = 2e-3, outputs = 2001 }
        output = { frames = 0 }
    """)
    checkpoint = small_disk / "s.checkpoint"
    code = """
        import sys
        from fecontact.integrate.rodas5p import checkpoint
        from fecontact.integrate.rodas5p.driver import Run
        from fecontact.cli import execute
        checkpoint.Checkpoint.__dataclass_fields__["period"].default = 0.0
        checkpoint.Checkpoint.__init__.__defaults__ = (0.0,
            *checkpoint.Checkpoint.__init__.__defaults__[1:])
        advance = Run.advance
        Run.advance = lambda run, steps: advance(run, 50)
        sys.exit(execute(["run", sys.argv[1], "-o", sys.argv[2], "--set",
                          f"simulation.outputs={sys.argv[3]}"]))
    """
    (small_disk / "s.vtkhdf").write_bytes(b"the earlier run")
    done = in_process(code, study, small_disk, 601, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    assert "cannot be written (no space left on device); make room on the disk" in done.stderr
    assert (small_disk / "s.vtkhdf").read_bytes() == b"the earlier run"
    assert checkpoint.exists()
    assert listed(small_disk) == ["s.checkpoint", "s.vtkhdf"]


def test_an_interrupt_waits_until_the_file_is_whole(tmp_path):
    def write(path):
        with new_file(path) as file:
            signal.raise_signal(signal.SIGINT)
            file["x"] = np.arange(5.0)

    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        assert np.array_equal(file["x"], np.arange(5.0))
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        write(tmp_path / "b.h5")
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_every_atomic_write_is_the_one(tmp_path):
    """No other module renames over a file or makes temporary names of its own."""
    root = Path(atomic_write.__file__).parents[2]
    files = list(root.rglob("*.py"))
    assert len(files) > 200
    for path in files:
        text = path.read_text()
        if path.name != "atomic_write.py":
            assert "os.replace" not in text, path
            assert '".part' not in text, path


def test_the_mesh_of_a_study_is_not_written_over(tmp_path, capsys):
    mesh = generate(Beam(length=0.1, height=0.01, element_size=0.01))
    write_mesh(mesh, tmp_path / "part.msh")
    before = (tmp_path / "part.msh").read_bytes() + b"$Comments\nby hand\n$EndComments\n"
    (tmp_path / "part.msh").write_bytes(before)
    (tmp_path / "part.toml").write_text('[geometry]\nfile = "part.msh"\n')
    assert execute(["mesh", str(tmp_path / "part.toml"), "-o", str(tmp_path)]) == 1
    assert "part.msh is the mesh that the study names" in capsys.readouterr().err
    assert (tmp_path / "part.msh").read_bytes() == before


@pytest.mark.parametrize(("name", "part"), [
    ("pad", "pad"), ("a/b", "a_b"), ("../../up", ".._.._up"), ("x\x1b[2J", "x_[2J"),
    ('<s>|"', "_s___"), ("\u6f22\u5b57", "\u6f22\u5b57"), ("n" * 1000, "n" * 40)])
def test_names_of_bodies_in_names_of_files(name, part):
    """No folder is left or looked for, and no name is too long for a file."""
    assert name_part(name) == part


def test_parts_of_names_of_files_differ():
    assert name_parts(["a/b", "a:b", "A_b", "c", "\u6f22" * 40, "n" * 50, "n" * 60]) == [
        "a_b", "a_b-2", "A_b-3", "c", "\u6f22" * 13, "n" * 40, "n" * 40 + "-2"]
