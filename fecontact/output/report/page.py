"""One HTML file that holds its data, styles and script, and asks no network for anything."""

import base64
import hashlib
import os
import re
import warnings
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from fecontact.core.checks import as_path
from fecontact.core.errors import InputError, ModelWarning
from fecontact.core.files.atomic_write import write_text
from fecontact.core.tables import parsed
from fecontact.core.units import UNITS
from fecontact.output.files.stored_system import library_versions
from fecontact.output.report.payload import Payload, as_text

Kind = Literal["run", "runs", "branches", "sweep", "fit", "widget"]
# In the order in which they need each other; together one script.
_COMMON = ("payload.js", "chart.js", "widgets.js")
SCRIPTS: Mapping[Kind, tuple[str, ...]] = {
    "run": (*_COMMON, "spectrum.js", "map.js", "player.js", "run.js", "start.js"),
    "runs": (*_COMMON, "spectrum.js", "runs.js", "start.js"),
    "branches": (*_COMMON, "player.js", "branches.js", "start.js"),
    "sweep": (*_COMMON, "sweep.js", "start.js"),
    "fit": (*_COMMON, "fit.js", "start.js"),
    "widget": (*_COMMON, "spectrum.js", "map.js", "player.js", "run.js", "widget.js"),
}
# Sections of a study that do not change the motion of a run.
_NOT_OF_RUNS = ("branch", "response", "sweep", "wear", "preload", "render", "output")
LARGE = 20e6  # bytes of a file that mail and browsers take without complaint

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" \
content="default-src 'none'; script-src 'sha256-{seal}'; style-src 'sha256-{style_seal}'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<noscript><p>This report needs JavaScript.</p></noscript>
<script type="text/plain" id="payload">{block}</script>
<script type="module">{script}</script>
</body>
</html>
"""


@cache
def script(kind: Kind) -> str:
    """The script of a page."""
    return _plain("\n".join(_asset(name) for name in SCRIPTS[kind]))


@cache
def styles() -> str:
    """The styles of all pages."""
    return _plain(_asset("report.css"))


def page(title: str, block: bytes, kind: Kind = "run") -> str:
    """A page with a block of data.

    All text of a study lies in the block, which has no letters that HTML knows, and is written by
    the script as text; the policy of the page runs no other script and loads nothing.
    """
    code, style = script(kind), styles()
    return _PAGE.format(title=escape(title), style=style, script=code,
                        block=as_text(block),
                        seal=_seal(code), style_seal=_seal(style))


def page_block(
    title: str, header: Mapping[str, Any], payload: Payload, study: str | None = None,
    sections: Sequence[str] = (), versions: Mapping[str, str] | None = None,
) -> bytes:
    """The data of a page: its header, to which what all pages have is added, and its arrays.

    ``sections`` are those of the study that are shown although they do not change a run.
    """
    return payload.block({
        "format": 1, "title": title, "units": UNITS, "study": _study_tables(study, sections),
        "versions": list(map(list, (versions or library_versions()).items())), **header})


def write_page(path: Path, title: str, block: bytes, kind: Kind = "run") -> Path:
    """Write a page, whole or not at all; a ModelWarning says if the file is large."""
    text = page(title, block, kind)
    if len(text) > LARGE:
        warnings.warn(f"{path} has {len(text) / 1e6:.0f} MB, which browsers open slowly; store "
                      f"fewer outputs of the run, or report a part of it.", ModelWarning,
                      stacklevel=3)
    write_text(path, text)
    return path


def require_page(path: str | Path) -> Path:
    """The path of a page; InputError for another suffix."""
    path = as_path(path, "a report")
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{path} must end in .html: a report is a page.")
    return path


def require_own_page(path: Path) -> None:
    """Raise InputError if a path exists and is no page of this package, which may be replaced."""
    if not os.path.lexists(path) or path.is_dir():
        return
    begin = _PAGE.partition("{seal}")[0].encode()
    try:
        with path.open("rb") as file:
            own = file.read(len(begin)) == begin
    except OSError:
        own = False
    if not own:
        raise InputError(f"{path} exists and is no page of fecontact; move it, or choose another "
                         f"name by fecontact report -o NAME.html.")


def _study_tables(study: str | None, sections: Sequence[str]) -> list[dict[str, Any]]:
    """Sections of a study with their keys and values as text; those of runs, and other ones.

    Sections of sections have dotted names; keys without a value are left out.
    """
    found: list[dict[str, Any]] = []

    def collect(name: str, table: Mapping[str, Any]) -> None:
        rows = [[key, text] for key, value in table.items()
                if not isinstance(value, dict) and (text := _text(value))]
        if rows:
            found.append({"name": name, "rows": rows})
        for key, value in table.items():
            if isinstance(value, dict):
                collect(f"{name}.{key}" if name else key, value)

    tables = parsed(study or "", "report: study")
    collect("", {name: table for name, table in tables.items()
                 if name in sections or name not in _NOT_OF_RUNS})
    found.sort(key=lambda section: not section["name"])
    return found


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.10g}"
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    if isinstance(value, dict):
        return ", ".join(f"{key} = {_text(one)}" for key, one in value.items())
    return str(value)


def _plain(text: str) -> str:
    """A script or styles without indents, empty lines and lines of comments."""
    return re.sub(r"\s*\n\s*", "\n", re.sub(r"^\s*//.*$", "", text, flags=re.MULTILINE)).strip()


def _asset(name: str) -> str:
    return (files("fecontact.output.report") / "assets" / name).read_text(encoding="utf-8")


def _seal(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
