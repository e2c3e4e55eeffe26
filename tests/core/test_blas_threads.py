"""Reduced models take one thread for linear algebra, and give the others back."""

import threading
from collections.abc import Iterator

import numpy as np
import pytest
from systems import friction_oscillator, lorenz_field
from threadpoolctl import threadpool_info, threadpool_limits

import fecontact as fc
from fecontact.bifurcation import ContinuationOptions, equilibrium_branch
from fecontact.core.resources.blas_threads import one_blas_thread


def blas_threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info()
            if library["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def three_threads(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Three BLAS threads, like on a machine of three cores; OpenBLAS starts missing threads."""
    # Tests before may have loaded one more library.
    monkeypatch.setattr(one_blas_thread, "_libraries", None)
    with one_blas_thread:  # loads all libraries
        pass
    with threadpool_limits(3, user_api="blas"):
        yield
        assert blas_threads() == {3}


def test_nested_blocks_and_decorated_functions() -> None:
    @one_blas_thread
    def inner(number: int) -> int:
        assert blas_threads() == {1}
        return 2 * number

    with one_blas_thread:
        assert blas_threads() == {1}
        assert inner(4) == 8
        assert blas_threads() == {1}
    assert blas_threads() == {3}
    assert inner(5) == 10
    assert inner.__name__ == "inner"


def test_errors_restore_the_threads() -> None:
    with pytest.raises(ZeroDivisionError), one_blas_thread, one_blas_thread:
        raise ZeroDivisionError
    assert blas_threads() == {3}


def test_blocks_of_several_threads_that_overlap() -> None:
    """The first ends before the second: the limit stays until the last has ended."""
    begun, leave = threading.Event(), threading.Event()

    def second() -> None:
        with one_blas_thread:
            begun.set()
            leave.wait(10.0)

    other = threading.Thread(target=second)
    with one_blas_thread:
        other.start()
        assert begun.wait(10.0)
    assert blas_threads() == {1}
    leave.set()
    other.join()
    assert blas_threads() == {3}


@pytest.mark.slow
def test_many_short_blocks_at_once() -> None:
    seen: list[set[int]] = []

    def work() -> None:
        for _ in range(200):
            with one_blas_thread:
                seen.append(blas_threads())

    workers = [threading.Thread(target=work) for _ in range(4)]
    for one in workers:
        one.start()
    for one in workers:
        one.join()
    assert len(seen) == 800
    assert all(threads == {1} for threads in seen)


def test_runs_and_their_start_have_one_thread() -> None:
    seen: set[int] = set()

    def tell(_: float) -> None:
        seen.update(blas_threads())

    run = fc.simulate(friction_oscillator(), 2.0, progress=tell)
    assert run.status is fc.Status.FINISHED
    assert seen == {1}


def test_branches_have_one_thread() -> None:
    seen: set[int] = set()

    def tell(_: float) -> None:
        seen.update(blas_threads())

    branch = equilibrium_branch(lorenz_field(), parameter="rho", bounds=(1.5, 3.0),
                                start=np.array([1.6, 1.6, 1.0]),
                                options=ContinuationOptions(progress=tell))
    assert len(branch.points) > 2
    assert seen == {1}
