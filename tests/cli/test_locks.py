"""Two processes that want to write the same run."""

import os
import signal
import subprocess
import sys
import time

import pytest
from tiny_study import TINY

from fecontact import InputError
from fecontact.cli import execute
from fecontact.core.files.locks import locked

HOLD = """
import sys, time
from pathlib import Path
from fecontact.core.files.locks import locked
with locked(Path(sys.argv[1]), "taken"):
    print("held", flush=True)
    time.sleep(60.0)
"""


@pytest.fixture
def holder():
    """Start a process that holds a lock; all of them end with the test."""
    processes = []

    def start(path):
        process = subprocess.Popen([sys.executable, "-c", HOLD, str(path)], text=True,
                                   stdout=subprocess.PIPE)
        processes.append(process)
        assert process.stdout.readline() == "held\n"
        return process

    yield start
    for process in processes:
        process.kill()
        process.wait()
        process.stdout.close()


def test_a_second_run_on_the_same_file_is_refused(tmp_path, monkeypatch, capsys, holder):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "results").mkdir()
    holder(tmp_path / "results" / ".tiny.lock")
    assert execute(["run", "tiny.toml"]) == 1
    said = capsys.readouterr().err
    assert said == (f"error: Another run is writing {os.path.join('results', 'tiny.vtkhdf')}; wait "
                    f"for it, or choose another folder with -o.\n")
    assert os.listdir("results") == [".tiny.lock"]
    assert execute(["run", "tiny.toml", "-o", "elsewhere"]) == 0


def test_the_lock_of_a_killed_run_keeps_nobody_out(tmp_path, monkeypatch, holder):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "results").mkdir()
    process = holder(tmp_path / "results" / ".tiny.lock")
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert (tmp_path / "results" / ".tiny.lock").exists()
    assert execute(["run", "tiny.toml"]) == 0
    assert not (tmp_path / "results" / ".tiny.lock").exists()


def test_locks_are_held_by_one_at_a_time(tmp_path):
    """A lock holds while the file comes and goes: each of many processes counts one up."""
    count = tmp_path / "count"
    count.write_text("0")
    script = ("import sys, time\n"
              "from pathlib import Path\n"
              "from fecontact.core.errors import InputError\n"
              "from fecontact.core.files.locks import locked\n"
              "count, done = Path(sys.argv[1]), 0\n"
              "while done < 50:\n"
              "    try:\n"
              "        with locked(count.with_name('.lock'), 'taken'):\n"
              "            number = int(count.read_text())\n"
              "            time.sleep(1e-4)\n"
              "            count.write_text(str(number + 1))\n"
              "            done += 1\n"
              "    except InputError:\n"
              "        time.sleep(1e-4)\n")
    processes = [subprocess.Popen([sys.executable, "-c", script, str(count)]) for _ in range(4)]
    assert [process.wait(timeout=60.0) for process in processes] == [0] * 4
    assert count.read_text() == "200"
    assert os.listdir(tmp_path) == ["count"]


def test_links_are_not_followed(tmp_path):
    (tmp_path / "mine").write_text("kept")
    (tmp_path / ".lock").symlink_to(tmp_path / "mine")
    with pytest.raises(InputError, match="cannot be written"), \
            locked(tmp_path / ".lock", "taken"):
        pass
    assert (tmp_path / "mine").read_text() == "kept"


def test_the_lock_goes_when_the_block_fails(tmp_path):
    begin = time.monotonic()
    for _ in range(2):
        with pytest.raises(ZeroDivisionError), locked(tmp_path / ".lock", "taken"):
            raise ZeroDivisionError
    assert os.listdir(tmp_path) == []
    assert time.monotonic() - begin < 1.0
