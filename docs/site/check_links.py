"""Looks into the built pages: do links lead somewhere, and does nothing come from a network?"""

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

URL = re.compile(r"""url\(["']?([^"')]+)""")
# Attributes by which a page loads something while it is shown.
LOADED = {("link", "href"), ("script", "src"), ("img", "src"), ("video", "src"),
          ("source", "src"), ("iframe", "src"), ("object", "data"), ("embed", "src")}


class Page(HTMLParser):
    """Targets, links and loaded resources of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.targets: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        """See :class:`html.parser.HTMLParser`."""
        for name, value in attributes:
            if value is None:
                continue
            if name == "id" or (tag, name) == ("a", "name"):
                self.targets.add(value)
            elif (tag, name) in LOADED:
                self.loaded.append(value)
            elif name == "srcset":
                self.loaded += [part.split()[0] for part in value.split(",")]
            elif (tag, name) == ("a", "href"):
                self.links.append(value)


def problems(site: Path) -> Iterator[str]:
    """One line for each link that leads nowhere and each resource from elsewhere."""
    pages = {path.resolve(): Page(path) for path in sorted(site.rglob("*.html"))}
    for path, page in pages.items():
        name = path.relative_to(site.resolve()).as_posix()
        for link in page.loaded + page.links:
            parts = urlsplit(link)
            if parts.scheme == "data":
                continue
            if parts.scheme or parts.netloc:
                if link in page.loaded:
                    yield f"{name} loads {link}"
                continue
            target = path if not parts.path else (path.parent / unquote(parts.path)).resolve()
            if not target.exists():
                yield f"{name}: {link} is not there"
            elif (parts.fragment and target in pages
                  and unquote(parts.fragment) not in pages[target].targets):
                yield f"{name}: {link} has no such place"
    for path in sorted(site.rglob("*.css")):
        text = path.read_text(encoding="utf-8")
        for link in URL.findall(text):
            if re.match(r"(\w+:)?//", link):
                yield f"{path.relative_to(site)} loads from elsewhere: {link}"
            elif not link.startswith("data:") and not (path.parent / link).exists():
                yield f"{path.relative_to(site)}: {link} is not there"
