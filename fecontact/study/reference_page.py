"""Reference of all keys of study files, generated from their classes: ``docs/study.md``."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, get_args, get_type_hints

from fecontact.core.docstrings import documented, summary
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.tables import described
from fecontact.laws.ground.height_map import HeightMap
from fecontact.laws.registry import is_kind, law_names
from fecontact.laws.synonyms import laws_called
from fecontact.study.geometry_section import SHAPES, MeshFile
from fecontact.study.links_section import LINKS
from fecontact.study.study import Study
from fecontact.system.gap import Crown

_HEAD = """# Study files

All sections and keys of a study file, with type, default and meaning. Units are in brackets.

- A key without a default is required. `none` means that the key may be left out; None in a meaning
  stands for a key that is left out.
- `fecontact keys SECTION` prints one section, `fecontact keys WORD` all keys with a word in their
  name or meaning.
- A number "of the whole face" is divided among the contact nodes by their lengths or areas.

The command `fecontact keys` writes this page from the code.
"""


def study_keys(section: str | None = None, more: Mapping[str, str] | None = None) -> str:
    """List the sections of study files and their keys as Markdown.

    Parameters
    ----------
    section : str, optional
        A single section, such as ``ground`` or ``ground.profile``, or a word: of all sections the
        keys whose names, meanings or laws have it, like ``roughness``. All keys by default.
    more : mapping of section to str, optional
        Paragraphs in Markdown that end a section.

    Raises
    ------
    InputError
        If there is neither such a section nor such a key; the message lists the sections.
    """
    parts = dict(_parts())
    for name, text in (more or {}).items():
        parts[name] += f"\n{text}\n"
    if section is None:
        return "\n".join([_HEAD, *parts.values()]).rstrip() + "\n"
    name = section.strip("[]")
    if name not in parts and (found := _keys_with(name, parts)):
        return found
    if name not in parts:
        raise InputError(f"Study files have no section [{name}]{nearest(name, parts)}; there are: "
                         f"{choices(parts)}.")
    return parts[name].rstrip() + "\n"


def _keys_with(word: str, parts: Mapping[str, str]) -> str:
    """Rows of the tables that have a word, each table below its title; laws by other names too."""
    laws = [cls for names in law_names().values() for cls in names.values()]
    called = laws_called(word, laws)
    meant = {f'`law = "{name}"`: {_summary(cls)}' for names in law_names().values()
             for name, cls in names.items() if cls in called}
    wanted = word.lower().replace("_", " ").replace("-", " ")
    found = []
    for part in parts.values():
        head, *tables = part.strip().split("\n\n")
        kept, title = [], ""
        for block in tables:
            if not block.startswith("|"):
                title = block
                if block in meant:
                    kept.append(block)
                continue
            first, rule, *rows = block.split("\n")
            rows = [row for row in rows
                    if wanted in row.lower().replace("_", " ").replace("-", " ")]
            if rows:
                kept += [title] * (bool(title) and title not in kept)
                kept.append("\n".join([first, rule, *rows]))
        if kept:
            found.append("\n\n".join([head, *kept]))
    return "\n\n".join(found) + "\n" if found else ""


def _parts() -> Iterator[tuple[str, str]]:
    hints = get_type_hints(Study)
    yield "gap", ("## `gap`\n\nInitial distance of the contact nodes from flat ground [m]. The key "
                  "stands above all sections. It is a number, a list with one number per node, or "
                  "a table. By default it is that of the mesh, whose lowest contact node touches "
                  "the ground.\n\nTable for a face that is an arc:\n\n" + _table(Crown)
                  + "\n\nTable for measured heights of a solid's face:\n\n"
                  + _table(HeightMap) + "\n")
    shapes = [_table(cls, f'`shape = "{name}"`: {_summary(cls)}') for name, cls in SHAPES.items()]
    yield "geometry", _section("geometry", "A shape and its dimensions, or the file of a mesh.",
                               *shapes, _table(MeshFile, f"`file`: {_summary(MeshFile)}"))
    printed: dict[Any, str] = {(*SHAPES.values(), MeshFile): "geometry"}
    # Interfaces refer to sections of a single body.
    for entry in sorted(fields(Study), key=lambda entry: entry.name == "interfaces"):
        name = entry.name.removesuffix("_settings")
        if name in ("geometry", "gap", "path", "links", "content_hashes", "_keys"):
            continue
        if name in ("bodies", "interfaces"):
            name = f"{name}.NAME"
        yield from _sections(name, _inner(hints[entry.name]), printed)
    kinds = [_table(cls, f'`kind = "{name}"`: {_summary(cls)}') for name, cls in LINKS.items()]
    yield "links.NAME", _section(
        "links.NAME", "Links join bodies at points or faces and do not open.", *kinds)


def _sections(name: str, classes: list[Any], printed: dict[Any, str]) -> Iterator[tuple[str, str]]:
    """A section, described by one of several classes, and its subsections."""
    known = tuple(classes)
    if printed.get(known) == name:  # a key that several of the classes have
        return
    if known in printed:
        yield name, _section(name, f"Keys of `[{printed[known]}]`.")
        return
    printed[known] = name
    if is_kind(classes[0]):
        yield name, _section(name, *_laws(classes[0]))
        return
    paragraphs = [_table(cls, _summary(cls)) for cls in classes]
    yield name, _section(name, *paragraphs)
    for cls in classes:
        hints = get_type_hints(cls)
        for entry in fields(cls):
            if inner := _inner(hints[entry.name]):
                yield from _sections(f"{name}.{entry.name}", inner, printed)


def _inner(hint: Any) -> list[Any]:
    """Dataclasses that occur in a type annotation."""
    if is_dataclass(hint):
        return [hint]
    return [cls for part in get_args(hint) for cls in _inner(part)]


def _laws(kind: Any) -> Iterator[str]:
    yield ("The key `law` names the law; the other keys are its parameters. `fecontact laws NAME` "
           "prints a law with its formula.")
    names: Mapping[str, type] = law_names()[kind]
    for name, cls in names.items():
        yield _table(cls, f'`law = "{name}"`: {_summary(cls)}')


def _section(name: str, *paragraphs: str) -> str:
    return "\n\n".join([f"## `[{name}]`", *paragraphs]) + "\n"


def _table(cls: Any, title: str = "") -> str:
    hints, entries = get_type_hints(cls), {entry.name: entry for entry in fields(cls)}
    rows = []
    for names, meaning in documented(cls):
        keys = [name for name in names if name in entries]
        if not keys:
            continue
        types = dict.fromkeys(_cell(described(hints[key])) for key in keys)
        defaults = [_default(entries[key]) for key in keys]
        if len(set(defaults)) == 1:
            defaults = defaults[:1]
        rows.append(f"| {', '.join(f'`{key}`' for key in keys)} | {'; '.join(types)} | "
                    f"{', '.join(defaults)} | {_cell(meaning)} |")
    head = [title, ""] if title else []
    if not rows:
        return "\n".join(head).rstrip()
    return "\n".join([*head, "| key | type | default | meaning |", "|---|---|---|---|", *rows])


def _default(entry: Any) -> str:
    value = entry.default_factory() if callable(entry.default_factory) else entry.default
    if value is MISSING:
        return ""
    if value is None:
        return "none"
    if is_dataclass(value):
        return "`{}`"
    if isinstance(value, float):
        return f"`{value:g}`"
    return f"`{json.dumps(list(value) if isinstance(value, tuple) else value)}`"


def _summary(cls: Any) -> str:
    text = summary(cls)
    if text.startswith("``["):  # the section's own name, which stands above
        text = text.partition("]``")[2].removeprefix(":").strip().removeprefix("with ")
    return _cell(text[:1].upper() + text[1:])


def _cell(text: str) -> str:
    """Docstring text for a table cell: roles become code, vertical bars are escaped."""
    text = re.sub(r":\w+:`~?([^`]*)`", lambda match: f"`{match[1].rpartition('.')[2]}`", text)
    text = re.sub(r"``([^`]*)``", r"`\1`", text)
    return re.sub(r"\\?\|", r"\\|", text)
