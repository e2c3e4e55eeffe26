"""References to named tuples in kernels, and parts of kernels."""

import gc
import re
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba import types
from numba.core import sigutils
from numba.core.ccallback import CFunc
from numba.core.compiler import Flags

from fecontact.core import kernel_parts
from fecontact.core.addresses import contract_signature, function_at
from fecontact.core.compiled import compile_law, helper, kernel, routine
from fecontact.core.constants import constants
from fecontact.core.records import (
    ComplexMatrix,
    ComplexVector,
    FlagVector,
    IntegerVector,
    Matrix,
    ShortBlock,
    Vector,
    holds_arrays,
    numba_type,
    signature_of,
)
from fecontact.core.references import Reference
from fecontact.laws.signatures import NORMAL, normal_at


class Inner(NamedTuple):
    rows: Matrix
    factor: float


class Outer(NamedTuple):
    x: Vector
    inner: Inner
    count: int


_ADDED = Callable[[Outer, Vector], float]
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


@kernel
def first_by_kernel(inner: Inner) -> float:
    return first_of(inner)


@kernel
def run(p: Outer, y: Vector, address: int) -> float:
    total = 0.0
    for _ in range(p.count):
        # A value stored between two reads is seen, and so is a change in place.
        p.x[0] += 1.0
        total += _added_at(address)(p, y)
    return total + first_by_kernel(p.inner)


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
    inner = numba_type(Inner)
    other = types.NamedTuple([numba_type(Vector), types.float64], Inner)
    assert Reference(inner) == Reference(numba_type(Inner))
    assert Reference(inner) != Reference(other)
    assert len(Reference(numba_type(Outer)).name) < 60


def test_a_part_of_kernels_can_be_called_from_python():
    p, y = given(), np.zeros(3)
    add_product(p, y)
    assert y == pytest.approx(2.5 * p.inner.rows @ p.x, rel=1e-14)
    assert first_of(p.inner) == pytest.approx(first_by_kernel(p.inner), rel=1e-15)


class Table(NamedTuple):
    places: IntegerVector
    weights: Vector
    inner: Inner
    factor: int


@kernel
def weighted(p: Table) -> float:
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
    said = constants({Table: {"places": np.array([3, 2]), "factor": 5}, Inner: {"rows": (2, None)}})
    assert weighted.for_values(said)(p) == 5.0 * (1100.0 + 1.0 + 5.0)
    # The shape alone determines which numbers lie beside one another.
    narrow = constants({Inner: {"rows": (None, 2)}})
    assert weighted.for_values(narrow)(p) == 2.0 * (111.0 + 1.0 + 3.0 + 5.0)
    assert weighted(p) == 2.0 * (111.0 + 1.0 + 5.0 + 9.0)


class Mixed(NamedTuple):
    """Fields of every kind, and a record in another that has numbers alone."""

    flag: bool
    amount: float
    marks: FlagVector
    spectrum: ComplexMatrix
    short: ShortBlock
    count: int
    inner: Inner
    outer: Outer


@kernel
def fields_of(p: Mixed, own: ComplexVector) -> int:
    own[0], own[1] = p.amount, p.spectrum[0, 0]
    own[2], own[3] = p.spectrum[1, 0], p.short[1, 2, 0]
    own[4], own[5] = p.inner.factor, p.outer.inner.rows[0, 1]
    own[6], own[7] = p.outer.x[2], p.outer.count
    p.marks[1] = p.flag
    return p.count


def mixed():
    return Mixed(True, 0.5, np.zeros(2, bool), np.array([[3.0j], [4.0j]]),
                 np.arange(6, dtype=np.int32).reshape(2, 3, 1), -7, given().inner, given())


def test_python_hands_over_fields_of_every_kind():
    p, own = mixed(), np.zeros(8, complex)
    counts = [sys.getrefcount(array) for array in (p.marks, p.spectrum, p.outer.x)]
    for _ in range(100):
        assert fields_of(p, own) == -7
    assert own.tolist() == [0.5, 3.0j, 4.0j, 5.0, 2.5, p.outer.inner.rows[0, 1],
                            p.outer.x[2], 4.0]
    assert p.marks.tolist() == [False, True]
    assert [sys.getrefcount(array) for array in (p.marks, p.spectrum, p.outer.x)] == counts


@pytest.mark.parametrize("change", [
    {"amount": "a"}, {"count": 1.5}, {"flag": None}, {"marks": np.zeros(2)},
    {"marks": [True, False]}, {"spectrum": np.ones((2, 1))}, {"spectrum": np.ones(2, complex)},
    {"spectrum": np.asfortranarray(np.ones((2, 2), complex))}, {"inner": (np.ones((1, 1)), 1.0)},
    {"inner": Inner(np.ones(1), 1.0)}, {"outer": given()._replace(x=np.ones(5)[::2])},
])
def test_fields_of_another_type_are_refused(change):
    with pytest.raises(TypeError, match="No matching definition"):
        fields_of(mixed()._replace(**change), np.zeros(8, complex))


class Numbers(NamedTuple):
    a: float
    b: float


def test_annotations_stand_for_types():
    vector = types.Array(types.float64, 1, "C")
    assert numba_type(Numbers) == types.NamedUniTuple(types.float64, 2, Numbers)
    assert numba_type(Table) == types.NamedTuple(
        [types.Array(types.int64, 1, "C"), vector, numba_type(Inner), types.int64], Table)
    assert numba_type(tuple[float, int]) == types.Tuple([types.float64, types.int64])
    assert holds_arrays(numba_type(Outer))
    assert not holds_arrays(numba_type(Numbers))
    with pytest.raises(TypeError, match="stands for no type"):
        numba_type(dict)


def test_only_records_with_arrays_go_by_reference():
    found = signature_of(Callable[[Outer, Numbers, Vector, bool], None])
    assert found.args == (Reference(numba_type(Outer)), numba_type(Numbers), numba_type(Vector),
                          types.boolean)
    assert found.return_type == types.void
    assert signature_of(weighted.py_func).args == (Reference(numba_type(Table)),)


@kernel(by_address=True)
def scaled_first(p: Inner, factor: float) -> float:
    return factor * p.rows[0, 0]


_scaled_at = function_at(scaled_first)


@kernel
def through_address(p: Outer, address: int) -> float:
    return _scaled_at(address)(p.inner, 3.0)


def test_a_kernel_is_called_by_its_address():
    p = given()
    assert through_address(p, scaled_first.address) == 3.0 * p.inner.rows[0, 0]


@kernel
def twice(p: Inner) -> float:
    return 2.0 * p.factor


def test_a_kernel_is_compiled_at_its_first_call_and_for_its_types_alone():
    assert not twice.overloads
    assert twice(Inner(np.ones((1, 1)), 1.5)) == 3.0
    assert len(twice.overloads) == 1
    with pytest.raises(TypeError, match="No matching definition"):
        twice(Inner(np.ones(1), 1.5))


@kernel
def total_of(p: Outer, y: Vector) -> float:
    return p.x.sum() + p.inner.rows.sum() + y.sum()


def test_read_only_arrays_are_read_in_records_too():
    p, y = given(), np.ones(3)
    expected = total_of(p, y)
    for array in (p.x, p.inner.rows, y):
        array.flags.writeable = False
    assert total_of(p, y) == expected
    assert not p.x.flags.writeable
    fixed = p._replace(x=np.frombuffer(p.x.tobytes()))
    assert total_of(fixed, y) == expected
    assert len(total_of.overloads) == 1


def sum_of(function):
    @kernel
    def total(x: Vector) -> float:
        found = 0.0
        for value in x:
            found += function(value)
        return found

    return total


many_sines, many_cosines = sum_of(np.sin), sum_of(np.cos)


def test_threads_may_call_a_kernel_for_the_first_time_together():
    x = np.linspace(0.0, 1.0, 100)
    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(lambda _: many_sines(x), range(8)))
    assert found == pytest.approx([np.sin(x).sum()] * 8)


def test_the_collector_of_garbage_is_as_before_after_compilation():
    before = gc.get_threshold()
    gc.set_threshold(701, 9, 8)
    try:
        assert many_cosines(np.zeros(3)) == 3.0
        assert gc.get_threshold() == (701, 9, 8)
    finally:
        gc.set_threshold(*before)


@pytest.mark.slow
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


def test_flags_are_equal_where_numba_says_so():
    """Settings that numba holds for equal are, those that differ are not, either way."""
    plain, own = Flags(), kernel_parts._Flags(Flags())
    assert own == plain
    assert plain == own
    assert hash(own) == hash(plain)
    own.nrt = plain.nrt = True
    assert own == plain
    assert own == own.copy()
    assert {own: 1}[plain] == 1
    own.no_cpython_wrapper = True
    assert own != plain
    assert plain != own
    assert own != kernel_parts._Flags(plain)
    # A default that has been set is no difference.
    plain.no_cpython_wrapper = True
    plain.fastmath = False
    assert own == plain
    assert plain == own


def test_a_part_is_compiled_once_for_constants_and_other_numbers():
    """A constant, another one and a counter are the same type of argument."""

    @routine
    def scaled(x, k):
        return (k + 2) * x

    for k in (types.literal(0), types.literal(1), types.int64):
        scaled.compile((types.float64, k))
    assert list(scaled.overloads) == [(types.float64, types.int64)]

    def summed(x):
        total = scaled(x, 0) + scaled(x, 1)
        for k in range(2):
            total += scaled(x, k)
        return total

    summed.__annotations__ = {"x": float, "return": float}
    assert kernel(summed)(1.5) == 2.0 * (2 + 3) * 1.5


def test_the_entry_of_a_law_holds_its_code():
    """It calls nothing, for laws that call nothing, and returns what they do."""

    def bed(u, v, p):
        force = p[0] * u + p[1] * v
        if force <= 0.0:
            return 0.0, 0.0, 0.0
        for k in range(2, len(p)):
            force += p[k] * u * u
        return force, p[0], p[1]

    law = CFunc(bed, sigutils.normalize_signature(contract_signature(NORMAL)), {},
                {"error_model": "numpy"}, kernel_parts.LawCompiler)
    law.compile()
    assert re.findall(r"\tcallq?\t", law._library.get_asm_str()) == []

    def at(address, p):
        return normal_at(address)(0.5, 2.0, p)

    at.__annotations__ = {"address": int, "p": Vector, "return": tuple[float, float, float]}
    assert kernel(at)(law.address, np.array([3.0, 1.0, 4.0])) == (4.5, 3.0, 1.0)
    assert kernel(at)(law.address, np.array([3.0, -1.0, 0.0])) == (0.0, 0.0, 0.0)
