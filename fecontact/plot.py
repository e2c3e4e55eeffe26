"""All plots: each takes what it draws, returns the matplotlib Figure and may write a file."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
