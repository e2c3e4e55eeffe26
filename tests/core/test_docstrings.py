"""Docstrings of parameters: read, and inherited by classes that leave them to their bases."""

import inspect
from dataclasses import dataclass, fields
from typing import ClassVar

import pytest

from fecontact.core.docstrings import documented, summary
from fecontact.laws import FrictionLaw, PerNode, law_names
from fecontact.laws.base import NodeLaw


@dataclass(frozen=True)
class Base(NodeLaw):
    """A base.

    Parameters
    ----------
    first, second : float
        Two numbers [m],
        in lines.
    last : str
        What only some have; "x" by default.
    """

    first: PerNode = 1.0
    second: PerNode = 1.0


@dataclass(frozen=True)
class Inner(Base):
    r"""An inner one, of a first paragraph
    in two lines.

    .. math:: \frac{1}{2}

    Parameters
    ----------
    middle : float
        Its own.

    References
    ----------
    A. Nobody, Nothing (1900).
    """

    kernel: ClassVar = None

    middle: PerNode = 1.0
    last: PerNode = 1.0


@dataclass(frozen=True)
class Bare(Base):
    more: PerNode = 1.0


def test_fields_are_described_by_the_class_and_its_bases_in_their_order():
    assert documented(Inner) == [
        (("first", "second"), "Two numbers [m], in lines."), (("middle",), "Its own."),
        (("last",), 'What only some have; "x" by default.')]
    assert inspect.getdoc(Inner) == r'''An inner one, of a first paragraph
in two lines.

.. math:: \frac{1}{2}

Parameters
----------
first, second : float
    Two numbers [m],
    in lines.
middle : float
    Its own.
last : str
    What only some have; "x" by default.

Raises
------
InputError
    For values outside these ranges.

References
----------
A. Nobody, Nothing (1900).'''
    assert summary(Inner) == "An inner one, of a first paragraph in two lines."


def test_a_class_without_a_docstring_stays_without():
    assert not documented(Bare)


LAWS = [(kind, name) for kind, names in law_names().items() for name in names
        if issubclass(kind, NodeLaw)]


@pytest.mark.parametrize(("kind", "name"), LAWS, ids=[name for _, name in LAWS])
def test_every_law_describes_each_of_its_fields_once(kind, name):
    cls = law_names()[kind][name]
    assert ([name for names, meaning in documented(cls) if meaning for name in names]
            == [entry.name for entry in fields(cls)])
    assert inspect.getdoc(cls).count("\nRaises\n------\n") == 1


def test_no_docstring_of_a_law_repeats_what_its_bases_say():
    """The text in the source, before that of the bases is added to it."""
    for kind, name in LAWS:
        cls = law_names()[kind][name]
        inherited = {entry for base in cls.__mro__[1:-1] if base not in (NodeLaw, FrictionLaw)
                     for entry in documented(base)}
        written = inspect.getsource(cls)
        for names, meaning in inherited:
            assert " ".join(written.split()).count(f"{meaning}") == 0, (name, names)
