"""Parameters of classes in their docstrings: reading them, and inheriting them."""

import inspect
from functools import cache
from typing import Any, ClassVar, get_origin

from docstring_parser import Docstring, DocstringStyle, compose, parse
from docstring_parser.common import DocstringParam

from fecontact.core.errors import require_docstrings

require_docstrings()


def documented(cls: type) -> list[tuple[tuple[str, ...], str]]:
    """Parameters of a class and their descriptions, grouped where names share a description.

    A parameter without a description gets its type instead.
    """
    return [(_names(entry), " ".join((entry.description or entry.type_name or "").split()))
            for entry in _parsed(inspect.getdoc(cls) or "").params]


def summary(thing: Any) -> str:
    """The first paragraph of a docstring, as one line."""
    doc = _parsed(inspect.getdoc(thing) or "")
    text = doc.short_description or ""
    if not doc.blank_after_short_description:
        text += "\n" + (doc.long_description or "").split("\n\n")[0]
    return " ".join(text.split())


class InheritsDocumentation:
    """Base of classes whose subclasses describe their own fields alone."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        inherit_documentation(cls)


def inherit_documentation(cls: type) -> None:
    """Complete the docstring of a dataclass from those of its bases.

    Add the fields that it does not describe itself, in their order, and the errors raised. A base
    may describe fields that only its subclasses have. A class without a docstring is left alone.
    """
    text = cls.__dict__.get("__doc__")
    if not text:
        return
    bases = [_parsed(inspect.cleandoc(base.__dict__.get("__doc__") or ""))
             for base in cls.__mro__[1:-1]]
    own = _parsed(inspect.cleandoc(text))
    annotations = inspect.get_annotations(cls)
    # A class variable in the place of an inherited field: the class has no such field.
    fixed = {name for name, hint in annotations.items() if ClassVar in (hint, get_origin(hint))}
    names = [*(name for name in (*getattr(cls, "__dataclass_fields__", ()), *annotations)
               if name not in fixed), *(name for entry in own.params for name in _names(entry))]
    entries: dict[str, DocstringParam] = {}
    for doc in (*reversed(bases), own):
        for entry in doc.params:
            entries |= dict.fromkeys(_names(entry), entry)
    parameters = list({id(entries[name]): entries[name] for name in names
                       if name in entries}.values())
    raises = next((doc.raises for doc in (own, *bases) if doc.raises), [])
    others = [item for item in own.meta if item not in own.params and item not in own.raises]
    complete = Docstring(style=own.style)
    complete.short_description = own.short_description
    complete.blank_after_short_description = own.blank_after_short_description
    complete.long_description = own.long_description
    complete.meta = [*parameters, *raises, *others]
    cls.__doc__ = compose(complete).replace("\n\n\n", "\n\n")


@cache
def _parsed(text: str) -> Docstring:
    found = parse(text, DocstringStyle.NUMPYDOC)
    for entry in found.params:
        entry.default = None  # parsed from the words "by default", which stay in the description
    return found


def _names(entry: DocstringParam) -> tuple[str, ...]:
    return tuple(name.strip() for name in entry.arg_name.split(","))
