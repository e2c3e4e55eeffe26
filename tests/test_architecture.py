"""The subpackages and the one way in which they import each other.

This is what docs/architecture.md says, read from the sources: also imports inside functions and
those for types alone count.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "fecontact"
SUBPACKAGES = ("core", "fem", "half_space", "laws", "reduction", "system", "integrate", "analysis",
               "bifurcation", "measured", "output", "study", "sweeps", "fitting", "cli")
# Subpackages that do not import each other, although the one stands above the other.
STRANGERS = {("laws", "fem"), ("study", "output")}
# Modules that hold nothing but public names under which people look for them.
NAMESPACES = {"plot", "io"}

MODULES = {
    ".".join(("fecontact", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(
        ".__init__"): path
    for path in sorted(PACKAGE.rglob("*.py"))
}


@cache
def tree(module: str) -> ast.Module:
    return ast.parse(MODULES[module].read_text(encoding="utf-8"))


def imported(module: str) -> Iterator[str]:
    """Modules of the package that a module imports, wherever in its text."""
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith("fecontact"))
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("fecontact"):
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                if full == "fecontact.__version__":
                    continue
                yield full if full in MODULES else str(node.module)


@cache
def arrows() -> dict[str, set[str]]:
    return {module: {target for target in imported(module) if target != module}
            for module in MODULES}


def subpackage(module: str) -> str:
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


def test_there_is_nothing_beside_the_subpackages():
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir()} - {"__pycache__"}
    files = {path.name for path in PACKAGE.iterdir() if path.is_file()}
    assert folders == set(SUBPACKAGES)
    assert files == {"__init__.py", "__init__.pyi", "__main__.py", "py.typed",
                     *(f"{name}.{ending}" for name in NAMESPACES for ending in ("py", "pyi"))}


@pytest.mark.parametrize("name", SUBPACKAGES)
def test_subpackages_import_only_from_those_above(name):
    above = {other for other in SUBPACKAGES[: SUBPACKAGES.index(name)]
             if (name, other) not in STRANGERS}
    wrong = {f"{module} -> {target}" for module, targets in arrows().items()
             if subpackage(module) == name
             for target in targets if subpackage(target) not in {name, *above}}
    assert not wrong


def test_no_module_imports_itself_through_others():
    left = {module: {target for target in targets if target in MODULES}
            for module, targets in arrows().items()}
    while free := [module for module, targets in left.items() if not targets & left.keys()]:
        for module in free:
            del left[module]
    # The modules left import only from each other: they are circles, or lead to circles.
    assert not left


def test_every_import_names_a_module_that_exists():
    assert {target for targets in arrows().values() for target in targets} <= MODULES.keys()


def test_imports_are_absolute_and_found_by_this_test():
    """A module that imports nothing would pass the others without being looked at."""
    relative = [module for module in MODULES for node in ast.walk(tree(module))
                if isinstance(node, ast.ImportFrom) and node.level]
    assert not relative
    assert sum(map(len, arrows().values())) > 800


COMPILERS = {"helper", "routine", "borrowing", "overload", "event", "signal", "normal_law",
             "friction_law", "memory_friction_law", "planar_friction_law", "ground_profile",
             "ground_surface"}


def name_of(node: ast.expr) -> str:
    return ast.unparse(node.func if isinstance(node, ast.Call) else node)


def untyped(node: ast.AST, known: frozenset[str]) -> Iterator[str]:
    """Functions without types that are not ``known`` to be parts of compiled ones."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.FunctionDef):
            yield from untyped(child, known)
            continue
        given = child.args
        entries = [*given.posonlyargs, *given.args, *given.kwonlyargs]
        if isinstance(node, ast.ClassDef) and entries and entries[0].arg in ("self", "cls"):
            entries = entries[1:]
        entries += [one for one in (given.vararg, given.kwarg) if one is not None]
        if (child.returns is not None or child.name == "__init__") and all(
                entry.annotation is not None for entry in entries):
            yield from untyped(child, known)
        elif child.name not in known and not COMPILERS & set(map(name_of, child.decorator_list)):
            yield child.name


def test_functions_without_types_are_parts_of_compiled_ones():
    """The type checker lets them pass; they are decorated, or handed to what compiles them."""
    found = set()
    for module in MODULES:
        handed = frozenset(
            one.id for node in ast.walk(tree(module)) if isinstance(node, ast.Call | ast.Tuple)
            for one in (node.args if isinstance(node, ast.Call) else node.elts)
            if isinstance(one, ast.Name))
        found |= {f"{module}: {name}" for name in untyped(tree(module), handed)}
    assert not found
