"""Faces of elastic bodies that may touch: contact nodes, their partners, gaps."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
