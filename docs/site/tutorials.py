"""Tutorials: pages whose Python blocks are run for the site, and notebooks made of them."""

import base64
import json
import re
from pathlib import Path
from typing import Any

from run_blocks import PYTHON
from runs import Job, python

RUNNER = Path(__file__).with_name("run_blocks.py")


def job(page: Path) -> Job:
    """How a tutorial is run."""
    return Job(page.stem, python(str(RUNNER), str(page), "../results.json"), (page, RUNNER),
               "tutorial")


def results(folder: Path) -> list[dict[str, str]]:
    """What the blocks of a tutorial gave."""
    return json.loads((folder / "results.json").read_text(encoding="utf-8"))


def with_results(text: str, given: list[dict[str, str]], name: str, pictures: Path) -> str:
    """A page with what its blocks printed and drew; pictures go into a folder beside it."""
    number = iter(range(len(given)))

    def shown(found: re.Match[str]) -> str:
        at = next(number)
        result = given[at]
        parts = [found[0]]
        if printed := (result["printed"] + result.get("text", "")).rstrip():
            parts.append(f"```text\n{printed}\n```")
        if "png" in result:
            file = pictures / f"{name}-{at + 1}.png"
            write(file, base64.b64decode(result["png"]))
            parts.append(f"![What the block above draws](pictures/{file.name})")
        return "\n\n".join(parts)

    return PYTHON.sub(shown, text)


def with_link(text: str, name: str) -> str:
    """A page that offers its notebook below its title."""
    title, rest = text.split("\n", 1)
    return f"{title}\n\n{{download}}`This page as a notebook <notebooks/{name}.ipynb>`\n{rest}"


def notebook(text: str, given: list[dict[str, str]] | None) -> str:
    """A page as a Jupyter notebook, with the results of its blocks if there are any."""
    import jupytext
    import nbformat

    book: Any = jupytext.reads(text, fmt="md")
    book.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3",
                                   "language": "python"}
    book.metadata.pop("jupytext", None)
    cells = [one for one in book.cells if one.cell_type == "code"]
    for count, (one, result) in enumerate(zip(cells, given or [], strict=given is not None), 1):
        one.execution_count = count
        if result["printed"]:
            one.outputs.append(nbformat.v4.new_output("stream", name="stdout",
                                                      text=result["printed"]))
        data = {kind: result[key] for key, kind in (("text", "text/plain"), ("png", "image/png"))
                if key in result}
        if data:
            one.outputs.append(nbformat.v4.new_output("execute_result", data=data,
                                                      execution_count=count))
    for number, one in enumerate(book.cells):
        one.id = f"cell-{number}"
    return nbformat.writes(book)


def write(path: Path, content: bytes) -> None:
    """Write a file unless it is already there as it should be."""
    if not path.exists() or path.read_bytes() != content:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
