"""What the docstring of a class says of its parameters."""

import inspect
import re


def documented(cls: type) -> list[tuple[tuple[str, ...], str]]:
    """Parameters of a class and what its docstring says of them, those together that stand so.

    Where it says nothing of a parameter but its values, these.
    """
    text = inspect.getdoc(cls) or ""
    found = re.search(r"^Parameters\n-+\n(.*?)(?:\n\n\w[\w ]*\n-+\n|\Z)", text, re.S | re.M)
    entries: list[tuple[tuple[str, ...], str, list[str]]] = []
    for line in (found.group(1) if found else "").splitlines():
        if line and not line.startswith(" "):
            names, _, values = line.partition(" : ")
            entries.append((tuple(name.strip() for name in names.split(",")), values, []))
        elif line.strip():
            entries[-1][2].append(line.strip())
    return [(names, " ".join(lines) or values) for names, values, lines in entries]
