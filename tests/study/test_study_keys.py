"""The page of keys of study files: complete, and what the code says."""

from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

from fecontact import InputError, Study
from fecontact.cli import execute
from fecontact.core.docstrings import documented
from fecontact.laws import law_names
from fecontact.laws.registry import is_kind
from fecontact.study.reference_page import study_keys
from fecontact.sweeps.summaries import summaries_table

PAGE = Path(__file__).parents[2] / "docs" / "study.md"


def classes_within(hint):
    if is_dataclass(hint) and is_kind(hint):
        for cls in law_names()[hint].values():
            yield from classes_within(cls)
    elif is_dataclass(hint):
        yield hint
        hints = get_type_hints(hint)
        for entry in fields(hint):
            yield from classes_within(hints[entry.name])
    for part in get_args(hint):
        yield from classes_within(part)


CLASSES = {cls for hint in get_type_hints(Study).values() for cls in classes_within(hint)}


@pytest.mark.parametrize("cls", sorted(CLASSES, key=lambda cls: cls.__name__),
                         ids=lambda cls: cls.__name__)
def test_every_key_is_documented_once(cls):
    said = [name for names, meaning in documented(cls) if meaning for name in names]
    assert sorted(said) == sorted(entry.name for entry in fields(cls))


def test_page_is_up_to_date():
    assert PAGE.read_text() == study_keys(None, {"sweep": summaries_table()}), (
        "fecontact keys > docs/study.md")


def test_every_key_stands_on_the_page():
    assert len(CLASSES) > 40
    rows = [line for line in study_keys().splitlines() if line.startswith("| `")]
    for cls in CLASSES:
        for entry in fields(cls):
            assert any(f"`{entry.name}`" in row.split(" | ")[0] for row in rows), entry.name
    for row in rows:
        assert row.count(" | ") == 3, row


def test_defaults_and_units_of_a_section():
    section = study_keys("[ground]")
    assert "| `speed` | a number | `0` | Speed V of the ground in +x [m/s]. |" in section
    assert "| `amplitude`, `wavelength`" not in section
    needed = study_keys("load.forces")
    assert ('| `component` | "x", "y", "z", "phi", "phi_x", "phi_y", "phi_z", a list of two '
            'numbers or a list of three numbers | `"y"` |') in needed
    assert ("| `signal` | a number or a table of a law and its parameters |  | Its history, or its "
            "constant value [N], [N m]. |") in needed
    laws = study_keys("interfaces.NAME")
    assert "total values refer to the face of the interface" in laws


def test_keys_on_the_command_line(capsys):
    assert execute(["keys", "ground.motion"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("## `[ground.motion]`")
    assert '`law = "speed-ramp"`' in out
    assert execute(["keys", "grund"]) == 1
    assert "no section [grund] (did you mean 'ground'?)" in capsys.readouterr().err


def test_keys_are_found_by_a_word():
    found = study_keys("wavelength")
    assert "## `[ground]`" in found
    rows = [line for line in found.splitlines() if line.startswith("| `")]
    assert rows
    assert all("wavelength" in row for row in rows)
    assert len(found) < 0.2 * len(study_keys())
    stribeck = study_keys("Stribeck")
    assert stribeck.startswith("## `[friction]`\n\n`law = \"exponential\"`")
    with pytest.raises(InputError, match="no section"):
        study_keys("xylophone")
