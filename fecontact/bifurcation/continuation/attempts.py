"""Attempts that are made one after the other until one succeeds."""

from collections.abc import Callable, Iterable
from typing import TypeVar

from fecontact.core.errors import AnalysisError, FecontactError, InputError

T = TypeVar("T")
R = TypeVar("R")


def first_that_goes(attempts: Iterable[T], go: Callable[[T], R]) -> R:
    """Result of the first attempt without a FecontactError; the last error if all have one."""
    failed: FecontactError = InputError("There is nothing to start from.")
    for attempt in attempts:
        try:
            return go(attempt)
        except FecontactError as error:
            failed = error
    raise failed


def first_found(attempts: Iterable[T], find: Callable[[T], R | None], missing: str) -> R:
    """Result of the first attempt that finds something.

    An attempt finds nothing if it gives None or raises a FecontactError.

    Raises
    ------
    AnalysisError
        If no attempt finds anything; ``missing`` is its text.
    """
    last: FecontactError | None = None
    for attempt in attempts:
        try:
            found = find(attempt)
        except FecontactError as error:
            last = error
            continue
        if found is not None:
            return found
    raise AnalysisError(missing) from last
