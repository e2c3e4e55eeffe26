"""A small study to run command lines on."""

import pytest
from tiny_study import TINY


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A study in a folder of its own, which is the current one."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    return path
