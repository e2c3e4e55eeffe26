"""The reference of public names: pages of examples are completed by signatures and docstrings.

A page ``reference/SPACE.md`` groups the names of a namespace by headings ``### Name, other_name``,
below which an example stands. Here every such heading is replaced by the entries of its names, made
by autodoc from their docstrings; names without a heading follow at the end. As a Sphinx extension
this file also finds the entries of classes that docstrings name by the module of their definition.
"""

import importlib
import inspect
import re
from functools import cache
from typing import Any

import fecontact

NAMESPACES = ("fecontact", *(f"fecontact.{name}" for name in fecontact.__all__
                             if inspect.ismodule(getattr(fecontact, name))))
HEADING = re.compile(r"^### (.+)$", re.MULTILINE)
OPTIONS = {"autoclass": "   :members:\n", "autofunction": "", "autodata": "   :no-value:\n",
           "autoexception": ""}


def names_of(space: str) -> list[str]:
    """Public names of a namespace, but for other namespaces."""
    module = importlib.import_module(space)
    return [name for name in module.__all__ if not inspect.ismodule(getattr(module, name))]


@cache
def places() -> dict[str, str]:
    """Each public name with its namespace."""
    return {name: space for space in NAMESPACES for name in names_of(space)}


def directive(thing: Any) -> str:
    """Name of the autodoc directive for an object of this kind."""
    if inspect.isclass(thing):
        return "autoexception" if issubclass(thing, Exception) else "autoclass"
    return "autofunction" if inspect.isroutine(thing) else "autodata"


def entry(space: str, name: str) -> str:
    """Markdown of the entry of a name."""
    thing = getattr(importlib.import_module(space), name)
    kind = directive(thing)
    if kind == "autodata":
        return (f"```{{eval-rst}}\n.. py:data:: {space}.{name}\n\n   "
                f"{ALIASES.get(name, 'A constant.')}\n```\n")
    return f"```{{eval-rst}}\n.. {kind}:: {space}.{name}\n{OPTIONS[kind]}```\n"


ALIASES = {
    "PerNode": "Type of a parameter of contact nodes: a number, or a sequence with one per node.",
    "Positive": "Annotation of a parameter that must be above zero.",
    "NotNegative": "Annotation of a parameter that must be zero or above.",
    "COLOURS": "Colours of curves, in the order in which plots use them.",
    "STATE_COLOURS": "Colours of open, sticking and slipping contact.",
}


def summary(space: str, name: str) -> str:
    """The first sentence about a name."""
    thing = getattr(importlib.import_module(space), name)
    if directive(thing) == "autodata":
        return ALIASES.get(name, "A constant.")
    first = " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())
    return re.sub(r":\w+:`~?(?:[\w.]+\.)?(\w+)`", r"`\1`", first).replace("``", "`").replace(
        "|", r"\|")


def table(space: str) -> str:
    """Markdown table of all names of a namespace, with links to their entries."""
    def row(name: str) -> str:
        return f"| {{any}}`{name} <{space}.{name}>` | {summary(space, name)} |"

    rows = [row(name) for name in names_of(space)]
    return "\n".join(["| name | |", "|---|---|", *rows]) + "\n"


def completed(text: str, space: str) -> str:
    """A page of the reference with the entries of its names, and of those that it leaves out."""
    left = names_of(space)

    def entries(found: re.Match[str]) -> str:
        names = [name.strip(" `") for name in found[1].split(",")]
        if not all(name in left for name in names):
            raise ValueError(f"reference of {space}: '{found[0]}' names what is not public, or is "
                             "there twice.")
        for name in names:
            left.remove(name)
        return "\n".join(entry(space, name) for name in names)

    page = HEADING.sub(entries, text)
    if left:
        page += "\n## Further names\n\n" + "\n".join(entry(space, name) for name in left)
    return page


def complete(app: Any, docname: str, source: list[str]) -> None:
    """Complete the pages of the reference as they are read."""
    folder, _, page = docname.rpartition("/")
    if folder == "reference" and page == "index":
        for space in NAMESPACES:
            source[0] = source[0].replace(f"<!-- names of {space} -->", table(space))
    elif folder == "reference":
        source[0] = completed(source[0], page if page == "fecontact" else f"fecontact.{page}")


BARS = re.compile(r"(``.*?``|:math:`.*?`)|(\|)")
INITIAL = re.compile(r"^(\s*)([A-Z])\. ")


def escape(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Bars of absolute values are no substitutions, initials of authors no numbers of a list."""
    depth = None  # of the equation that the line is in
    for number, line in enumerate(lines):
        indent = len(line) - len(line.lstrip())
        if depth is not None and line.strip() and indent <= depth:
            depth = None
        if line.lstrip().startswith(".. math::"):
            depth = indent
        if depth is None:
            line = BARS.sub(lambda found: found[1] or r"\|", line)
            lines[number] = INITIAL.sub(r"\1\\\2. ", line)


def find(app: Any, env: Any, node: Any, content: Any) -> Any:
    """The entry of a public name that a docstring gives by another path."""
    from sphinx.util.nodes import make_refnode

    if node.get("refdomain") != "py":
        return None
    parts = node["reftarget"].split(".")
    for length in (1, 2):
        if len(parts) >= length and (space := places().get(parts[-length])):
            full = ".".join([space, *parts[len(parts) - length:]])
            objects = env.get_domain("py").objects
            if full in objects:
                found = objects[full]
                return make_refnode(app.builder, node["refdoc"], found.docname, found.node_id,
                                    content, full)
    return None


def narrow(app: Any, doctree: Any) -> None:
    """Names and types of parameters mean what is public, or the class's own, not any attribute."""
    from sphinx.addnodes import pending_xref

    for node in doctree.findall(pending_xref):
        if node.get("refdomain") == "py" and "refspecific" in node:
            del node["refspecific"]  # its being there counts, whatever its value
            if node["reftype"] == "class":
                node["py:class"] = None


def borrowed(app: Any, what: str, name: str, thing: Any, skip: bool, options: Any) -> bool | None:
    """Leave out members that another library puts into classes, such as setters of figures."""
    module = getattr(thing, "__module__", None) or ""
    return True if module.partition(".")[0] == "matplotlib" else None


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("source-read", complete)
    app.connect("autodoc-process-docstring", escape)
    app.connect("autodoc-skip-member", borrowed)
    app.connect("doctree-read", narrow)
    app.connect("missing-reference", find)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
