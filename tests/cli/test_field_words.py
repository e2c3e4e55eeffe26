"""Words of the field in place of commands, and readers of help that end early."""

import subprocess
import sys

import pytest

from fecontact.cli.field_words import _COMMANDS, _WORDS, command_called


@pytest.mark.parametrize("command", _WORDS)
def test_words_lead_to_commands_and_options_that_exist(cli, command):
    name, *options = command.split()
    code, out, _ = cli(name, "--help")
    assert code == 0
    assert all(option in out for option in options)
    assert name not in _COMMANDS


def test_a_word_of_the_field_names_the_command(cli):
    assert command_called("Harmonic_Balance") == "response"
    assert command_called("nonsense") is None
    assert cli("backbone")[::2] == (2, "error: There is no command 'backbone'; `fecontact modes "
                                       "--nonlinear` does this.\n")
    assert "fecontact --help` lists" in cli("nonsense")[2]


def test_a_reader_of_help_may_end_early():
    """The reader closes the pipe early, like ``fecontact sweep --help | head``."""
    with subprocess.Popen([sys.executable, "-m", "fecontact", "sweep", "--help"],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
        assert process.wait() == 1
