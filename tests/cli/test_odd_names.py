"""Names with letters that terminals and tables of rich would interpret."""

import warnings

import numpy as np
import pytest

from fecontact.cli.console import echo, note, show
from fecontact.cli.tables import table
from fecontact.cli.templates import template
from fecontact.core.errors import ModelWarning
from fecontact.output.files.fields_of_frames import FieldKind
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.style import legend_label

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


def test_characters_that_the_font_lacks_are_named_once(capsys):
    from fecontact.cli.entry import _show_warning

    tell = _show_warning(warnings.showwarning)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = tell
        with new_figure(3.0, 2.0) as figure:
            figure.text(0.5, 0.5, "\u6f22\u5b57")
            figure.canvas.draw()
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "the font of pictures lacks '" in err


def test_cells_of_tables_are_no_markup(capsys):
    """[s], [red] and [/b] are markup for rich, or an error."""
    show(table("time [s]", "[red]", rows=[(CLEARS, "[/b] [i]x"), ("top [/left]", "[/]")]))
    out, err = capsys.readouterr()
    assert err == ""
    for text in ("time [s]", "[red]", SHOWN, "[/b] [i]x", "top [/left]", "[/]"):
        assert text in out
    assert "\x1b" not in out


@pytest.mark.parametrize("name", [r"$\frac{1}{$", "$a{$", "$a{$ $b$", r"$\mathdefault{$"])
def test_dollars_in_labels_are_no_mathematics(name, tmp_path):
    """A fraction without its end is an error as mathematics; powers of ten remain."""
    with new_figure(3.0, 2.0, tmp_path / "odd.png") as figure:
        axes = figure.subplots()
        axes.semilogy([1.0, 2.0], [1e-3, 1e3], label=name)
        axes.set(xlabel=f"force at {name} [N]")
        axes.legend()
    assert (tmp_path / "odd.png").is_file()
    assert all(text.get_parse_math() for text in axes.get_yticklabels())


@pytest.mark.parametrize("name", [CLEARS, "\tx", "n" * 400, "n " * 200, "\ud800"])
def test_names_of_any_letters_and_length_leave_space_for_axes(name, tmp_path):
    """No warning of a missing letter or of axes without size, which are errors in tests."""
    with new_figure(6.0, 4.0, tmp_path / "odd.png") as figure:
        axes = figure.subplots()
        axes.plot([1.0, 2.0], label=name)
        axes.set(title=name, ylabel=f"displacement of {name} [mm]")
        axes.legend(loc="lower left")
    assert axes.get_title().startswith(ascii(name)[1:-1][:4])
    assert min(axes.get_window_extent().size) > 100.0


def test_dollars_in_titles_of_pictures_are_no_mathematics():
    from fecontact.output.render.overlay import Overlay

    scene = np.full((1, 1, 3), 255, np.uint8)
    plain, odd = (Overlay(640, 360, title).around(scene, 0) for title in ("a", r"$\frac{1}{$"))
    assert (odd < 128).sum() > 3 * (plain < 128).sum() > 0


def test_names_with_an_underscore_stand_in_legends(tmp_path):
    with new_figure(3.0, 2.0, tmp_path / "odd.png") as figure:
        axes = figure.subplots()
        axes.plot([1.0, 2.0], label=legend_label("_face"))
        assert [text.get_text().strip() for text in axes.legend().get_texts()] == ["_face"]


def test_numbers_beyond_single_precision_are_its_largest():
    kind = FieldKind("displacement", "Point", (), "m", rounded=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        stored = kind.flat(np.array([[1e300, -1e39, 1.0, np.nan]]))
    largest = np.finfo(np.float32).max
    assert np.array_equal(stored, [largest, -largest, 1.0, np.nan], equal_nan=True)


def test_meshes_of_bodies_of_any_name_are_written_beside_each_other(cli, tmp_path):
    """A slash is no folder, and names that files cannot tell apart get numbers."""
    text = template("pad").replace("bodies.pad", 'bodies."a/b"').replace("bodies.block",
                                                                         'bodies."a:b"')
    (tmp_path / "s.toml").write_text(
        text.replace("pad.contact", "a/b.contact").replace("block.top", "a:b.top"))
    code, _, err = cli("mesh", tmp_path / "s.toml", "-o", tmp_path / "out")
    assert (code, err) == (0, "")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"s-a_b.msh", "s-a_b-2.msh"}
