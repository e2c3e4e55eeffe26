"""Elastic bodies: shapes of solids, fields, faces that may touch, their partners and gaps."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
