"""Builds the site: ``python docs/site/build.py [FOLDER]``, by default into build/site.

Pages are those of docs/. Examples and tutorials are run for it, two at a time; what they gave is
kept in FOLDER/kept. Nothing is loaded from a network. With ``--without-runs`` nothing is run:
examples and tutorials show their source and what was kept.
"""

import argparse
import re
import shutil
import sys
import time
from pathlib import Path

import check_links
import gallery
import public_names
import tutorials
from runs import ROOT, Job, digest, run_all

DOCS = ROOT / "docs"
OUTSIDE = re.compile(r"\]\(((?:\.\./)+[^)#]+)")


def tell(text: str) -> None:
    """Say how far the build is."""
    print(text, flush=True)


def stage(source: Path, folders: dict[str, Path]) -> None:
    """Lay out pages as Sphinx is to read them; files keep their times unless they change."""
    wanted = set()

    def put(name: str, content: bytes) -> None:
        wanted.add(source / name)
        tutorials.write(source / name, content)

    for path in sorted(DOCS.rglob("*")):
        name = path.relative_to(DOCS).as_posix()
        if path.is_dir() or "__pycache__" in path.parts or name.startswith("validation/"):
            continue
        if path.suffix != ".md":
            put(name, path.read_bytes())
            continue
        text = path.read_text(encoding="utf-8")
        for linked in OUTSIDE.findall(text):
            target = (path.parent / linked).resolve()
            if not target.is_relative_to(DOCS) and target.is_file():
                tutorials.write(source.parent / target.relative_to(ROOT), target.read_bytes())
        if path.parent.name == "tutorials" and path.stem != "index":
            folder = folders.get(f"tutorial/{path.stem}")
            given = None if folder is None else tutorials.results(folder)
            put(f"tutorials/notebooks/{path.stem}.ipynb",
                tutorials.notebook(text, given).encode())
            if given is not None:
                text = tutorials.with_results(text, given, path.stem,
                                              source / "tutorials/pictures")
            text = tutorials.with_link(text, path.stem)
        if path.parent.name == "reference":
            if path.stem == "index":
                for space in public_names.NAMESPACES:
                    text = text.replace(f"<!-- names of {space} -->", public_names.table(space))
            else:
                text = public_names.completed(text, space_of(path.stem))
        put(name, text.encode())
    for path in gallery.EXAMPLES.glob("*.*"):
        tutorials.write(source.parent / "examples" / path.name, path.read_bytes())
    for names in gallery.GROUPS.values():
        for name in names:
            put(f"gallery/{name}.md", gallery.page(name, folders.get(f"example/{name}")).encode())
    put("gallery/studies.md", gallery.studies().encode())
    put("gallery/index.md", gallery.index(folders).encode())
    gallery.copy_pictures(folders, source / "_static")
    for path in source.rglob("*.md"):
        if path not in wanted:
            path.unlink()


def space_of(stem: str) -> str:
    """The namespace of a page of the reference."""
    return "fecontact" if stem == "fecontact" else f"fecontact.{stem}"


def all_jobs() -> list[Job]:
    """Examples, and tutorials."""
    return [*gallery.jobs(), *(tutorials.job(path)
                               for path in sorted((DOCS / "tutorials").glob("*.md"))
                               if path.stem != "index")]


def kept_results(jobs: list[Job], kept: Path) -> dict[str, Path]:
    """Results that are there without running anything."""
    folders = {job.key: kept / job.kind / f"{job.name}-{digest(job)}" for job in jobs}
    return {name: folder for name, folder in folders.items() if folder.exists()}


def main(folder: Path, runs: bool = True) -> int:
    """Build the site; the number of things that are wrong with it."""
    from sphinx.cmd.build import main as sphinx

    start = time.perf_counter()
    jobs = all_jobs()
    kept = folder / "kept"
    folders = run_all(jobs, kept, tell) if runs else kept_results(jobs, kept)
    tell(f"examples and tutorials: {time.perf_counter() - start:.0f} s")
    source, pages = folder / "source" / "docs", folder / "html"
    stage(source, folders)
    if sphinx(["-W", "--keep-going", "-q", "-E", "-a", "-j", "2", "-b", "html",
               "-d", str(folder / "doctrees"), str(source), str(pages)]):
        return 1
    wrong = list(check_links.problems(pages))
    for line in wrong:
        tell(line)
    tell(f"{pages / 'index.html'} ({time.perf_counter() - start:.0f} s)")
    return len(wrong)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "build" / "site")
    parser.add_argument("--without-runs", action="store_true")
    parser.add_argument("--fresh", action="store_true", help="build every page anew")
    given = parser.parse_args()
    if given.fresh:
        for name in ("source", "doctrees", "html"):
            shutil.rmtree(given.folder / name, ignore_errors=True)
    sys.exit(main(given.folder.resolve(), not given.without_runs) != 0)
