"""The public names: all there, documented, and quick to import."""

import ast
import importlib
import inspect
import re
import subprocess
import sys
import textwrap
import typing
from functools import cache, cached_property
from pathlib import Path

import pytest

import fecontact

ROOT = Path(__file__).parents[1]

NAMESPACES = ("fem", "half_space", "laws", "reduction", "integrate", "analysis", "bifurcation",
              "measured", "study", "sweeps", "fitting", "system", "plot", "io")
PUBLIC = [("fecontact", name) for name in fecontact.__all__ if name not in NAMESPACES] + [
    (f"fecontact.{space}", name) for space in NAMESPACES
    for name in importlib.import_module(f"fecontact.{space}").__all__]
WITHOUT_DOCSTRING = {"PerNode", "Positive", "NotNegative", "COLOURS", "STATE_COLOURS"}


@pytest.mark.parametrize(("space", "name"), PUBLIC)
def test_every_public_name_exists_and_is_documented(space, name):
    thing = getattr(importlib.import_module(space), name)
    if name in WITHOUT_DOCSTRING:
        return
    assert thing.__doc__
    assert not thing.__doc__.startswith(f"{name}(")  # a docstring of its own, not dataclass's


def test_every_name_has_one_place():
    names = [name for _, name in PUBLIC]
    assert len(set(names)) == len(names)
    assert len(set(fecontact.__all__) - set(NAMESPACES)) <= 53
    assert set(NAMESPACES) <= set(fecontact.__all__)
    assert fecontact.laws.LuGreFriction.__module__ == "fecontact.laws.friction.bristle"


@pytest.mark.parametrize(("space", "name", "told"), [
    ("fecontact", "LuGreFriction", "it is fecontact.laws.LuGreFriction."),
    ("fecontact.laws", "simulate", "it is fecontact.simulate."),
    ("fecontact.laws", "LugreFriction", "did you mean fecontact.laws.LuGreFriction?"),
    ("fecontact.plot", "plot_mode", "did you mean fecontact.plot.plot_modes?"),
    ("fecontact.io", "xyz", "has no name 'xyz'."),
])
def test_names_that_are_elsewhere_are_told(space, name, told):
    with pytest.raises(AttributeError, match=rf"^{re.escape(space)} has no name '{name}'") as error:
        getattr(importlib.import_module(space), name)
    assert str(error.value).endswith(told)


@pytest.mark.parametrize("space", NAMESPACES)
def test_namespaces_have_a_docstring_and_keep_their_names(space):
    module = importlib.import_module(f"fecontact.{space}")
    assert module.__doc__
    assert dir(module) == sorted(module.__all__)
    for name in module.__all__:
        getattr(module, name)
        assert name not in vars(fecontact), name


@pytest.mark.parametrize(("space", "name"), PUBLIC)
def test_names_are_not_hidden_by_modules_of_that_name(space, name):
    """``fecontact.analysis.receptance`` is the function, whatever was imported before it."""
    assert not inspect.ismodule(getattr(importlib.import_module(space), name))


def public_things():
    """Public functions and classes by name, those of public modules too."""
    found = {}
    for name in fecontact.__all__:
        thing = getattr(fecontact, name)
        if inspect.ismodule(thing):
            found |= {f"{name}.{inner}": getattr(thing, inner)
                      for inner in getattr(thing, "__all__", ())}
        else:
            found[name] = thing
    return found


def test_help_of_a_public_function_fits_a_screen():
    """At most 45 lines, and 55 where the signature is wrapped to 80 characters."""
    functions = {name: thing for name, thing in public_things().items()
                 if inspect.isroutine(thing)}
    assert len(functions) > 80
    for name, function in functions.items():
        # Below a title, and the signature, which some versions of Python break at each parameter.
        shown = 3 + len(inspect.getdoc(function).splitlines())
        signature = textwrap.wrap(str(inspect.signature(function)), 80)
        assert len(signature) <= 14, name
        assert shown <= 45, name
        assert shown + len(signature) - 1 <= 55, name


@cache
def names_for_types(module):
    """Names of a module with those that it imports for type checkers alone."""
    found = dict(vars(module))
    for block in ast.parse(inspect.getsource(module)).body:
        if not (isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"):
            continue
        for one in block.body:
            for alias in one.names:
                source = importlib.import_module(
                    one.module if isinstance(one, ast.ImportFrom) else alias.name)
                found[alias.asname or alias.name] = (
                    getattr(source, alias.name) if isinstance(one, ast.ImportFrom) else source)
    return found


def annotated(thing):
    """All types in the annotations of a function, or of a class, its fields and its methods."""
    if inspect.isroutine(thing):
        parts = [inspect.unwrap(thing)]
    else:
        parts = []
        for cls in thing.__mro__:
            if not cls.__module__.startswith("fecontact."):
                continue
            inner = [getattr(one, "fget", None) or getattr(one, "func", None)
                     or getattr(one, "__func__", one) for name, one in vars(cls).items()
                     if not name.startswith("_") and (inspect.isfunction(one) or isinstance(
                         one, property | cached_property | classmethod | staticmethod))]
            parts += [cls, *(one for one in inner if inspect.isfunction(one))]
    for part in parts:
        hints = typing.get_type_hints(part, names_for_types(sys.modules[part.__module__]))
        yield from (hint for name, hint in hints.items() if not name.startswith("_"))


def classes_in(hint):
    """The classes in a type: in its arguments, options, and behind its alias."""
    if hasattr(hint, "__value__"):
        yield from classes_in(hint.__value__)
    elif isinstance(hint, list | tuple):
        for one in hint:
            yield from classes_in(one)
    else:
        if inspect.isclass(hint):
            yield hint
        yield from classes_in(typing.get_args(hint))


def test_what_public_names_take_and_give_has_a_public_name():
    """Types of fields, properties and methods too: users import them for annotations."""
    pytest.importorskip("xarray")
    things = public_things()
    known = {thing for thing in things.values() if inspect.isclass(thing)}
    assert len(known) > 150
    nameless = {f"{cls.__module__}.{cls.__qualname__} of {name}" for name, thing in things.items()
                if inspect.isroutine(thing) or inspect.isclass(thing)
                for hint in annotated(thing) for cls in classes_in(hint)
                if cls.__module__.startswith("fecontact.") and cls not in known}
    assert not nameless


@pytest.mark.parametrize("alias", ["ArrayLike", "Array", "PerNode"])
def test_signatures_show_types_of_arrays_by_name(alias):
    shown = [str(inspect.signature(thing)) for thing in public_things().values()
             if inspect.isroutine(thing) or (inspect.isclass(thing)
             and not issubclass(thing, Exception))]
    assert any(alias in text for text in shown)
    for text in shown:
        assert "_SupportsArray" not in text
        assert "<lambda>" not in text


def test_import_loads_nothing_heavy():
    heavy = "('numba', 'scipy', 'skfem', 'gmsh', 'vtk', 'pyvista', 'matplotlib', 'meshio', 'h5py')"
    code = f"import sys, fecontact; print(sorted(set({heavy}) & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_core_loads_no_libraries_of_pictures_and_meshes():
    heavy = "('gmsh', 'vtk', 'pyvista', 'matplotlib', 'meshio')"
    code = (f"import sys, fecontact; fecontact.simulate, fecontact.ElasticBody, fecontact.Study; "
            f"print(sorted(set({heavy}) & set(sys.modules)))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("path", sorted(
    path.relative_to(ROOT).as_posix() for folder in ("docs", "benchmarks", "examples")
    for path in (ROOT / folder).rglob("*.py")))
def test_names_that_scripts_import_exist(path):
    """Scripts that take minutes are not run by tests; what they import must be there."""
    for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("fecontact"):
            module = importlib.import_module(str(node.module))
            for name in (alias.name for alias in node.names):
                assert hasattr(module, name) or importlib.import_module(f"{node.module}.{name}")
