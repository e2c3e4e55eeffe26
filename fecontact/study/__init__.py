"""Sections of study files as objects, for sweeps and bases from Python."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
