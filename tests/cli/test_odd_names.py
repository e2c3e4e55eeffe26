"""Names with letters that terminals and tables of rich would interpret."""

import warnings

from fecontact.cli.console import echo, note, show
from fecontact.cli.tables import table
from fecontact.core.errors import ModelWarning

CLEARS = "pad\x1b[2J\x07"  # clears a terminal and rings its bell
SHOWN = r"pad\x1b[2J\x07"


def test_control_characters_are_shown_escaped(capsys):
    echo(f"\n{CLEARS}: µ")
    note(f"warning: {CLEARS}")
    out, err = capsys.readouterr()
    assert out == f"\n{SHOWN}: µ\n"
    assert err == f"warning: {SHOWN}\n"


def test_warnings_of_the_model_are_escaped(capsys):
    from fecontact.cli.entry import _show_warning

    _show_warning(warnings.showwarning)(ModelWarning(CLEARS), ModelWarning, "file", 1)
    assert capsys.readouterr().err == f"warning: {SHOWN}\n"


def test_cells_of_tables_are_no_markup(capsys):
    """[s], [red] and [/b] are markup for rich, or an error."""
    show(table("time [s]", "[red]", rows=[(CLEARS, "[/b] [i]x")]))
    out, err = capsys.readouterr()
    assert err == ""
    for text in ("time [s]", "[red]", SHOWN, "[/b] [i]x"):
        assert text in out
    assert "\x1b" not in out
