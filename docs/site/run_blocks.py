"""Runs the Python blocks of a page one after the other, as the cells of a notebook.

Usage: python run_blocks.py PAGE.md RESULTS.json, in the folder in which files are to be written.
For each block the results list what it printed, and the value of its last line: as PNG if it is a
figure, otherwise as text.
"""

import ast
import base64
import io
import json
import re
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

PYTHON = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def cell(code: str, names: dict[str, Any], where: str) -> dict[str, str]:
    """What a block prints and gives."""
    tree = ast.parse(code, where)
    last = None
    if tree.body and isinstance(tree.body[-1], ast.Expr):
        last = ast.Expression(tree.body.pop().value)  # type: ignore[attr-defined]
    printed = io.StringIO()
    value = None
    with redirect_stdout(printed):
        exec(compile(tree, where, "exec"), names)
        if last is not None:
            value = eval(compile(last, where, "eval"), names)
    result = {"printed": printed.getvalue()}
    if hasattr(value, "_repr_png_"):
        drawn = value._repr_png_()
        result["png"] = base64.b64encode(drawn[0] if isinstance(drawn, tuple) else drawn).decode()
    elif value is not None:
        result["text"] = repr(value)
    return result


def main(page: str, results: str) -> None:
    """Run a page."""
    names: dict[str, Any] = {"__name__": "__main__"}
    found = []
    for number, block in enumerate(PYTHON.findall(Path(page).read_text(encoding="utf-8")), 1):
        where = f"{Path(page).name}, block {number}"
        try:
            found.append(cell(block, names, where))
        except Exception:
            print(where, file=sys.stderr)
            raise
    Path(results).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
