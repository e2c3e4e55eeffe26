"""The public names: all there, documented, and quick to import."""

import subprocess
import sys

import pytest

import fecontact


@pytest.mark.parametrize("name", fecontact.__all__)
def test_every_public_name_exists_and_is_documented(name):
    thing = getattr(fecontact, name)
    assert thing.__doc__
    assert not thing.__doc__.startswith(f"{name}(")  # a docstring of its own, not dataclass's


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
