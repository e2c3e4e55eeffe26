"""The public names: all there, documented, and quick to import."""

import importlib
import subprocess
import sys

import pytest

import fecontact

NAMESPACES = ("laws", "reduction", "integrate", "analysis", "bifurcation", "study", "sweeps",
              "plot", "io")
PUBLIC = [("fecontact", name) for name in fecontact.__all__ if name not in NAMESPACES] + [
    (f"fecontact.{space}", name) for space in NAMESPACES
    for name in importlib.import_module(f"fecontact.{space}").__all__]
ANNOTATIONS = {"PerNode", "Positive", "NotNegative"}


@pytest.mark.parametrize(("space", "name"), PUBLIC)
def test_every_public_name_exists_and_is_documented(space, name):
    thing = getattr(importlib.import_module(space), name)
    if name in ANNOTATIONS:
        return
    assert thing.__doc__
    assert not thing.__doc__.startswith(f"{name}(")  # a docstring of its own, not dataclass's


def test_every_name_has_one_place():
    names = [name for _, name in PUBLIC]
    assert len(set(names)) == len(names)
    assert len(fecontact.__all__) < 60
    assert set(NAMESPACES) <= set(fecontact.__all__)
    assert fecontact.laws.LuGreFriction is getattr(importlib.import_module("fecontact.laws"),
                                                   "LuGreFriction")


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
