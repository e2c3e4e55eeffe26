"""Names with letters that terminals and tables of rich would interpret."""

import warnings

from fecontact.cli.console import echo, note, show
from fecontact.cli.tables import table
from fecontact.core.errors import ModelWarning
from fecontact.output.plots.figure import new_figure

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


def test_dollars_in_labels_are_no_mathematics(tmp_path):
    """A fraction without its end is an error as mathematics; powers of ten remain."""
    with new_figure(3.0, 2.0, tmp_path / "odd.png") as figure:
        axes = figure.subplots()
        axes.semilogy([1.0, 2.0], [1e-3, 1e3], label=r"$\frac{1}{$")
        axes.set(xlabel=r"force at $\frac{1}{$ [N]")
        axes.legend()
    assert (tmp_path / "odd.png").is_file()
    assert all(text.get_parse_math() for text in axes.get_yticklabels())
