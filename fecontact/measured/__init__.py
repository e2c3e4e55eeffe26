"""Measurements: files, ring-downs, frequency and damping over amplitude, assurance criteria."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
