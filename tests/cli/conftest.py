"""Command lines run in this process, and a small study to run them on."""

import pytest
from tiny_study import TINY

from fecontact.cli import execute


@pytest.fixture
def cli(capsys):
    """Run a command line in this process: exit code, stdout, stderr."""

    def run(*tokens):
        code = execute([str(token) for token in tokens])
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        return code, said.out, said.err

    return run


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A study in a folder of its own, which is the current one."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    return path
