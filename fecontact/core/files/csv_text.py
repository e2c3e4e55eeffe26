"""CSV tables whose cells neither spreadsheets nor terminals take for commands."""

import csv
import io
import re
from collections.abc import Iterable, Sequence
from typing import Any

# Spreadsheets compute cells that begin with one of these characters; apostrophes before it are
# counted, so that a cell that has one already reads back as it was.
_FORMULA = re.compile(r"'*[=+\-@\t\r]")
# Control characters but tabs and line breaks steer a terminal that prints the file; they are
# written as \x1b and so on. The second half keeps a text that looks like one of them.
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]|\\(?=x[0-9a-f]{2})")
_ESCAPED = re.compile(r"\\x([0-9a-f]{2})")


def csv_text(rows: Iterable[Sequence[Any]]) -> str:
    """Rows as lines of CSV text, every cell by :func:`safe_cell`."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [safe_cell(value) for value in row] for row in rows)
    return text.getvalue()


def safe_cell(value: Any) -> Any:
    """The value; a text with control characters escaped, and an apostrophe before a formula.

    Numbers remain as they are, negative ones included.
    """
    if not isinstance(value, str):
        return value
    text = _CONTROL.sub(lambda found: f"\\x{ord(found[0]):02x}", value)
    return f"'{text}" if _FORMULA.match(text) and not _is_number(text) else text


def read_cell(text: str) -> str:
    """Text of a cell as it was before :func:`safe_cell`."""
    marked = text.startswith("'") and _FORMULA.match(text)
    return _ESCAPED.sub(lambda found: chr(int(found[1], 16)), text[1:] if marked else text)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
