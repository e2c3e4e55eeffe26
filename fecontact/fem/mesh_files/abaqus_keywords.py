"""Keyword blocks of Abaqus input files and of the files that they include."""

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from fecontact.core.checks import require_regular_file
from fecontact.core.errors import MeshError, shown

_ENCLOSED = ("PART", "INSTANCE", "ASSEMBLY")  # each closed by *END PART and so on
_WITH_DATA = ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE")

Options = dict[str, str]
# Exponents of double precision, as Fortran writes them.
_DOUBLE = re.compile(r"[dD](?=[+-]?\d+$)")


def as_number(word: str) -> float:
    """Number that a word of a data line is, zero if it is empty; ValueError for other words."""
    return float(_DOUBLE.sub("e", word.strip()) or 0.0)


class Deck:
    """An Abaqus input file, read block by block.

    Attributes
    ----------
    keywords : Counter
        Number of blocks of each keyword read so far.
    ends_with_elements : list of str
        Names of the files whose last block is *ELEMENT.
    is_read : bool
        True if all lines are read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.keywords: Counter[str] = Counter()
        self.ends_with_elements: list[str] = []
        self.is_read = False
        self._keyword = ""
        self._last_line = ""
        self._cut_lines: list[tuple[Path, str]] = []

    def blocks(self) -> Iterator[tuple[str, Options, list[str]]]:
        """Yield keyword, options and data lines of each block."""
        options: Options = {}
        rows: list[str] = []
        for line in self._lines(self.path, ()):
            self._last_line = line
            if line[0] != "*":
                rows.append(line)
                continue
            yield self._keyword, options, rows
            self._keyword, options = _keyword(line)
            self.keywords[self._keyword] += 1
            rows = []
        self.is_read = True
        yield self._keyword, options, rows

    def require_end(self) -> None:
        """Refuse a file that ends within data, within a part, or before the data of a keyword."""
        for path, line in self._cut_lines:
            of = "" if path == self.path else f" of the included file {path.name}"
            raise MeshError(f"The last line{of}, {shown(line)}, has no line break, so the file may "
                            f"be cut off; end it with a line break if it is complete.")
        for name in _ENCLOSED:
            if self.keywords[name] > self.keywords[f"END {name}"]:
                raise MeshError(f"The file has a line *{name} without a line *END {name}, so it "
                                f"may be cut off; add the line if the file is complete.")
        line = self._last_line
        nodes_of_elements = self._keyword == "NSET" and "ELSET" in line.upper()
        if line.startswith("*") and self._keyword in _WITH_DATA and not nodes_of_elements:
            raise MeshError(f"The file ends with the line {shown(line)} without its data, so it "
                            f"may be cut off; remove the line if the file is complete.")

    def _lines(self, path: Path, outer: tuple[Path, ...]) -> Iterator[str]:
        """Yield lines without comments; an included file stands in place of its *INCLUDE."""
        raw = begun = ""
        with path.open(encoding="utf-8-sig", errors="replace") as stream:
            for raw in stream:
                line = raw.strip()
                if not line or line.startswith("**"):
                    continue
                if line[0] != "*" and not begun:
                    yield line
                    continue
                if line[0] == "*" and begun:
                    yield from self._expanded(begun, path, outer)
                    begun = ""
                begun += line
                if line[-1] != ",":  # a keyword line goes on after a comma at its end
                    yield from self._expanded(begun, path, outer)
                    begun = ""
            if begun:
                yield from self._expanded(begun, path, outer)
        if raw.strip() and not raw.endswith("\n") and not raw.strip().startswith("*"):
            self._cut_lines.append((path, raw.strip()))
        if self._keyword == "ELEMENT":
            self.ends_with_elements.append(path.name)

    def _expanded(self, line: str, path: Path, outer: tuple[Path, ...]) -> Iterator[str]:
        """Yield a keyword line and the lines of the file that it names by INPUT."""
        keyword, options = _keyword(line)
        if keyword != "INCLUDE":
            yield line
            if keyword not in _WITH_DATA or "INPUT" not in options:
                return
        given = options.get("INPUT", "")
        if not given:
            raise MeshError(f"The line {shown(line)} names no file; write *INCLUDE, INPUT=file.")
        included = path.parent / given.replace("\\", "/")
        if not included.is_file():
            raise MeshError(f"{path.name} includes the file {shown(given)}, but there is no file "
                            f"{included}; put it there, or correct INPUT=.")
        require_regular_file(included, "a mesh")
        chain = (*outer, path)
        if any(included.samefile(one) for one in chain):
            names = " -> ".join(one.name for one in (*chain, included))
            raise MeshError(f"The file includes itself, {names}; remove one of these lines "
                            f"*INCLUDE.")
        yield from self._lines(included, chain)


def _keyword(line: str) -> tuple[str, Options]:
    """Keyword and options of a line; commas within quotation marks do not separate."""
    name, *words = re.split(r',(?=(?:[^"]*"[^"]*")*[^"]*$)', line[1:])
    pairs = [word.partition("=") for word in words]
    return " ".join(name.upper().split()), {
        option.strip().upper(): value.strip().strip('"') for option, _, value in pairs}
