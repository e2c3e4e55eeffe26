"""References to named tuples in kernels, and parts of kernels."""

import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import types

from fecontact.core.compiled import (
    compile_law,
    f8,
    function_at,
    helper,
    i8,
    integers,
    kernel,
    matrix,
    routine,
    vector,
)
from fecontact.core.references import Reference, borrowed, constants


class Inner(NamedTuple):
    rows: Any
    factor: float


class Outer(NamedTuple):
    x: Any
    inner: Inner
    count: int


INNER = types.NamedTuple([matrix, f8], Inner)
OUTER = types.NamedTuple([vector, INNER, i8], Outer)
_ADDED = f8(Reference(OUTER), vector)
_added_at = function_at(_ADDED)


@helper
def add_product(p, y):
    rows, factor = p.inner.rows, p.inner.factor
    for i in range(len(y)):
        for k in range(len(p.x)):
            y[i] += factor * rows[i, k] * p.x[k]


@routine
def first_of(inner):
    return inner.rows[0, 0] * inner.factor


def _add(p, y):
    add_product(p, y)
    return first_of(p.inner)


added = compile_law(_ADDED, "added(p, y)", _add)


@kernel(f8(INNER))
def first_by_value(held):
    return first_of(borrowed(held))


@kernel(f8(OUTER, vector, i8))
def run(held, y, address):
    p = borrowed(held)
    total = 0.0
    for _ in range(p.count):
        # What is stored between two reads is seen, and so is a change in place.
        p.x[0] += 1.0
        total += _added_at(address)(p, y)
    return total + first_by_value(p.inner)


def given():
    rng = np.random.default_rng(0)
    return Outer(rng.normal(size=5), Inner(rng.normal(size=(3, 5)), 2.5), 4)


def test_functions_see_the_tuple_itself():
    p, y = given(), np.zeros(3)
    x, expected = p.x.copy(), np.zeros(3)
    for _ in range(4):
        x[0] += 1.0
        expected += 2.5 * p.inner.rows @ x
    total = run(p, y, added.address)
    assert y == pytest.approx(expected, rel=1e-14)
    assert (p.x == x).all()
    assert total == pytest.approx(5.0 * 2.5 * p.inner.rows[0, 0], rel=1e-14)


def test_one_kernel_for_tuples_of_any_values():
    for _ in range(3):
        first, second = given(), given()._replace(count=1)
        assert run(first, np.zeros(3), added.address) != run(second, np.zeros(3), added.address)


def test_references_are_told_apart_by_what_they_refer_to():
    other = types.NamedTuple([vector, f8], Inner)
    assert Reference(INNER) == Reference(INNER)
    assert Reference(INNER) != Reference(other)
    assert len(Reference(OUTER).name) < 60


def test_a_part_of_kernels_can_be_called_from_python():
    p, y = given(), np.zeros(3)
    add_product(p, y)
    assert y == pytest.approx(2.5 * p.inner.rows @ p.x, rel=1e-14)
    assert first_of(p.inner) == pytest.approx(first_by_value(p.inner), rel=1e-15)


class Table(NamedTuple):
    places: Any
    weights: Any
    inner: Inner
    factor: int


TABLE = types.NamedTuple([integers, vector, INNER, i8], Table)
_SUM = f8(TABLE)


@kernel(_SUM)
def weighted(held):
    p = borrowed(held)
    total = 0.0
    for k in range(len(p.places)):
        total += p.weights[p.places[k]]
    for i in range(p.inner.rows.shape[0]):
        total += p.inner.rows[i, 1]
    return p.factor * total


def test_constants_stand_for_what_a_tuple_says():
    rows = np.arange(12.0).reshape(3, 4)
    p = Table(np.array([0, 1, 2]), np.array([1.0, 10.0, 100.0, 1000.0]), Inner(rows, 2.5), 2)
    assert weighted(p) == 2.0 * (111.0 + 1.0 + 5.0 + 9.0)
    said = constants({TABLE: {"places": np.array([3, 2]), "factor": 5}, INNER: {"rows": (2, None)}})
    assert kernel(_SUM, constants=said)(weighted.py_func)(p) == 5.0 * (1100.0 + 1.0 + 5.0)
    # What numbers stand beside one another follows from the shape alone.
    narrow = constants({INNER: {"rows": (None, 2)}})
    assert kernel(_SUM, constants=narrow)(weighted.py_func)(p) == 2.0 * (111.0 + 1.0 + 3.0 + 5.0)
    assert weighted(p) == 2.0 * (111.0 + 1.0 + 5.0 + 9.0)


@pytest.mark.long
def test_a_law_keeps_its_functions_whatever_kernel_was_loaded_before():
    # The step loop holds functions of the same names as the law that changes contacts.
    script = """
import fecontact.integrate.nonsmooth.event_driven
import fecontact as fc
from systems import impact_oscillator
run = fc.simulate(impact_oscillator(1), 0.2, solver=fc.integrate.SetValued(restitution=0.5))
assert run.statistics["impacts"] > 0
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True,
                          cwd=Path(__file__).parent.parent)
    assert done.returncode == 0, done.stderr
