"""Elements of universal files (data set 2412)."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from fecontact import InputError
from fecontact.io import read_uff

DATA = Path(__file__).parents[1] / "data"

ELEMENTS = """    -1
  2412
         1        91         1         1         7         3
         1         2         4
         2        94         1         1         7         4
         1         2         5         4
         3        91         1         1         7         3
         2         3         5
         4        21         1         1         7         2
         0         1         1
         1         2
    -1
"""


def with_elements(folder, text):
    source = next(DATA.glob("*.u*f*"))
    copy = folder / "modes.uff"
    shutil.copy(source, copy)
    with copy.open("a") as file:
        file.write(text)
    return source, copy


def test_elements_are_kept_by_their_number_of_nodes(tmp_path):
    source, copy = with_elements(tmp_path, ELEMENTS)
    modes = read_uff(copy)
    assert sorted(modes.elements) == [2, 3, 4]
    np.testing.assert_array_equal(modes.elements[3], [[1, 2, 4], [2, 3, 5]])
    np.testing.assert_array_equal(modes.elements[4], [[1, 2, 5, 4]])
    np.testing.assert_array_equal(modes.elements[2], [[1, 2]])
    plain = read_uff(source)
    assert plain.elements == {}
    np.testing.assert_array_equal(modes.shapes, plain.shapes)


def test_an_element_with_too_few_nodes_is_named(tmp_path):
    _, copy = with_elements(tmp_path, ELEMENTS.replace("         2         3         5\n",
                                                       "         2         3\n"))
    with pytest.raises(InputError, match="Element 3 of data set 2412 has 2 nodes where 3"):
        read_uff(copy)
