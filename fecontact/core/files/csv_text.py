"""CSV tables whose cells spreadsheets do not take for formulas."""

import csv
import io
import re
from collections.abc import Iterable, Sequence
from typing import Any

# Spreadsheets compute cells that begin with one of these characters; apostrophes before it are
# counted, so that a cell that has one already reads back as it was.
_FORMULA = re.compile(r"'*[=+\-@\t\r]")


def csv_text(rows: Iterable[Sequence[Any]]) -> str:
    """Rows as lines of CSV text, every cell by :func:`safe_cell`."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [safe_cell(value) for value in row] for row in rows)
    return text.getvalue()


def safe_cell(value: Any) -> Any:
    """The value, or its text with an apostrophe in front if a spreadsheet would compute it.

    Numbers remain as they are, negative ones included.
    """
    if not isinstance(value, str) or not _FORMULA.match(value) or _is_number(value):
        return value
    return f"'{value}"


def read_cell(text: str) -> str:
    """Text of a cell as it was before :func:`safe_cell`."""
    marked = text.startswith("'") and _FORMULA.match(text)
    return text[1:] if marked else text


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
