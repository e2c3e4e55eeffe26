"""Names that docstrings, messages and pages mention are there, under the one place they have."""

import ast
import builtins
import importlib
import inspect
import pkgutil
import re
from functools import cache
from pathlib import Path

import pytest

import fecontact

ROOT = Path(__file__).parents[1]
MODULES = [module.name for module in pkgutil.walk_packages(fecontact.__path__, "fecontact.")
           if not module.name.endswith("__main__")]
ROLE = re.compile(r":(?:func|class|meth|mod|attr|data|exc|obj):`~?([^`]+)`")
DOTTED = re.compile(r"(?<![\w/.@-])(?:fecontact|fc)(?:\.[A-Za-z_]\w*)+")
# Names of files look like those of modules.
FILES = (".css", ".md")
# Packages of others: names in them are only looked at here, not imported.
FOREIGN = ("numpy.", "scipy.", "numba.", "matplotlib.", "pandas.", "xarray.", "concurrent.")
PAGES = sorted(path for pattern in ("*.md", "*.toml", "*.cff", "Makefile", "docs/**/*.md",
                                    "docs/**/*.py", "examples/*.*", "benchmarks/*.py", ".ci/*",
                                    ".github/**/*.*", "tests/**/*.py", "fecontact/**/*.toml",
                                    "fecontact/**/*.py", "fecontact/**/*.pyi")
               for path in ROOT.glob(pattern) if path.is_file())


def follow(name):
    """Object of a dotted name; LookupError if there is none."""
    first, *rest = name.split(".")
    found, path = importlib.import_module("fecontact" if first == "fc" else first), "fecontact"
    for part in rest:
        path = f"{path}.{part}"
        try:
            found = inspect.getattr_static(found, part) if inspect.isclass(found) else getattr(
                found, part)
        except AttributeError:
            if part in getattr(found, "__annotations__", ()):
                return None  # a field without a default
            try:
                found = importlib.import_module(path)
            except ModuleNotFoundError:
                raise LookupError(name) from None
    return found


@cache
def public_names():
    """The one dotted name of each public thing, by identity."""
    found = {}
    for space in ("", *(f".{name}" for name in fecontact.__all__
                        if inspect.ismodule(getattr(fecontact, name)))):
        module = importlib.import_module(f"fecontact{space}")
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isroutine(thing) or inspect.isclass(thing):
                found[id(thing)] = f"fecontact{space}.{name}"
    return found


def strings(node, inside=()):
    """Texts of a syntax tree, each with the classes around it."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Constant) and isinstance(child.value, str):
            yield child.value, inside
        yield from strings(child, (*inside, child.name) if isinstance(child, ast.ClassDef)
                           else inside)


def trouble_with(reference, module, inside):
    """Reason why a reference leads nowhere, or not by the public name; empty if all is well."""
    if reference.startswith(FOREIGN):
        return ""
    if reference.startswith("fecontact."):
        try:
            found = follow(reference)
        except LookupError:
            return f"{reference} does not exist"
        known = public_names().get(id(found), reference)
        return "" if reference == known else f"{reference} is public as {known}"
    first, *rest = reference.split(".")
    for space in (*(getattr(module, name, None) for name in inside), module, fecontact, builtins):
        found = getattr(space, first, None)
        if found is None and first not in getattr(space, "__annotations__", ()):
            continue
        for part in rest:
            if not hasattr(found, part) and part not in getattr(found, "__annotations__", ()):
                return f"{reference} does not exist"
            found = getattr(found, part, None)
        return ""
    return f"{reference} is no name of {module.__name__}"


def test_references_of_docstrings_and_messages_lead_somewhere():
    seen, wrong = 0, []
    for name in MODULES:
        module = importlib.import_module(name)
        for text, inside in strings(ast.parse(Path(module.__file__).read_text())):
            for reference in ROLE.findall(text):
                seen += 1
                if trouble := trouble_with(re.sub(r"\s+", "", reference), module, inside):
                    wrong.append(f"{name}: {trouble}")
    assert seen > 200
    assert not wrong, "\n".join(wrong)


def test_dotted_names_of_all_files_exist():
    seen, wrong = 0, []
    for path in PAGES:
        if path == Path(__file__):
            continue
        for name in DOTTED.findall(path.read_text()):
            if name.endswith(FILES):
                continue
            seen += 1
            try:
                follow(name)
            except LookupError:
                wrong.append(f"{path.relative_to(ROOT)}: {name}")
    assert seen > 2000
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(("text", "trouble"), [
    ("fecontact.bifurcation.hopf_curve", "does not exist"),
    ("fecontact.integrate.window.window", "does not exist"),
    ("fecontact.ElasticBody.modal_basis", "does not exist"),
    ("fecontact.reduction.reduce_body.modal_basis", "is public as fecontact.modal_basis"),
    ("Trajectory.between", ""), ("Trajectory.window", "does not exist"),
    ("ElasticBody.mesh", ""), ("nowhere", "is no name of fecontact"),
])
def test_stale_references_are_noticed(text, trouble):
    found = trouble_with(text, fecontact, ())
    assert trouble in found
    assert bool(trouble) == bool(found)
